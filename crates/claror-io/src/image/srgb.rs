//! The sRGB transfer function (IEC 61966-2-1).

/// Encoded [0, 1] → linear, the exact piecewise curve.
pub fn srgb_to_linear(encoded: f32) -> f32 {
    let x = f64::from(encoded);
    let linear = if x <= 0.04045 { x / 12.92 } else { ((x + 0.055) / 1.055).powf(2.4) };
    linear as f32
}

/// Linear → encoded, the inverse of [`srgb_to_linear`]. Below 0 the linear part continues.
pub fn linear_to_srgb(linear: f32) -> f32 {
    let x = f64::from(linear);
    let encoded = if x <= 0.003_130_8 { 12.92 * x } else { 1.055 * x.powf(1.0 / 2.4) - 0.055 };
    encoded as f32
}
