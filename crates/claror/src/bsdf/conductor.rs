//! `conductor`: a smooth metal, a mirror with the colour of the metal's Fresnel reflectance.
//!
//! | parameter | unit | default | |
//! |---|---|---|---|
//! | `eta`, `k` | 1 | 0, 1 | complex index of refraction; 0, 1 is a perfect mirror |
//! | `specular_reflectance` | 1 | 1 | factor, for artists |

use super::fresnel;
use super::lobe::LobeSample;
use crate::math::Vec3;
use crate::spectrum::Rgb;

#[derive(Debug, Clone, Copy)]
pub(super) struct Conductor {
    pub(super) eta: Rgb,
    pub(super) k: Rgb,
    pub(super) specular_reflectance: Rgb,
}

impl Conductor {
    pub(super) fn sample(&self, wo: Vec3) -> Option<LobeSample> {
        if wo.z <= 0.0 {
            return None;
        }
        let weight = self.specular_reflectance * fresnel::conductor(wo.z, self.eta, self.k);
        Some(LobeSample::delta(fresnel::reflect(wo), weight, 1.0, 1.0))
    }
}
