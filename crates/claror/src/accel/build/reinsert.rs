//! Improves a finished binary tree: subtrees with large boxes are taken out and put back where they
//! enlarge the boxes above them least (Meister and Bittner 2018: Parallel reinsertion for bounding
//! volume hierarchy optimization). The places are looked for in parallel on an unchanging tree and
//! taken one after the other, so that the result does not depend on the threads.

use super::binary::BinaryNode;
use super::split::Box3;
use rayon::prelude::*;

/// Rounds of looking and moving.
const ROUNDS: usize = 3;
/// One of so many nodes is tried in each round: those with the largest boxes.
const CANDIDATE_SHARE: usize = 16;
/// Most nodes looked at to find a place for one subtree: bounds the time for hostile scenes.
const MAX_VISITS: usize = 2000;
/// Trees over more primitives than this stay as they are: the links would take too much memory.
const MAX_PRIMITIVES: usize = 1 << 22;
/// A tree that has become deeper than this is not used.
const MAX_BINARY_DEPTH: usize = 120;
const NONE: u32 = u32::MAX;
const ROOT: usize = 0;

/// A tree as links. Nodes keep the numbers that they had.
struct Links {
    bounds: Vec<Box3>,
    parent: Vec<u32>,
    /// Both children; of a leaf, [`NONE`] and its primitive.
    children: Vec<[u32; 2]>,
}

/// A better place for a subtree.
#[derive(Clone, Copy)]
struct Move {
    node: u32,
    /// Its new sibling.
    to: u32,
    /// By how much the boxes' half areas shrink in sum.
    gain: f32,
}

/// Improves the tree, and puts the primitives in its new order.
pub(super) fn improve(nodes: &mut Vec<BinaryNode>, order: &mut Vec<u32>) {
    if order.len() < 8 || order.len() > MAX_PRIMITIVES {
        return;
    }
    let mut links = Links::new(nodes, order);
    for _ in 0..ROUNDS {
        let moves = links.find_moves();
        links.apply(&moves);
        links.refit();
    }
    if links.depth() <= MAX_BINARY_DEPTH {
        nodes.clear();
        order.clear();
        links.write(ROOT, nodes, order);
    }
}

impl Links {
    fn new(nodes: &[BinaryNode], order: &[u32]) -> Self {
        let mut parent = vec![NONE; nodes.len()];
        let mut primitives = order.iter();
        // The array holds every subtree's left part first: leaves stand in the order of the
        // primitives.
        let children = (0..nodes.len())
            .map(|i| match nodes[i].right {
                0 => [NONE, *primitives.next().expect("one leaf per primitive")],
                right => {
                    parent[i + 1] = i as u32;
                    parent[right as usize] = i as u32;
                    [i as u32 + 1, right]
                }
            })
            .collect();
        let bounds = nodes.iter().map(|node| Box3::from(node.bounds)).collect();
        Self { bounds, parent, children }
    }

    fn is_leaf(&self, node: usize) -> bool {
        self.children[node][0] == NONE
    }

    fn sibling(&self, node: usize) -> usize {
        let [a, b] = self.children[self.parent[node] as usize];
        (if a as usize == node { b } else { a }) as usize
    }

    /// The best place for each of the largest nodes, the best gain first.
    fn find_moves(&self) -> Vec<Move> {
        let count = self.bounds.len() / CANDIDATE_SHARE;
        let mut candidates: Vec<(f32, u32)> = (1..self.bounds.len())
            .filter(|&i| self.parent[i] as usize != ROOT)
            .map(|i| (self.bounds[i].half_area(), i as u32))
            .collect();
        let larger = |a: &(f32, u32), b: &(f32, u32)| b.0.total_cmp(&a.0).then(a.1.cmp(&b.1));
        if count < candidates.len() {
            candidates.select_nth_unstable_by(count, larger);
            candidates.truncate(count);
        }
        let mut moves: Vec<Move> =
            candidates.par_iter().filter_map(|&(_, node)| self.find_move(node as usize)).collect();
        moves.sort_unstable_by(|a, b| b.gain.total_cmp(&a.gain).then(a.node.cmp(&b.node)));
        moves
    }

    /// Climbs from the subtree's parent to the root, and looks through what hangs beside the way.
    fn find_move(&self, node: usize) -> Option<Move> {
        let parent = self.parent[node] as usize;
        let mut search = Search {
            links: self,
            moved: self.bounds[node],
            least: self.bounds[node].half_area(),
            best: Move { node: node as u32, to: NONE, gain: 0.0 },
            visits: 0,
        };
        let (mut pivot, mut beside) = (parent, self.sibling(node));
        // The box of the way so far without the subtree, and what taking it out gains.
        let mut without = self.bounds[beside];
        let mut gain = self.bounds[parent].half_area();
        while search.visits < MAX_VISITS {
            search.below(beside, gain);
            if pivot == ROOT {
                break;
            }
            if pivot != parent {
                without.grow(self.bounds[beside].min, self.bounds[beside].max);
                gain += self.bounds[pivot].half_area() - without.half_area();
            }
            beside = self.sibling(pivot);
            pivot = self.parent[pivot] as usize;
        }
        (search.best.to != NONE).then_some(search.best)
    }

    /// Makes the moves that no earlier one has interfered with.
    fn apply(&mut self, moves: &[Move]) {
        let mut touched = vec![false; self.parent.len()];
        for m in moves {
            let (node, to) = (m.node as usize, m.to as usize);
            let parent = self.parent[node] as usize;
            let target_parent = self.parent[to] as usize;
            if parent == ROOT || to == ROOT || self.is_below(to, node) {
                continue;
            }
            let sibling = self.sibling(node);
            let grandparent = self.parent[parent] as usize;
            let all = [node, to, parent, sibling, grandparent, target_parent];
            if to == parent || all.iter().any(|&i| touched[i]) {
                continue;
            }
            for i in all {
                touched[i] = true;
            }
            // The sibling takes the parent's place, the parent comes between target and above.
            self.replace(grandparent, parent, sibling);
            let target_parent = self.parent[to] as usize;
            self.replace(target_parent, to, parent);
            self.children[parent] = [node as u32, to as u32];
            self.parent[to] = parent as u32;
        }
    }

    fn replace(&mut self, parent: usize, old: usize, new: usize) {
        let slot = usize::from(self.children[parent][0] as usize != old);
        self.children[parent][slot] = new as u32;
        self.parent[new] = parent as u32;
    }

    /// Whether `node` is `above` or lies below it.
    fn is_below(&self, mut node: usize, above: usize) -> bool {
        while node != above {
            if node == ROOT {
                return false;
            }
            node = self.parent[node] as usize;
        }
        true
    }

    /// All nodes, parents before children, and the depth of each.
    fn top_down(&self) -> Vec<(u32, u32)> {
        let mut nodes = Vec::with_capacity(self.parent.len());
        nodes.push((ROOT as u32, 0));
        let mut next = 0;
        while let Some(&(node, depth)) = nodes.get(next) {
            if !self.is_leaf(node as usize) {
                nodes.extend(self.children[node as usize].map(|child| (child, depth + 1)));
            }
            next += 1;
        }
        nodes
    }

    fn refit(&mut self) {
        for &(node, _) in self.top_down().iter().rev() {
            if !self.is_leaf(node as usize) {
                let [a, b] = self.children[node as usize].map(|child| self.bounds[child as usize]);
                let mut bounds = a;
                bounds.grow(b.min, b.max);
                self.bounds[node as usize] = bounds;
            }
        }
    }

    fn depth(&self) -> usize {
        self.top_down().last().map_or(0, |&(_, depth)| depth as usize)
    }

    /// Appends the subtree to the array of nodes; its number of primitives.
    fn write(&self, node: usize, nodes: &mut Vec<BinaryNode>, order: &mut Vec<u32>) -> u32 {
        let position = nodes.len();
        let bounds = self.bounds[node].into();
        nodes.push(BinaryNode { bounds, count: 1, right: 0 });
        let [left, right] = self.children[node];
        if left == NONE {
            order.push(right);
            return 1;
        }
        let left_count = self.write(left as usize, nodes, order);
        nodes[position].right = nodes.len() as u32;
        nodes[position].count = left_count + self.write(right as usize, nodes, order);
        nodes[position].count
    }
}

/// The search for a place for one subtree.
struct Search<'a> {
    links: &'a Links,
    /// Box of the subtree.
    moved: Box3,
    /// Its half area: no new parent has less.
    least: f32,
    best: Move,
    visits: usize,
}

impl Search<'_> {
    /// Tries every place in a subtree that may still be better than the best; `gain` is what is
    /// gained before the new parent's box is paid for.
    fn below(&mut self, node: usize, gain: f32) {
        if gain - self.least <= self.best.gain || self.visits >= MAX_VISITS {
            return;
        }
        self.visits += 1;
        let bounds = &self.links.bounds[node];
        let mut merged = *bounds;
        merged.grow(self.moved.min, self.moved.max);
        let gain = gain - merged.half_area();
        if gain > self.best.gain {
            (self.best.gain, self.best.to) = (gain, node as u32);
        }
        if !self.links.is_leaf(node) {
            let gain = gain + bounds.half_area();
            for child in self.links.children[node] {
                self.below(child as usize, gain);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::binary;
    use super::super::primitives::PrimitiveRef;
    use super::*;
    use crate::math::{Bounds3, Vec3};

    /// Long boxes at all angles, which a builder from the top down cannot part well.
    fn boxes() -> Vec<PrimitiveRef> {
        let along = |i: u32, step: f32| (i as f32 * step).fract() * 10.0;
        let make = |i: u32| {
            let min = Vec3::new(along(i, 0.618_034), along(i, 0.754_878), along(i, 0.569_84));
            let size = [Vec3::X, Vec3::Y, Vec3::Z][i as usize % 3] * 4.0 + 0.05;
            PrimitiveRef::new(Bounds3 { min, max: min + size }, i).unwrap()
        };
        (0..4000).map(make).collect()
    }

    fn area(nodes: &[BinaryNode]) -> f64 {
        nodes.iter().map(|node| f64::from(node.bounds.half_area())).sum()
    }

    #[test]
    fn boxes_shrink_and_nothing_is_lost() {
        let mut refs = boxes();
        let mut nodes = binary::build(&mut refs, 64);
        let mut order: Vec<u32> = refs.iter().map(PrimitiveRef::id).collect();
        let before = area(&nodes);
        improve(&mut nodes, &mut order);
        let after = area(&nodes);
        assert!(after < before, "{after} after {before}");
        assert_eq!((nodes.len(), nodes[0].count), (7999, 4000));
        order.sort_unstable();
        assert!(order.into_iter().eq(0..4000));
    }
}
