//! The colour spaces of FLIP: YCxCz and L*a*b*, both relative to the white of linear sRGB.

use claror::math::{Mat3, Vec3};

/// Linear sRGB → CIE XYZ, from the primaries and the D65 white (0.3127, 0.3290) of IEC 61966-2-1.
const XYZ_FROM_RGB: Mat3 = Mat3::from_cols_array(&[
    0.412_390_8,
    0.212_639,
    0.019_330_818,
    0.357_584_33,
    0.715_168_7,
    0.119_194_78,
    0.180_480_8,
    0.072_192_32,
    0.950_532_2,
]);

/// The conversions, with the matrices that they need.
#[derive(Debug, Clone, Copy)]
pub(super) struct ColorSpaces {
    rgb_from_xyz: Mat3,
    white: Vec3,
}

impl ColorSpaces {
    pub(super) fn new() -> Self {
        Self { rgb_from_xyz: XYZ_FROM_RGB.inverse(), white: XYZ_FROM_RGB * Vec3::ONE }
    }

    /// Linear sRGB → YCxCz, a linear relative of L*a*b*.
    pub(super) fn ycxcz(&self, rgb: Vec3) -> Vec3 {
        let v = XYZ_FROM_RGB * rgb / self.white;
        Vec3::new(116.0 * v.y - 16.0, 500.0 * (v.x - v.y), 200.0 * (v.y - v.z))
    }

    /// YCxCz → linear sRGB.
    pub(super) fn rgb_from_ycxcz(&self, c: Vec3) -> Vec3 {
        let y = (c.x + 16.0) / 116.0;
        let v = Vec3::new(y + c.y / 500.0, y, y - c.z / 200.0);
        self.rgb_from_xyz * (v * self.white)
    }

    /// Linear sRGB → L*a*b*, with a* and b* scaled by L*/100 (the Hunt effect).
    pub(super) fn hunt_lab(&self, rgb: Vec3) -> Vec3 {
        let f = (XYZ_FROM_RGB * rgb / self.white).to_array().map(lab_curve);
        let l = 116.0 * f[1] - 16.0;
        let hunt = 0.01 * l;
        Vec3::new(l, 500.0 * (f[0] - f[1]) * hunt, 200.0 * (f[1] - f[2]) * hunt)
    }
}

/// The cube root, linear near zero (CIE 15).
fn lab_curve(t: f32) -> f32 {
    const DELTA: f32 = 6.0 / 29.0;
    if t > DELTA * DELTA * DELTA { t.cbrt() } else { t / (3.0 * DELTA * DELTA) + 4.0 / 29.0 }
}
