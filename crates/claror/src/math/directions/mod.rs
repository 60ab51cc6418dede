//! Densities of directions: cumulative shares of the cells of a grid on the faces of a cube, which
//! needs no trigonometry. Within a cell the density is uniform on the face.

mod field;

use super::{Vec2, Vec3, facing};
pub use field::{DirectionField, DirectionSums};

/// Facings: the six signed axes.
const FACINGS: usize = 6;
/// Cells along an edge of a face of the cube of directions.
const EDGE: usize = 10;
/// Direction cells of a face.
const FACE: usize = EDGE * EDGE;
/// Direction cells.
pub const CELLS: usize = FACINGS * FACE;

/// The axes along and across the face of the cube of directions around a signed axis.
const ACROSS: [[usize; 2]; 3] = [[1, 2], [2, 0], [0, 1]];

/// Direction cell of the unit vector `d`, and density by solid angle, there, of what is uniform in
/// that cell of the face: with r the vector to the face, dω = du dv / |r|³.
pub fn cell_of(d: Vec3) -> (usize, f32) {
    let face = facing(d) as usize;
    let axis = face / 2;
    let scale = 1.0 / d[axis].abs();
    let [i, j] = ACROSS[axis].map(|a| {
        // A negative float narrows to 0.
        let x = (0.5 * EDGE as f32) * (d[a] * scale + 1.0);
        (x as usize).min(EDGE - 1)
    });
    (face * FACE + j * EDGE + i, DENSITY_ON_FACE * scale * scale * scale)
}

/// Direction inside cell `cell`, uniform on the face for `u` uniform in the unit square, and its
/// density by solid angle.
pub fn direction_in(cell: usize, u: Vec2) -> (Vec3, f32) {
    let (face, within) = (cell / FACE, cell % FACE);
    let axis = face / 2;
    let mut r = Vec3::ZERO;
    r[axis] = if face % 2 == 0 { 1.0 } else { -1.0 };
    r[ACROSS[axis][0]] = ((within % EDGE) as f32 + u.x) * (2.0 / EDGE as f32) - 1.0;
    r[ACROSS[axis][1]] = ((within / EDGE) as f32 + u.y) * (2.0 / EDGE as f32) - 1.0;
    let length2 = r.length_squared();
    let length = length2.sqrt();
    (r / length, DENSITY_ON_FACE * length2 * length)
}

/// One over the area of a cell of a face.
const DENSITY_ON_FACE: f32 = FACE as f32 / 4.0;

/// A density of directions: cumulative shares of the cells, the last one 1.
#[derive(Debug, Clone, Copy)]
pub struct Directions<'a>(&'a [f32]);

impl Directions<'_> {
    /// A direction and its density by solid angle; `None` where rounding leaves none.
    pub fn sample(&self, u: Vec2) -> Option<(Vec3, f32)> {
        let shares = self.0;
        let cell = shares.partition_point(|&c| c <= u.x).min(CELLS - 1);
        let before = if cell == 0 { 0.0 } else { shares[cell - 1] };
        let share = shares[cell] - before;
        if share <= 0.0 {
            return None;
        }
        let within = ((u.x - before) / share).clamp(0.0, 1.0 - f32::EPSILON);
        let (direction, density) = direction_in(cell, Vec2::new(within, u.y));
        Some((direction, share * density))
    }

    /// Density by solid angle with which [`Directions::sample`] chooses the unit vector `d`.
    pub fn pdf(&self, d: Vec3) -> f32 {
        let (cell, density) = cell_of(d);
        let before = if cell == 0 { 0.0 } else { self.0[cell - 1] };
        (self.0[cell] - before) * density
    }
}

/// Cumulative shares of cells of these weights, times `scale`. A fifth of each cell's weight is
/// spread over its four neighbours on the face, since what was seen is little and places are not
/// points.
fn cumulative_shares(weights: &[f32; CELLS], scale: &[f32; CELLS]) -> [f32; CELLS] {
    let mut spread = [0.0_f32; CELLS];
    for (cell, &weight) in weights.iter().enumerate() {
        if weight == 0.0 {
            continue;
        }
        let face = cell - cell % FACE;
        let (j, i) = (cell % FACE / EDGE, cell % EDGE);
        let neighbours = [
            (j.saturating_sub(1), i),
            ((j + 1).min(EDGE - 1), i),
            (j, i.saturating_sub(1)),
            (j, (i + 1).min(EDGE - 1)),
        ];
        spread[cell] += 0.8 * weight;
        for (j, i) in neighbours {
            spread[face + j * EDGE + i] += 0.05 * weight;
        }
    }
    let mut total = 0.0_f64;
    let mut sums = [0.0_f64; CELLS];
    for cell in 0..CELLS {
        total += f64::from(spread[cell]) * f64::from(scale[cell].max(0.0));
        sums[cell] = total;
    }
    if total <= 0.0 {
        // Nothing matters here: any density will do.
        return std::array::from_fn(|cell| (cell + 1) as f32 / CELLS as f32);
    }
    let mut shares = sums.map(|s| (s / total) as f32);
    shares[CELLS - 1] = 1.0;
    shares
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn direction_cells_are_inverse_to_their_sampling() {
        for cell in 0..CELLS {
            for u in [Vec2::new(0.01, 0.02), Vec2::new(0.5, 0.5), Vec2::new(0.99, 0.97)] {
                let (d, density) = direction_in(cell, u);
                assert!((d.length() - 1.0).abs() < 1e-5);
                let (found, same_density) = cell_of(d);
                assert_eq!(found, cell);
                assert!((density - same_density).abs() < 1e-5 * density);
            }
        }
    }
}
