//! "Did you mean …?"

/// Optimal string alignment distance: insertions, deletions, replacements and swaps of
/// neighbours, case ignored.
fn distance(a: &str, b: &str) -> usize {
    let a: Vec<char> = a.to_lowercase().chars().collect();
    let b: Vec<char> = b.to_lowercase().chars().collect();
    let mut before: Vec<usize> = Vec::new();
    let mut last: Vec<usize> = (0..=b.len()).collect();
    for i in 1..=a.len() {
        let mut row = vec![i; b.len() + 1];
        for j in 1..=b.len() {
            let replace = last[j - 1] + usize::from(a[i - 1] != b[j - 1]);
            row[j] = replace.min(last[j] + 1).min(row[j - 1] + 1);
            if i > 1 && j > 1 && a[i - 1] == b[j - 2] && a[i - 2] == b[j - 1] {
                row[j] = row[j].min(before[j - 2] + 1);
            }
        }
        before = last;
        last = row;
    }
    last[b.len()]
}

/// Longer names are not compared: the cost is the product of the lengths.
const MAX_NAME: usize = 64;

/// The known name that is nearest to `name`, if it is near enough to be what was meant: at most
/// a third of its letters differ.
pub(super) fn nearest<'a>(name: &str, known: impl IntoIterator<Item = &'a str>) -> Option<&'a str> {
    if name.len() > MAX_NAME {
        return None;
    }
    known
        .into_iter()
        .filter(|k| k.len() <= MAX_NAME && *k != name)
        .map(|k| (distance(name, k), k))
        .filter(|(d, k)| *d <= 1.max(k.chars().count().max(name.chars().count()) / 3))
        // The first of equally near ones, so that the answer does not depend on chance.
        .min_by_key(|(d, _)| *d)
        .map(|(_, k)| k)
}

/// `did you mean "…"?`, or the list of what is known when nothing is near and the list short.
pub fn hint<'a>(name: &str, known: impl IntoIterator<Item = &'a str> + Clone) -> Option<String> {
    if let Some(near) = nearest(name, known.clone()) {
        return Some(format!("did you mean \"{near}\"?"));
    }
    let all: Vec<&str> = known.into_iter().take(25).collect();
    (1..25).contains(&all.len()).then(|| format!("known are: {}", all.join(", ")))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn near_names_are_found() {
        let known = ["reflectance", "specular_reflectance", "alpha", "alpha_u", "k"];
        assert_eq!(nearest("reflectence", known), Some("reflectance"));
        assert_eq!(nearest("Reflectance", known), Some("reflectance"));
        assert_eq!(nearest("aplha", known), Some("alpha"));
        assert_eq!(nearest("alpa_u", known), Some("alpha_u"));
        assert_eq!(nearest("to_world", known), None);
        assert_eq!(distance("ca", "abc"), 3);
        assert_eq!(distance("", "abc"), 3);
    }

    #[test]
    fn far_names_get_the_list() {
        assert_eq!(hint("xyz", ["alpha", "beta"]).as_deref(), Some("known are: alpha, beta"));
        assert_eq!(hint("xyz", []), None);
        assert_eq!(nearest(&"a".repeat(100_000), ["a"]), None);
    }
}
