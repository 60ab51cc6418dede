//! `bumpmap` and `normalmap`: a material in a turned shading frame.
//!
//! | parameter | unit | default | |
//! |---|---|---|---|
//! | (texture) | scene units | | height field of `bumpmap` |
//! | `scale` | 1 | 1 | factor on the heights |
//! | `normalmap` | | | normal of `normalmap`: local x, y, z as (xyz + 1)/2, to be read raw |
//! | `flip_invalid_normals` | | true | mirror normals that turn away from the viewer |
//! | `use_shadowing_function` | | true | fade light out towards the unperturbed horizon |
//!
//! As in Mitsuba 3.9: a normal that turns away from the viewer is mirrored around the unperturbed
//! one (Schüssler et al. 2017: Microfacet-based normal mapping for robust Monte Carlo path
//! tracing), light must come from the same side of both normals, and is attenuated where that
//! would end abruptly (Estevez et al. 2019: A microfacet-based shadowing function to solve the
//! bump terminator problem).

use super::PerturbationOptions;
use crate::interaction::SurfaceInteraction;
use crate::math::{Frame, Vec2, Vec3};
use crate::spectrum::Rgb;

/// What remains of a replaced shading frame.
#[derive(Debug, Clone, Copy)]
pub(super) struct Guard {
    /// Index of the guard of the map around this one.
    pub(super) outer: Option<u8>,
    /// The normal that was replaced.
    normal: Vec3,
    /// Roughness² of the shadowing function: how far the new normal is from the old.
    alpha2: f32,
}

impl Guard {
    /// For the replaced normal (world) and the new one, local to the replaced frame.
    pub(super) fn new(
        outer: Option<u8>,
        normal: Vec3,
        perturbed: Vec3,
        options: PerturbationOptions,
    ) -> Self {
        let alpha2 =
            if options.use_shadowing_function { (0.125 * tan2(perturbed.z)).min(1.0) } else { 0.0 };
        Self { outer, normal, alpha2 }
    }

    /// Factor on light from `wi` (world), whose cosine with the new normal is `cos_local`.
    pub(super) fn shadowing(&self, wi: Vec3, cos_local: f32) -> f32 {
        let cos = self.normal.dot(wi);
        if cos * cos_local <= 0.0 {
            return 0.0;
        }
        if self.alpha2 == 0.0 {
            return 1.0;
        }
        2.0 / (1.0 + (1.0 + self.alpha2 * tan2(cos)).sqrt())
    }
}

/// tan² of the angle with this cosine.
fn tan2(cos: f32) -> f32 {
    let cos2 = cos * cos;
    (1.0 - cos2).max(0.0) / cos2
}

/// The frame of a normal map's colour, local to the frame that it replaces; `wo` is local, too.
pub(super) fn normal_map(color: Rgb, wo: Vec3, options: PerturbationOptions) -> Frame {
    let n = Vec3::new(color.r, color.g, color.b) * 2.0 - Vec3::ONE;
    let n = towards_viewer(n.try_normalize().unwrap_or(Vec3::Z), wo, options);
    Frame::from_normal_tangent(n, Vec3::X)
}

/// The frame of a height field with this gradient by (u, v), local to the frame `shading` that it
/// replaces; `wo` is local, too. The change of the normal along the surface is ignored
/// (Blinn 1978: Simulation of wrinkled surfaces).
pub(super) fn bump_map(
    gradient: Vec2,
    si: &SurfaceInteraction,
    shading: &Frame,
    wo: Vec3,
    options: PerturbationOptions,
) -> Frame {
    let n = shading.n;
    let raised = |dp: Vec3, slope: f32| dp + n * (slope - n.dot(dp));
    let (dp_du, dp_dv) = si.derivatives.map_or((shading.s, shading.t), |d| (d.dp_du, d.dp_dv));
    let normal = raised(dp_du, gradient.x).cross(raised(dp_dv, gradient.y));
    let normal = normal.try_normalize().unwrap_or(n);
    let normal = if normal.dot(si.ng) < 0.0 { -normal } else { normal };
    let local = towards_viewer(shading.to_local(normal), wo, options);
    // Mitsuba takes dp/du as if it were local: only anisotropic materials see the difference.
    Frame::from_normal_tangent(local, dp_du)
}

/// Mirrors a normal that turns away from the viewer around z, if that is wanted.
fn towards_viewer(n: Vec3, wo: Vec3, options: PerturbationOptions) -> Vec3 {
    if options.flip_invalid_normals && wo.z * wo.dot(n) <= 0.0 {
        Vec3::new(-n.x, -n.y, n.z)
    } else {
        n
    }
}
