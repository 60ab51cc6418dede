//! The grid in the picture, and weights between its points.

use super::Interpolation;
use crate::film::{CropWindow, FilmSettings};
use crate::math::{Vec2, Vec3};

/// Where in its pixel a point lies: not at the centre, which may lie exactly on an edge.
const WITHIN_PIXEL: Vec2 = Vec2::new(0.63, 0.29);

/// Pixels of every `step`-th column and row of the film, and of the last ones.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Lattice {
    columns: Vec<u32>,
    rows: Vec<u32>,
}

impl Lattice {
    /// Those that samples of the film's crop window may lie between: a part of the picture is
    /// interpolated from the same points as the whole.
    pub(super) fn new(film: &FilmSettings, step: u32) -> Self {
        let CropWindow { x, y, width, height } = film.crop;
        // Samples lie so far outside of the window, and points not in the middle of their pixels.
        let margin = film.filter.radius().ceil() as u32 + 1;
        let axis = |first: u32, size: u32, all: u32| {
            let range = (first.saturating_sub(margin), first.saturating_add(size + margin));
            lines(range, all, step.max(1))
        };
        Self { columns: axis(x, width, film.width), rows: axis(y, height, film.height) }
    }

    /// Number of points.
    pub(super) fn len(&self) -> usize {
        self.columns.len() * self.rows.len()
    }

    /// Column and row of the film of point `index`.
    pub(super) fn pixel(&self, index: usize) -> (u32, u32) {
        (self.columns[index % self.columns.len()], self.rows[index / self.columns.len()])
    }

    /// Film position of point `index`.
    pub(super) fn film(&self, index: usize) -> Vec2 {
        let (x, y) = self.pixel(index);
        Vec2::new(x as f32, y as f32) + WITHIN_PIXEL
    }

    /// The cell in which a film position lies; beyond the outermost points the nearest one.
    pub(super) fn cell(&self, film: Vec2) -> Cell {
        let at = film - WITHIN_PIXEL;
        let (left, right, s) = interval(&self.columns, at.x);
        let (top, bottom, t) = interval(&self.rows, at.y);
        let point = |column, row| row * self.columns.len() + column;
        Cell {
            corners: [
                point(left, top),
                point(right, top),
                point(left, bottom),
                point(right, bottom),
            ],
            within: Vec2::new(s, t),
        }
    }
}

/// The lines of a lattice that enclose a range of columns or rows, `all` of which there are.
fn lines((start, end): (u32, u32), all: u32, step: u32) -> Vec<u32> {
    let last = all.saturating_sub(1);
    let first = start.min(last) / step * step;
    let mut lines = Vec::new();
    let mut line = first;
    loop {
        lines.push(line);
        if line >= end.min(last) {
            return lines;
        }
        line = line.saturating_add(step).min(last);
    }
}

/// The two neighbouring lines that enclose a coordinate, and its place between them, 0 to 1.
fn interval(lines: &[u32], x: f32) -> (usize, usize, f32) {
    let right = lines.partition_point(|&line| line as f32 <= x).clamp(1, lines.len().max(2) - 1);
    let left = right - 1;
    let right = right.min(lines.len() - 1);
    let (a, b) = (lines[left] as f32, lines[right] as f32);
    let place = if b > a { ((x - a) / (b - a)).clamp(0.0, 1.0) } else { 0.0 };
    (left, right, place)
}

/// A cell of a lattice, and a place in it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Cell {
    /// Its corners, by index: top left, top right, bottom left, bottom right.
    pub(super) corners: [usize; 4],
    /// From the first to the last of them, 0 to 1.
    pub(super) within: Vec2,
}

/// A point of a surface, with its unit normal.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Place {
    pub(super) p: Vec3,
    pub(super) n: Vec3,
}

impl Cell {
    /// Weights of the corners for the point `at`, not normalized; 0 for those that are missing.
    pub(super) fn weights(
        &self,
        interpolation: Interpolation,
        at: &Place,
        corners: &[Option<Place>; 4],
    ) -> [f64; 4] {
        let [s, t] = self.within.to_array().map(f64::from);
        let mut weights = match interpolation {
            Interpolation::Nearest4 => [1.0; 4],
            Interpolation::Bilinear => [(1.0 - s) * (1.0 - t), s * (1.0 - t), (1.0 - s) * t, s * t],
            Interpolation::Ward => return ward_weights(at, corners),
        };
        for (weight, corner) in weights.iter_mut().zip(corners) {
            if corner.is_none() {
                *weight = 0.0;
            }
        }
        weights
    }
}

/// Ward's weight 1 / (‖P − Pᵢ‖ / Rᵢ + √(1 − N·Nᵢ)) (Ward, Rubinstein and Clear 1988, equation 7)
/// without R: lengths count as they are, in scene units.
fn ward_weights(at: &Place, corners: &[Option<Place>; 4]) -> [f64; 4] {
    let error = |corner: &Place| {
        let distance = f64::from(at.p.distance(corner.p));
        let turn = (1.0 - f64::from(at.n.dot(corner.n))).max(0.0).sqrt();
        distance + turn
    };
    let errors = corners.map(|corner| corner.as_ref().map(error));
    if errors.contains(&Some(0.0)) {
        // The point is one of the grid's: nothing else counts.
        return errors.map(|error| if error == Some(0.0) { 1.0 } else { 0.0 });
    }
    errors.map(|error| error.map_or(0.0, |error| 1.0 / error))
}
