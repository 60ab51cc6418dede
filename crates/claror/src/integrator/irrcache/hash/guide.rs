//! Where walks find light: densities of directions, learned from earlier walks.
//!
//! Where light comes through a door ajar, hardly any walk finds the gap, and those that do decide
//! about all others. The cells of the hash know soon how much light the surfaces beyond send, even
//! those that few walks saw; from them each segment of a walk learns how much arrives at its
//! start from its direction. Later walks look there, mixed with the material's own density, so that
//! their estimates stay unbiased whatever was learned. After Vorba et al. 2014 and Müller et al.
//! 2017 (path guiding), with irradiance cached where they use single walks.

use std::f32::consts::FRAC_1_PI;

use super::{IrradianceHash, LEVELS, Visit, lit_normal};
use crate::interaction::SurfaceInteraction;
use crate::math::directions::{CELLS, DirectionField, DirectionSums, Directions, cell_of};
use crate::math::{Bounds3, Vec3};
use crate::spectrum::Rgb;

/// Voxels along the scene's longest side.
const RESOLUTION: u32 = 24;
/// Grids from fine to coarse.
const GRIDS: u32 = 3;
/// Segments that must have begun in a voxel for it to be trusted.
const LEAST_SEGMENTS: u32 = 2048;

/// What a segment of a walk taught.
#[derive(Debug, Clone, Copy)]
pub(super) struct Lesson {
    slot: u32,
    cell: u16,
    weight: f32,
}

/// Directions in which walks look for light.
pub(super) struct WalkGuide(DirectionField);

impl WalkGuide {
    /// What is known for the place `p` with unit normal `n` on the lit side.
    pub(super) fn at(&self, p: Vec3, n: Vec3) -> Option<Directions<'_>> {
        self.0.at(p, n)
    }

    /// From everywhere towards one direction.
    #[cfg(test)]
    pub(super) fn towards(bounds: Bounds3, d: Vec3) -> Self {
        let mut sums = DirectionSums::new(bounds, 1);
        for n in [Vec3::X, Vec3::Y, Vec3::Z].into_iter().flat_map(|axis| [axis, -axis]) {
            sums.add(sums.slot(Vec3::ZERO, n), cell_of(d).0, 1.0);
        }
        Self(sums.field(1, 1, &[1.0; CELLS]))
    }
}

/// Knows how bright surfaces are, and what was learned from that.
pub(super) struct Teacher {
    known: IrradianceHash,
    sums: DirectionSums,
}

impl Teacher {
    pub(super) fn new(bounds: Bounds3, known: IrradianceHash) -> Self {
        Self { known, sums: DirectionSums::new(bounds, RESOLUTION) }
    }

    /// Goes on with what is known now.
    pub(super) fn update(&mut self, known: IrradianceHash) {
        self.known = known;
    }

    /// Radiance that a surface of this diffuse albedo sends, W·m⁻²·sr⁻¹, without emission: a guess.
    pub(super) fn radiance(&self, si: &SurfaceInteraction, albedo: Rgb) -> Rgb {
        let n = lit_normal(si);
        let found = (0..LEVELS)
            .rev()
            .filter_map(|level| self.known.find(self.known.key(si.p, n, si.shape, level)));
        let mut indirect = None;
        for cell in found {
            let indirect = *indirect.get_or_insert(cell.indirect);
            if let Some(direct) = cell.direct {
                return albedo * (indirect + direct) * FRAC_1_PI;
            }
        }
        albedo * indirect.unwrap_or(Rgb::BLACK) * FRAC_1_PI
    }

    /// That so much arrives at a place from the direction `d`.
    pub(super) fn lesson(&self, at: &Visit, d: Vec3, weight: f32) -> Lesson {
        Lesson { slot: self.sums.slot(at.p, at.n) as u32, cell: cell_of(d).0 as u16, weight }
    }

    /// Sums depend on the order.
    pub(super) fn add(&mut self, lessons: &[Lesson]) {
        for lesson in lessons {
            self.sums.add(lesson.slot as usize, lesson.cell.into(), lesson.weight);
        }
    }

    /// A guide by all that was learned.
    pub(super) fn guide(&self) -> WalkGuide {
        WalkGuide(self.sums.field(GRIDS, LEAST_SEGMENTS, &[1.0; CELLS]))
    }
}
