//! Layers that describe the visible surface instead of its light (Mitsuba's `aov`), and what the
//! irradiance cache does there.

use super::IrradianceCache;
use crate::interaction::{Detail, SurfaceDerivatives, SurfaceInteraction};
use crate::irradiance::{Inspection, Miss};
use crate::math::{Ray, Vec3};
use crate::sampler::Sampler;
use crate::scene::Scene;
use crate::spectrum::Rgb;

/// A further layer of the picture.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Aov {
    /// Name of the layer.
    pub name: String,
    /// What it holds.
    pub kind: AovKind,
}

/// What a layer holds, of the first surface that the camera ray meets; zero where it meets none.
/// Those of the irradiance cache are of the first diffuse surface, mirrors and glass followed as
/// the picture follows them, and zero where no record serves it.
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
    /// Interpolated irradiance, W·m⁻².
    Irradiance,
    /// Weighted harmonic mean of the records' harmonic mean distances, scene units; at most the
    /// diagonal of the scene's box, since it is infinite where nothing is seen.
    HarmonicMeanDistance,
    /// Weighted mean of the records' first radii, scene units.
    RecordRadius,
    /// Records that the look-up uses.
    RecordCount,
    /// Sum of the records' weights; also where it does not suffice.
    LookupWeight,
    /// 0 where the cache serves the point, else why not, see [`AovKind::miss_code`]; of the pixel's
    /// first sample.
    CacheMiss,
}

impl AovKind {
    /// All kinds.
    pub const ALL: [Self; 16] = [
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
        Self::Irradiance,
        Self::HarmonicMeanDistance,
        Self::RecordRadius,
        Self::RecordCount,
        Self::LookupWeight,
        Self::CacheMiss,
    ];

    /// The name in the `aovs` parameter: Mitsuba's, where Mitsuba knows it.
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
            Self::Irradiance => "irradiance",
            Self::HarmonicMeanDistance => "harmonic_mean_distance",
            Self::RecordRadius => "record_radius",
            Self::RecordCount => "record_count",
            Self::LookupWeight => "lookup_weight",
            Self::CacheMiss => "cache_miss",
        }
    }

    /// The kind with that name.
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
            _ => self.name(),
        }
    }

    /// Suffixes of the layer's channels, as Mitsuba names them.
    pub fn channels(self) -> &'static [&'static str] {
        match self {
            Self::Albedo | Self::Irradiance => &["R", "G", "B"],
            Self::Depth | Self::HarmonicMeanDistance | Self::RecordRadius => &["T"],
            Self::Uv => &["U", "V"],
            Self::PrimitiveIndex | Self::ShapeIndex | Self::CacheMiss => &["I"],
            Self::RecordCount => &["N"],
            Self::LookupWeight => &["W"],
            _ => &["X", "Y", "Z"],
        }
    }

    /// Whether it is an index, which is taken from the first sample instead of averaged.
    pub fn is_index(self) -> bool {
        matches!(self, Self::PrimitiveIndex | Self::ShapeIndex | Self::CacheMiss)
    }

    /// Whether it tells of the irradiance cache.
    pub fn needs_cache(self) -> bool {
        matches!(
            self,
            Self::Irradiance
                | Self::HarmonicMeanDistance
                | Self::RecordRadius
                | Self::RecordCount
                | Self::LookupWeight
                | Self::CacheMiss
        )
    }

    /// The value of [`AovKind::CacheMiss`]: 0 served, 1 no record reaches the point, 2 those that
    /// do face elsewhere, 3 they lie in front of it, 4 their weight does not suffice, 5 the cache
    /// is not asked, because there is no diffuse surface or it lies beyond `max_depth`.
    pub fn miss_code(inspection: Option<&Inspection>) -> u8 {
        match inspection.map(|i| i.found) {
            Some(Ok(_)) => 0,
            Some(Err(Miss::NoneNear)) => 1,
            Some(Err(Miss::Turned)) => 2,
            Some(Err(Miss::InFront)) => 3,
            Some(Err(Miss::LittleWeight)) => 4,
            None => 5,
        }
    }
}

/// Values of the layers `aovs` along the camera ray, all channels in a row; `values` is
/// overwritten. `sampler` is that of the ray's sample, and rays traced are added to `rays`.
pub fn eval_aovs(
    scene: &Scene,
    cache: Option<&IrradianceCache>,
    aovs: &[Aov],
    ray: &Ray,
    sampler: &mut Sampler,
    rays: &mut u64,
    values: &mut Vec<f32>,
) {
    values.clear();
    let wants = |of_cache: bool| aovs.iter().any(|aov| aov.kind.needs_cache() == of_cache);
    let hit = if wants(false) {
        *rays += 1;
        scene.intersect_with(ray, Detail::Derivatives)
    } else {
        None
    };
    let inspection = match cache {
        Some(cache) if wants(true) => cache.inspect_seen(scene, ray, sampler, rays),
        _ => None,
    };
    for aov in aovs {
        match &hit {
            _ if aov.kind.needs_cache() => {
                push_cached(scene, aov.kind, inspection.as_ref(), values);
            }
            Some(si) => push(scene, aov.kind, si, values),
            None => values.extend(aov.kind.channels().iter().map(|_| 0.0)),
        }
    }
}

fn push_cached(
    scene: &Scene,
    kind: AovKind,
    inspection: Option<&Inspection>,
    values: &mut Vec<f32>,
) {
    let of = |value: fn(&Inspection) -> f32| inspection.map_or(0.0, value);
    match kind {
        AovKind::Irradiance => {
            let found = inspection.and_then(|i| i.found.ok());
            values.extend(found.map_or(Rgb::BLACK, |found| found.irradiance).to_array());
        }
        AovKind::HarmonicMeanDistance => {
            let farthest = scene.accel.bounds().extent().length();
            let distance = inspection.filter(|i| i.records > 0).map(|i| i.harmonic_mean_distance);
            values.push(distance.map_or(0.0, |distance| distance.min(farthest)));
        }
        AovKind::RecordRadius => values.push(of(|i| i.radius)),
        AovKind::RecordCount => values.push(of(|i| i.records as f32)),
        AovKind::LookupWeight => values.push(of(|i| i.weight)),
        _ => values.push(f32::from(AovKind::miss_code(inspection))),
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
        // See `push_cached`.
        AovKind::Irradiance
        | AovKind::HarmonicMeanDistance
        | AovKind::RecordRadius
        | AovKind::RecordCount
        | AovKind::LookupWeight
        | AovKind::CacheMiss => {}
    }
}
