//! How many rays per second one core traces, by kind of ray, and how that compares with Embree 3
//! in the same run.
//!
//! `cargo bench --bench trace [-- SCENE…]`. Embree is looked for when the benchmark runs
//! (`libembree3.so`, on Debian 12 package `libembree3-3`); without it the ratio is left out.
//! Both trace the same rays, a slice at a time in turn, so that whatever else the machine does
//! touches both alike; times are CPU times of the thread where the system tells them; what is
//! printed are medians. Believe the ratios, not the rates.

mod clock;
mod embree;
mod rays;
mod scenes;

use claror::accel::Accel;
use claror::math::Ray;
use claror::shape::ShapeTable;
use clock::Clock;
use embree::{Embree, EmbreeScene, Robustness};
use rays::RaySet;

/// Timings per tracer and ray set.
const ROUNDS: usize = 15;
/// Each takes one of so many parts of the set, in turn.
const PARTS: usize = 5;

fn main() {
    // `cargo bench` passes `--bench`; anything else names scenes.
    let wanted: Vec<String> = std::env::args().skip(1).filter(|a| !a.starts_with("--")).collect();
    let embree = match Embree::load() {
        Ok(embree) => Some(embree),
        Err(why) => {
            println!("Embree not found, ratio skipped ({why})");
            None
        }
    };
    for (name, make) in scenes::ALL {
        if wanted.is_empty() || wanted.iter().any(|w| name.contains(w.as_str())) {
            bench_scene(name, &make(), embree.as_ref());
        }
    }
}

fn bench_scene(name: &str, shapes: &ShapeTable, embree: Option<&Embree>) {
    let triangles: usize = shapes.meshes.iter().map(|m| m.triangles.len()).sum();
    let clock = Clock::new();
    let wall = std::time::Instant::now();
    let accel = Accel::build(shapes).expect("the scenes are sound");
    println!(
        "\n{name}: {triangles} triangles, built in {:.2} s, {:.1} MB",
        wall.elapsed().as_secs_f64(),
        accel.memory_bytes() as f64 / 1e6
    );
    let other = embree.map(|e| {
        let wall = std::time::Instant::now();
        let scenes = [e.scene(shapes, Robustness::Default), e.scene(shapes, Robustness::Robust)];
        println!("  (Embree: two scenes built in {:.2} s)", wall.elapsed().as_secs_f64());
        scenes
    });
    println!("  {:<24} {:>10}   {:>12} {:>12}", "rays", "Mrays/s", "/ Embree", "/ its robust");
    for set in rays::all(&accel, shapes) {
        report(&set, &accel, shapes, other.as_ref(), &clock);
    }
}

fn report(
    set: &RaySet,
    accel: &Accel,
    shapes: &ShapeTable,
    other: Option<&[EmbreeScene<'_>; 2]>,
    clock: &Clock,
) {
    let parts: Vec<&[Ray]> = set.rays.chunks(set.rays.len().div_ceil(PARTS)).collect();
    let mut ours = Vec::new();
    let mut theirs = [Vec::new(), Vec::new()];
    let mut differences = 0;
    for rays in parts.iter().cycle().take(ROUNDS) {
        let (seconds, hits) = clock.time(|| trace(accel, shapes, rays, set.any_hit));
        ours.push(rays.len() as f64 / seconds);
        for (i, scene) in other.into_iter().flatten().enumerate() {
            let (seconds, their_hits) = clock.time(|| scene.trace(rays, set.any_hit));
            theirs[i].push(rays.len() as f64 / seconds);
            differences = hits.abs_diff(their_hits).max(differences);
        }
    }
    let ratio = |theirs: &[f64]| {
        let ratios: Vec<f64> = ours.iter().zip(theirs).map(|(a, b)| a / b).collect();
        if ratios.is_empty() { "-".to_owned() } else { format!("{:.2}", median(ratios)) }
    };
    println!(
        "  {:<24} {:>10.2}   {:>12} {:>12}   ({differences} hits differ)",
        set.name,
        median(ours.clone()) / 1e6,
        ratio(&theirs[0]),
        ratio(&theirs[1]),
    );
}

/// Number of rays that hit.
fn trace(accel: &Accel, shapes: &ShapeTable, rays: &[Ray], any_hit: bool) -> usize {
    if any_hit {
        rays.iter().filter(|ray| accel.occluded(shapes, ray)).count()
    } else {
        rays.iter().filter(|ray| accel.intersect(shapes, ray).is_some()).count()
    }
}

fn median(mut values: Vec<f64>) -> f64 {
    values.sort_by(f64::total_cmp);
    values[values.len() / 2]
}
