//! Which points ask whether a record is in sight.

use super::lookups::record;
use crate::irradiance::{Cell, Grid, Hemisphere, SECTORS, rim_distances};
use crate::math::{Vec2, Vec3};
use crate::spectrum::Rgb;

/// What a record sees beside a wall at x = `distance`.
fn beside_wall(grid: Grid, distance: f32) -> Hemisphere {
    let (columns, rows) = grid.size();
    let cells = (0..rows).flat_map(|j| (0..columns).map(move |i| (i, j))).map(|(i, j)| {
        let direction = grid.direction(i, j, Vec2::splat(0.5));
        let t = if direction.x > 0.0 { distance / direction.x } else { f32::INFINITY };
        Cell { direction, distance: t, normal: Vec3::ZERO, flags: 0, radiance: Rgb::WHITE }
    });
    Hemisphere::new(grid, cells.collect()).expect("one cell each")
}

/// Points on the wall's side within reach ask, others do not; the axis may lie anyhow.
#[test]
fn points_beside_a_wall_ask() {
    for grid in
        [Grid::Concentric { n: 24 }, Grid::Polar { m: 14, n: 43 }, Grid::Concentric { n: 4 }]
    {
        let rim = rim_distances(&beside_wall(grid, 0.5));
        assert!(rim.iter().all(|d| !d.is_nan()), "{grid:?}");
        for turn in 0..12 {
            let axis = Vec2::from_angle(0.55 * turn as f32);
            let mut r = record(Vec3::ZERO, Vec3::Z, 1.0);
            r.axis = axis.extend(0.0);
            (r.corral, r.corral_distance) = crate::irradiance::corral::corral(&rim, axis, 1.0);
            let asks = |degrees: f32| {
                let p = (0.8 * Vec2::from_angle(degrees.to_radians())).extend(0.0);
                let end = r.sight_of(p);
                let rise = 0.8 * f32::to_radians(10.0).tan();
                assert!(end.is_none_or(|end| end.distance(rise * Vec3::Z) < 1e-5));
                end.is_some()
            };
            // Within 1.5 radii the wall stands from -70 to 70 degrees.
            assert!((-60..=60).all(|a| asks(a as f32)), "{grid:?} {turn}");
            if grid.len() > 100 {
                assert!((110..=250).all(|a| !asks(a as f32)), "{grid:?} {turn}");
            }
            let before = r.sight_of((0.4 * axis.rotate(Vec2::new(axis.x, -axis.y))).extend(0.0));
            assert_eq!(before, None, "nothing stands before the wall");
            assert_eq!(crate::irradiance::corral::corral(&rim, axis, 0.3).0, 0, "out of reach");
        }
    }
    assert_eq!(SECTORS, u32::BITS);
}
