//! From shapes to a [`Tree`]: collect the primitives ([`primitives`]), split them in two again and
//! again ([`binary`], [`split`]), improve on that ([`reinsert`]), choose which splits become wide
//! nodes and which leaves ([`collapse`]), and write nodes and blocks ([`emit`]).

mod binary;
mod collapse;
mod emit;
mod primitives;
mod reinsert;
mod split;

use super::AccelError;
use super::arena::Arena;
use super::node::{Child, DIRECTORY_STEP, MAX_DEPTH, ShapeRange, Tree};
use crate::math::Bounds3;
use crate::shape::{InstanceId, ShapeId, ShapeTable};
use emit::Plan;
use primitives::{Collected, PrimitiveRef};
pub(super) use primitives::{triangle, triangles_in};

/// The tree over the given shapes and placed groups.
pub(super) fn tree(
    shapes: &ShapeTable,
    ids: &[ShapeId],
    instances: &[(InstanceId, Bounds3)],
) -> Result<Tree, AccelError> {
    let Collected { mut refs, ranges, specials, triangle_count } =
        primitives::collect(shapes, ids, instances)?;
    if specials.len() >= Child::MAX_NUMBER {
        return Err(AccelError::TooManyPrimitives(specials.len() as u64));
    }
    let mut tree = Tree {
        rows: Arena::zeroed(0),
        specials,
        directory: directory(&ranges, triangle_count),
        ranges,
        triangle_count,
        bounds: Bounds3::EMPTY,
    };
    for (attempt, sah_depth) in binary::SAH_DEPTHS.into_iter().enumerate() {
        if attempt > 0 {
            refs = primitives::collect(shapes, ids, instances)?.refs;
        }
        let mut nodes = binary::build(&mut refs, sah_depth);
        let mut order: Vec<u32> = refs.iter().map(PrimitiveRef::id).collect();
        // The largest pieces of memory must not stand side by side: in the rare case of a second
        // attempt, the primitives are collected again.
        refs = Vec::new();
        if attempt == 0 {
            reinsert::improve(&mut nodes, &mut order);
        }
        let choices = collapse::plan(&nodes, &order, triangle_count);
        let plan = Plan { shapes, nodes: &nodes, order: &order, choices: &choices };
        let size = plan.size(&tree);
        if size.rows >= Child::MAX_NUMBER {
            return Err(AccelError::TooManyPrimitives(u64::from(triangle_count)));
        }
        if size.depth <= MAX_DEPTH {
            tree.bounds = nodes.first().map_or(Bounds3::EMPTY, |root| root.bounds);
            plan.emit(&mut tree, &size);
            return Ok(tree);
        }
    }
    unreachable!("a tree of halved ranges is never too deep")
}

/// See [`Tree::directory`].
fn directory(ranges: &[ShapeRange], triangle_count: u32) -> Vec<u32> {
    let mut range = 0;
    (0..triangle_count)
        .step_by(DIRECTORY_STEP as usize)
        .map(|first| {
            while ranges.get(range + 1).is_some_and(|next| next.first <= first) {
                range += 1;
            }
            range as u32
        })
        .collect()
}
