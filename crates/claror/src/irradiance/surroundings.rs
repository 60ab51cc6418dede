//! What a record has seen, coarsely: to find out what it does not know.
//!
//! A record says how much light there was, not where it came from. Who finds something near a point
//! that a record serves has to know whether the record's rays met it, too, and what they saw there.
//! For that their radiance and inverse distances are kept, averaged over the cells of a grid over
//! the hemisphere so coarse that a cell holds some ten rays.

use super::hemisphere::{Grid, Hemisphere};
use crate::bytes::{BytesError, Reader, put_f32, put_u32};
use crate::math::{Frame, Vec3};
use crate::spectrum::Rgb;

/// Cells along an edge. Finer grids, up to 12, make pictures no better.
const EDGE: u32 = 6;
const GRID: Grid = Grid::Concentric { n: EDGE };
/// Number of cells.
const CELLS: usize = (EDGE * EDGE) as usize;
/// Sine of the lowest direction that is told from others: below it the rim answers.
const LOWEST: f32 = 1e-3;

/// See the module.
#[derive(Debug, Clone, Copy, PartialEq)]
#[repr(C)]
pub struct Surroundings {
    /// How near things may be that records around do not resolve, scene units.
    pub reach: f32,
    /// Mean inverse distance of what the rays of a cell met, 1/scene units.
    closeness: [f32; CELLS],
    /// The largest of them.
    largest: f32,
    /// Mean radiance of a cell's rays, W·m⁻²·sr⁻¹: see [`packed`].
    radiance: [u32; CELLS],
}

impl Surroundings {
    /// Of what a record sees.
    pub fn new(hemisphere: &Hemisphere, reach: f32) -> Self {
        let mut sums = [(Rgb::BLACK, 0.0, 0.0); CELLS];
        for cell in &hemisphere.cells {
            if let Some(at) = GRID.cell_of(above(cell.direction)) {
                let (radiance, closeness, count) = &mut sums[at];
                *radiance += cell.radiance;
                *closeness += 1.0 / cell.distance;
                *count += 1.0;
            }
        }
        let closeness = sums.map(|(_, sum, count)| (sum / f32::max(count, 1.0)).min(f32::MAX));
        let radiance = sums.map(|(sum, _, count)| packed(sum * (1.0 / f32::max(count, 1.0))));
        Self::of_cells(reach, closeness, radiance)
    }

    fn of_cells(reach: f32, closeness: [f32; CELLS], radiance: [u32; CELLS]) -> Self {
        let largest = closeness.into_iter().fold(0.0, f32::max);
        Self { reach, closeness, largest, radiance }
    }

    /// How much nearer than `distance` things are in a direction from a record with the normal `n`:
    /// the mean over the rays of the ratio of that distance to theirs. 1 where the rays met what is
    /// there, 0 where they went on for long.
    pub fn closeness(&self, n: Vec3, direction: Vec3, distance: f32) -> f32 {
        distance * self.closeness[cell(n, direction)]
    }

    /// Radiance from a direction, W·m⁻²·sr⁻¹.
    pub fn radiance(&self, n: Vec3, direction: Vec3) -> Rgb {
        unpacked(self.radiance[cell(n, direction)])
    }

    /// Whether rays in a direction met something within reach.
    #[inline]
    pub fn has_near(&self, n: Vec3, direction: Vec3) -> bool {
        self.largest * self.reach > 1.0 && self.closeness(n, direction, self.reach) > 1.0
    }

    /// As [`Surroundings::read`] expects it.
    pub(crate) fn put(&self, out: &mut Vec<u8>) {
        put_f32(out, self.reach);
        self.closeness.iter().for_each(|&x| put_f32(out, x));
        self.radiance.iter().for_each(|&x| put_u32(out, x));
    }

    /// `None` where a number is not one that could have been written.
    pub(crate) fn read(reader: &mut Reader) -> Result<Option<Self>, BytesError> {
        let reach = reader.f32()?;
        let (mut closeness, mut radiance) = ([0.0; CELLS], [0; CELLS]);
        for x in &mut closeness {
            *x = reader.f32()?;
        }
        for x in &mut radiance {
            *x = reader.u32()?;
        }
        let is_sound = |x: f32| x >= 0.0 && x.is_finite();
        let all = is_sound(reach) && closeness.into_iter().all(is_sound);
        Ok(all.then(|| Self::of_cells(reach, closeness, radiance)))
    }
}

/// The cell of a world-space direction about a normal. What is below the horizon is taken for what
/// is just above it: records on a curved surface are turned against each other.
fn cell(n: Vec3, direction: Vec3) -> usize {
    let local = Frame::from_normal(n).to_local(direction);
    GRID.cell_of(above(local)).unwrap_or(0)
}

fn above(local: Vec3) -> Vec3 {
    Vec3 { z: local.z.max(LOWEST), ..local }.normalize()
}

/// Bits of a colour's mantissas, and what is added to its exponent.
const MANTISSA: i32 = 8;
const BIAS: i32 = 128;

/// A colour of 8 bits per channel and a common exponent of 8 (Ward 1991: Real pixels). Black where
/// it is negative, infinite or NaN.
fn packed(colour: Rgb) -> u32 {
    let largest = colour.max_component();
    if !(colour.is_finite() && largest > 0.0) {
        return 0;
    }
    // Exactly 2^exponent > largest.
    let exponent = ((largest.to_bits() >> 23) as i32 - 126).clamp(MANTISSA - BIAS, 255 - BIAS);
    let scale = f64::exp2(f64::from(MANTISSA - exponent));
    let channel = |x: f32| (f64::from(x.max(0.0)) * scale).round().min(255.0) as u32;
    let [r, g, b] = colour.to_array().map(channel);
    (exponent + BIAS) as u32 | r << 8 | g << 16 | b << 24
}

fn unpacked(bits: u32) -> Rgb {
    let scale = f64::exp2(f64::from((bits & 0xff) as i32 - BIAS - MANTISSA));
    Rgb::from([8, 16, 24].map(|at| (f64::from(bits >> at & 0xff) * scale) as f32))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::irradiance::Cell;
    use crate::math::Vec2;

    fn hemisphere(see: impl Fn(Vec3) -> (f32, Rgb)) -> Hemisphere {
        let grid = Grid::Concentric { n: 24 };
        let cells = (0..24 * 24).map(|k| {
            let direction = grid.direction(k % 24, k / 24, Vec2::splat(0.5));
            let (distance, radiance) = see(direction);
            Cell { direction, distance, normal: Vec3::ZERO, flags: 0, radiance }
        });
        Hemisphere::new(grid, cells.collect()).unwrap()
    }

    #[test]
    fn colours_are_kept_to_half_a_percent() {
        for exponent in [-100, -30, -1, 0, 1, 7, 60, 120] {
            let scale = f32::exp2(exponent as f32);
            for colour in [[1.0, 1.0, 1.0], [0.999_99, 0.5, 0.0], [0.001, 0.7, 0.3]] {
                let colour = Rgb::from(colour) * scale;
                let back = unpacked(packed(colour));
                for (a, b) in colour.to_array().into_iter().zip(back.to_array()) {
                    assert!((a - b).abs() <= colour.max_component() / 255.0, "{colour:?} {back:?}");
                }
            }
            // Powers of two change no bit of the mantissas.
            let colour = Rgb::new(0.7, 0.2, 0.9);
            assert_eq!(unpacked(packed(colour * scale)), unpacked(packed(colour)) * scale);
        }
        for nothing in
            [Rgb::BLACK, Rgb::splat(-1.0), Rgb::splat(f32::NAN), Rgb::splat(f32::INFINITY)]
        {
            assert_eq!(unpacked(packed(nothing)), Rgb::BLACK);
        }
        assert!(unpacked(packed(Rgb::splat(f32::MAX))).is_finite());
        assert!(unpacked(packed(Rgb::splat(1e-42))).max_component() < 1e-35);
    }

    /// A wall at x = 0.5, red, under a white sky.
    #[test]
    fn a_wall_is_where_it_was_seen() {
        let n = Vec3::new(0.6, 0.0, 0.8);
        let frame = Frame::from_normal(n);
        let seen = hemisphere(|local| {
            let x = frame.to_world(local).x;
            if x > 0.0 { (0.5 / x, Rgb::new(1.0, 0.0, 0.0)) } else { (f32::INFINITY, Rgb::WHITE) }
        });
        let surroundings = Surroundings::new(&seen, 1.0);
        let towards = Vec3::new(0.9, 0.1, 0.2).normalize();
        let away = Vec3::new(-0.7, 0.1, 0.7).normalize();
        let closeness = surroundings.closeness(n, towards, 0.5 / towards.x);
        assert!((closeness - 1.0).abs() < 0.1, "{closeness}");
        assert_eq!(surroundings.closeness(n, away, 100.0), 0.0);
        assert_eq!(surroundings.radiance(n, towards), Rgb::new(1.0, 0.0, 0.0));
        assert_eq!(surroundings.radiance(n, away), Rgb::WHITE);
        assert!(surroundings.has_near(n, towards) && !surroundings.has_near(n, away));
        assert!(!Surroundings::new(&seen, 0.4).has_near(n, towards));
        let mut bytes = Vec::new();
        surroundings.put(&mut bytes);
        assert_eq!(Surroundings::read(&mut Reader::new(&bytes)), Ok(Some(surroundings)));
        // From below the horizon the rim answers.
        let below = (towards - 0.95 * n).normalize();
        assert!(below.dot(n) < 0.0 && surroundings.closeness(n, below, 1.0) > 0.0);
    }

    #[test]
    fn odd_numbers_are_survived() {
        let seen = hemisphere(|_| (0.0, Rgb::splat(f32::INFINITY)));
        let surroundings = Surroundings::new(&seen, 1.0);
        let mut bytes = Vec::new();
        surroundings.put(&mut bytes);
        assert_eq!(Surroundings::read(&mut Reader::new(&bytes)), Ok(Some(surroundings)));
        bytes[..4].copy_from_slice(&f32::NAN.to_le_bytes());
        assert_eq!(Surroundings::read(&mut Reader::new(&bytes)), Ok(None));
        for direction in [Vec3::ZERO, Vec3::splat(f32::NAN), -Vec3::Z] {
            assert!(surroundings.radiance(Vec3::Z, direction).is_finite());
            assert!(!surroundings.closeness(Vec3::Z, direction, 1.0).is_nan());
        }
    }
}
