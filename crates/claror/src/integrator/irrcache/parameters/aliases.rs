//! What other programs call their parameters of irradiance caching.
//!
//! Mitsuba 0.6 `irrcache`, pbrt-v2 `irradiancecache`, the ambient options of Radiance's `rpict`,
//! and the two numbers of the thesis whose mistakes the criterion `thesis` keeps.

/// A name from elsewhere.
#[derive(Debug, Clone, Copy)]
pub struct CacheAlias {
    /// Whose.
    pub system: &'static str,
    /// The name there.
    pub name: &'static str,
    pub(super) meaning: Meaning,
}

/// What becomes of a value from elsewhere.
#[derive(Debug, Clone, Copy)]
pub(super) enum Meaning {
    /// It is the value of these.
    Is(&'static [&'static str]),
    /// It is converted into a value of this.
    Becomes { to: &'static str, expected: &'static str, convert: fn(&str) -> Option<String> },
    /// One value is what happens anyway; others cannot be.
    Only { value: fn(&str) -> bool, why: &'static str },
}

const MITSUBA: &str = "Mitsuba 0.6";
const PBRT: &str = "pbrt-v2";
const RADIANCE: &str = "Radiance";
const THESIS: &str = "thesis";

/// All of them. Names that differ from ours by capitals and underscores alone need no entry.
pub const ALIASES: &[CacheAlias] = &[
    becomes(MITSUBA, "resolution", "gather_samples", "a whole number from 3 to 181", |v| {
        // Elevations; twice as many azimuths.
        let n: u32 = whole(v, 3..=181)?;
        Some((2 * n * n).to_string())
    }),
    becomes(MITSUBA, "qualityAdjustment", "overlap", "a number from 0.1 to 1", |v| {
        let q: f32 = v.parse().ok().filter(|q| (0.1..=1.0).contains(q))?;
        Some((1.0 / q).to_string())
    }),
    only(
        MITSUBA,
        "clampScreen",
        is_true,
        "radii are bounded in pixels unless min_radius and max_radius bound them in scene units",
    ),
    only(MITSUBA, "influenceMin", never, "give min_radius in scene units"),
    only(MITSUBA, "influenceMax", never, "give max_radius in scene units"),
    only(MITSUBA, "direct", is_true, INDIRECT_LAYER),
    only(MITSUBA, "indirectOnly", is_false, INDIRECT_LAYER),
    only(MITSUBA, "debug", is_false, "records are not painted into the picture"),
    is(PBRT, "maxangledifference", &["max_angle"]),
    is(PBRT, "nsamples", &["gather_samples"]),
    becomes(PBRT, "maxindirectdepth", "max_depth", "a whole number", bounces_to_depth),
    only(
        PBRT,
        "maxspeculardepth",
        never,
        "mirrors and glass are followed as far as max_depth says",
    ),
    // Whichever the criterion looks at.
    is(RADIANCE, "aa", &["error", "accuracy"]),
    is(RADIANCE, "ar", &["ambient_resolution"]),
    is(RADIANCE, "ad", &["gather_samples"]),
    only(
        RADIANCE,
        "as",
        is_0,
        "more rays where the first ones differ would be a bias: noise asks for whole batches of them",
    ),
    becomes(RADIANCE, "ab", "max_depth", "a whole number", bounces_to_depth),
    only(RADIANCE, "av", is_0, NO_CONSTANT),
    only(RADIANCE, "aw", is_0, NO_CONSTANT),
    is(THESIS, "A", &["accuracy"]),
];

const INDIRECT_LAYER: &str = "the picture has all light; --layers writes indirect light by itself";
const NO_CONSTANT: &str = "there is no constant ambient light: all light is computed";

const fn is(system: &'static str, name: &'static str, to: &'static [&'static str]) -> CacheAlias {
    CacheAlias { system, name, meaning: Meaning::Is(to) }
}

const fn becomes(
    system: &'static str,
    name: &'static str,
    to: &'static str,
    expected: &'static str,
    convert: fn(&str) -> Option<String>,
) -> CacheAlias {
    CacheAlias { system, name, meaning: Meaning::Becomes { to, expected, convert } }
}

const fn only(
    system: &'static str,
    name: &'static str,
    value: fn(&str) -> bool,
    why: &'static str,
) -> CacheAlias {
    CacheAlias { system, name, meaning: Meaning::Only { value, why } }
}

fn whole(value: &str, range: std::ops::RangeInclusive<u32>) -> Option<u32> {
    value.parse().ok().filter(|n| range.contains(n))
}

/// Diffuse bounces of indirect light; `max_depth` counts emission and direct light before them.
fn bounces_to_depth(value: &str) -> Option<String> {
    let n = whole(value, 0..=u32::MAX - 2)?;
    Some((n + 2).to_string())
}

fn is_true(value: &str) -> bool {
    value == "true"
}

fn is_false(value: &str) -> bool {
    value == "false"
}

fn is_0(value: &str) -> bool {
    value.parse() == Ok(0.0_f32)
}

fn never(_: &str) -> bool {
    false
}

impl CacheAlias {
    pub(super) fn find(name: &str) -> Option<&'static Self> {
        ALIASES.iter().find(|alias| same_name(alias.name, name))
    }

    /// The parameters that it sets; none for what cannot be set.
    pub fn targets(&self) -> Vec<&'static str> {
        match self.meaning {
            Meaning::Is(to) => to.to_vec(),
            Meaning::Becomes { to, .. } => vec![to],
            Meaning::Only { .. } => Vec::new(),
        }
    }
}

/// Whether names are alike but for capitals and underscores.
pub(super) fn same_name(a: &str, b: &str) -> bool {
    let letters = |name: &str| -> Vec<u8> {
        name.bytes().filter(|&c| c != b'_').map(|c| c.to_ascii_lowercase()).collect()
    };
    letters(a) == letters(b)
}
