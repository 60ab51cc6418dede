//! `null`: an invisible surface. Also the transparent share of `mask`.

use super::lobe::LobeSample;
use crate::math::Vec3;
use crate::spectrum::Rgb;

/// Straight on, from either side.
pub(super) fn sample(wo: Vec3) -> LobeSample {
    LobeSample::delta(-wo, Rgb::WHITE, 1.0, 1.0)
}
