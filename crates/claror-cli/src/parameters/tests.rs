use super::*;
use claror::film::FilmSettings;
use claror::math::{Transform, Vec2};
use claror::sampler::SamplerSettings;
use claror::sensor::SensorKind;

fn sensor() -> Sensor {
    Sensor {
        name: "camera".to_owned(),
        kind: SensorKind::Perspective { fov_x: 0.7, principal_point_offset: Vec2::ZERO },
        to_world: Transform::IDENTITY,
        near_clip: 0.01,
        far_clip: 1e4,
        film: FilmSettings {
            width: 64,
            height: 48,
            crop: CropWindow { x: 8, y: 8, width: 16, height: 16 },
            filter: FilterKind::Gaussian { stddev: 0.5 },
            alpha: false,
        },
        sampler: SamplerSettings { kind: SamplerKind::Sobol, sample_count: 16, seed: 0 },
    }
}

fn set_one(name: &str, value: &str) -> Result<Vec<(String, String)>, (String, String)> {
    let (mut integrator, mut sensor) = (IntegratorSettings::default(), sensor());
    let mut target = Target { integrator: &mut integrator, sensor: &mut sensor };
    set(&mut target, name, value)?;
    Ok(list(&integrator, &sensor))
}

#[test]
fn what_is_set_is_listed() {
    for (name, value) in [
        ("integrator.type", "direct"),
        ("integrator.max_depth", "-1"),
        ("integrator.max_depth", "7"),
        ("integrator.rr_depth", "9"),
        ("integrator.early_roulette", "false"),
        ("integrator.hide_emitters", "true"),
        ("sampler.type", "independent"),
        ("sampler.seed", "18446744073709551615"),
        ("sampler.sample_count", "33"),
        ("sensor.near_clip", "0.5"),
        ("sensor.far_clip", "70"),
        ("film.width", "65"),
        ("film.height", "66"),
        ("film.crop", "1,2,3,4"),
        ("film.alpha", "true"),
        ("film.rfilter", "catmullrom"),
    ] {
        let listed = set_one(name, value).expect("a valid value");
        assert!(listed.contains(&(name.to_owned(), value.to_owned())), "{name} in {listed:?}");
    }
}

#[test]
fn impossible_values_are_refused() {
    for (name, value) in [
        ("integrator.max_depth", "-2"),
        ("integrator.max_depth", "1.5"),
        ("integrator.max_depth", "99999999999"),
        ("integrator.rr_depth", "0"),
        ("integrator.emitter_samples", "4"),
        ("sampler.sample_count", "0"),
        ("sensor.near_clip", "nan"),
        ("film.width", "0"),
        ("film.crop", "60,0,8,8"),
        ("film.crop", "4294967295,0,4294967295,8"),
        ("film.rfilter", "bicubic"),
        ("film.alpha", "maybe"),
    ] {
        assert!(set_one(name, value).is_err(), "{name}={value} was accepted");
    }
}

#[test]
fn misspelt_names_get_the_nearest() {
    let (_, hint) = set_one("integrator.maxdepth", "3").expect_err("unknown");
    assert_eq!(hint, "did you mean \"integrator.max_depth\"?");
    let (_, hint) = set_one("x", "3").expect_err("unknown");
    assert!(hint.contains("sampler.seed"), "{hint}");
}

#[test]
fn names_of_other_programs_set_what_is_listed() {
    let (mut integrator, mut sensor) = (IntegratorSettings::default(), sensor());
    let mut target = Target { integrator: &mut integrator, sensor: &mut sensor };
    let (_, hint) = set(&mut target, "integrator.aa", "0.2").expect_err("no cache");
    assert!(hint.contains("-i irrcache"), "{hint}");
    set(&mut target, "integrator.type", "irrcache").expect("a valid value");
    set(&mut target, "integrator.aa", "0.25").expect("a valid value");
    set(&mut target, "integrator.ab", "2").expect("a valid value");
    let (message, hint) = set(&mut target, "integrator.as", "9").expect_err("a bias");
    assert_eq!(message, "`9` cannot be the value of integrator.as");
    assert!(hint.contains("noise"), "{hint}");
    let listed = list(&integrator, &sensor);
    for (name, value) in [("error", "0.25"), ("accuracy", "0.25"), ("max_depth", "4")] {
        assert!(listed.contains(&(format!("integrator.{name}"), value.to_owned())));
    }
    let mut target = Target { integrator: &mut integrator, sensor: &mut sensor };
    let (_, hint) = set(&mut target, "integrator.accurcy", "9").expect_err("misspelt");
    assert_eq!(hint, "did you mean \"integrator.accuracy\"?");
}

/// A name that two integrators have means that of the one in use.
#[test]
fn parameters_of_grids_are_those_of_their_integrator() {
    let (mut integrator, mut sensor) = (IntegratorSettings::default(), sensor());
    let mut target = Target { integrator: &mut integrator, sensor: &mut sensor };
    let (_, hint) = set(&mut target, "integrator.step", "7").expect_err("no grid");
    assert!(hint.contains("-i gridcache"), "{hint}");
    for (name, value) in [
        ("integrator.type", "gridcache"),
        ("integrator.step", "7"),
        ("integrator.gather_samples", "99"),
    ] {
        set(&mut target, name, value).expect("a valid value");
    }
    let (_, hint) = set(&mut target, "integrator.error", "0.1").expect_err("no records");
    assert!(hint.contains("-i irrcache"), "{hint}");
    assert!(set(&mut target, "integrator.quantity", "light").is_err());
    assert_eq!((integrator.grid.step, integrator.grid.gather_samples), (7, 99));
    assert_eq!(integrator.cache.gather_samples, None);
    let listed = list(&integrator, &sensor);
    for (name, value) in [("step", "7"), ("interpolation", "bilinear")] {
        assert!(listed.contains(&(format!("integrator.{name}"), value.to_owned())));
    }
    let unique: std::collections::BTreeSet<_> = names().into_iter().collect();
    assert_eq!(unique.len(), names().len());
}

#[test]
fn the_numbers_of_direct_follow_its_choice() {
    let (mut integrator, mut sensor) = (IntegratorSettings::default(), sensor());
    let mut target = Target { integrator: &mut integrator, sensor: &mut sensor };
    for (name, value) in [
        ("integrator.type", "direct"),
        ("integrator.emitter_samples", "4"),
        ("integrator.bsdf_samples", "0"),
    ] {
        set(&mut target, name, value).expect("a valid value");
    }
    assert_eq!(integrator.kind, IntegratorKind::Direct { emitter_samples: 4, bsdf_samples: 0 });
}

#[test]
fn another_size_gives_up_the_crop() {
    let mut sensor = sensor();
    resize(&mut sensor, 32, 24).expect("a valid size");
    assert_eq!(sensor.film.crop, CropWindow { x: 0, y: 0, width: 32, height: 24 });
}
