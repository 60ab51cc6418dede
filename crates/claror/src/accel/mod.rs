//! The ray kernel: an 8-wide bounding volume hierarchy over all shapes.
//!
//! [`Accel::build`] makes a binary tree by binned surface area heuristic (`build`), collapses it
//! to eight children per node and packs its triangles into blocks of four (`node`). A ray is
//! traced by one generic routine (`traverse`) over a small set of vector operations (`simd`),
//! compiled once per instruction set; the best one that the machine has is chosen when the
//! structure is built. Triangles are tested watertightly (`triangle`), spheres, disks and
//! cylinders in their own space in double precision, instances by tracing their group's own tree.
//!
//! # What is guaranteed
//! - Same tree, whatever the number of threads that built it.
//! - Same bits of every hit on every instruction set: all paths execute the same IEEE operations
//!   in the same order, without fused multiply-add.
//! - Of several triangles hit at the same `t`, the one with the smallest number wins, so that the
//!   answer does not depend on the order of the traversal.
//! - No ray passes between two triangles that share an edge or a vertex.

mod arena;
mod build;
mod node;
mod simd;
mod stack;
mod traverse;
mod triangle;
mod validate;

#[cfg(test)]
mod tests;

use crate::math::{Bounds3, Ray};
use crate::shape::{GroupId, InstanceId, ShapeId, ShapeKind, ShapeTable};
use node::{Special, Tree};
use simd::Isa;
use traverse::RawHit;

/// Where a ray met a surface, before anything about the surface is computed
/// (see [`ShapeTable::interaction`]).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Hit {
    /// Ray parameter.
    pub t: f32,
    /// Mesh: weight of the triangle's vertex 1. Rectangle: u. Otherwise 0.
    pub u: f32,
    /// Mesh: weight of the triangle's vertex 2. Rectangle: v. Otherwise 0.
    pub v: f32,
    /// The shape.
    pub shape: ShapeId,
    /// Triangle of a mesh; 0 otherwise.
    pub primitive: u32,
    /// The instance, if the shape belongs to a group.
    pub instance: Option<InstanceId>,
}

/// Why an acceleration structure could not be built.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum AccelError {
    /// More triangles in one tree than its 32-bit numbers can name.
    #[error("{0} triangles in one group of shapes; at most 2147483648 are supported")]
    TooManyPrimitives(u64),
    /// An instance names a group that does not exist.
    #[error("instance {instance} refers to group {group}, which does not exist")]
    NoSuchGroup {
        /// The instance.
        instance: u32,
        /// The missing group.
        group: u32,
    },
}

/// Bounding volume hierarchies of a scene: one over everything in the world, one per group.
#[derive(Debug, Clone)]
pub struct Accel {
    top: Tree,
    groups: Vec<Tree>,
    isa: Isa,
}

impl Accel {
    /// Builds the hierarchies, in parallel on the current rayon pool. Triangles and shapes with
    /// coordinates that are not finite are left out.
    pub fn build(shapes: &ShapeTable) -> Result<Self, AccelError> {
        check_instances(shapes)?;
        let mut in_group = vec![false; shapes.shapes.len()];
        let mut groups = Vec::with_capacity(shapes.groups.len());
        for group in &shapes.groups {
            for id in &group.shapes {
                in_group[id.0 as usize] = true;
            }
            groups.push(build::tree(shapes, &group.shapes, &[])?);
        }
        let free: Vec<ShapeId> =
            (0..shapes.shapes.len()).filter(|&i| !in_group[i]).map(|i| ShapeId(i as u32)).collect();
        let instances: Vec<(InstanceId, Bounds3)> = shapes
            .instances
            .iter()
            .enumerate()
            .map(|(i, instance)| {
                let local = groups[instance.group.0 as usize].bounds;
                (InstanceId(i as u32), crate::shape::transformed_bounds(&instance.transform, local))
            })
            .collect();
        let top = build::tree(shapes, &free, &instances)?;
        Ok(Self { top, groups, isa: Isa::detect() })
    }

    /// The closest hit in `[0, ray.t_max]`.
    #[inline]
    pub fn intersect(&self, shapes: &ShapeTable, ray: &Ray) -> Option<Hit> {
        let mut best = RawHit::none(ray.t_max);
        self.closest_in(&self.top, shapes, ray, &mut best);
        best.is_hit().then(|| self.resolve(shapes, &best))
    }

    /// True when anything is hit in `[0, ray.t_max]`.
    #[inline]
    pub fn occluded(&self, shapes: &ShapeTable, ray: &Ray) -> bool {
        self.any_in(&self.top, shapes, ray)
    }

    /// A box that holds everything that can be hit; empty for an empty scene.
    pub fn bounds(&self) -> Bounds3 {
        self.top.bounds
    }

    /// Bytes on the heap.
    pub fn memory_bytes(&self) -> usize {
        self.top.memory_bytes() + self.groups.iter().map(Tree::memory_bytes).sum::<usize>()
    }

    /// Checks every invariant of the trees against the geometry; a sentence about the first that
    /// is broken. For tests.
    pub fn validate(&self, shapes: &ShapeTable) -> Result<(), String> {
        validate::accel(self, shapes)
    }

    fn closest_in(&self, tree: &Tree, shapes: &ShapeTable, ray: &Ray, best: &mut RawHit) {
        let special = |special: Special, best: &RawHit| match special {
            Special::Shape(id) => closest_of_shape(&shapes.shapes[id.0 as usize].kind, ray, best),
            Special::Instance(id) => {
                let instance = &shapes.instances[id.0 as usize];
                let group = &self.groups[instance.group.0 as usize];
                let local = instance.transform.inverse_ray(ray);
                let mut inner = RawHit::none(best.t);
                self.closest_in(group, shapes, &local, &mut inner);
                inner.is_hit().then_some(RawHit { instance: id.0, ..inner })
            }
        };
        traverse::closest(self.isa, tree, ray, best, special);
    }

    fn any_in(&self, tree: &Tree, shapes: &ShapeTable, ray: &Ray) -> bool {
        let special = |special: Special| match special {
            Special::Shape(id) => {
                let kind = &shapes.shapes[id.0 as usize].kind;
                crate::shape::intersect_quadric(kind, ray, ray.t_max).is_some()
            }
            Special::Instance(id) => {
                let instance = &shapes.instances[id.0 as usize];
                let local = instance.transform.inverse_ray(ray);
                self.any_in(&self.groups[instance.group.0 as usize], shapes, &local)
            }
        };
        traverse::any(self.isa, tree, ray, special)
    }

    /// From numbers of the tree to numbers of the scene.
    #[inline]
    fn resolve(&self, shapes: &ShapeTable, raw: &RawHit) -> Hit {
        let instance = (raw.instance != RawHit::NO_INSTANCE).then_some(InstanceId(raw.instance));
        let tree = match instance {
            Some(id) => &self.groups[shapes.instances[id.0 as usize].group.0 as usize],
            None => &self.top,
        };
        let (shape, primitive) = tree.shape_of(raw.key);
        let hit = Hit { t: raw.t, u: raw.u, v: raw.v, shape, primitive, instance };
        match &shapes.shapes[shape.0 as usize].kind {
            ShapeKind::Mesh(_) => hit,
            ShapeKind::Rectangle(_) => rectangle_hit(hit),
            _ => Hit { primitive: 0, ..hit },
        }
    }
}

/// The closest hit with a sphere, disk or cylinder not beyond the best so far.
fn closest_of_shape(kind: &ShapeKind, ray: &Ray, best: &RawHit) -> Option<RawHit> {
    let t = crate::shape::intersect_quadric(kind, ray, best.t)?;
    Some(RawHit { t, ..RawHit::none(t) })
}

/// A rectangle is two triangles, (c00, c10, c11) and (c00, c11, c01): from the barycentrics of
/// either to the rectangle's uv.
fn rectangle_hit(hit: Hit) -> Hit {
    let (u, v) = match hit.primitive {
        0 => (hit.u + hit.v, hit.v),
        _ => (hit.u, hit.u + hit.v),
    };
    Hit { u: u.min(1.0), v: v.min(1.0), primitive: 0, ..hit }
}

fn check_instances(shapes: &ShapeTable) -> Result<(), AccelError> {
    for (i, instance) in shapes.instances.iter().enumerate() {
        let GroupId(group) = instance.group;
        if group as usize >= shapes.groups.len() {
            return Err(AccelError::NoSuchGroup { instance: i as u32, group });
        }
    }
    Ok(())
}
