//! claror: a physically based renderer.
//!
//! This crate holds the renderer proper. It opens no file, writes to no terminal and reads no
//! clock but what its caller hands in; `claror-io` meets the files, `claror-cli` the user.
//!
//! The modules stand in the order in which data flows, and each uses only those above it:
//! [`math`], [`spectrum`] → [`image`], [`texture`] → [`shape`], [`bsdf`], [`emitter`],
//! [`sensor`] → [`accel`] → [`scene`] → [`sampler`], [`film`], [`irradiance`] → [`integrator`] →
//! [`render`] → [`verify`]; [`bytes`] is beside them.
//!
//! Units: lengths are scene units (the scene file decides; metres by convention), radiance is
//! W·m⁻²·sr⁻¹ per linear sRGB channel, irradiance W·m⁻², intensity W·sr⁻¹. Directions point
//! away from the surface: `wo` towards the viewer, `wi` towards the light.

pub mod accel;
pub mod bsdf;
pub mod bytes;
pub mod emitter;
pub mod film;
pub mod image;
pub mod integrator;
pub mod interaction;
pub mod irradiance;
pub mod math;
pub mod render;
pub mod sampler;
pub mod scene;
pub mod sensor;
pub mod shape;
pub mod spectrum;
pub mod texture;
pub mod verify;
