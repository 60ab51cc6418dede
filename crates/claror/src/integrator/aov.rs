//! Layers that describe the visible surface instead of its light (Mitsuba's `aov`).

use crate::interaction::{Detail, SurfaceDerivatives, SurfaceInteraction};
use crate::math::{Ray, Vec3};
use crate::scene::Scene;

/// A further layer of the picture.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Aov {
    /// Name of the layer.
    pub name: String,
    /// What it holds.
    pub kind: AovKind,
}

/// What a layer holds, of the first surface that the camera ray meets; zero where it meets none.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum AovKind {
    /// Diffuse albedo.
    Albedo,
    /// Distance along the camera ray from the near clip plane, scene units.
    Depth,
    /// Position, world space.
    Position,
    /// Texture coordinates.
    Uv,
    /// Geometric normal, world space.
    GeometricNormal,
    /// Shading normal, world space.
    ShadingNormal,
    /// Derivative of the position by u.
    DpDu,
    /// Derivative of the position by v.
    DpDv,
    /// Index of the triangle in its mesh; of the pixel's first sample.
    PrimitiveIndex,
    /// Index of the shape in the scene; of the pixel's first sample.
    ShapeIndex,
}

impl AovKind {
    /// All kinds.
    pub const ALL: [Self; 10] = [
        Self::Albedo,
        Self::Depth,
        Self::Position,
        Self::Uv,
        Self::GeometricNormal,
        Self::ShadingNormal,
        Self::DpDu,
        Self::DpDv,
        Self::PrimitiveIndex,
        Self::ShapeIndex,
    ];

    /// The name in Mitsuba's `aovs` parameter.
    pub fn name(self) -> &'static str {
        match self {
            Self::Albedo => "albedo",
            Self::Depth => "depth",
            Self::Position => "position",
            Self::Uv => "uv",
            Self::GeometricNormal => "geo_normal",
            Self::ShadingNormal => "sh_normal",
            Self::DpDu => "dp_du",
            Self::DpDv => "dp_dv",
            Self::PrimitiveIndex => "prim_index",
            Self::ShapeIndex => "shape_index",
        }
    }

    /// The kind with that name in Mitsuba's `aovs` parameter.
    pub fn from_name(name: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|kind| kind.name() == name)
    }

    /// The layer's name where the user gives none: the usual one of renderers and denoisers.
    pub fn default_layer(self) -> &'static str {
        match self {
            Self::Albedo => "Albedo",
            Self::Depth => "Z",
            Self::Position => "P",
            Self::Uv => "uv",
            Self::GeometricNormal => "N",
            Self::ShadingNormal => "Ns",
            Self::DpDu => "dPdu",
            Self::DpDv => "dPdv",
            Self::PrimitiveIndex => "primitive",
            Self::ShapeIndex => "shape",
        }
    }

    /// Suffixes of the layer's channels, as Mitsuba names them.
    pub fn channels(self) -> &'static [&'static str] {
        match self {
            Self::Albedo => &["R", "G", "B"],
            Self::Depth => &["T"],
            Self::Uv => &["U", "V"],
            Self::PrimitiveIndex | Self::ShapeIndex => &["I"],
            _ => &["X", "Y", "Z"],
        }
    }

    /// Whether it is an index, which is taken from the first sample instead of averaged.
    pub fn is_index(self) -> bool {
        matches!(self, Self::PrimitiveIndex | Self::ShapeIndex)
    }
}

/// Values of the layers `aovs` along the camera ray, all channels in a row; `values` is
/// overwritten.
pub fn eval_aovs(scene: &Scene, aovs: &[Aov], ray: &Ray, values: &mut Vec<f32>) {
    values.clear();
    let hit = scene.intersect_with(ray, Detail::Derivatives);
    for aov in aovs {
        match &hit {
            Some(si) => push(scene, aov.kind, si, values),
            None => values.extend(aov.kind.channels().iter().map(|_| 0.0)),
        }
    }
}

fn push(scene: &Scene, kind: AovKind, si: &SurfaceInteraction, values: &mut Vec<f32>) {
    let dp = |which: fn(&SurfaceDerivatives) -> Vec3| {
        si.derivatives.as_ref().map_or(Vec3::ZERO, which).to_array()
    };
    match kind {
        AovKind::Albedo => {
            let tables = &scene.tables;
            let bsdf = tables.shapes.shapes[si.shape.0 as usize].bsdf;
            let bsdf = tables.bsdfs.at_hit(&tables.textures, &tables.shapes, bsdf, si);
            values.extend(bsdf.albedo().to_array());
        }
        AovKind::Depth => values.push(si.t),
        AovKind::Position => values.extend(si.p.to_array()),
        AovKind::Uv => values.extend(si.uv.to_array()),
        AovKind::GeometricNormal => values.extend(si.ng.to_array()),
        AovKind::ShadingNormal => values.extend(si.frame.n.to_array()),
        AovKind::DpDu => values.extend(dp(|d| d.dp_du)),
        AovKind::DpDv => values.extend(dp(|d| d.dp_dv)),
        // Exact up to 2^24, as any index that is stored as f32.
        AovKind::PrimitiveIndex => values.push(si.primitive as f32),
        AovKind::ShapeIndex => values.push(si.shape.0 as f32),
    }
}
