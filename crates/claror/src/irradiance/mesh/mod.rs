//! Gradient and Hessian of irradiance from the triangulated hemisphere.
//!
//! Neighbouring hit points are joined to a mesh around the receiver, each piece with a radiance,
//! and the mesh is treated as fixed geometry while the receiver moves: what the derivatives of
//! polygons' form factors then say includes the change of occlusion (Schwarzhaupt, Jensen and
//! Jarosz 2012: Practical Hessian-based error control for irradiance caching). Vertical strips
//! between the outermost hit points and the tangent plane close the mesh, so that constant
//! radiance has no derivatives at all.
//!
//! # Where radiance changes
//!
//! Only the lines matter along which radiance changes. A triangle whose corners lie on different
//! surfaces has such a line inside. The published rule gives the triangle the radiance of the
//! farthest corner, which puts the line on the nearer surface: right where one surface hides the
//! other, but a bias of half a cell where two surfaces meet. [`MeshRule::Surfaces`] asks the hit
//! points' normals instead: if the two tangent planes meet between the samples, that is where the
//! line is; if not, one surface hides the other, and the line is half way and on the nearer one.
//! Triangles on one surface get the mean of their corners. `tests::gradients` has the errors of
//! all rules in rooms with exact values.

mod edge;
mod samples;
mod surface;
#[cfg(test)]
mod tests;
mod topology;

use crate::math::{DVec2, DVec3, Vec2};
use crate::spectrum::Rgb;

use super::hemisphere::Hemisphere;
use edge::EdgeDerivatives;
use samples::{Radiance, combine, mean};
use surface::{Hit, Split};
pub use topology::MeshTopology;

/// How a triangle gets its radiance.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum MeshRule {
    /// That of the farthest corner (Schwarzhaupt, Jensen and Jarosz 2012).
    Farthest,
    /// The mean of the corners: no bias where surfaces meet, wrong where one hides another.
    Average,
    /// By the surfaces that the corners lie on.
    #[default]
    Surfaces,
}

/// What the estimate is asked for.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct MeshSettings {
    /// How triangles get their radiance.
    pub rule: MeshRule,
    /// Distance of misses, scene units; ten scene diameters are far enough to be an environment.
    pub far: f32,
    /// Share of a geometric term in the Hessian, which makes it see occluders that are as dark as
    /// what they hide: radiance plus this times mean radiance times harmonic mean distance over
    /// distance. 0 switches it off.
    pub geometry: f32,
    /// Irradiance (W·m⁻²) added to the record's own in that term, so that it works in the dark.
    pub floor: f32,
}

impl MeshSettings {
    /// The recommended rule, without the geometric term, with misses at the distance `far`.
    pub fn new(far: f32) -> Self {
        Self { rule: MeshRule::default(), far, geometry: 0.0, floor: 0.0 }
    }
}

/// Derivatives of irradiance by the receiver's position, tangential, in its local frame.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Derivatives {
    /// Gradient per channel, W·m⁻³.
    pub gradient: [Vec2; 3],
    /// Second derivatives xx, xy, yy of the luminance (plus the geometric term), W·m⁻⁴.
    pub hessian: [f32; 3],
}

/// Gradient and Hessian; `None` when the topology is not that of the hemisphere's grid.
pub fn mesh_derivatives(
    hemisphere: &Hemisphere,
    topology: &MeshTopology,
    settings: &MeshSettings,
) -> Option<Derivatives> {
    if hemisphere.grid != topology.grid() {
        return None;
    }
    let hits: Vec<Hit> = hemisphere.cells.iter().map(|c| samples::hit(c, settings.far)).collect();
    let radiance = samples::radiance(hemisphere, settings);
    let mut mesh = Mesh { topology, hits, radiance, sum: Sum::default() };
    let splits = mesh.splits(settings.rule);
    mesh.smooth_behind_edges(&splits);
    let faces = mesh.faces(settings.rule, &splits);
    mesh.add_edges(&splits, &faces);
    mesh.add_insides(&splits, &faces);
    mesh.add_rim(&splits, &faces);
    Some(mesh.sum.derivatives())
}

/// Radiance of a face near each of its corners; for the strips of the rim near both ends.
type Face = [Radiance; 3];

struct Mesh<'a> {
    topology: &'a MeshTopology,
    hits: Vec<Hit>,
    radiance: Vec<Radiance>,
    sum: Sum,
}

/// The edges that surfaces divide, by edge.
struct Splits {
    /// Number of the edge's split, or `WHOLE`.
    of_edge: Vec<u32>,
    splits: Vec<Split>,
}

const WHOLE: u32 = u32::MAX;
/// Lines meet at one point when their distances differ by no more than this factor.
const ONE_PLACE: f64 = 1.5;

impl Splits {
    fn get(&self, edge: usize) -> Option<&Split> {
        self.splits.get(self.of_edge[edge] as usize)
    }
}

impl Mesh<'_> {
    fn splits(&self, rule: MeshRule) -> Splits {
        let edges = &self.topology.edges;
        let mut splits = Splits { of_edge: vec![WHOLE; edges.len()], splits: Vec::new() };
        if rule == MeshRule::Surfaces {
            for (index, edge) in edges.iter().enumerate() {
                let (a, b) = (&self.hits[edge.a as usize], &self.hits[edge.b as usize]);
                if let Some(split) = surface::split(a, b) {
                    splits.of_edge[index] = splits.splits.len() as u32;
                    splits.splits.push(split);
                }
            }
        }
        splits
    }

    /// Radiance just behind the edge of an occluder counts more than any other, since the edge
    /// moves faster than what is behind: there it is averaged with neighbours on the same surface,
    /// against noise.
    fn smooth_behind_edges(&mut self, splits: &Splits) {
        if splits.splits.is_empty() {
            return;
        }
        let mut behind = vec![false; self.hits.len()];
        for (index, edge) in self.topology.edges.iter().enumerate() {
            if let Some(split) = splits.get(index) {
                let (a, b) = (split.on_a.length_squared(), split.on_b.length_squared());
                behind[edge.a as usize] |= a > b;
                behind[edge.b as usize] |= b > a;
            }
        }
        let mut sums: Vec<(Radiance, f64)> = self.radiance.iter().map(|&l| (l, 1.0)).collect();
        for (index, edge) in self.topology.edges.iter().enumerate() {
            if splits.get(index).is_none() {
                for (at, other) in [(edge.a, edge.b), (edge.b, edge.a)] {
                    if behind[at as usize] {
                        let (sum, count) = &mut sums[at as usize];
                        *sum = combine(*sum, self.radiance[other as usize], |s, l| s + l);
                        *count += 1.0;
                    }
                }
            }
        }
        for (k, (sum, count)) in sums.into_iter().enumerate() {
            if behind[k] {
                self.radiance[k] = sum.map(|s| s / count);
            }
        }
    }

    fn faces(&self, rule: MeshRule, splits: &Splits) -> Vec<Face> {
        let edges = &self.topology.edges;
        let triangles = self.topology.triangles.iter().zip(&self.topology.triangle_edges);
        let mut faces: Vec<Face> = triangles
            .map(|(corners, edges)| {
                let divided = edges.map(|e| splits.get(e as usize).is_some());
                self.triangle(rule, *corners, divided)
            })
            .collect();
        for (k, edge) in edges.iter().enumerate().skip(self.topology.interior) {
            faces.push(self.strip(rule, edge.a, edge.b, splits.get(k).is_some()));
        }
        faces
    }

    fn triangle(&self, rule: MeshRule, corners: [u32; 3], divided: [bool; 3]) -> Face {
        let l = corners.map(|c| self.radiance[c as usize]);
        if rule == MeshRule::Farthest {
            let farthest = |a: u32, b: u32| {
                if self.hits[a as usize].distance >= self.hits[b as usize].distance { a } else { b }
            };
            let c = farthest(farthest(corners[0], corners[1]), corners[2]);
            return [self.radiance[c as usize]; 3];
        }
        match pair(divided) {
            Division::Whole => [mean(mean(l[0], l[1], 0.5), l[2], 1.0 / 3.0); 3],
            Division::Alone(k) => {
                let (a, b) = ((k + 1) % 3, (k + 2) % 3);
                let mut face = l;
                face[a] = mean(l[a], l[b], 0.5);
                face[b] = face[a];
                face
            }
            Division::Three => l,
        }
    }

    fn strip(&self, rule: MeshRule, a: u32, b: u32, divided: bool) -> Face {
        let (la, lb) = (self.radiance[a as usize], self.radiance[b as usize]);
        let farther = self.hits[a as usize].distance >= self.hits[b as usize].distance;
        match rule {
            _ if divided => [la, lb, lb],
            MeshRule::Farthest => [if farther { la } else { lb }; 3],
            MeshRule::Average | MeshRule::Surfaces => [mean(la, lb, 0.5); 3],
        }
    }

    /// The edges between hit points, with the difference of what lies on both sides.
    fn add_edges(&mut self, splits: &Splits, faces: &[Face]) {
        for (index, edge) in self.topology.edges.iter().enumerate() {
            let [left, right] = edge.corners;
            let difference = |end: usize| {
                let near = |corner: u32| faces[corner as usize / 3][corner as usize % 3];
                combine(near(left[end]), near(right[end]), |l, r| l - r)
            };
            let (at_a, at_b) = (difference(0), difference(1));
            let a = self.hits[edge.a as usize].position;
            let b = self.hits[edge.b as usize].position;
            match splits.get(index) {
                None if at_a == at_b => self.sum.add(a, b, at_a),
                None => {
                    // Three surfaces that are not told apart pairwise.
                    let middle = 0.5 * (a + b);
                    self.sum.add(a, middle, at_a);
                    self.sum.add(middle, b, at_b);
                }
                Some(split) => {
                    // Where one surface is behind the other, also the way from one to the other.
                    let near = split.near();
                    self.sum.add(a, split.on_a, at_a);
                    self.sum.add(split.on_a, near, at_a);
                    self.sum.add(near, split.on_b, at_b);
                    self.sum.add(split.on_b, b, at_b);
                }
            }
        }
    }

    /// The lines between surfaces inside triangles.
    fn add_insides(&mut self, splits: &Splits, faces: &[Face]) {
        if splits.splits.is_empty() {
            return;
        }
        for (t, edges) in self.topology.triangle_edges.iter().enumerate() {
            let points = edges.map(|e| splits.get(e as usize).map(Split::near));
            let face = faces[t];
            match points {
                // Opposite the undivided edge is the corner that stands alone.
                [None, Some(p), Some(q)] => self.line(p, q, face[0], face[2]),
                [Some(q), None, Some(p)] => self.line(p, q, face[1], face[0]),
                [Some(p), Some(q), None] => self.line(p, q, face[2], face[1]),
                [Some(p), Some(q), Some(r)] => {
                    let points = [p, q, r];
                    let (centre, ends) = meeting(points);
                    for k in 0..3 {
                        let (left, right) = (face[k], face[(k + 1) % 3]);
                        self.line(points[k], ends[k], left, right);
                        self.line(ends[k], centre, left, right);
                    }
                }
                _ => {}
            }
        }
    }

    fn line(&mut self, from: DVec3, to: DVec3, left: Radiance, right: Radiance) {
        self.sum.add(from, to, combine(left, right, |l, r| l - r));
    }

    /// The sides of the strips below the rim, and their lower ends in the tangent plane.
    fn add_rim(&mut self, splits: &Splits, faces: &[Face]) {
        let strips = &faces[self.topology.triangles.len()..];
        let rim = &self.topology.edges[self.topology.interior..];
        let ground = |p: DVec3| p.truncate().extend(0.0);
        for (k, (edge, face)) in rim.iter().zip(strips).enumerate() {
            let before = strips[(k + strips.len() - 1) % strips.len()];
            let a = self.hits[edge.a as usize].position;
            let b = self.hits[edge.b as usize].position;
            self.line(a, ground(a), face[0], before[1]);
            match splits.get(self.topology.interior + k) {
                None => self.sum.add(ground(a), ground(b), face[0]),
                Some(split) => {
                    let near = split.near();
                    self.line(ground(near), near, face[0], face[1]);
                    self.sum.add(ground(a), ground(split.on_a), face[0]);
                    self.sum.add(ground(split.on_a), ground(near), face[0]);
                    self.sum.add(ground(near), ground(split.on_b), face[1]);
                    self.sum.add(ground(split.on_b), ground(b), face[1]);
                }
            }
        }
    }
}

/// Where the lines from points on the three edges of a triangle meet, and the end of each: the same
/// point, or for lines on a surface behind the others, what is behind that point.
fn meeting(points: [DVec3; 3]) -> (DVec3, [DVec3; 3]) {
    let lengths = points.map(DVec3::length);
    let limit = ONE_PLACE * lengths.into_iter().fold(f64::INFINITY, f64::min);
    let near = points.iter().zip(lengths).filter(|(_, length)| *length <= limit);
    let (sum, count) = near.fold((DVec3::ZERO, 0.0), |(sum, n), (&p, _)| (sum + p, n + 1.0));
    let centre = sum / count;
    let direction = centre.normalize_or_zero();
    (centre, lengths.map(|l| if l <= limit { centre } else { l * direction }))
}

/// How surfaces divide a triangle.
enum Division {
    Whole,
    /// This corner lies on another surface than the two others.
    Alone(usize),
    Three,
}

fn pair(divided: [bool; 3]) -> Division {
    match divided {
        [true, true, true] => Division::Three,
        [false, true, true] => Division::Alone(2),
        [true, false, true] => Division::Alone(0),
        [true, true, false] => Division::Alone(1),
        _ => Division::Whole,
    }
}

/// Sums over edges, in the order in which they are added.
#[derive(Default)]
struct Sum {
    gradient: [DVec2; 3],
    hessian: [f64; 3],
}

impl Sum {
    fn add(&mut self, from: DVec3, to: DVec3, radiance: Radiance) {
        if radiance == [0.0; 4] {
            return;
        }
        let EdgeDerivatives { gradient, hessian } = edge::derivatives(from, to);
        for (sum, l) in self.gradient.iter_mut().zip(radiance) {
            *sum += l * DVec2::from(gradient);
        }
        for (sum, h) in self.hessian.iter_mut().zip(hessian) {
            *sum += radiance[3] * h;
        }
    }

    fn derivatives(&self) -> Derivatives {
        Derivatives {
            gradient: self.gradient.map(|g| g.as_vec2()),
            hessian: self.hessian.map(|h| h as f32),
        }
    }
}

/// Gradient of the luminance.
pub fn luminance_gradient(gradient: &[Vec2; 3]) -> Vec2 {
    let along = |f: fn(Vec2) -> f32| Rgb::from(gradient.map(f)).luminance();
    Vec2::new(along(|g| g.x), along(|g| g.y))
}
