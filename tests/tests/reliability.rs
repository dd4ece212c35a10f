//! A run cannot be lost, stopped late, or mixed up.

#![cfg(unix)]

#[path = "reliability/disturbed.rs"]
mod disturbed;
#[path = "reliability/folder.rs"]
mod folder;
#[path = "reliability/run.rs"]
mod run;
