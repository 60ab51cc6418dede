//! Tests against closed forms and finite differences in scenes whose irradiance is known exactly.

mod gradients;
mod hemispheres;
pub(crate) mod scene;
