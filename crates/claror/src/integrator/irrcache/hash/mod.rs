//! A coarse average of irradiance over the cells of a world-space grid, filled by random
//! walks from the camera.
//!
//! Far from a record it does not matter exactly where on a surface a ray ends: the average over a
//! cell has the same mean and none of the noise of a single walk. Near it, the coarse cells would
//! show, so it must only be asked beyond a least length of the ray, and cells shrink with that
//! length. After Keller, Dahm and Binder 2014 (Path space filtering) and Binder, Fricke and Keller
//! 2018 (jittered spatial hashing).

mod fill;
mod guide;
mod table;
#[cfg(test)]
mod tests;
mod walk;

pub(super) use fill::HashStatistics;
pub(in crate::integrator) use walk::{direct_light, lit_normal};

use crate::bytes::{BytesError, Reader, put_f32, put_u64};
use crate::interaction::SurfaceInteraction;
use crate::math::{Vec2, Vec3, facing};
use crate::shape::ShapeId;
use crate::spectrum::Rgb;

/// Edge of the largest cells as a share of the scene's extent; those of each further level are
/// half as large.
const CELL: f32 = 0.05;
const LEVELS: u32 = 4;
/// Least length of a ray that may use a cell by default, as a share of the scene's extent; with
/// finer settings it is more, up to so many times.
const MIN_SEGMENT: f32 = 0.05;
const LONGEST_SEGMENT: f32 = 2.0;
/// Largest cell that a ray may use, as a share of its length: about what a record cannot resolve,
/// whose rays are so far apart. The smallest cells serve the shortest rays.
const RESOLUTION: f32 = 0.1;
/// What a random number is multiplied with for its later digits: they are as good as independent, and
/// enough are left.
const DIGITS: f32 = 64.0;
/// Bytes of a cell in a file.
const CELL_BYTES: usize = 8 + 4 * 6;
/// Steps beyond a key's own slot, mean of all: less than one where keys are as random as they
/// should be; in a file that was made to be slow, as many as there are cells.
const MAX_STEPS: usize = 32;

/// Where a walk met a diffuse surface.
#[derive(Debug, Clone, Copy)]
struct Visit {
    p: Vec3,
    n: Vec3,
    shape: ShapeId,
}

/// Mean irradiance of a cell, W·m⁻².
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(in crate::integrator) struct CellIrradiance {
    /// By way of other surfaces, and by the sky that the cache holds.
    pub(in crate::integrator) indirect: Rgb,
    /// By all other light sources; `None` where it is too uncertain.
    pub(in crate::integrator) direct: Option<Rgb>,
}

impl CellIrradiance {
    const BLACK: Self = Self { indirect: Rgb::BLACK, direct: None };

    /// Numbers for a file: what is not known is NaN.
    fn to_array(self) -> [f32; 6] {
        let [a, b, c] = self.indirect.to_array();
        let [d, e, f] = self.direct.map_or([f32::NAN; 3], Rgb::to_array);
        [a, b, c, d, e, f]
    }

    /// From numbers of a file; `None` where they make no sense.
    fn from_array([a, b, c, d, e, f]: [f32; 6]) -> Option<Self> {
        let (indirect, direct) = (Rgb::from([a, b, c]), Rgb::from([d, e, f]));
        let direct = (!d.is_nan()).then_some(direct);
        let is_sound = indirect.is_finite() && direct.is_none_or(Rgb::is_finite);
        is_sound.then_some(Self { indirect, direct })
    }
}

/// Mean irradiance by cell.
#[derive(Debug, Clone, PartialEq)]
pub(in crate::integrator) struct IrradianceHash {
    /// Edge of the largest cells, scene units.
    cell: f32,
    /// A ray must be so long to end in a cell, scene units.
    min_segment: f32,
    /// Open addressing; a power of two of slots. Key 0 is an empty slot.
    slots: Vec<(u64, CellIrradiance)>,
}

impl IrradianceHash {
    /// Without any cells, for a scene of this extent and settings that are by this factor finer than
    /// usual.
    fn empty(extent: f32, refinement: f32) -> Self {
        let segment = MIN_SEGMENT * refinement.powf(0.25).clamp(1.0, LONGEST_SEGMENT);
        let slots = vec![(0, CellIrradiance::BLACK)];
        Self { cell: CELL * extent, min_segment: segment * extent, slots }
    }

    /// Puts means by distinct keys into the slots; false if that takes more steps than allowed.
    fn insert(&mut self, means: &[(u64, CellIrradiance)], mut steps: usize) -> bool {
        let size = (2 * means.len() + 1).next_power_of_two();
        self.slots = vec![(0, CellIrradiance::BLACK); size];
        for mean in means {
            let mut slot = mean.0 as usize & (size - 1);
            while self.slots[slot].0 != 0 {
                slot = (slot + 1) & (size - 1);
                if steps == 0 {
                    return false;
                }
                steps -= 1;
            }
            self.slots[slot] = *mean;
        }
        true
    }

    /// Mean irradiance around the surface point at the end of a ray, if its cell was reached; `u`
    /// moves the look-up within a cell's width, which turns the cells' edges into noise. Only its
    /// later digits do, so that it may choose a direction where no cell is found: the way in which
    /// none is found must say nothing about that.
    pub(in crate::integrator) fn lookup(
        &self,
        si: &SurfaceInteraction,
        u: Vec2,
    ) -> Option<CellIrradiance> {
        if si.t < self.min_segment {
            return None;
        }
        let within = (u * DIGITS).fract();
        let finest = (self.cell / (RESOLUTION * si.t)).log2().ceil().max(0.0) as u32;
        // Coarser cells know where finer ones were hardly visited.
        (0..=finest.min(LEVELS - 1)).rev().find_map(|level| {
            let shift = (within - 0.5) * self.edge(level);
            let p = si.p + si.frame.s * shift.x + si.frame.t * shift.y;
            self.find(self.key(p, lit_normal(si), si.shape, level))
        })
    }

    fn find(&self, key: u64) -> Option<CellIrradiance> {
        let mask = self.slots.len() - 1;
        let mut slot = key as usize & mask;
        loop {
            match self.slots[slot] {
                (0, _) => return None,
                (found, value) if found == key => return Some(value),
                _ => slot = (slot + 1) & mask,
            }
        }
    }

    /// Edge of the cells of a level, scene units.
    fn edge(&self, level: u32) -> f32 {
        self.cell / (1_u32 << level) as f32
    }

    /// Never 0.
    fn key(&self, p: Vec3, n: Vec3, shape: ShapeId, level: u32) -> u64 {
        let per_unit = 1.0 / self.edge(level);
        let whole = |x: f32| (x * per_unit).floor() as i32 as u32;
        let side = u32::from(facing(n)) | level << 8;
        [whole(p.x), whole(p.y), whole(p.z), side, shape.0].into_iter().fold(1, |h: u64, word| {
            let h = (h ^ u64::from(word)).wrapping_mul(0x9e37_79b9_7f4a_7c15);
            h ^ (h >> 32)
        }) | 1 << 63
    }
}

impl IrradianceHash {
    /// Appends it as bytes: cells by ascending key.
    pub(super) fn put(&self, out: &mut Vec<u8>) {
        [self.min_segment, self.cell].into_iter().for_each(|x| put_f32(out, x));
        let cells = self.by_key();
        put_u64(out, cells.len() as u64);
        for (key, value) in cells {
            put_u64(out, key);
            value.to_array().into_iter().for_each(|x| put_f32(out, x));
        }
    }

    /// What [`IrradianceHash::put`] appended.
    pub(super) fn read(reader: &mut Reader) -> Result<Self, BytesError> {
        let [min_segment, cell] = [reader.f32()?, reader.f32()?];
        if ![min_segment, cell].iter().all(|x| x.is_finite() && *x > 0.0) {
            return Err(BytesError::BadLength);
        }
        let count = reader.length(CELL_BYTES)?;
        let mut cells: Vec<(u64, CellIrradiance)> = Vec::with_capacity(count);
        for index in 0..count {
            let key = reader.u64()?;
            let mut values = [0.0; 6];
            for value in &mut values {
                *value = reader.f32()?;
            }
            let value = CellIrradiance::from_array(values);
            let value = value.filter(|_| cells.last().map_or(0, |c| c.0) < key);
            let value = value.ok_or(BytesError::BadEntry { what: "hash", index })?;
            cells.push((key, value));
        }
        let mut hash = Self { min_segment, cell, slots: Vec::new() };
        let is_quick = hash.insert(&cells, MAX_STEPS * cells.len());
        if is_quick { Ok(hash) } else { Err(BytesError::BadLength) }
    }

    fn by_key(&self) -> Vec<(u64, CellIrradiance)> {
        let mut cells: Vec<(u64, CellIrradiance)> =
            self.slots.iter().filter(|s| s.0 != 0).copied().collect();
        cells.sort_unstable_by_key(|(key, _)| *key);
        cells
    }

    pub(super) fn cells(&self) -> usize {
        self.slots.iter().filter(|s| s.0 != 0).count()
    }

    pub(super) fn memory_bytes(&self) -> usize {
        size_of_val(&self.slots[..])
    }

    /// Forgets all but some cells.
    #[cfg(test)]
    pub(super) fn keep(&mut self, count: usize) {
        let cells = self.by_key();
        self.insert(&cells[..count], usize::MAX);
    }
}
