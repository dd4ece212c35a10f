# Every target is a thin name for a command that can be run by hand.
.DEFAULT_GOAL := help
.PHONY: help setup build demo test lint

help: ## Show the targets
	@awk -F ':.*## ' '/^[a-z]+:.*## / { printf "  make %-8s %s\n", $$1, $$2 }' $(MAKEFILE_LIST)

setup: ## Fetch the MuJoCo library and the robots' models
	@scripts/setup

build: setup ## Build every program, optimised
	cargo build --workspace --release

demo: setup ## Train, export and run a small policy
	@scripts/demo

test: setup ## Run all tests
	cargo test --workspace --no-fail-fast

lint: setup ## Check formatting, lints and documentation, warnings being errors
	cargo fmt --all --check
	rustfmt --edition 2024 --check firmware-examples/*/src/bin/*.rs
	cargo clippy --workspace --all-targets -- -D warnings
	cargo clippy --workspace --all-targets --no-default-features -- -D warnings
	cd firmware-examples/common && cargo clippy --all-targets --all-features -- -D warnings
	RUSTDOCFLAGS="-D warnings" cargo doc --workspace --no-deps
