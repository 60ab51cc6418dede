//! `diffuse`: ideal Lambertian reflection, black seen or lit from behind.
//!
//! | parameter | unit | default | |
//! |---|---|---|---|
//! | `reflectance` | 1 | 0.5 | share of the light that is reflected |

use std::f32::consts::FRAC_1_PI;

use super::lobe::{LobeEval, LobeSample};
use crate::math::{Vec2, Vec3, warp};
use crate::spectrum::Rgb;

#[derive(Debug, Clone, Copy)]
pub(super) struct Diffuse {
    pub(super) reflectance: Rgb,
}

impl Diffuse {
    pub(super) fn eval(&self, wo: Vec3, wi: Vec3) -> LobeEval {
        if wo.z <= 0.0 || wi.z <= 0.0 {
            return LobeEval::ZERO;
        }
        let pdf = FRAC_1_PI * wi.z;
        let value = self.reflectance * pdf;
        LobeEval { value, diffuse: value, pdf }
    }

    pub(super) fn sample(&self, wo: Vec3, u: Vec2) -> Option<LobeSample> {
        if wo.z <= 0.0 {
            return None;
        }
        let wi = warp::cosine_hemisphere(u);
        let pdf = warp::cosine_hemisphere_pdf(wi.z);
        (pdf > 0.0).then_some(LobeSample {
            wi,
            weight: self.reflectance,
            diffuse_weight: self.reflectance,
            pdf,
            eta: 1.0,
            is_delta: false,
        })
    }

    pub(super) fn diffuse_albedo(&self, wo: Vec3) -> Rgb {
        if wo.z > 0.0 { self.reflectance } else { Rgb::BLACK }
    }
}
