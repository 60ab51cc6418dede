//! Radiance of the sun's disc through the atmosphere.
//!
//! The logarithm of the radiance falls with the mass of air on the way, nearly in proportion
//! (Beer-Lambert); the rest is the change of the light's colour on the way. Per turbidity and
//! channel a cubic in the air mass was fitted to the radiance that Mitsuba 3.9.1 shows at 30
//! elevations (its model: Hosek and Wilkie 2013, Adding a solar-radiance function). Between whole
//! turbidities the radiance is linear, as there.

use crate::spectrum::Rgb;

/// Coefficients of the cubic in a tenth of the air mass, by turbidity 1 to 10 and channel.
const LOG_RADIANCE: [[[f32; 4]; 3]; 10] = [
    [
        [10.0963, -0.6445, -0.025, 0.0154],
        [10.0065, -1.3844, 0.0306, 0.0239],
        [9.9462, -3.1537, 0.1959, -0.2538],
    ],
    [
        [10.0963, -0.7366, -0.029, 0.0102],
        [10.0065, -1.4871, 0.0294, 0.0172],
        [9.9463, -3.2532, 0.1998, -0.263],
    ],
    [
        [10.0962, -0.8891, -0.0353, 0.0017],
        [10.0063, -1.655, 0.0242, 0.0079],
        [9.9462, -3.4137, 0.1984, -0.2762],
    ],
    [
        [10.0962, -1.1417, -0.0433, -0.013],
        [10.0059, -1.9316, 0.0171, -0.0086],
        [9.946, -3.6771, 0.1892, -0.2899],
    ],
    [
        [10.0961, -1.414, -0.0515, -0.0317],
        [10.0057, -2.2327, 0.0147, -0.0313],
        [9.9457, -3.96, 0.1733, -0.3017],
    ],
    [
        [10.0962, -1.6114, -0.0509, -0.0549],
        [10.0058, -2.4515, 0.021, -0.0583],
        [9.9456, -4.1651, 0.1696, -0.3205],
    ],
    [
        [10.0965, -1.9389, -0.0462, -0.0942],
        [10.0057, -2.8103, 0.0265, -0.1007],
        [9.9453, -4.5025, 0.1598, -0.3495],
    ],
    [
        [10.0967, -2.4755, -0.0483, -0.1531],
        [10.0047, -3.3902, -0.0061, -0.1361],
        [9.9454, -5.0654, 0.1662, -0.4153],
    ],
    [
        [10.0963, -3.351, -0.0868, -0.2224],
        [10.0041, -4.3628, -0.0061, -0.2381],
        [9.9447, -5.9832, 0.1347, -0.4871],
    ],
    [
        [10.0963, -4.8067, -0.1133, -0.3653],
        [10.0039, -5.9744, 0.0056, -0.4106],
        [9.9436, -7.4939, 0.0553, -0.5569],
    ],
];

/// Lowest elevation with a radiance of its own, degrees.
const MIN_ELEVATION: f32 = 2.0;

/// Radiance of the disc for a sun at this elevation (radians, above 0).
pub(super) fn radiance(turbidity: f32, elevation: f32) -> Rgb {
    let mass = 0.1 * air_mass(elevation.to_degrees().max(MIN_ELEVATION));
    let of = |i: usize| {
        Rgb::from(
            LOG_RADIANCE[i].map(|[a, b, c, d]| (a + mass * (b + mass * (c + mass * d))).exp()),
        )
    };
    let clear = (turbidity.clamp(1.0, 10.0) as usize).min(9);
    of(clear - 1).lerp(of(clear), turbidity - clear as f32)
}

/// Air on the way over that to the zenith (Kasten and Young 1989); elevation in degrees.
fn air_mass(elevation: f32) -> f32 {
    1.0 / (elevation.to_radians().sin() + 0.505_72 * (elevation + 6.079_95).powf(-1.6364))
}
