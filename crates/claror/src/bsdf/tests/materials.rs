//! The materials that the tests go through; the same as in `reference.py`.

use super::support::Materials;
use crate::bsdf::{Bsdf, BsdfId, MicrofacetKind, PerturbationOptions, Principled, metal};
use crate::image::Image;
use crate::texture::{ImageId, Texture, TextureFilter, TextureId, UvTransform, WrapMode};

const COLOR: [f32; 3] = [0.2, 0.5, 0.8];
const PALE: [f32; 3] = [0.9, 0.8, 0.7];
const WHITE: [f32; 3] = [1.0; 3];
const BECKMANN: MicrofacetKind = MicrofacetKind::Beckmann;
const GGX: MicrofacetKind = MicrofacetKind::Ggx;

/// Adds a material of each kind; the names are those of `reference.py`.
pub(super) fn all(m: &mut Materials) -> Vec<(&'static str, BsdfId)> {
    let mut list = models(m);
    list.extend(principled(m));
    list.extend(adapters(m));
    list.extend(perturbed(m));
    list
}

fn models(m: &mut Materials) -> Vec<(&'static str, BsdfId)> {
    let aniso = (0.15, 0.4);
    vec![
        ("diffuse", diffuse(m)),
        ("gold-ggx", gold(m, GGX, true, (0.25, 0.25), WHITE)),
        ("gold-beckmann", gold(m, BECKMANN, true, (0.25, 0.25), PALE)),
        ("gold-ggx-aniso", gold(m, GGX, true, aniso, WHITE)),
        ("gold-beckmann-aniso-all", gold(m, BECKMANN, false, aniso, WHITE)),
        ("glass-ggx", glass(m, GGX, true, (0.3, 0.3), [WHITE, PALE])),
        ("glass-beckmann-aniso", glass(m, BECKMANN, true, aniso, [PALE, WHITE])),
        ("glass-ggx-all", glass(m, GGX, false, (0.5, 0.5), [WHITE, WHITE])),
        ("plastic", plastic(m, false, WHITE)),
        ("plastic-nonlinear", plastic(m, true, PALE)),
        ("roughplastic-ggx", rough_plastic(m, GGX, true, 0.2, (false, WHITE))),
        ("roughplastic-beckmann", rough_plastic(m, BECKMANN, true, 0.35, (true, PALE))),
        ("roughplastic-all", rough_plastic(m, BECKMANN, false, 0.3, (false, WHITE))),
    ]
}

fn principled(m: &mut Materials) -> Vec<(&'static str, BsdfId)> {
    let mut list = Vec::new();
    let mut add = |m: &mut Materials, name, change: &dyn Fn(&mut Materials, &mut Principled)| {
        let mut p = plain_principled(m);
        change(m, &mut p);
        list.push((name, m.add(Bsdf::Principled(Box::new(p)))));
    };
    add(m, "principled", &|_, _| ());
    add(m, "principled-cloth", &|m, p| {
        p.roughness = m.scalar(0.7);
        p.sheen = m.scalar(0.8);
        p.sheen_tint = m.scalar(0.6);
        p.flatness = m.scalar(0.5);
        p.spec_tint = m.scalar(0.4);
    });
    add(m, "principled-varnish", &|m, p| {
        p.roughness = m.scalar(0.4);
        p.anisotropic = m.scalar(0.6);
        p.metallic = m.scalar(0.7);
        p.clearcoat = m.scalar(0.9);
        p.clearcoat_gloss = m.scalar(0.3);
    });
    add(m, "principled-glass", &|m, p| {
        p.roughness = m.scalar(0.35);
        p.spec_trans = m.scalar(0.8);
        p.eta = 1.4;
        p.metallic = m.scalar(0.1);
        p.clearcoat = m.scalar(0.5);
        p.spec_tint = m.scalar(0.3);
    });
    add(m, "principled-rates", &|m, p| {
        p.spec_trans = m.scalar(0.3);
        p.eta = eta_of_specular(0.8);
        p.sheen = m.scalar(0.3);
        p.clearcoat = m.scalar(1.0);
        p.main_specular_sampling_rate = 0.5;
        p.clearcoat_sampling_rate = 2.0;
        p.diffuse_reflectance_sampling_rate = 3.0;
    });
    list
}

fn adapters(m: &mut Materials) -> Vec<(&'static str, BsdfId)> {
    let (aniso, iso) = (brushed(m), gold(m, GGX, true, (0.25, 0.25), WHITE));
    let base = diffuse(m);
    let (opacity, weight) = (m.scalar(0.4), m.scalar(0.3));
    vec![
        ("twosided", m.add(Bsdf::TwoSided { front: aniso, back: aniso })),
        ("twosided-two", m.add(Bsdf::TwoSided { front: base, back: iso })),
        ("mask", m.add(Bsdf::Mask { opacity, nested: base })),
        ("blend", m.add(Bsdf::Blend { weight, first: base, second: iso })),
    ]
}

fn perturbed(m: &mut Materials) -> Vec<(&'static str, BsdfId)> {
    let brushed = brushed(m);
    let glass = glass(m, GGX, true, (0.3, 0.3), [WHITE, WHITE]);
    let base = diffuse(m);
    let displacement = height(m);
    let normal = bitmap(m, (2, 2, 3), [0.75, 0.25, 0.875].repeat(4));
    let bump = |m: &mut Materials, scale, nested, options| {
        m.add(Bsdf::BumpMap { displacement, scale, nested, options })
    };
    let on = PerturbationOptions::default();
    let off = PerturbationOptions { flip_invalid_normals: false, use_shadowing_function: false };
    let mapped_base = m.add(Bsdf::NormalMap { normal, nested: base, options: on });
    let bumpy = bump(m, 0.375, brushed, on);
    vec![
        ("normalmap", m.add(Bsdf::NormalMap { normal, nested: brushed, options: on })),
        ("normalmap-plain", m.add(Bsdf::NormalMap { normal, nested: brushed, options: off })),
        ("bumpmap", bumpy),
        ("bumpmap-plain", bump(m, 0.375, brushed, off)),
        ("bumpmap-glass", bump(m, 0.375, glass, on)),
        ("twosided-bumpmap", m.add(Bsdf::TwoSided { front: bumpy, back: bumpy })),
        ("bumpmap-normalmap", bump(m, 0.125, mapped_base, on)),
    ]
}

fn diffuse(m: &mut Materials) -> BsdfId {
    let reflectance = m.rgb(COLOR);
    m.add(Bsdf::Diffuse { reflectance })
}

fn brushed(m: &mut Materials) -> BsdfId {
    gold(m, GGX, true, (0.15, 0.4), WHITE)
}

fn gold(
    m: &mut Materials,
    distribution: MicrofacetKind,
    sample_visible: bool,
    alpha: (f32, f32),
    specular: [f32; 3],
) -> BsdfId {
    let (eta, k) = metal("Au").expect("gold is known");
    let bsdf = Bsdf::RoughConductor {
        distribution,
        sample_visible,
        alpha_u: m.scalar(alpha.0),
        alpha_v: m.scalar(alpha.1),
        eta: m.rgb(eta.to_array()),
        k: m.rgb(k.to_array()),
        specular_reflectance: m.rgb(specular),
    };
    m.add(bsdf)
}

fn glass(
    m: &mut Materials,
    distribution: MicrofacetKind,
    sample_visible: bool,
    alpha: (f32, f32),
    specular: [[f32; 3]; 2],
) -> BsdfId {
    let bsdf = Bsdf::RoughDielectric {
        distribution,
        sample_visible,
        alpha_u: m.scalar(alpha.0),
        alpha_v: m.scalar(alpha.1),
        eta: 1.5,
        specular_reflectance: m.rgb(specular[0]),
        specular_transmittance: m.rgb(specular[1]),
    };
    m.add(bsdf)
}

fn plastic(m: &mut Materials, nonlinear: bool, specular: [f32; 3]) -> BsdfId {
    let bsdf = Bsdf::Plastic {
        eta: 1.5,
        diffuse_reflectance: m.rgb(COLOR),
        specular_reflectance: m.rgb(specular),
        nonlinear,
    };
    m.add(bsdf)
}

fn rough_plastic(
    m: &mut Materials,
    distribution: MicrofacetKind,
    sample_visible: bool,
    alpha: f32,
    (nonlinear, specular): (bool, [f32; 3]),
) -> BsdfId {
    let bsdf = Bsdf::RoughPlastic {
        distribution,
        sample_visible,
        alpha,
        eta: 1.5,
        diffuse_reflectance: m.rgb(COLOR),
        specular_reflectance: m.rgb(specular),
        nonlinear,
    };
    m.add(bsdf)
}

/// Mitsuba's defaults but for the colour.
pub(super) fn plain_principled(m: &mut Materials) -> Principled {
    let zero = m.scalar(0.0);
    Principled {
        base_color: m.rgb(COLOR),
        roughness: m.scalar(0.5),
        anisotropic: zero,
        metallic: zero,
        spec_trans: zero,
        spec_tint: zero,
        sheen: zero,
        sheen_tint: zero,
        flatness: zero,
        clearcoat: zero,
        clearcoat_gloss: zero,
        eta: eta_of_specular(0.5),
        diffuse_reflectance_sampling_rate: 1.0,
        main_specular_sampling_rate: 1.0,
        clearcoat_sampling_rate: 1.0,
    }
}

/// The index with the reflectance `0.08·specular` at normal incidence.
fn eta_of_specular(specular: f32) -> f32 {
    2.0 / (1.0 - (0.08 * specular).sqrt()) - 1.0
}

/// Height 0.5·column - 0.25·row over 4 by 4 pixels.
fn height(m: &mut Materials) -> TextureId {
    let pixel = |i: i32| (i % 4) as f32 * 0.5 - (i / 4) as f32 * 0.25;
    bitmap(m, (4, 4, 1), (0..16).map(pixel).collect())
}

fn bitmap(
    m: &mut Materials,
    (width, height, channels): (usize, usize, usize),
    data: Vec<f32>,
) -> TextureId {
    m.textures.images.push(Image { width, height, channels, data });
    m.textures.textures.push(Texture::Bitmap {
        image: ImageId(m.textures.images.len() as u32 - 1),
        filter: TextureFilter::Bilinear,
        wrap: WrapMode::Repeat,
        to_uv: UvTransform::IDENTITY,
        scale: 1.0,
    });
    TextureId(m.textures.textures.len() as u32 - 1)
}
