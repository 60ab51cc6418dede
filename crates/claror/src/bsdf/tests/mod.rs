//! Tests that concern all material models.

mod delta;
mod support;
