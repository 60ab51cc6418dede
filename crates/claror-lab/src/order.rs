//! In which order runs are made.
//!
//! Machines drift: they get warm, others use them. So all settings take turns, round by round,
//! and within a round stand in an order that no setting profits from.

use xxhash_rust::xxh3::xxh3_64;

/// An order of the jobs: rounds one after another, each in an order that is fixed but arbitrary.
/// A job is its round and its name.
pub(crate) fn interleaved<'a>(jobs: impl Iterator<Item = (usize, &'a str)>) -> Vec<usize> {
    let mut keyed: Vec<(usize, u64, usize)> = jobs
        .enumerate()
        .map(|(at, (round, name))| (round, xxh3_64(format!("{round} {name}").as_bytes()), at))
        .collect();
    keyed.sort_unstable();
    keyed.into_iter().map(|(_, _, at)| at).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rounds_follow_each_other_and_differ() {
        let names: Vec<String> = (0..40).map(|i| format!("setting {}", i % 20)).collect();
        let jobs = || names.iter().enumerate().map(|(i, name)| (i / 20, name.as_str()));
        let order = interleaved(jobs());
        assert_eq!(order, interleaved(jobs()));
        let mut sorted = order.clone();
        sorted.sort_unstable();
        assert_eq!(sorted, (0..40).collect::<Vec<_>>());
        assert!(order[..20].iter().all(|&at| at < 20));
        assert_ne!(order[..20], (0..20).collect::<Vec<_>>());
        let second: Vec<usize> = order[20..].iter().map(|at| at - 20).collect();
        assert_ne!(order[..20], second);
    }
}
