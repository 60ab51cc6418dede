//! Names of files.

/// The text in letters, digits, dots and single hyphens: `accuracy=0.1` → `accuracy-0.1`.
pub(crate) fn slug(text: &str) -> String {
    let mut slug = String::new();
    for c in text.chars() {
        if c.is_ascii_alphanumeric() || c == '.' || c == '_' {
            slug.push(c);
        } else if !slug.is_empty() && !slug.ends_with('-') {
            slug.push('-');
        }
    }
    let slug = slug.trim_matches(['-', '.']);
    if slug.is_empty() { "scene".to_owned() } else { slug.to_owned() }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn slugs_are_safe_file_names() {
        assert_eq!(slug("accuracy=0.1, index=bvh"), "accuracy-0.1-index-bvh");
        assert_eq!(slug("../../etc"), "etc");
        assert_eq!(slug("Übung / µ"), "bung");
        assert_eq!(slug(".."), "scene");
    }
}
