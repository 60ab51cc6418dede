//! Materials.

use claror::bsdf::{
    Bsdf, BsdfId, MicrofacetKind, PerturbationOptions, Principled, ior_names, metal, metal_names,
    named_ior,
};
use claror::spectrum::Rgb;
use claror::texture::TextureId;

use super::Builder;
use super::spectrum::Role;
use crate::scene::description::{ObjectIndex, Tag, Value};
use crate::scene::nearest::{hint, nearest};
use crate::scene::properties::Properties;
use crate::scene::source::Span;
use crate::scene::values::short;

/// All material plugins.
const PLUGINS: [&str; 15] = [
    "diffuse",
    "dielectric",
    "thindielectric",
    "roughdielectric",
    "conductor",
    "roughconductor",
    "plastic",
    "roughplastic",
    "principled",
    "twosided",
    "mask",
    "blendbsdf",
    "bumpmap",
    "normalmap",
    "null",
];

/// Roughness: `alpha` in both directions.
struct Microfacets {
    distribution: MicrofacetKind,
    sample_visible: bool,
    alpha_u: TextureId,
    alpha_v: TextureId,
}

impl<'a> Builder<'a> {
    /// A diffuse material of that reflectance.
    pub(super) fn default_bsdf(&mut self, reflectance: f32, span: Span) -> BsdfId {
        if let Some(id) = self.default_bsdfs.get(&reflectance.to_bits()) {
            return *id;
        }
        let reflectance_texture = self.constant(Rgb::splat(reflectance));
        let id = self.push_bsdf(Bsdf::Diffuse { reflectance: reflectance_texture }, span);
        self.default_bsdfs.insert(reflectance.to_bits(), id);
        id
    }

    fn push_bsdf(&mut self, bsdf: Bsdf, span: Span) -> BsdfId {
        self.tables.bsdfs.bsdfs.push(bsdf);
        self.bsdf_spans.push(span);
        BsdfId(u32::try_from(self.bsdf_spans.len() - 1).unwrap_or(u32::MAX))
    }

    /// The material that an object is.
    pub(super) fn bsdf(&mut self, index: ObjectIndex) -> BsdfId {
        if let Some(id) = self.bsdfs.get(&index) {
            return *id;
        }
        let properties = self.properties(index);
        let span = properties.span();
        let made = match properties.plugin() {
            "diffuse" => {
                let reflectance = self.texture(&properties, "reflectance", Role::Reflectance, 0.5);
                Some(Bsdf::Diffuse { reflectance })
            }
            "null" => Some(Bsdf::Null),
            "dielectric" | "thindielectric" | "roughdielectric" => Some(self.glass(&properties)),
            "conductor" | "roughconductor" => Some(self.metal(&properties)),
            "plastic" | "roughplastic" => Some(self.plastic(&properties)),
            "principled" => Some(self.principled(&properties)),
            "twosided" => self.two_sided(&properties),
            "mask" => self.mask(&properties),
            "blendbsdf" => self.blend(&properties),
            "bumpmap" => self.bump_map(&properties),
            "normalmap" => self.normal_map(&properties),
            _ => {
                self.unsupported(&properties, &PLUGINS, "a grey diffuse is used instead");
                None
            }
        };
        self.finish(properties);
        let id = match made {
            Some(bsdf) => self.push_bsdf(bsdf, span),
            None => self.default_bsdf(0.5, span),
        };
        self.bsdfs.insert(index, id);
        id
    }

    /// Checks the finished table: what is nested where, and that every material is small enough.
    pub(super) fn check_bsdfs(&self) {
        use claror::bsdf::BsdfError as E;
        let Err(error) = self.tables.bsdfs.validate(&self.tables.textures) else { return };
        let id = match &error {
            E::MissingTexture { bsdf, .. }
            | E::TooManyLobes { bsdf, .. }
            | E::TooManyMaps { bsdf, .. }
            | E::EqualIndices { bsdf }
            | E::NestedOutOfOrder { bsdf, .. } => *bsdf,
            E::TransmissiveTwoSided { bsdf, .. } => *bsdf,
        };
        let span = self.bsdf_spans[id.0 as usize];
        // The user knows no numbers of materials.
        let name = format!("material {}", id.0);
        let message = error.to_string().replacen(&name, "this material", 1);
        self.log.error(span, message, None);
    }

    /// `int_ior` over `ext_ior`.
    fn relative_ior(&self, properties: &Properties<'a>, interior: &'static str) -> f32 {
        self.ior(properties, "int_ior", interior) / self.ior(properties, "ext_ior", "air")
    }

    /// An index of refraction: a number, or the name of a material.
    fn ior(&self, properties: &Properties<'a>, name: &'static str, default: &'static str) -> f32 {
        let default = named_ior(default).unwrap_or(1.0);
        match properties.get(name).map(|p| &p.value) {
            None => default,
            Some(Value::String(material)) => {
                named_ior(&material.to_lowercase()).unwrap_or_else(|| {
                    let message =
                        format!("\"{}\" has no known index of refraction", short(material));
                    properties.error(
                        name,
                        message,
                        hint(material, ior_names().collect::<Vec<_>>()),
                    );
                    default
                })
            }
            Some(_) => properties.positive(name, default),
        }
    }

    fn reflectance(&mut self, properties: &Properties<'a>, name: &'static str) -> TextureId {
        self.texture(properties, name, Role::Reflectance, 1.0)
    }

    fn distribution(properties: &Properties<'a>) -> (MicrofacetKind, bool) {
        let kinds = [("beckmann", MicrofacetKind::Beckmann), ("ggx", MicrofacetKind::Ggx)];
        let distribution = properties.choice("distribution", &kinds);
        (distribution, properties.boolean("sample_visible", true))
    }

    fn microfacets(&mut self, properties: &Properties<'a>) -> Microfacets {
        let (distribution, sample_visible) = Self::distribution(properties);
        let given = [properties.has("alpha_u"), properties.has("alpha_v")];
        if given != [false; 2] {
            if given != [true; 2] {
                let message = "\"alpha_u\" and \"alpha_v\" must be given together";
                self.log.error(properties.span(), message, None);
            }
            if properties.has("alpha") {
                let message =
                    "\"alpha\" stands beside \"alpha_u\" and \"alpha_v\": give one roughness";
                properties.error("alpha", message, None);
            }
            let alpha_u = self.alpha(properties, "alpha_u");
            let alpha_v = self.alpha(properties, "alpha_v");
            return Microfacets { distribution, sample_visible, alpha_u, alpha_v };
        }
        let alpha = self.alpha(properties, "alpha");
        Microfacets { distribution, sample_visible, alpha_u: alpha, alpha_v: alpha }
    }

    /// A roughness, 0.1 by default.
    fn alpha(&mut self, properties: &Properties<'a>, name: &'static str) -> TextureId {
        if let Some(Value::Float(v)) = properties.get(name).map(|p| &p.value)
            && *v < 0.0
        {
            properties.error(name, format!("\"{name}\" = {v} must be at least 0"), None);
        }
        self.texture(properties, name, Role::Unbounded, 0.1)
    }

    fn glass(&mut self, properties: &Properties<'a>) -> Bsdf {
        let eta = self.relative_ior(properties, "bk7");
        let specular_reflectance = self.reflectance(properties, "specular_reflectance");
        let specular_transmittance = self.reflectance(properties, "specular_transmittance");
        match properties.plugin() {
            "dielectric" => Bsdf::Dielectric { eta, specular_reflectance, specular_transmittance },
            "thindielectric" => {
                Bsdf::ThinDielectric { eta, specular_reflectance, specular_transmittance }
            }
            _ => {
                let Microfacets { distribution, sample_visible, alpha_u, alpha_v } =
                    self.microfacets(properties);
                Bsdf::RoughDielectric {
                    distribution,
                    sample_visible,
                    alpha_u,
                    alpha_v,
                    eta,
                    specular_reflectance,
                    specular_transmittance,
                }
            }
        }
    }

    fn metal(&mut self, properties: &Properties<'a>) -> Bsdf {
        let (eta, k) = self.complex_ior(properties);
        let specular_reflectance = self.reflectance(properties, "specular_reflectance");
        if properties.plugin() == "conductor" {
            return Bsdf::Conductor { eta, k, specular_reflectance };
        }
        let Microfacets { distribution, sample_visible, alpha_u, alpha_v } =
            self.microfacets(properties);
        Bsdf::RoughConductor {
            distribution,
            sample_visible,
            alpha_u,
            alpha_v,
            eta,
            k,
            specular_reflectance,
        }
    }

    /// `material`, or `eta` and `k`; a perfect mirror by default.
    fn complex_ior(&mut self, properties: &Properties<'a>) -> (TextureId, TextureId) {
        let material = properties.string("material").unwrap_or("none");
        if material != "none" {
            if properties.has("eta") || properties.has("k") {
                let message = "\"material\" stands beside \"eta\" and \"k\": give one of them";
                properties.error("material", message, None);
            }
            let known = metal(material);
            if known.is_none() {
                let names: Vec<&str> = metal_names().collect();
                // Symbols are short: the nearest letters mean little unless only the case differs.
                let same = names.iter().find(|n| n.eq_ignore_ascii_case(material)).copied();
                let near = same.or_else(|| nearest(material, names.iter().copied()));
                let message = format!("\"{}\" is no known metal", short(material));
                properties.error(
                    "material",
                    message,
                    near.map(|n| format!("did you mean \"{n}\"?")),
                );
            }
            let (eta, k) = known.unwrap_or((Rgb::BLACK, Rgb::WHITE));
            return (self.constant(eta), self.constant(k));
        }
        let eta = self.texture(properties, "eta", Role::Unbounded, 0.0);
        let k = self.texture(properties, "k", Role::Unbounded, 1.0);
        (eta, k)
    }

    fn plastic(&mut self, properties: &Properties<'a>) -> Bsdf {
        let eta = self.relative_ior(properties, "polypropylene");
        let diffuse_reflectance =
            self.texture(properties, "diffuse_reflectance", Role::Reflectance, 0.5);
        let specular_reflectance = self.reflectance(properties, "specular_reflectance");
        let nonlinear = properties.boolean("nonlinear", false);
        if properties.plugin() == "plastic" {
            return Bsdf::Plastic { eta, diffuse_reflectance, specular_reflectance, nonlinear };
        }
        let (distribution, sample_visible) = Self::distribution(properties);
        Bsdf::RoughPlastic {
            distribution,
            sample_visible,
            alpha: properties.float_that("alpha", 0.1, "at least 0", |v| v >= 0.0),
            eta,
            diffuse_reflectance,
            specular_reflectance,
            nonlinear,
        }
    }

    fn principled(&mut self, properties: &Properties<'a>) -> Bsdf {
        let eta = if properties.has("eta") {
            if properties.has("specular") {
                let message = "\"specular\" stands beside \"eta\": give one of them";
                properties.error("specular", message, None);
            }
            properties.positive("eta", 1.5)
        } else {
            // Burley 2012: specular 0..1 is the reflectance at normal incidence 0..8 %.
            let specular = properties
                .float_that("specular", 0.5, "between 0 and 1", |v| (0.0..=1.0).contains(&v));
            2.0 / (1.0 - (0.08 * specular).sqrt()) - 1.0
        };
        let mut share = |name, default| self.texture(properties, name, Role::Reflectance, default);
        Bsdf::Principled(Box::new(Principled {
            base_color: share("base_color", 0.5),
            roughness: share("roughness", 0.5),
            anisotropic: share("anisotropic", 0.0),
            metallic: share("metallic", 0.0),
            spec_trans: share("spec_trans", 0.0),
            spec_tint: share("spec_tint", 0.0),
            sheen: share("sheen", 0.0),
            sheen_tint: share("sheen_tint", 0.0),
            flatness: share("flatness", 0.0),
            clearcoat: share("clearcoat", 0.0),
            clearcoat_gloss: share("clearcoat_gloss", 0.0),
            eta,
            diffuse_reflectance_sampling_rate: properties
                .positive("diffuse_reflectance_sampling_rate", 1.0),
            main_specular_sampling_rate: properties.positive("main_specular_sampling_rate", 1.0),
            clearcoat_sampling_rate: properties.positive("clearcoat_sampling_rate", 1.0),
        }))
    }

    /// Nested materials, as many as `counts` allows; `None` after an error.
    fn nested_bsdfs(
        &mut self,
        properties: &Properties<'a>,
        counts: std::ops::RangeInclusive<usize>,
    ) -> Option<Vec<BsdfId>> {
        let found = self.nested(properties, Tag::Bsdf);
        let ids: Vec<BsdfId> = found.iter().map(|(_, index)| self.bsdf(*index)).collect();
        if counts.contains(&ids.len()) {
            return Some(ids);
        }
        if !properties.has_broken() {
            let (low, high) = (counts.start(), counts.end());
            let range = if low == high { low.to_string() } else { format!("{low} or {high}") };
            let plugin = short(properties.plugin());
            let message = format!("\"{plugin}\" needs {range} nested <bsdf>, found {}", ids.len());
            self.log.error(properties.span(), message, None);
        }
        None
    }

    fn two_sided(&mut self, properties: &Properties<'a>) -> Option<Bsdf> {
        let sides = self.nested_bsdfs(properties, 1..=2)?;
        let (front, back) = (*sides.first()?, *sides.last()?);
        Some(Bsdf::TwoSided { front, back })
    }

    fn mask(&mut self, properties: &Properties<'a>) -> Option<Bsdf> {
        let opacity = self.texture(properties, "opacity", Role::Reflectance, 0.5);
        let nested = *self.nested_bsdfs(properties, 1..=1)?.first()?;
        Some(Bsdf::Mask { opacity, nested })
    }

    fn blend(&mut self, properties: &Properties<'a>) -> Option<Bsdf> {
        if !properties.is_given("weight") {
            self.missing(properties, "weight");
        }
        let weight = self.texture(properties, "weight", Role::Reflectance, 0.5);
        let parts = self.nested_bsdfs(properties, 2..=2)?;
        Some(Bsdf::Blend { weight, first: *parts.first()?, second: *parts.last()? })
    }

    fn bump_map(&mut self, properties: &Properties<'a>) -> Option<Bsdf> {
        let scale = properties.float("scale", 1.0);
        let nested = self.nested_bsdfs(properties, 1..=1);
        let Some(texture) = self.only_nested(properties, Tag::Texture) else {
            if !properties.has_broken() {
                let message = "\"bumpmap\" needs a nested <texture>";
                self.log.error(properties.span(), message, None);
            }
            return None;
        };
        let displacement = self.texture_object(texture, Role::Unbounded)?;
        let options = Self::perturbation_options(properties);
        Some(Bsdf::BumpMap { displacement, scale, nested: *nested?.first()?, options })
    }

    fn normal_map(&mut self, properties: &Properties<'a>) -> Option<Bsdf> {
        let options = Self::perturbation_options(properties);
        if !properties.is_given("normalmap") {
            self.missing(properties, "normalmap");
        }
        let normal = self.opt_texture(properties, "normalmap", Role::Unbounded);
        let nested = self.nested_bsdfs(properties, 1..=1);
        Some(Bsdf::NormalMap { normal: normal?, nested: *nested?.first()?, options })
    }

    fn perturbation_options(properties: &Properties<'a>) -> PerturbationOptions {
        PerturbationOptions {
            flip_invalid_normals: properties.boolean("flip_invalid_normals", true),
            use_shadowing_function: properties.boolean("use_shadowing_function", true),
        }
    }
}
