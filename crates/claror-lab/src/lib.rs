//! Experiments with the renderer.
//!
//! [`plan`] → [`settings`] → [`jobs`] → [`experiment`]: runs of the program with measured time and
//! error → [`study`] → [`report`]. Nothing here computes light: every run is a process of its own,
//! so that time and memory are its own, and so that a reader can repeat it in a shell.

mod assemble;
mod equal_time;
pub mod error;
pub mod experiment;
mod folder;
mod forecast;
mod illustrate;
pub mod jobs;
pub mod lab;
mod lookups;
mod machine;
mod measure;
mod names;
mod order;
mod overrides;
pub mod plan;
mod process;
mod reference;
pub mod report;
mod search;
pub mod settings;
mod statistics;
pub mod study;
mod tables;

pub use error::LabError;
pub use experiment::{Outcome, outlook, run};
pub use lab::{Options, Progress, Watch};
pub use overrides::Overrides;
