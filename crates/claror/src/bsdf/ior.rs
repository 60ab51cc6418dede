//! Named indices of refraction: what Mitsuba accepts for `int_ior` and `ext_ior`.

/// Index of refraction of the named material relative to vacuum, in visible light; `None` for
/// unknown names.
pub fn named_ior(name: &str) -> Option<f32> {
    IORS.iter().find(|row| row.0 == name).map(|row| row.1)
}

/// All names that [`named_ior`] knows.
pub fn ior_names() -> impl Iterator<Item = &'static str> {
    IORS.iter().map(|row| row.0)
}

/// Gases at 0 °C and 1 atm, liquids at 20 °C, solids at room temperature (sodium D line).
const IORS: [(&str, f32); 23] = [
    ("vacuum", 1.0),
    ("helium", 1.000_036),
    ("hydrogen", 1.000_132),
    ("air", 1.000_277),
    ("carbon dioxide", 1.000_45),
    ("water", 1.333),
    ("acetone", 1.36),
    ("ethanol", 1.361),
    ("carbon tetrachloride", 1.461),
    ("glycerol", 1.4729),
    ("benzene", 1.501),
    ("silicone oil", 1.520_45),
    ("bromine", 1.661),
    ("water ice", 1.31),
    ("fused quartz", 1.458),
    ("pyrex", 1.47),
    ("acrylic glass", 1.49),
    ("polypropylene", 1.49),
    ("bk7", 1.5046),
    ("sodium chloride", 1.544),
    ("amber", 1.55),
    ("pet", 1.575),
    ("diamond", 2.419),
];

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_are_unique_and_values_plausible() {
        for name in ior_names() {
            assert_eq!(ior_names().filter(|n| *n == name).count(), 1, "{name}");
            let ior = named_ior(name).expect("listed names are known");
            assert!((1.0..2.5).contains(&ior), "{name} {ior}");
        }
        assert_eq!(named_ior("water"), Some(1.333));
        assert_eq!(named_ior("watr"), None);
    }
}
