//! Where to check: cells of equal area, so that all places count alike.

use crate::film::CropWindow;
use crate::math::Vec2;

/// Rows of cells that share a rectangle out, all of the same area whatever their number.
#[derive(Debug, Clone, Copy)]
pub(super) struct Strata {
    crop: CropWindow,
    rows: usize,
    pub(super) count: usize,
}

impl Strata {
    /// `count` cells, about as wide as high.
    pub(super) fn new(crop: CropWindow, count: usize) -> Self {
        let aspect = f64::from(crop.height) / f64::from(crop.width.max(1));
        let rows = (count as f64 * aspect).sqrt().round() as usize;
        Self { crop, rows: rows.clamp(1, count.max(1)), count: count.max(1) }
    }

    /// The point at `u` in [0, 1)² of a cell, in pixels of the film. Cells cut pixels, but a
    /// uniform choice of cell and `u` is uniform over the crop window.
    pub(super) fn point(&self, stratum: usize, u: Vec2) -> (f64, f64) {
        let first = |row: usize| row * self.count / self.rows;
        let row = (0..self.rows).rev().find(|row| first(*row) <= stratum).unwrap_or(0);
        let (from, to) = (first(row), first(row + 1));
        let (all, in_row) = (self.count as f64, (to - from) as f64);
        let x = ((stratum - from) as f64 + f64::from(u.x)) / in_row;
        let y = (from as f64 + f64::from(u.y) * in_row) / all;
        let crop = &self.crop;
        (
            f64::from(crop.x) + x * f64::from(crop.width),
            f64::from(crop.y) + y * f64::from(crop.height),
        )
    }

    /// Column and row in the picture of the pixel that holds a point.
    pub(super) fn pixel(&self, point: (f64, f64)) -> (u32, u32) {
        let crop = &self.crop;
        let column = (point.0 as u32).saturating_sub(crop.x).min(crop.width - 1);
        let row = (point.1 as u32).saturating_sub(crop.y).min(crop.height - 1);
        (column, row)
    }
}
