//! The commands.

pub(crate) mod bench;
pub(crate) mod cache;
mod cache_file;
mod cache_lookups;
pub(crate) mod check;
mod command_line;
pub(crate) mod compare;
pub(crate) mod documents;
pub(crate) mod info;
mod load;
mod observer;
pub(crate) mod render;
mod show_points;
mod state_file;
mod statistics;
mod verify;
mod verify_picture;
mod verify_report;
