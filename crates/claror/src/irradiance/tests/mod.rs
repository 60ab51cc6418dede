//! Tests against closed forms and finite differences in scenes whose irradiance is known exactly.

mod clamps;
mod corrals;
mod criteria;
mod gradients;
mod hemispheres;
mod indices;
mod inspections;
mod lookups;
mod rotations;
mod scene;
mod smoothing;

use super::{
    Criterion, Estimates, Hemisphere, MeshSettings, MeshTopology, Radii, RadiusBounds,
    RadiusSettings, mesh_derivatives,
};

/// All that a record is made from.
fn estimates(hemisphere: &Hemisphere, far: f32) -> Estimates {
    let (n, _) = hemisphere.grid.size();
    let settings = MeshSettings::new(far);
    let d = mesh_derivatives(hemisphere, &MeshTopology::new(n), &settings).expect("same grid");
    Estimates { translational: d.gradient, hessian: d.hessian, ..Estimates::new(hemisphere) }
}

const ALL: [Criterion; 6] = [
    Criterion::Thesis,
    Criterion::Ward88,
    Criterion::Ward92,
    Criterion::Tabellion04,
    Criterion::Krivanek06,
    Criterion::Hessian,
];

fn radii_of(criterion: Criterion, estimates: &Estimates, scale: f32) -> Radii {
    let bounds = RadiusBounds { least: 0.03 * scale, largest: scale, reference: 0.1 * scale };
    super::radii(estimates, &bounds, &RadiusSettings::new(criterion))
}
