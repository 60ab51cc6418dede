//! Proves that a tree is what the traversal takes it for.

use super::Accel;
use super::build::{triangle, triangles_in};
use super::node::{
    ABSENT, Child, LeafBlock, MAX_DEPTH, NARROW_ROWS, NODE_ROWS, Special, Tree, WIDE_ROWS, WIDTH,
};
use crate::math::Bounds3;
use crate::shape::{ShapeTable, transformed_bounds};

/// See [`Accel::validate`].
pub(super) fn accel(accel: &Accel, shapes: &ShapeTable) -> Result<(), String> {
    for tree in accel.groups.iter().chain([&accel.top]) {
        let mut check = Check {
            accel,
            shapes,
            tree,
            row_seen: vec![false; tree.rows.len()],
            special_seen: vec![false; tree.specials.len()],
            triangle_seen: vec![false; tree.triangle_count as usize],
        };
        check.node(0, tree.bounds, 1)?;
        check.everything_is_reached()?;
    }
    Ok(())
}

struct Check<'a> {
    accel: &'a Accel,
    shapes: &'a ShapeTable,
    tree: &'a Tree,
    row_seen: Vec<bool>,
    special_seen: Vec<bool>,
    triangle_seen: Vec<bool>,
}

/// Marks something as seen; an error the second time, or when there is no such thing.
fn mark(seen: &mut [bool], number: usize, what: &str) -> Result<(), String> {
    match seen.get_mut(number) {
        None => Err(format!("{what} {number} of {}", seen.len())),
        Some(true) => Err(format!("{what} {number} is reached twice")),
        Some(seen) => {
            *seen = true;
            Ok(())
        }
    }
}

fn holds(outer: Bounds3, inner: Bounds3) -> bool {
    outer.min.cmple(inner.min).all() && outer.max.cmpge(inner.max).all()
}

impl Check<'_> {
    fn node(&mut self, number: usize, bounds: Bounds3, depth: usize) -> Result<(), String> {
        for row in number..number + NODE_ROWS {
            mark(&mut self.row_seen, row, "row")?;
        }
        if !number.is_multiple_of(2) {
            return Err(format!("node {number} straddles cache lines"));
        }
        if depth > MAX_DEPTH {
            return Err(format!("node {number} lies at depth {depth}"));
        }
        let node = self.tree.node(number);
        let mut previous = usize::MAX;
        for i in 0..WIDTH {
            let (child, child_bounds) = (node.child(i), node.child_bounds(i));
            if child == Child::NOTHING {
                previous = 0;
                if !child_bounds.is_empty() {
                    return Err(format!("absent child {i} of node {number} has a box"));
                }
                continue;
            }
            if previous == 0 {
                return Err(format!("node {number} has a gap before child {i}"));
            }
            previous = 1;
            if !holds(bounds, child_bounds) {
                return Err(format!("child {i} of node {number} sticks out of its parent"));
            }
            self.child(child, child_bounds, depth)?;
        }
        Ok(())
    }

    fn child(&mut self, child: Child, bounds: Bounds3, depth: usize) -> Result<(), String> {
        if !child.is_leaf() {
            return self.node(child.number(), bounds, depth + 1);
        }
        if child.is_special() {
            mark(&mut self.special_seen, child.number(), "special primitive")?;
            let own = self.special_bounds(self.tree.specials[child.number()]);
            let inside = holds(bounds, own);
            return inside.then_some(()).ok_or_else(|| format!("{child:?} sticks out of its box"));
        }
        let first = child.number();
        for row in first..first + if child.is_wide() { WIDE_ROWS } else { NARROW_ROWS } {
            mark(&mut self.row_seen, row, "row")?;
        }
        if child.is_wide() {
            self.block(self.tree.wide_block(first), bounds)
        } else {
            self.block(self.tree.narrow_block(first), bounds)
        }
    }

    fn block<const N: usize>(
        &mut self,
        block: LeafBlock<'_, N>,
        bounds: Bounds3,
    ) -> Result<(), String> {
        for column in (0..N).filter(|&column| block.id(column) != ABSENT) {
            let id = block.id(column);
            mark(&mut self.triangle_seen, id as usize, "triangle")?;
            let (shape, i) = self.tree.shape_of(id);
            for (vertex, p) in triangle(self.shapes, shape, i).into_iter().enumerate() {
                if (0..3).any(|axis| block.coordinates(vertex, axis)[column] != p[axis]) {
                    return Err(format!("triangle {id} has another vertex {vertex}"));
                }
                if !holds(bounds, Bounds3 { min: p, max: p }) {
                    return Err(format!("triangle {id} sticks out of its box"));
                }
            }
        }
        Ok(())
    }

    fn special_bounds(&self, special: Special) -> Bounds3 {
        match special {
            Special::Shape(id) => self.shapes.shape_bounds(id),
            Special::Instance(id) => {
                let instance = &self.shapes.instances[id.0 as usize];
                let group = &self.accel.groups[instance.group.0 as usize];
                transformed_bounds(&instance.transform, group.bounds)
            }
        }
    }

    fn everything_is_reached(&self) -> Result<(), String> {
        // A node begins on a cache line: one row may be left out before it.
        let left_out = self.row_seen.windows(2).any(|pair| pair == [false, false]);
        if left_out {
            return Err("some nodes or blocks are not reached from the root".to_owned());
        }
        let finite = |special: &Special| {
            let b = self.special_bounds(*special);
            b.min.is_finite() && b.max.is_finite() && !b.is_empty()
        };
        for (number, special) in self.tree.specials.iter().enumerate() {
            if !self.special_seen[number] && finite(special) {
                return Err(format!("special primitive {number} is missing"));
            }
        }
        for range in &self.tree.ranges {
            for i in 0..triangles_in(self.shapes, range.shape) as u32 {
                let vertices = triangle(self.shapes, range.shape, i);
                let seen = self.triangle_seen[(range.first + i) as usize];
                if !seen && vertices.iter().all(|p| p.is_finite() && p.abs().max_element() < 1e37) {
                    return Err(format!("triangle {i} of {:?} is missing", range.shape));
                }
            }
        }
        Ok(())
    }
}
