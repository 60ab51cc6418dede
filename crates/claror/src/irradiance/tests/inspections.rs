//! What is told of look-ups is what they do.

use super::ALL;
use super::lookups::{at, record, settings, unit};
use crate::irradiance::{
    Criterion, Index, Inspection, LookupSettings, Miss, Query, Record, inspect, lookup, rejection,
    weight,
};
use crate::math::Vec3;
use crate::math::statistics::TestRng;

fn all(records: &[Record], query: &Query, settings: &LookupSettings) -> Inspection {
    inspect(records, &Index::All(records.len() as u32), query, settings, |_| true)
}

/// A query is served exactly if the look-up says so, and a record is rejected exactly if it has
/// no weight.
#[test]
fn inspections_agree_with_look_ups() {
    let mut rng = TestRng::new(5);
    for criterion in ALL {
        let settings = settings(criterion);
        let mut served = 0;
        let flat = Vec3::new(1.0, 1.0, 0.1);
        for _ in 0..2000 {
            let near = |rng: &mut TestRng| (Vec3::Z + 0.3 * unit(rng)).normalize();
            let records: Vec<Record> =
                (0..4).map(|_| record(0.4 * flat * unit(&mut rng), near(&mut rng), 0.5)).collect();
            let query = at(0.2 * flat * unit(&mut rng), near(&mut rng));
            let found = lookup(&records, &Index::All(4), &query, &settings);
            let told = all(&records, &query, &settings);
            assert_eq!(told.found.ok(), found);
            if let Some(found) = found {
                served += 1;
                assert_eq!((told.weight, told.records), (found.weight, found.records));
            }
            for record in &records {
                let weight = weight(record, &query, &settings);
                assert_eq!(rejection(record, &query, &settings).is_none(), weight.is_some());
            }
        }
        assert!((100..1900).contains(&served), "{criterion:?}: {served} of 2000 are served");
    }
}

#[test]
fn misses_have_the_reason_of_the_record_that_comes_closest() {
    let query = at(Vec3::ZERO, Vec3::Z);
    let far = record(Vec3::new(2.0, 0.0, 0.0), Vec3::Z, 1.0);
    let turned = record(Vec3::new(0.1, 0.0, 0.0), Vec3::X, 1.0);
    let in_front = record(Vec3::new(0.0, 0.0, 0.1), Vec3::Z, 1.0);
    for criterion in ALL {
        let settings = settings(criterion);
        let reason = |records: &[Record]| all(records, &query, &settings).found.unwrap_err();
        assert_eq!(reason(&[]), Miss::NoneNear);
        assert_eq!(reason(&[far]), Miss::NoneNear, "{criterion:?}");
        assert_eq!(reason(&[turned, far]), Miss::Turned, "{criterion:?}");
        let back = record(Vec3::ZERO, -Vec3::Z, 1.0);
        assert_eq!(reason(&[back]), Miss::Turned, "{criterion:?}");
        assert_eq!(reason(&[far, in_front, turned]), Miss::InFront, "{criterion:?}");
    }
    // The rim of a smooth region has a weight, but not enough of it.
    let rim = record(Vec3::new(0.0, 1.6, 0.0), Vec3::Z, 1.0);
    let rim = Record { axis: Vec3::X, ..rim };
    let told = all(&[in_front, rim], &query, &settings(Criterion::Hessian));
    assert_eq!(told.found, Err(Miss::LittleWeight));
    assert!(told.weight > 0.0 && told.weight < 0.5 && told.records == 1, "{told:?}");
    // Ward's error counts distance and angle together.
    let tilted = record(Vec3::new(0.5, 0.0, 0.0), Vec3::new(-0.2, 0.0, 1.0).normalize(), 1.0);
    let ward = settings(Criterion::Ward88);
    assert_eq!(all(&[tilted], &query, &ward).found, Err(Miss::LittleWeight), "{ward:?}");
}

#[test]
fn means_are_weighted() {
    let settings = settings(Criterion::Hessian);
    let query = at(Vec3::ZERO, Vec3::Z);
    let records =
        [(0.2, 1.0, 3.0), (-0.5, 1.4, 5.0), (0.3, 0.9, f32::INFINITY)].map(|(x, r, d)| Record {
            harmonic_mean_distance: d,
            ..record(Vec3::new(x, 0.0, 0.0), Vec3::Z, r)
        });
    let w = records.map(|record| weight(&record, &query, &settings).expect("near").0);
    let told = all(&records, &query, &settings);
    let total: f32 = w.iter().sum();
    let radius = (w[0] + 1.4 * w[1] + 0.9 * w[2]) / total;
    let distance = total / (w[0] / 3.0 + w[1] / 5.0);
    assert!((told.weight - total).abs() < 1e-6 && told.records == 3);
    assert!((told.radius - radius).abs() < 1e-6, "{told:?}");
    assert!((told.harmonic_mean_distance / distance - 1.0).abs() < 1e-6, "{told:?}");
    // What sees nothing is infinitely far from everything.
    assert_eq!(all(&records[2..], &query, &settings).harmonic_mean_distance, f32::INFINITY);
    let nothing = all(&[], &query, &settings);
    assert_eq!((nothing.weight, nothing.records, nothing.radius), (0.0, 0, 0.0));
}
