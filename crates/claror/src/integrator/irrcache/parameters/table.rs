//! All parameters of `irrcache`.

use super::{CacheParameter, Change, Field};
use crate::emitter::Sky;
use crate::integrator::irrcache::{Bounces, IrrCacheSettings};
use crate::irradiance::{Criterion, IndexKind};

/// All parameters, in the order in which they are listed.
pub const PARAMETERS: &[CacheParameter] = &[
    CacheParameter {
        name: "criterion",
        unit: "",
        doc: "how far records reach, and what its paper says about the rest",
        changes: Change::Records,
        field: Field::Word {
            words: || {
                let mut names = Criterion::ALL.map(Criterion::name);
                names.reverse();
                names.to_vec()
            },
            get: |s| s.criterion.name(),
            set: |s, i| s.criterion = Criterion::ALL[Criterion::ALL.len() - 1 - i],
        },
    },
    CacheParameter {
        name: "error",
        unit: "1",
        doc: "interpolation error that records are spread for with `hessian`: smaller is finer; a dial, not a bound",
        changes: Change::Records,
        field: positive(|s| s.error, |s, v| s.error = v),
    },
    CacheParameter {
        name: "accuracy",
        unit: "1",
        doc: "Ward's a, for all other criteria: smaller is finer",
        changes: Change::Records,
        field: positive(IrrCacheSettings::accuracy, |s, v| s.accuracy = Some(v)),
    },
    CacheParameter {
        name: "quality",
        unit: "1",
        doc: "divides `error` and `accuracy`: larger is finer",
        changes: Change::Records,
        field: positive(|s| s.quality, |s, v| s.quality = v),
    },
    CacheParameter {
        name: "exponent",
        unit: "1",
        doc: "power of the error in the radii of `hessian`: 1/4 is for the mean error, 1/2 for the largest",
        changes: Change::Records,
        field: number(
            "a number above 0 and up to 1",
            |v| v > 0.0 && v <= 1.0,
            |s| s.exponent,
            |s, v| s.exponent = v,
        ),
    },
    CacheParameter {
        name: "ellipse",
        unit: "",
        doc: "elliptic regions with `hessian`, up to twice as long as wide",
        changes: Change::Records,
        field: Field::Switch { get: |s| s.ellipse, set: |s, v| s.ellipse = v },
    },
    CacheParameter {
        name: "noise",
        unit: "1",
        doc: "relative standard error of a record: up to sixteen times the rays until it is met; by default what `error` is worth",
        changes: Change::Records,
        field: positive(IrrCacheSettings::noise, |s, v| s.noise = Some(v)),
    },
    CacheParameter {
        name: "gather_samples",
        unit: "rays",
        doc: "rays of a record, rounded to a grid; by default what `error` is worth",
        changes: Change::Records,
        field: Field::Count {
            least: *IrrCacheSettings::GATHER_SAMPLES.start(),
            most: *IrrCacheSettings::GATHER_SAMPLES.end(),
            get: IrrCacheSettings::gather_samples,
            set: |s, v| s.gather_samples = Some(v),
        },
    },
    CacheParameter {
        name: "min_pixel_spacing",
        unit: "pixels",
        doc: "least radius of a record; by default finer where `error` is",
        changes: Change::Records,
        field: positive(IrrCacheSettings::min_pixel_spacing, |s, v| s.min_pixel_spacing = Some(v)),
    },
    CacheParameter {
        name: "max_pixel_spacing",
        unit: "pixels",
        doc: "largest radius of a record",
        changes: Change::Records,
        field: positive(|s| s.max_pixel_spacing, |s, v| s.max_pixel_spacing = v),
    },
    CacheParameter {
        name: "min_radius",
        unit: "scene units",
        doc: "least radius of a record instead of that in pixels; 0: in pixels",
        changes: Change::Records,
        field: not_negative(|s| s.min_radius, |s, v| s.min_radius = v),
    },
    CacheParameter {
        name: "max_radius",
        unit: "scene units",
        doc: "largest radius of a record instead of that in pixels; 0: in pixels",
        changes: Change::Records,
        field: not_negative(|s| s.max_radius, |s, v| s.max_radius = v),
    },
    CacheParameter {
        name: "ambient_resolution",
        unit: "1",
        doc: "least radius as in Radiance instead of that in pixels: `accuracy` times the scene's size over this, and 64 times that the largest; 0: in pixels",
        changes: Change::Records,
        field: not_negative(|s| s.ambient_resolution, |s, v| s.ambient_resolution = v),
    },
    CacheParameter {
        name: "max_angle",
        unit: "degrees",
        doc: "largest angle between the normals of a record and of a point that it serves",
        changes: Change::Records,
        field: number(
            "a number above 0 and up to 90",
            |v| v > 0.0 && v <= 90.0,
            IrrCacheSettings::max_angle,
            |s, v| s.max_angle = Some(v),
        ),
    },
    CacheParameter {
        name: "crevice_spread",
        unit: "1",
        doc: "largest factor by which the least radius raises others, so that crevices do not darken their surroundings; 0: any",
        changes: Change::Records,
        field: number(
            "0 or a number of at least 1",
            |v| v == 0.0 || (v >= 1.0 && v.is_finite()),
            IrrCacheSettings::crevice_spread,
            |s, v| s.crevice_spread = Some(v),
        ),
    },
    CacheParameter {
        name: "clamp_neighbor",
        unit: "",
        doc: "records shrink where neighbours know of near geometry (Křivánek et al. 2006)",
        changes: Change::Records,
        field: Field::Switch {
            get: IrrCacheSettings::clamp_neighbor,
            set: |s, v| s.clamp_neighbor = Some(v),
        },
    },
    CacheParameter {
        name: "overture",
        unit: "",
        doc: "records are made before the picture, from coarse to fine; false: in raster order, and pixels see no later ones",
        changes: Change::Records,
        field: Field::Switch { get: IrrCacheSettings::overture, set: |s, v| s.overture = Some(v) },
    },
    CacheParameter {
        name: "leak_protection",
        unit: "",
        doc: "records do not serve points behind thin walls: where something stands close, one short ray asks",
        changes: Change::Records,
        field: Field::Switch {
            get: IrrCacheSettings::leak_protection,
            set: |s, v| s.leak_protection = Some(v),
        },
    },
    CacheParameter {
        name: "index",
        unit: "",
        doc: "where records are looked for; all but `leaves`, which forgets neighbours, give the same bits",
        changes: Change::Records,
        field: Field::Word {
            words: || IndexKind::ALL.map(IndexKind::name).to_vec(),
            get: |s| s.index().name(),
            set: |s, i| s.index = Some(IndexKind::ALL[i]),
        },
    },
    CacheParameter {
        name: "nearest",
        unit: "records",
        doc: "how many of the records that can serve a point do, the nearest ones; 0: all",
        changes: Change::Records,
        field: Field::Count {
            least: 0,
            most: 64,
            get: |s| s.lookup().nearest,
            set: |s, v| s.nearest = Some(v),
        },
    },
    CacheParameter {
        name: "overlap",
        unit: "1",
        doc: "factor by which records serve farther than their radii; with `hessian` more where `error` is finer",
        changes: Change::Records,
        field: number(
            "a number from 1 to 10",
            |v| (1.0..=10.0).contains(&v),
            |s| s.lookup().overlap,
            |s, v| s.overlap = Some(v),
        ),
    },
    CacheParameter {
        name: "smoothing",
        unit: "radii",
        doc: "how far apart records may be that even out each other's noise, where irradiance changes little; 0: none do",
        changes: Change::Records,
        field: number(
            "a number from 0 to 10",
            |v| (0.0..=10.0).contains(&v),
            IrrCacheSettings::smoothing,
            |s, v| s.smoothing = Some(v),
        ),
    },
    CacheParameter {
        name: "contact_shadows",
        unit: "",
        doc: "samples of the picture look for what is nearer than the least radius, and add what records do not know of it",
        changes: Change::Records,
        field: Field::Switch {
            get: IrrCacheSettings::contact_shadows,
            set: |s, v| s.contact_shadows = Some(v),
        },
    },
    CacheParameter {
        name: "min_weight",
        unit: "1",
        doc: "sum of weights below which a point gets a record of its own",
        changes: Change::Records,
        field: not_negative(|s| s.lookup().min_weight, |s, v| s.min_weight = Some(v)),
    },
    CacheParameter {
        name: "in_front",
        unit: "radii",
        doc: "how far a record may lie in front of a point that it serves",
        changes: Change::Records,
        field: not_negative(|s| s.lookup().in_front, |s, v| s.in_front = Some(v)),
    },
    CacheParameter {
        name: "gradients",
        unit: "",
        doc: "records are extrapolated by their rotational and translational gradients",
        changes: Change::Records,
        field: Field::Switch { get: |s| s.lookup().gradients, set: |s, v| s.gradients = Some(v) },
    },
    CacheParameter {
        name: "mix",
        unit: "1",
        doc: "share of the mean gradient of all records in that, against their own",
        changes: Change::Records,
        field: number(
            "a number between 0 and 1",
            |v| (0.0..=1.0).contains(&v),
            |s| s.lookup().mix,
            |s, v| s.mix = Some(v),
        ),
    },
    CacheParameter {
        name: "bounces",
        unit: "",
        doc: "light at the ends of a record's rays: walks that end at a coarse average, or do not, or at a second, coarser cache",
        changes: Change::Records,
        field: Field::Word {
            words: || Bounces::ALL.map(Bounces::name).to_vec(),
            get: |s| s.bounces.name(),
            set: |s, i| s.bounces = Bounces::ALL[i],
        },
    },
    CacheParameter {
        name: "sky",
        unit: "",
        doc: "whether records hold direct light from the sky: if it has no small bright parts, no, or yes",
        changes: Change::Records,
        field: Field::Word {
            words: || Sky::ALL.map(Sky::name).to_vec(),
            get: |s| s.sky.name(),
            set: |s, i| s.sky = Sky::ALL[i],
        },
    },
    CacheParameter {
        name: "analytic_direct",
        unit: "",
        doc: "direct light of up to eight lights by closed forms times sampled visibility: consistent, a little biased at few samples",
        changes: Change::Picture,
        field: Field::Switch { get: |s| s.analytic_direct, set: |s, v| s.analytic_direct = v },
    },
    CacheParameter {
        name: "debias",
        unit: "1",
        doc: "share of look-ups that a random walk corrects: above 0 the picture has the mean of path tracing, with more noise",
        changes: Change::Picture,
        field: number(
            "a number between 0 and 1",
            |v| (0.0..=1.0).contains(&v),
            |s| s.debias,
            |s, v| s.debias = v,
        ),
    },
    CacheParameter {
        name: "show_points",
        unit: "",
        doc: "also write the picture with a dot for every record that the camera sees, as NAME.points.png",
        changes: Change::Nothing,
        field: Field::Switch { get: |s| s.show_points, set: |s, v| s.show_points = v },
    },
];

const fn number(
    expected: &'static str,
    is_good: fn(f32) -> bool,
    get: fn(&IrrCacheSettings) -> f32,
    set: fn(&mut IrrCacheSettings, f32),
) -> Field<IrrCacheSettings> {
    Field::Number { expected, is_good, get, set }
}

const fn positive(
    get: fn(&IrrCacheSettings) -> f32,
    set: fn(&mut IrrCacheSettings, f32),
) -> Field<IrrCacheSettings> {
    number("a number above 0", |v| v > 0.0 && v.is_finite(), get, set)
}

const fn not_negative(
    get: fn(&IrrCacheSettings) -> f32,
    set: fn(&mut IrrCacheSettings, f32),
) -> Field<IrrCacheSettings> {
    number("a number of at least 0", |v| v >= 0.0 && v.is_finite(), get, set)
}
