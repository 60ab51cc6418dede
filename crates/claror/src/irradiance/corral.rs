//! Corrals: on which sides of a record something stands close to the surface.
//!
//! Ward's tests of validity know nothing of walls: a record serves points behind a thin one. As in
//! Radiance a record notes the sectors of azimuth in which its lowest samples met something within
//! its reach, and only points in those sectors have to ask whether something is between.

use super::hemisphere::{Grid, Hemisphere};
use super::record::Record;
use crate::math::{Vec2, Vec3};

/// Sectors of azimuth, one bit each.
pub const SECTORS: u32 = 32;
/// A record asks about what is nearer than this many of its long radii.
const REACH: f32 = 1.5;
/// What stands somewhere between samples is hardly nearer than this share of what they met.
const BEFORE: f32 = 0.9;
/// Tangent of 10 degrees: how far above the surface a line of sight ends, per length. Radiance
/// rises twice as steeply; that hides records under things that stand low, and no more leaks.
const RISE: f32 = 0.176_326_98;

/// Sector of a tangential direction. Sectors are equal in the diamond |x| + |y| = 1, which needs
/// no inverse tangent.
#[inline]
fn sector(x: f32, y: f32) -> u32 {
    let p = x / (x.abs() + y.abs());
    let quarters = if y >= 0.0 { 1.0 - p } else { 3.0 + p };
    (quarters * (SECTORS / 4) as f32) as u32 % SECTORS
}

/// Horizontal distance of the nearest hit among the lowest samples, by sector about local x.
/// Sectors without a sample take their neighbours'.
pub fn rim_distances(hemisphere: &Hemisphere) -> [f32; SECTORS as usize] {
    let (columns, rows) = hemisphere.grid.size();
    let is_lowest = |index: u32| {
        let (i, j) = (index % columns, index / columns);
        match hemisphere.grid {
            Grid::Concentric { n } => i == 0 || j == 0 || i + 1 == n || j + 1 == n,
            Grid::Polar { .. } => j + 1 == rows,
        }
    };
    let mut nearest = [f32::NAN; SECTORS as usize];
    for (cell, index) in hemisphere.cells.iter().zip(0..) {
        if is_lowest(index) {
            let along = cell.direction.truncate();
            let distance = &mut nearest[sector(along.x, along.y) as usize];
            // The smaller of two, whichever is a number.
            *distance = distance.min(cell.distance * along.length());
        }
    }
    let seen = nearest;
    let count = SECTORS as usize;
    for (k, distance) in nearest.iter_mut().enumerate() {
        let mut step = 1;
        while distance.is_nan() && step < count {
            *distance = seen[(k + step) % count].min(seen[(k + count - step) % count]);
            step += 1;
        }
    }
    nearest
}

/// The sectors, about the record's axis, in which something is near, and how near it can be.
pub(super) fn corral(rim: &[f32; SECTORS as usize], axis: Vec2, reach: f32) -> (u32, f32) {
    let (mut flags, mut nearest) = (0, f32::INFINITY);
    for (distance, k) in rim.iter().zip(0..) {
        if *distance >= REACH * reach || distance.is_nan() {
            continue;
        }
        nearest = nearest.min(BEFORE * distance);
        // The sector and a half more on both sides, turned to the axis.
        let turned = |k: f32| {
            let along = centre(k);
            sector(along.dot(axis), axis.perp_dot(along))
        };
        let (mut sector, last) = (turned(k as f32 - 0.5), turned(k as f32 + 1.5));
        while sector != last {
            flags |= 1 << sector;
            sector = (sector + 1) % SECTORS;
        }
        flags |= 1 << last;
    }
    (flags, nearest)
}

/// Direction in the diamond at `k` sectors.
fn centre(k: f32) -> Vec2 {
    let quarters = k.rem_euclid(SECTORS as f32) / (SECTORS / 4) as f32;
    let x = if quarters <= 2.0 { 1.0 - quarters } else { quarters - 3.0 };
    let y = 1.0 - x.abs();
    Vec2::new(x, if quarters <= 2.0 { y } else { -y })
}

impl Record {
    /// Where a line of sight from `p` has to end that tells whether the record may serve it;
    /// `None` when nothing is known to stand between.
    #[inline]
    pub fn sight_of(&self, p: Vec3) -> Option<Vec3> {
        if self.corral == 0 {
            return None;
        }
        let delta = p - self.position;
        let across = self.normal.cross(self.axis);
        let along = Vec2::new(delta.dot(self.axis), delta.dot(across));
        let distance = along.length();
        if distance < self.corral_distance || distance == 0.0 {
            return None;
        }
        let is_marked = self.corral >> sector(along.x, along.y) & 1 != 0;
        is_marked.then(|| self.sight_from(distance))
    }

    /// Where a line of sight ends that comes from a point so far away.
    pub fn sight_from(&self, distance: f32) -> Vec3 {
        self.position + self.normal * (RISE * distance)
    }
}
