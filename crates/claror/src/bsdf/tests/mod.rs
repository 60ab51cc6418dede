//! Tests that concern all material models.

mod delta;
mod materials;
mod reference;
mod support;
