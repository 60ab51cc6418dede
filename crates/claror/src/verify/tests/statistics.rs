use approx::assert_relative_eq;

use crate::film::CropWindow;
use crate::math::special::ln_gamma;
use crate::math::statistics::{TestRng, normal_quantile};
use crate::verify::strata::Strata;
use crate::verify::{
    Interval, LEVEL, Share, Verdict, clopper_pearson, stratified_mean, stratified_ratio,
};

#[test]
fn clopper_pearson_has_known_values() {
    let close = |hits, trials, low: f64, high: f64| {
        let interval = clopper_pearson(hits, trials, 0.05);
        assert_relative_eq!(interval.low, low, epsilon = 1e-6);
        assert_relative_eq!(interval.high, high, epsilon = 1e-6);
    };
    // Closed forms without and with nothing but hits.
    close(0, 10, 0.0, 1.0 - 0.025_f64.powf(0.1));
    close(10, 10, 0.025_f64.powf(0.1), 1.0);
    // R: binom.test(k, n)$conf.int.
    close(1, 10, 0.002_528_579, 0.445_016_1);
    close(5, 20, 0.086_571_47, 0.491_045_9);
    assert_eq!(clopper_pearson(0, 0, 0.05), Interval { low: 0.0, high: 1.0 });
}

/// Summed over all outcomes, the interval covers every probability at least as often as it says.
#[test]
fn clopper_pearson_covers() {
    let n = 40_usize;
    let ln_choose = |k: usize| {
        ln_gamma(n as f64 + 1.0) - ln_gamma(k as f64 + 1.0) - ln_gamma((n - k) as f64 + 1.0)
    };
    for p in [0.01_f64, 0.05, 0.1, 0.37, 0.5, 0.9] {
        let mass =
            |k: usize| (ln_choose(k) + k as f64 * p.ln() + (n - k) as f64 * (1.0 - p).ln()).exp();
        let covered: f64 =
            (0..=n).filter(|k| clopper_pearson(*k, n, LEVEL).contains(p)).map(mass).sum();
        assert!((1.0 - LEVEL..1.0).contains(&covered), "{p}: {covered}");
    }
}

/// Two strata by hand: 1, 3 and 10, 14: within them variances 2 and 8.
#[test]
fn stratified_means_by_hand() {
    let estimate = stratified_mean(&[1.0, 10.0, 3.0, 14.0], 2);
    assert_relative_eq!(estimate.value, 7.0);
    assert_relative_eq!(estimate.standard_error, (0.25 * (2.0 / 2.0 + 8.0 / 2.0_f64)).sqrt());
    // 3·10²/(4 + 64) − 2, but no more than the number of strata.
    assert_relative_eq!(estimate.dof, 2.0);
    let ratio = stratified_ratio(&[2.0, 4.0, 6.0, 8.0], &[1.0, 2.0, 3.0, 4.0], 2).expect("x > 0");
    assert_relative_eq!(ratio.value, 2.0);
    assert_relative_eq!(ratio.standard_error, 0.0, epsilon = 1e-15);
    assert_eq!(ratio.interval(), Interval { low: 2.0, high: 2.0 });
    assert!(stratified_ratio(&[0.0; 4], &[0.0; 4], 2).is_none());
}

/// Normal values whose spread differs twentyfold between the strata, and whose means differ much
/// more: the intervals hold the mean 95 times in a hundred. Of 4000 trials a correct program is
/// off by more than 1.4 % (four standard deviations of the count) once in 16 000.
#[test]
fn stratified_intervals_cover() {
    for (strata, per_stratum) in [(8, 2), (32, 2), (16, 6)] {
        let trials = 4000;
        let mut rng = TestRng::new(17);
        let covered = (0..trials)
            .filter(|_| {
                let values: Vec<f64> = (0..strata * per_stratum)
                    .map(|k| {
                        let s = (k % strata) as f64 / strata as f64;
                        let u = (f64::from(rng.next_f32()) + 1e-9).min(1.0 - 1e-9);
                        100.0 * (s - 0.5 + 0.5 / strata as f64)
                            + (0.1 + 2.0 * s) * normal_quantile(u)
                    })
                    .collect();
                stratified_mean(&values, strata).interval().contains(0.0)
            })
            .count();
        let share = covered as f64 / trials as f64;
        assert!((share - 0.95).abs() < 0.014, "{strata} × {per_stratum}: {share}");
    }
}

#[test]
fn verdicts_follow_the_interval() {
    let claim = Interval { low: -1.0, high: 1.0 };
    for (low, high, verdict) in [
        (-0.5, 0.5, Verdict::Confirmed),
        (-1.0, 1.0, Verdict::Confirmed),
        (0.5, 1.5, Verdict::Undecided),
        (-2.0, 2.0, Verdict::Undecided),
        (1.1, 1.5, Verdict::Refuted),
        (-3.0, -2.0, Verdict::Refuted),
    ] {
        assert_eq!(Interval { low, high }.verdict(&claim), verdict, "{low} to {high}");
    }
}

/// Differences of 0, 1 and 2 with an error of 0.2 against a tolerance of 1: 0 is surely within,
/// 2 surely beyond, 1 in doubt.
#[test]
fn doubt_counts_for_both_sides() {
    let share = Share::new([0.0, -1.0, 2.0].into_iter().map(|d| (d, 0.2, 1.0)));
    assert_eq!(share, Share { surely: 1, possibly: 2, of: 3 });
    assert_eq!(share.interval().low, share.sure_interval().low);
    assert!(share.interval().high > share.sure_interval().high);
}

/// Whatever the number of cells and the window, points lie in the window and the cells share its
/// area out evenly: with one point in the middle of each of a fine grid of `u`.
#[test]
fn strata_are_equal() {
    let crop = CropWindow { x: 5, y: 7, width: 31, height: 11 };
    for count in [1, 2, 7, 50, 128] {
        let strata = Strata::new(crop, count);
        let grid = 60;
        let mut hits = vec![0_u32; 31 * 11];
        for s in 0..count {
            for i in 0..grid * grid {
                let at = |i: i32| (i as f32 + 0.5) / grid as f32;
                let point = strata.point(s, crate::math::Vec2::new(at(i % grid), at(i / grid)));
                let (x, y) = strata.pixel(point);
                assert_eq!((x, y), (point.0 as u32 - 5, point.1 as u32 - 7), "inside");
                hits[(y * 31 + x) as usize] += 1;
            }
        }
        // A boundary of a pixel moves at most a row and a column of each cell's grid.
        let expected = (count * 3600) as f64 / 341.0;
        let edge = 2.0 * (expected.sqrt() + 1.0) * 2.0;
        for hit in hits {
            assert!((f64::from(hit) - expected).abs() < edge.max(0.2 * expected), "{count}: {hit}");
        }
    }
}
