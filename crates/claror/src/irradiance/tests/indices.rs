//! All indices give the same bits.

use super::lookups::record;
use crate::irradiance::{
    Bvh, Criterion, Index, LookupSettings, Query, RadiusSettings, Record, lookup, weight,
};
use crate::math::statistics::TestRng;
use crate::math::{Bounds3, Frame, Vec3, warp};
use crate::spectrum::Rgb;

const BOUNDS: Bounds3 = Bounds3 { min: Vec3::splat(-1.0), max: Vec3::splat(1.0) };

/// In the box, and somewhat outside; radii over four orders of magnitude.
fn records(count: usize, rng: &mut TestRng) -> Vec<Record> {
    (0..count)
        .map(|_| {
            let n = normal(rng);
            let mut r = record(point(rng), n, 0.5 * 10_f32.powf(-3.0 * rng.next_f32()));
            let frame = Frame::from_normal(n);
            let angle = 6.0 * rng.next_f32();
            r.axis = frame.s * angle.cos() + frame.t * angle.sin();
            r.irradiance = Rgb::new(rng.next_f32(), rng.next_f32(), rng.next_f32());
            r.translational = [r.axis * rng.next_f32(); 3];
            r.rotational = [r.axis * rng.next_f32(); 3];
            r.max_angle = 0.8;
            r
        })
        .collect()
}

fn normal(rng: &mut TestRng) -> Vec3 {
    let n = warp::uniform_sphere(rng.next_vec2());
    // Most along axes, as in rooms.
    if rng.next_f32() < 0.7 {
        [Vec3::X, -Vec3::Y, Vec3::Z][(rng.next_u64() % 3) as usize]
    } else {
        n
    }
}

fn point(rng: &mut TestRng) -> Vec3 {
    let mut p = Vec3::ZERO;
    for k in 0..3 {
        let x = 2.2 * rng.next_f32() - 1.1;
        p[k] = match rng.next_u64() % 8 {
            // On the faces of cells and of the box.
            0 => (8.0 * x).round() / 8.0,
            1 => x.signum(),
            // The cells' faces of an octree that is a little larger.
            2 => 1.01 * (8.0 * x).round() / 8.0,
            _ => x,
        };
    }
    p
}

fn queries(records: &[Record], count: usize, rng: &mut TestRng) -> Vec<Query> {
    let mut queries: Vec<Query> = (0..count)
        .map(|_| {
            let r = &records[(rng.next_u64() % records.len() as u64) as usize];
            match rng.next_u64() % 3 {
                0 => (point(rng), normal(rng)),
                1 => (r.position + r.axis * (2.0 * r.radii[0] * rng.next_f32()), r.normal),
                _ => (r.position, r.normal),
            }
        })
        .map(|(p, n)| Query { p, n_smooth: n, n_shading: n })
        .collect();
    // Corners of supports.
    for r in records.iter().take(100) {
        let b = r.support(1.4, 0.5);
        for p in [b.min, b.max] {
            queries.push(Query { p, n_smooth: r.normal, n_shading: r.normal });
        }
    }
    queries
}

fn indices(records: &[Record], settings: &LookupSettings) -> [(&'static str, Index); 4] {
    let mut octree = Index::octree(BOUNDS, settings.reach());
    let mut all = Index::all();
    for (r, k) in records.iter().zip(0..) {
        assert!(octree.insert(k, r) && all.insert(k, r));
    }
    let frozen = Index::frozen(records, settings.reach());
    let bvh = Index::Bvh(Bvh::new(records, settings.reach()));
    [("all", all), ("octree", octree), ("frozen", frozen), ("bvh", bvh)]
}

#[test]
fn all_indices_give_the_same_bits() {
    let mut rng = TestRng::new(11);
    let records = records(3000, &mut rng);
    let queries = queries(&records, 10_000, &mut rng);
    for criterion in [Criterion::Hessian, Criterion::Ward92, Criterion::Tabellion04] {
        let mut settings = LookupSettings::new(&RadiusSettings::new(criterion));
        settings.min_weight = 0.0;
        let indices = indices(&records, &settings);
        let mut found = 0;
        for query in &queries {
            let [all, others @ ..] = &indices;
            let reference = lookup(&records, &all.1, query, &settings);
            found += usize::from(reference.is_some());
            for (name, index) in others {
                let mut listed: Vec<u32> = Vec::new();
                index.for_candidates(query.p, |i| listed.push(i));
                listed.sort_unstable();
                assert!(listed.windows(2).all(|w| w[0] < w[1]), "{name} repeats itself");
                let other = lookup(&records, index, query, &settings);
                assert_eq!(reference, other, "{name} {criterion:?} {query:?}");
            }
        }
        assert!(found > queries.len() / 3, "{found}");
    }
}

#[test]
fn supports_hold_all_that_is_served() {
    let mut rng = TestRng::new(12);
    for criterion in super::ALL {
        let settings = LookupSettings::new(&RadiusSettings::new(criterion));
        let reach = settings.reach();
        let mut served = 0;
        for r in records(20_000, &mut rng) {
            let b = r.support(reach.factor, reach.thickness);
            let offset = warp::uniform_sphere(rng.next_vec2()) * r.radii[1] * reach.factor;
            let p = r.position + offset * rng.next_f32();
            let query = Query { p, n_smooth: r.normal, n_shading: r.normal };
            if weight(&r, &query, &settings).is_some() {
                served += 1;
                assert!(p.cmpge(b.min).all() && p.cmple(b.max).all());
            }
        }
        assert!(served > 1000);
    }
}

/// The mistake that the leaves are kept for: what is found changes across the faces of cells.
#[test]
fn leaves_forget_their_neighbours() {
    let mut rng = TestRng::new(13);
    let settings = LookupSettings::new(&RadiusSettings::new(Criterion::Ward88));
    let mut leaves = Index::leaves(BOUNDS);
    let records: Vec<Record> =
        (0..500).map(|_| record((2.0 * rng.next_vec2() - 1.0).extend(0.0), Vec3::Z, 0.2)).collect();
    for (r, k) in records.iter().zip(0..) {
        leaves.insert(k, r);
    }
    let (mut subset, mut fewer) = (0, 0);
    for _ in 0..1000 {
        let p = (2.0 * rng.next_vec2() - 1.0).extend(0.0);
        let query = Query { p, n_smooth: Vec3::Z, n_shading: Vec3::Z };
        let all = lookup(&records, &Index::All(500), &query, &settings).map_or(0, |f| f.records);
        let few = lookup(&records, &leaves, &query, &settings).map_or(0, |f| f.records);
        subset += u32::from(few <= all);
        fewer += u32::from(few < all);
    }
    assert_eq!(subset, 1000);
    assert!(fewer > 300, "{fewer}");
}

#[test]
fn odd_records_and_empty_caches() {
    let settings = LookupSettings::new(&RadiusSettings::new(Criterion::Hessian));
    // All at one place, so that no split tells them apart.
    let same = vec![record(Vec3::ONE, Vec3::Z, 0.1); 300];
    let frozen = Index::frozen(&same, settings.reach());
    for index in [frozen, Index::Bvh(Bvh::new(&same, settings.reach()))] {
        let mut count = 0;
        index.for_candidates(Vec3::ONE, |_| count += 1);
        assert_eq!(count, 300);
    }
    let mut endless = Index::octree(Bounds3::EMPTY, settings.reach());
    let mut odd = record(Vec3::ONE, Vec3::Z, f32::INFINITY);
    endless.insert(0, &odd);
    odd.radii = [f32::NAN; 2];
    endless.insert(1, &odd);
    let mut seen = Vec::new();
    endless.for_candidates(Vec3::ZERO, |i| seen.push(i));
    assert_eq!(seen, [1, 0]);
    for index in [
        Index::frozen(&[], settings.reach()),
        Index::Bvh(Bvh::new(&[], settings.reach())),
        Index::all(),
    ] {
        index.for_candidates(Vec3::ZERO, |_| panic!("nothing there"));
    }
    let mut full = Index::frozen(&same, settings.reach());
    assert!(!full.insert(300, &same[0]));
}

/// An octree of leaves remembers how it was.
#[test]
fn leaves_know_their_past() {
    let mut rng = TestRng::new(14);
    let records = records(400, &mut rng);
    let mut whole = Index::leaves(BOUNDS);
    for (r, k) in records.iter().zip(0..) {
        whole.insert(k, r);
    }
    let mut then = Index::leaves(BOUNDS);
    for (r, k) in records.iter().zip(0..) {
        then.insert(k, r);
        for _ in 0..20 {
            let p = point(&mut rng);
            let (mut a, mut b) = (Vec::new(), Vec::new());
            then.for_candidates(p, |i| a.push(i));
            whole.for_candidates_of(k + 1, p, |i| b.push(i));
            assert_eq!(a, b, "after {k}");
        }
    }
}
