//! Everything of claror that meets a file: scene files, meshes, pictures, checkpoints, caches.
//!
//! Readers treat every file as hostile: they return [`Diagnostic`]s or a [`ReadError`], never
//! panic, and stay within [`Limits`]. Writers replace a file as a whole or not at all.

pub mod compare;
pub mod container;
pub mod diagnostic;
pub mod image;
pub mod limits;
pub mod mesh;
pub mod records;
pub mod scene;
mod source;
pub mod write;

pub use diagnostic::{Diagnostic, ReadError, Severity};
pub use limits::Limits;
