//! `principled`: one model for most materials (Burley 2012: Physically based shading at Disney;
//! Burley 2015: Extending the Disney BRDF to a BSDF with integrated subsurface scattering), with
//! Mitsuba 3's choices where the notes leave some.
//!
//! | parameter | unit | default | |
//! |---|---|---|---|
//! | `base_color` | 1 | 0.5 | colour |
//! | `roughness` | 1 | 0.5 | square root of the facets' slope |
//! | `anisotropic` | 1 | 0 | 0 isotropic, 1 stretched along u |
//! | `metallic` | 1 | 0 | 0 dielectric, 1 metal |
//! | `spec_trans` | 1 | 0 | 0 opaque, 1 glass |
//! | `eta` or `specular` | 1 | `specular` 0.5 | index of refraction, or its reflectance over 0.08 |
//! | `spec_tint` | 1 | 0 | the dielectric's reflection takes the base colour |
//! | `sheen`, `sheen_tint` | 1 | 0 | cloth's light at grazing angles, and its colour |
//! | `flatness` | 1 | 0 | diffuse reflection becomes that of thin subsurface scattering |
//! | `clearcoat`, `clearcoat_gloss` | 1 | 0 | a coat of varnish, and how smooth it is |
//! | `..._sampling_rate` | 1 | 1 | how often the component is sampled, relative to the others |
//!
//! The base is opaque from behind unless `spec_trans > 0`: then inside and outside are told
//! apart, and only the interface itself is seen from inside.

use std::f32::consts::{FRAC_1_PI, PI, TAU};

use super::MicrofacetKind;
use super::fresnel;
use super::lobe::{LobeEval, LobeSample};
use super::microfacet::Microfacets;
use super::rough_dielectric::refraction_jacobian;
use crate::math::{Vec2, Vec3, warp};
use crate::spectrum::Rgb;

/// Roughness of the coat for the shadowing of its facets (Burley 2012, §5.6).
const COAT_SHADOWING_ALPHA: f32 = 0.25;
/// Reflectance of the coat at normal incidence: index 1.5.
const COAT_R0: f32 = 0.04;

#[derive(Debug, Clone, Copy)]
pub(super) struct PrincipledLobe {
    pub(super) base_color: Rgb,
    pub(super) roughness: f32,
    pub(super) anisotropic: f32,
    pub(super) metallic: f32,
    pub(super) spec_trans: f32,
    pub(super) spec_tint: f32,
    pub(super) sheen: f32,
    pub(super) sheen_tint: f32,
    pub(super) flatness: f32,
    pub(super) clearcoat: f32,
    pub(super) clearcoat_gloss: f32,
    pub(super) eta: f32,
    pub(super) diffuse_rate: f32,
    pub(super) specular_rate: f32,
    pub(super) clearcoat_rate: f32,
}

/// One pair of directions: what all components need.
struct Geometry {
    wo: Vec3,
    wi: Vec3,
    /// Microfacet normal, turned outwards.
    m: Vec3,
    /// Whether the viewer is outside.
    is_front: bool,
    is_reflection: bool,
    /// Whether both directions see that side of the facet that they see of the surface.
    is_compatible: bool,
    /// Dielectric Fresnel reflectance at the facet.
    fresnel: f32,
}

/// Probabilities of the components.
struct Probabilities {
    diffuse: f32,
    clearcoat: f32,
    transmission: f32,
    reflection: f32,
}

impl PrincipledLobe {
    pub(super) fn eval(&self, wo: Vec3, wi: Vec3) -> LobeEval {
        let Some(g) = self.geometry(wo, wi) else {
            return LobeEval::ZERO;
        };
        let facets = self.facets();
        let d = facets.d(g.m);
        let mut value = self.eval_interface(&g, &facets, d);
        if g.is_front && g.is_reflection {
            value += self.eval_clearcoat(&g) + self.eval_diffuse(&g) + self.eval_sheen(&g);
        }
        LobeEval { value, diffuse: Rgb::BLACK, pdf: self.pdf(&g, &facets, d) }
    }

    pub(super) fn sample(&self, wo: Vec3, u_component: f32, u: Vec2) -> Option<LobeSample> {
        let is_front = wo.z > 0.0;
        if wo.z == 0.0 || (!is_front && self.transmitting() <= 0.0) {
            return None;
        }
        let m = self.facets().sample(if is_front { wo } else { -wo }, u);
        let f = fresnel::dielectric(wo.dot(m), self.eta);
        let p = self.probabilities(is_front, f.reflectance);
        let mut u_component = u_component;
        let mut chosen = |probability: f32| {
            let is_chosen = u_component < probability;
            u_component -= probability;
            is_chosen
        };
        let (wi, eta) = if chosen(p.diffuse) {
            (warp::cosine_hemisphere(u), 1.0)
        } else if chosen(p.clearcoat) {
            (fresnel::reflect_at(wo, self.sample_clearcoat_normal(u)), 1.0)
        } else if chosen(p.transmission) {
            (fresnel::refract_at(wo, m, &f), f.eta_it)
        } else {
            (fresnel::reflect_at(wo, m), 1.0)
        };
        if (wi.z * wo.z > 0.0) != (eta == 1.0) {
            return None;
        }
        LobeSample::smooth(wi, self.eval(wo, wi), eta)
    }

    fn geometry(&self, wo: Vec3, wi: Vec3) -> Option<Geometry> {
        let side = wo.z * wi.z;
        let is_front = wo.z > 0.0;
        if side == 0.0 || (!is_front && self.transmitting() <= 0.0) {
            return None;
        }
        let is_reflection = side > 0.0;
        let eta = if is_reflection { 1.0 } else { self.eta_path(is_front) };
        let m = (wo + wi * eta).normalize_or_zero();
        let m = m * 1.0_f32.copysign(m.z);
        let (cos_o, cos_i) = (wo.dot(m), wi.dot(m));
        Some(Geometry {
            wo,
            wi,
            m,
            is_front,
            is_reflection,
            is_compatible: cos_o * wo.z > 0.0 && cos_i * wi.z > 0.0,
            fresnel: fresnel::dielectric(cos_o, self.eta).reflectance,
        })
    }

    /// The main specular component: reflected or refracted at the interface or the metal.
    fn eval_interface(&self, g: &Geometry, facets: &Microfacets, d: f32) -> Rgb {
        if !g.is_compatible {
            return Rgb::BLACK;
        }
        let shape = d * facets.g1(g.wo, g.m) * facets.g1(g.wi, g.m);
        if g.is_reflection {
            // As in Mitsuba, an interface of index 1 reflects nothing even where it is metal.
            if g.fresnel <= 0.0 {
                return Rgb::BLACK;
            }
            return self.reflectance(g) * (shape / (4.0 * g.wo.z.abs()));
        }
        let (cos_o, cos_i) = (g.wo.dot(g.m), g.wi.dot(g.m));
        let eta = self.eta_path(g.is_front);
        let jacobian = refraction_jacobian(cos_o, cos_i, eta);
        let scale = (1.0 - g.fresnel) * shape * (cos_o / g.wo.z).abs() * jacobian / (eta * eta);
        self.base_color.map(f32::sqrt) * (self.transmitting() * scale)
    }

    /// Fresnel reflectance: true for the dielectric, Schlick's for metal and tint.
    fn reflectance(&self, g: &Geometry) -> Rgb {
        if !g.is_front {
            return Rgb::splat(self.transmitting() * g.fresnel);
        }
        let cos = g.wo.dot(g.m);
        let dielectric = (1.0 - self.metallic) * (1.0 - self.spec_tint) * g.fresnel;
        let mut sum = Rgb::splat(dielectric);
        if self.metallic > 0.0 {
            sum += self.schlick(self.base_color, cos) * self.metallic;
        }
        if self.spec_tint > 0.0 {
            let eta = if cos >= 0.0 { self.eta } else { 1.0 / self.eta };
            let r0 = ((eta - 1.0) / (eta + 1.0)) * ((eta - 1.0) / (eta + 1.0));
            let share = (1.0 - self.metallic) * self.spec_tint;
            sum += self.schlick(self.tint() * r0, cos) * share;
        }
        sum
    }

    /// Varnish: an isotropic lobe with a long tail and a quarter of the strength.
    fn eval_clearcoat(&self, g: &Geometry) -> Rgb {
        if self.clearcoat <= 0.0 || !g.is_compatible {
            return Rgb::BLACK;
        }
        let f = self.schlick(Rgb::splat(COAT_R0), g.wo.dot(g.m));
        let shadowing = coat_g1(g.wo, g.m) * coat_g1(g.wi, g.m);
        // Burley's clearcoat has no 1/(4 cos cos).
        f * (0.25 * self.clearcoat * self.clearcoat_d(g.m) * shadowing * g.wi.z.abs())
    }

    /// Diffuse reflection with retro-reflection, or flattened (Burley 2015, §4 and §5).
    fn eval_diffuse(&self, g: &Geometry) -> Rgb {
        let share = self.diffuse();
        if share <= 0.0 {
            return Rgb::BLACK;
        }
        let (cos_o, cos_i) = (g.wo.z.abs(), g.wi.z.abs());
        let (f_o, f_i) = (schlick_weight(cos_o), schlick_weight(cos_i));
        let lambert = (1.0 - 0.5 * f_o) * (1.0 - 0.5 * f_i);
        let cos_d = g.m.dot(g.wi);
        let rr = 2.0 * self.roughness * cos_d * cos_d;
        let retro = rr * (f_i + f_o + f_i * f_o * (rr - 1.0));
        let mut shape = lambert + retro;
        if self.flatness > 0.0 {
            // Hanrahan and Krueger 1993, as approximated in Burley 2012.
            let fss90 = 0.5 * rr;
            let fss = (1.0 + (fss90 - 1.0) * f_i) * (1.0 + (fss90 - 1.0) * f_o);
            let flat = 1.25 * (fss * (1.0 / (cos_i + cos_o) - 0.5) + 0.5);
            shape += (flat - shape) * self.flatness;
        }
        self.base_color * (share * cos_i * FRAC_1_PI * shape)
    }

    fn eval_sheen(&self, g: &Geometry) -> Rgb {
        let share = self.sheen * (1.0 - self.metallic);
        if share <= 0.0 {
            return Rgb::BLACK;
        }
        let f = schlick_weight(g.m.dot(g.wi).abs());
        let color = Rgb::WHITE.lerp(self.tint(), self.sheen_tint);
        color * (share * f * g.wi.z.abs())
    }

    fn pdf(&self, g: &Geometry, facets: &Microfacets, d: f32) -> f32 {
        let p = self.probabilities(g.is_front, g.fresnel);
        let outer = if g.is_front { g.wo } else { -g.wo };
        let (cos_o, cos_i) = (g.wo.dot(g.m), g.wi.dot(g.m));
        if !g.is_reflection {
            if !g.is_compatible {
                return 0.0;
            }
            let jacobian = refraction_jacobian(cos_o, cos_i, self.eta_path(g.is_front));
            return p.transmission * facets.pdf(outer, g.m, d) * jacobian;
        }
        let mut pdf = p.diffuse * warp::cosine_hemisphere_pdf(g.wi.z.abs());
        if g.is_compatible {
            let mut normals = p.reflection * facets.pdf(outer, g.m, d);
            if p.clearcoat > 0.0 {
                normals += p.clearcoat * self.clearcoat_d(g.m) * g.m.z;
            }
            pdf += normals / (4.0 * cos_i.abs());
        }
        pdf
    }

    /// Probabilities of the components; `fresnel` is the reflectance at the facet. From inside
    /// there is the interface only.
    fn probabilities(&self, is_front: bool, fresnel: f32) -> Probabilities {
        if !is_front {
            let (reflection, transmission) = (fresnel, 1.0 - fresnel);
            return Probabilities { diffuse: 0.0, clearcoat: 0.0, transmission, reflection };
        }
        let transmission = self.specular_rate * self.transmitting() * (1.0 - fresnel);
        let reflection = self.specular_rate - transmission;
        let clearcoat = 0.25 * self.clearcoat * self.clearcoat_rate;
        let diffuse = self.diffuse() * self.diffuse_rate;
        let total = transmission + reflection + clearcoat + diffuse;
        let scale = if total > 0.0 { 1.0 / total } else { 0.0 };
        Probabilities {
            diffuse: diffuse * scale,
            clearcoat: clearcoat * scale,
            transmission: transmission * scale,
            reflection: reflection * scale,
        }
    }

    /// Share of the diffuse base.
    fn diffuse(&self) -> f32 {
        (1.0 - self.metallic) * (1.0 - self.spec_trans)
    }

    /// Share of glass.
    fn transmitting(&self) -> f32 {
        (1.0 - self.metallic) * self.spec_trans
    }

    /// Index of the far side over that of the viewer's side.
    fn eta_path(&self, is_front: bool) -> f32 {
        if is_front { self.eta } else { 1.0 / self.eta }
    }

    /// The base colour at luminance 1; white for black.
    fn tint(&self) -> Rgb {
        let luminance = self.base_color.luminance();
        if luminance > 0.0 { self.base_color / luminance } else { Rgb::WHITE }
    }

    fn facets(&self) -> Microfacets {
        let aspect = (1.0 - 0.9 * self.anisotropic).sqrt();
        let alpha = self.roughness * self.roughness;
        let (u, v) = ((alpha / aspect).max(1e-3), (alpha * aspect).max(1e-3));
        Microfacets::new(MicrofacetKind::Ggx, true, u, v)
    }

    /// Schlick's approximation; from the denser side with the cosine of the refracted direction.
    fn schlick(&self, r0: Rgb, cos: f32) -> Rgb {
        let f = fresnel::dielectric(cos, self.eta);
        let cos = if f.eta_it > 1.0 { cos.abs() } else { f.cos_theta_t.abs() };
        r0.lerp(Rgb::WHITE, schlick_weight(cos))
    }

    fn clearcoat_alpha(&self) -> f32 {
        0.1 + (0.001 - 0.1) * self.clearcoat_gloss
    }

    /// The varnish's distribution of normals: generalised Trowbridge-Reitz with exponent 1
    /// (Burley 2012, §B.2).
    fn clearcoat_d(&self, m: Vec3) -> f32 {
        let alpha2 = self.clearcoat_alpha() * self.clearcoat_alpha();
        let d = (alpha2 - 1.0) / (PI * alpha2.ln() * (1.0 + (alpha2 - 1.0) * m.z * m.z));
        if d * m.z > 1e-20 { d } else { 0.0 }
    }

    fn sample_clearcoat_normal(&self, u: Vec2) -> Vec3 {
        let alpha2 = self.clearcoat_alpha() * self.clearcoat_alpha();
        let cos2 = (1.0 - alpha2.powf(1.0 - u.y)) / (1.0 - alpha2);
        let (sin, cos) = ((1.0 - cos2).max(0.0).sqrt(), cos2.max(0.0).sqrt());
        let (sin_phi, cos_phi) = (TAU * u.x).sin_cos();
        Vec3::new(sin * cos_phi, sin * sin_phi, cos)
    }
}

/// (1 - cos)⁵.
fn schlick_weight(cos: f32) -> f32 {
    let m = (1.0 - cos).clamp(0.0, 1.0);
    m * m * m * m * m
}

/// Shadowing of the varnish's facets.
fn coat_g1(w: Vec3, m: Vec3) -> f32 {
    if w.dot(m) * w.z <= 0.0 {
        return 0.0;
    }
    let cos2 = w.z * w.z;
    let tan2 = (1.0 - cos2) / cos2;
    2.0 / (1.0 + (1.0 + COAT_SHADOWING_ALPHA * COAT_SHADOWING_ALPHA * tan2).sqrt())
}
