//! Provisional: uniform choice among area lights (rectangles, spheres, even meshes) and a constant
//! environment, to be replaced by the real light sampling.
#![allow(missing_docs, clippy::all, reason = "provisional")]

use super::*;
use crate::interaction::SurfaceInteraction;
use crate::math::{Bounds3, Vec2};
use crate::scene::SceneTables;
use crate::shape::ShapeKind;
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum LightError {
    #[error("x")]
    X,
}
#[derive(Debug, Clone, Copy)]
pub struct LightReference {
    pub p: Vec3,
    pub n: Option<Vec3>,
}
#[derive(Debug, Clone, Copy)]
pub struct LightSample {
    pub wi: Vec3,
    pub distance: f32,
    pub radiance: Rgb,
    pub pdf: f32,
    pub is_delta: bool,
    pub target: Option<(Vec3, Vec3)>,
}
#[derive(Debug)]
pub struct LightSampler {
    areas: Vec<f32>,
    ids: Vec<ShapeId>,
    env: Option<Rgb>,
}
impl LightSampler {
    pub fn build(t: &SceneTables, _b: Bounds3) -> Result<Self, LightError> {
        let ids = t
            .emitters
            .emitters
            .iter()
            .filter_map(|e| if let Emitter::Area { shape, .. } = e { Some(*shape) } else { None })
            .collect();
        let env = t.emitters.emitters.iter().find_map(|e| {
            if let Emitter::Constant { radiance } = e { Some(*radiance) } else { None }
        });
        let areas =
            (0..t.shapes.shapes.len()).map(|i| t.shapes.surface_area(ShapeId(i as u32))).collect();
        Ok(Self { areas, ids, env })
    }
    pub fn has_environment(&self) -> bool {
        self.env.is_some()
    }
    fn n(&self) -> f32 {
        self.ids.len() as f32 + if self.env.is_some() { 1.0 } else { 0.0 }
    }
    pub fn sample(
        &self,
        t: &SceneTables,
        r: &LightReference,
        us: f32,
        u: Vec2,
    ) -> Option<LightSample> {
        let n = self.n();
        if n == 0.0 {
            return None;
        }
        let k = ((us * n) as usize).min(n as usize - 1);
        if k >= self.ids.len() {
            let z = 1.0 - 2.0 * u.x;
            let rr = (1.0 - z * z).max(0.0).sqrt();
            let ph = std::f32::consts::TAU * u.y;
            return Some(LightSample {
                wi: Vec3::new(rr * ph.cos(), rr * ph.sin(), z),
                distance: f32::INFINITY,
                radiance: self.env?,
                pdf: 1.0 / (4.0 * std::f32::consts::PI) / n,
                is_delta: false,
                target: None,
            });
        }
        let id = self.ids[k];
        let shape = &t.shapes.shapes[id.0 as usize];
        let (p, ng, area) = match &shape.kind {
            ShapeKind::Rectangle(tr) => {
                let p = tr.point((u * 2.0 - Vec2::ONE).extend(0.0));
                let nn = tr.normal(Vec3::Z).normalize();
                (p, nn, self.areas[id.0 as usize])
            }
            ShapeKind::Mesh(m) => {
                let mesh = &t.shapes.meshes[m.0 as usize];
                let x = u.x * mesh.triangles.len() as f32;
                let tri = (x as usize).min(mesh.triangles.len() - 1);
                let ux = x - tri as f32;
                let [a, b, c] = mesh.triangles[tri].map(|i| mesh.positions[i as usize]);
                let s = ux.sqrt();
                let (b1, b2) = (1.0 - s, u.y * s);
                let p = a + (b - a) * b1 + (c - a) * b2;
                let cr = (b - a).cross(c - a);
                (p, cr.normalize(), 0.5 * cr.length() * mesh.triangles.len() as f32)
            }
            ShapeKind::Disk(tr) => {
                let p = Vec2::from_angle(std::f32::consts::TAU * u.y) * u.x.sqrt();
                (tr.point(p.extend(0.0)), tr.normal(Vec3::Z).normalize(), self.areas[id.0 as usize])
            }
            ShapeKind::Sphere(tr) => {
                let z = 1.0 - 2.0 * u.x;
                let rr = (1.0 - z * z).max(0.0).sqrt();
                let ph = std::f32::consts::TAU * u.y;
                let l = Vec3::new(rr * ph.cos(), rr * ph.sin(), z);
                (tr.point(l), tr.normal(l).normalize(), self.areas[id.0 as usize])
            }
            _ => return None,
        };
        let ng = if shape.flip_normals { -ng } else { ng };
        let d = p - r.p;
        let dist = d.length();
        let wi = d / dist;
        let c = -wi.dot(ng);
        if c <= 0.0 {
            return None;
        }
        let Emitter::Area { radiance, .. } = &t.emitters.emitters[shape.emitter?.0 as usize] else {
            return None;
        };
        Some(LightSample {
            wi,
            distance: dist,
            radiance: t.textures.constant(*radiance)?,
            pdf: dist * dist / (c * area) / n,
            is_delta: false,
            target: Some((p, ng * 1e-4 * dist)),
        })
    }
    pub fn pdf_surface(
        &self,
        t: &SceneTables,
        _r: &LightReference,
        wi: Vec3,
        hit: &SurfaceInteraction,
    ) -> f32 {
        let shape = &t.shapes.shapes[hit.shape.0 as usize];
        let c = -wi.dot(hit.ng);
        if shape.emitter.is_none() || c <= 0.0 {
            return 0.0;
        }
        let area = match &shape.kind {
            ShapeKind::Mesh(m) => {
                let mesh = &t.shapes.meshes[m.0 as usize];
                mesh.triangle_area(hit.primitive) * mesh.triangles.len() as f32
            }
            _ => self.areas[hit.shape.0 as usize],
        };
        hit.t * hit.t / (c * area) / self.n()
    }
    pub fn pdf_environment(&self, _t: &SceneTables, _r: &LightReference, _wi: Vec3) -> f32 {
        1.0 / (4.0 * std::f32::consts::PI) / self.n()
    }
    pub fn environment_radiance(&self, _t: &SceneTables, _d: Vec3) -> Rgb {
        self.env.unwrap_or(Rgb::BLACK)
    }
    pub fn emitted_radiance(&self, t: &SceneTables, si: &SurfaceInteraction) -> Rgb {
        let Some(e) = t.shapes.shapes[si.shape.0 as usize].emitter else { return Rgb::BLACK };
        if si.wo.dot(si.frame.n) <= 0.0 {
            return Rgb::BLACK;
        }
        let Emitter::Area { radiance, .. } = &t.emitters.emitters[e.0 as usize] else {
            return Rgb::BLACK;
        };
        t.textures.constant(*radiance).unwrap_or(Rgb::BLACK)
    }
}
