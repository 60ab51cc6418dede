//! No jumps where a record begins to serve, nor at the faces of the index.

use super::*;
use crate::math::Vec3;

/// Points of a line across the wall, 1/256 of it apart: about a pixel.
const POINTS: i32 = 225;

/// Root mean square over many lines across the back wall of a room of the second difference of
/// cached irradiance, relative to it: 0 for a linear change, large for jumps.
fn roughness(settings: IrrCacheSettings, is_forgetful: bool) -> f64 {
    let mut t = TestScene::default();
    let grey = t.diffuse(Rgb::splat(0.6));
    let black = t.diffuse(Rgb::BLACK);
    t.room(grey);
    let lamp = place(DVec3::new(0.0, 0.99, 0.0), -DVec3::Y, DVec3::splat(0.3));
    let lamp = t.shape(ShapeKind::Rectangle(lamp), black);
    t.emit(lamp, Rgb::splat(5.0));
    t.camera(DVec3::new(0.0, 0.0, -0.95), DVec3::Z, 60.0, 48);
    t.tables.integrator = cached(settings);
    let scene = t.build();
    let mut cache = build(&scene);
    if is_forgetful {
        cache.index = Index::leaves(scene.accel.bounds());
        for (i, record) in cache.records.iter().enumerate() {
            cache.index.insert(i as u32, record);
        }
    }
    let (mut squares, mut count) = (0.0, 0);
    for line in 0..32 {
        let across = -0.85 + 1.7 * line as f32 / 31.0;
        for is_upright in [false, true] {
            let values: Vec<Option<f64>> = (0..POINTS)
                .map(|i| {
                    let along = (i - POINTS / 2) as f32 / 128.0;
                    let (x, y) = if is_upright { (across, along) } else { (along, across) };
                    let n = -Vec3::Z;
                    let query = Query { p: Vec3::new(x, y, 1.0), n_smooth: n, n_shading: n };
                    cache.lookup(&query).map(|found| f64::from(found.irradiance.luminance()))
                })
                .collect();
            for three in values.windows(3) {
                if let [Some(a), Some(b), Some(c)] = *three {
                    squares += ((a - 2.0 * b + c) / b).powi(2);
                    count += 1;
                }
            }
        }
    }
    let least = if is_forgetful { 1 } else { 9 };
    assert!(count > 64 * (POINTS - 2) * least / 10, "{count} points were served");
    (squares / f64::from(count)).sqrt()
}

/// The smooth kernel fades records in and out: second differences as small as those of a picture
/// without noise, while weights that end at a rim (Ward, Rubinstein and Clear 1988) leave edges.
#[test]
fn records_fade_in_and_out() {
    let smooth = roughness(IrrCacheSettings::default(), false);
    for criterion in [
        Criterion::Krivanek06,
        Criterion::Tabellion04,
        Criterion::Ward92,
        Criterion::Ward88,
        Criterion::Thesis,
    ] {
        let other = roughness(IrrCacheSettings { criterion, ..Default::default() }, false);
        if !criterion.uses_gradients() {
            assert!(other > 3.0 * smooth, "{criterion:?}: {other:e}, smooth {smooth:e}");
        }
    }
    // Where the index loses records at the faces of its cells, so does the picture.
    let forgetful = roughness(IrrCacheSettings::default(), true);
    assert!(forgetful > 3.0 * smooth, "leaves: {forgetful:e}, smooth {smooth:e}");
    assert!(smooth < 6e-4, "{smooth:e}");
}
