//! Experiments with the renderer.
//!
//! Plan file → [`study`]: runs of the program with measured time and error → report.

pub mod report;
pub mod study;
