//! Pictures in and out.
//!
//! The format of a file is told from its first bytes, whatever its name; what is written follows
//! the name's ending ([`Format::of_path`]).

mod exr_read;
mod exr_write;
mod hdr;
mod pfm;
mod png;
mod read;
mod srgb;
#[cfg(test)]
mod tests;

pub use exr_write::{Layer, MetadataValue, SampleFormat, write_exr};
pub use hdr::write_hdr;
pub use pfm::write_pfm;
pub use png::{BitDepth, write_png};
pub use read::{DecodedImage, decode, read, read_layer};
pub use srgb::{linear_to_srgb, srgb_to_linear};

use std::path::Path;

/// Why a picture cannot be written.
#[derive(Debug, thiserror::Error)]
pub enum WriteError {
    /// The disk is full, the pipe is closed, …
    #[error("{0}")]
    Io(#[from] std::io::Error),
    /// The format cannot hold this picture.
    #[error("{0}")]
    Unsupported(String),
}

impl From<WriteError> for std::io::Error {
    fn from(error: WriteError) -> Self {
        match error {
            WriteError::Io(error) => error,
            WriteError::Unsupported(message) => {
                Self::new(std::io::ErrorKind::InvalidInput, message)
            }
        }
    }
}

/// Formats that can be written.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Format {
    /// OpenEXR: float or half, named layers, metadata.
    Exr,
    /// PNG: 8 or 16 bits, sRGB.
    Png,
    /// Radiance HDR: shared exponent.
    Hdr,
    /// Portable float map.
    Pfm,
}

impl Format {
    /// By the ending of the name, in upper or lower case.
    pub fn of_path(path: &Path) -> Option<Self> {
        let ending = path.extension()?.to_str()?.to_ascii_lowercase();
        match ending.as_str() {
            "exr" => Some(Self::Exr),
            "png" => Some(Self::Png),
            "hdr" | "rgbe" | "pic" => Some(Self::Hdr),
            "pfm" => Some(Self::Pfm),
            _ => None,
        }
    }
}
