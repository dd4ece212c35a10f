# Every target is a thin name for commands that can be run by hand.
.DEFAULT_GOAL := help
.PHONY: help setup build demo check test lint fuzz book deny

help: ## Show the targets
	@awk -F ':.*## ' '/^[a-z]+:.*## / { printf "  make %-6s %s\n", $$1, $$2 }' $(MAKEFILE_LIST)

setup: ## Fetch the MuJoCo library and the robots' models
	@scripts/setup

build: setup ## Build every program, optimised
	cargo build --workspace --release

demo: setup ## Train, export and run a small policy
	@scripts/demo

check: setup ## Check format, lints and the fast tests, before each commit; leaves out what takes minutes
	@scripts/check

test: setup ## Run all tests
	cargo test --workspace --no-fail-fast

# `--lib --bins --examples` counts the features of dev-dependencies, as clippy above does: what it checked is used again.
lint: setup ## Check format, lints and documentation, warnings being errors
	cargo fmt --all --check
	rustfmt --edition 2024 --check firmware-examples/*/src/bin/*.rs firmware-examples/templates/*/src/main.rs
	cargo clippy --workspace --all-targets -- -D warnings
	cargo clippy --workspace --all-targets --no-default-features -- -D warnings
	cd firmware-examples/common && cargo clippy --all-targets --all-features -- -D warnings
	RUSTDOCFLAGS="-D warnings" cargo doc --workspace --no-deps --lib --bins --examples

fuzz: setup ## Run libFuzzer on what reads foreign bytes, 20 s each; `scripts/fuzz 3600 loader` for longer
	@scripts/fuzz

book: ## Build the documents as a book in target/book, and check all links
	@scripts/book

deny: ## Check licences, sources and duplicates of dependencies
	@scripts/check-dependencies
