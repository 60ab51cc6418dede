//! Tests that concern all material models.

mod delta;
mod extremes;
mod materials;
mod physics;
mod reference;
mod sampling;
mod support;
