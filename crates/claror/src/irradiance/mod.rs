//! Irradiance caching: records of irradiance on surfaces, and interpolation between them.
//!
//! The mathematics alone: what a record follows from is a [`Hemisphere`] of samples that somebody
//! else took, and nothing here knows a scene. Everything is flat, deterministic to the bit and
//! free of absolute lengths. Local frames have z along the record's normal.
//!
//! Ward, Rubinstein and Clear 1988: A ray tracing solution for diffuse interreflection; Ward and
//! Heckbert 1992: Irradiance gradients; Tabellion and Lamorlette 2004: An approximate global
//! illumination system for computer generated films; Křivánek et al. 2006: Making radiance and
//! irradiance caching practical; Schwarzhaupt, Jensen and Jarosz 2012: Practical Hessian-based
//! error control for irradiance caching.

mod clamp;
mod corral;
mod criterion;
mod hemisphere;
mod index;
mod inspect;
mod kernel;
mod lookup;
mod mesh;
mod polar;
mod record;
mod rotational;
mod smooth;
mod surroundings;
#[cfg(test)]
mod tests;

pub use clamp::{NeighbourClamp, limited};
pub use corral::{SECTORS, rim_distances};
pub use criterion::{
    CreviceRule, Criterion, Estimates, Radii, RadiusBounds, RadiusSettings, clamped_by_neighbour,
    eigenvalues, radii, ward_angle,
};
pub use hemisphere::{Cell, Grid, Hemisphere};
pub use index::{Bvh, Cells, Index, IndexKind, LeafOctree, Octree};
pub use inspect::{Inspection, Miss, inspect};
pub use kernel::{LookupSettings, Query, Reach, Rejection, Weight, rejection, weight};
pub(crate) use lookup::{Candidate, Candidates, lookup_with};
pub use lookup::{Interpolated, lookup, lookup_seen};
pub use mesh::{
    Derivatives, MeshRule, MeshSettings, MeshTopology, luminance_gradient, mesh_derivatives,
};
pub use polar::ward_heckbert_gradient;
pub use record::Record;
pub use rotational::{angular_support, rotational_curvature, rotational_gradient};
pub use smooth::{Smoother, Uncertainty};
pub use surroundings::Surroundings;
