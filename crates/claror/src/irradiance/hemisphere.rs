//! What a record sees: one sample per cell of a grid over the hemisphere, and the means, extremes
//! and errors that follow from it.

use std::f64::consts::PI;

use crate::math::{Vec2, Vec3, warp};
use crate::spectrum::Rgb;

/// Minimum distances are looked for above this cosine (10 degrees above the tangent plane), where
/// neighbouring, coplanar geometry cannot be hit by rounding.
const MIN_DISTANCE_COSINE: f32 = 0.173_648_18;
/// Share of the cells below the robust minimum distance.
const ROBUST_QUANTILE: f64 = 0.05;

/// How the hemisphere is divided into cells of equal cosine-weighted solid angle.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Grid {
    /// `n × n` squares, mapped to the disk (Shirley and Chiu 1997) and lifted to the hemisphere.
    Concentric {
        /// Cells along an edge of the square.
        n: u32,
    },
    /// `m` rings in sin²θ, each with `n` equal azimuths (Ward and Heckbert 1992).
    Polar {
        /// Rings.
        m: u32,
        /// Azimuths.
        n: u32,
    },
}

impl Grid {
    /// Number of cells.
    pub fn len(self) -> usize {
        let (columns, rows) = self.size();
        columns as usize * rows as usize
    }

    /// True for a grid without cells.
    pub fn is_empty(self) -> bool {
        self.len() == 0
    }

    /// Columns (index `i`) and rows (index `j`); the azimuth and the ring of a polar grid. Cell
    /// (i, j) has index `j · columns + i`.
    pub fn size(self) -> (u32, u32) {
        match self {
            Self::Concentric { n } => (n, n),
            Self::Polar { m, n } => (n, m),
        }
    }

    /// Index of the cell that a local unit direction lies in; `None` below the horizon.
    pub fn cell_of(self, direction: Vec3) -> Option<usize> {
        if direction.z <= 0.0 {
            return None;
        }
        let u = match self {
            Self::Concentric { .. } => warp::concentric_square(direction.truncate()),
            Self::Polar { .. } => {
                let turn = direction.y.atan2(direction.x) / std::f32::consts::TAU;
                let around = if turn < 0.0 { turn + 1.0 } else { turn };
                Vec2::new(around, 1.0 - direction.z * direction.z)
            }
        };
        let (columns, rows) = self.size();
        let index = |u: f32, count: u32| ((u * count as f32) as usize).min(count as usize - 1);
        Some(index(u.y, rows) * columns as usize + index(u.x, columns))
    }

    /// Local, unit direction in cell (i, j) at `jitter` in [0, 1)²; z is along the normal. Uniform
    /// jitter makes it cosine distributed within the cell.
    pub fn direction(self, i: u32, j: u32, jitter: Vec2) -> Vec3 {
        let (columns, rows) = self.size();
        let u = (Vec2::new(i as f32, j as f32) + jitter) / Vec2::new(columns as f32, rows as f32);
        match self {
            Self::Concentric { .. } => warp::cosine_hemisphere(u),
            Self::Polar { .. } => {
                let (sin, cos) = (std::f32::consts::TAU * u.x).sin_cos();
                let sin_theta = u.y.sqrt();
                Vec3::new(sin_theta * cos, sin_theta * sin, (1.0 - u.y).max(0.0).sqrt())
            }
        }
    }
}

/// What was found along the direction of one cell.
#[derive(Debug, Clone, Copy, PartialEq)]
#[repr(C)]
pub struct Cell {
    /// Unit direction, local: z is along the record's normal.
    pub direction: Vec3,
    /// Distance from the record to the hit, scene units; infinite where nothing was hit.
    pub distance: f32,
    /// Geometric normal at the hit, local, either side; zero where unknown and for misses.
    pub normal: Vec3,
    /// [`Cell::BACK_FACE`] or 0.
    pub flags: u32,
    /// Radiance from there, without the first hit's emission (W·m⁻²·sr⁻¹).
    pub radiance: Rgb,
}

impl Cell {
    /// Flag: the hit was at the back of a closed object, so the record may lie inside of it.
    pub const BACK_FACE: u32 = 1;
}

/// One sample per cell of a grid.
#[derive(Debug, Clone)]
pub struct Hemisphere {
    /// The division.
    pub grid: Grid,
    /// One per cell, by index.
    pub cells: Vec<Cell>,
    /// How many independent batches the cells' radiance is the mean of.
    pub batches: u32,
}

impl Hemisphere {
    /// From the cells in order; `None` when there is not one for each cell of the grid, or none.
    pub fn new(grid: Grid, cells: Vec<Cell>) -> Option<Self> {
        (!grid.is_empty() && cells.len() == grid.len()).then_some(Self { grid, cells, batches: 1 })
    }

    /// Irradiance, W·m⁻²: π times the mean radiance.
    pub fn irradiance(&self) -> Rgb {
        let mut sum = [0.0_f64; 3];
        for cell in &self.cells {
            for (sum, l) in sum.iter_mut().zip(cell.radiance.to_array()) {
                *sum += f64::from(l);
            }
        }
        let scale = PI / self.cells.len() as f64;
        Rgb::from(sum.map(|sum| (scale * sum) as f32))
    }

    /// Harmonic mean of the distances to the hits, scene units: misses add nothing to the sum of
    /// the inverses, but count. Infinite when nothing was hit (Ward, Rubinstein and Clear 1988).
    pub fn harmonic_mean_distance(&self) -> f32 {
        let inverse: f64 = self.cells.iter().map(|c| 1.0 / f64::from(c.distance)).sum();
        (self.cells.len() as f64 / inverse) as f32
    }

    /// Arithmetic mean of the distances: dominated by what is far, so wrong as a radius, infinite
    /// after one miss. Only for the criterion that is kept to show that.
    pub fn arithmetic_mean_distance(&self) -> f32 {
        let sum: f64 = self.cells.iter().map(|c| f64::from(c.distance)).sum();
        (sum / self.cells.len() as f64) as f32
    }

    /// Distance to the nearest hit more than 10 degrees above the tangent plane, scene units
    /// (Tabellion and Lamorlette 2004); infinite when nothing was hit there.
    pub fn minimum_distance(&self) -> f32 {
        self.steep_distances().fold(f32::INFINITY, f32::min)
    }

    /// As [`Hemisphere::minimum_distance`], but the distance that 5 % of those cells stay below, so
    /// that a speck of geometry or a self-intersection does not decide alone.
    pub fn robust_minimum_distance(&self) -> f32 {
        let mut distances: Vec<f32> = self.steep_distances().collect();
        let k = (ROBUST_QUANTILE * distances.len() as f64) as usize;
        if k >= distances.len() {
            return f32::INFINITY;
        }
        *distances.select_nth_unstable_by(k, f32::total_cmp).1
    }

    fn steep_distances(&self) -> impl Iterator<Item = f32> + '_ {
        self.cells.iter().filter(|c| c.direction.z > MIN_DISTANCE_COSINE).map(|c| c.distance)
    }

    /// Estimated relative standard error of the irradiance's luminance, from the differences of
    /// neighbouring cells: what a stratified grid leaves of the variance. Infinite in the dark
    /// unless there is no difference at all.
    pub fn relative_error(&self) -> f32 {
        let luminance = |i: u32, j: u32| {
            let (columns, _) = self.grid.size();
            f64::from(self.cells[(j * columns + i) as usize].radiance.luminance())
        };
        let (columns, rows) = self.grid.size();
        let wraps = matches!(self.grid, Grid::Polar { .. });
        let (mut sum, mut pairs) = (0.0_f64, 0_u32);
        for j in 0..rows {
            for i in 0..columns {
                let here = luminance(i, j);
                if i + 1 < columns || (wraps && columns > 2) {
                    sum += (luminance((i + 1) % columns, j) - here).powi(2);
                    pairs += 1;
                }
                if j + 1 < rows {
                    sum += (luminance(i, j + 1) - here).powi(2);
                    pairs += 1;
                }
            }
        }
        if sum == 0.0 {
            return 0.0;
        }
        let half_mean_square = 0.5 * sum / f64::from(pairs);
        let sigma = PI * (half_mean_square / self.cells.len() as f64).sqrt();
        (sigma / f64::from(self.irradiance().luminance())) as f32
    }

    /// Share of the cells whose ray met the back of a closed object, 0 to 1.
    pub fn back_face_share(&self) -> f32 {
        let count = self.cells.iter().filter(|c| c.flags & Cell::BACK_FACE != 0).count();
        count as f32 / self.cells.len() as f32
    }

    /// Averages the radiance with that of an independent batch on the same grid, cell by cell. The
    /// geometry (directions, distances, normals) stays that of the first batch. Ignored when the
    /// grids differ.
    pub fn add_batch(&mut self, other: &Self) {
        if self.grid != other.grid {
            return;
        }
        let total = self.batches + other.batches;
        let (mine, theirs) = (self.batches as f32, other.batches as f32);
        for (cell, new) in self.cells.iter_mut().zip(&other.cells) {
            cell.radiance = (cell.radiance * mine + new.radiance * theirs) / total as f32;
        }
        self.batches = total;
    }
}
