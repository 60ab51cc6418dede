//! Tests of the program as a user meets it: the real binary in a fresh folder.

mod bench;
mod cache;
#[cfg(unix)]
mod checkpoint;
mod common;
mod compare;
mod exit_codes;
mod grid;
mod json;
mod render;
mod show;
mod verify;
