//! Which binary nodes become wide nodes, which leaves, which dissolve into their parent: the
//! cheapest choice by the surface area heuristic, found by dynamic programming (Ylitie, Karras and
//! Laine 2017: Efficient incoherent ray traversal on GPUs through compressed wide BVHs, section
//! 3.1).

use super::super::node::{NARROW, WIDE, WIDTH};
use super::binary::BinaryNode;

/// Cost of testing a ray against the eight boxes of a node.
const NODE_COST: f32 = 1.0;
/// Cost of testing a ray against a narrow block of triangles.
const NARROW_COST: f32 = 0.6;
/// Cost of testing a ray against a wide block of triangles.
const WIDE_COST: f32 = 0.8;
/// Cost of testing a ray against a sphere, disk, cylinder or instance.
const SPECIAL_COST: f32 = 1.0;

/// Subtrees above this size are planned in parallel.
const PARALLEL: u32 = 4096;

/// What becomes of a binary node. It may stand for one child of a wide node: then it is a leaf, or
/// a wide node of its own. Or it dissolves into up to `budget` children, shared between its two
/// sides.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Choice(u32);

impl Choice {
    const LEAF: u32 = 1 << 31;

    /// As one child: whether it is a leaf.
    pub(super) fn is_leaf(self) -> bool {
        self.0 & Self::LEAF != 0
    }

    /// With `budget` children (2 to 8) to spend: how many for the left side and how many for the
    /// right; `None` when it is best kept as one child.
    pub(super) fn shares(self, budget: usize) -> Option<(usize, usize)> {
        let (left, budget) = (2..=budget)
            .rev()
            .map(|budget| ((self.0 >> (3 * budget) & 7) as usize, budget))
            .find(|&(left, _)| left > 0)?;
        Some((left, budget - left))
    }

    fn set_share(&mut self, budget: usize, left: usize) {
        self.0 |= (left as u32) << (3 * budget);
    }
}

/// Least cost of a subtree spread over at most i + 1 children of a wide node.
type Costs = [f32; WIDTH - 1];

/// The choice for every binary node. `order` are the primitives' numbers; those from
/// `triangle_count` on are no triangles.
pub(super) fn plan(nodes: &[BinaryNode], order: &[u32], triangle_count: u32) -> Vec<Choice> {
    let mut choices = vec![Choice::default(); nodes.len()];
    if !nodes.is_empty() {
        subtree(nodes, order, triangle_count, &mut choices);
    }
    choices
}

/// Plans the subtree whose root is the first of `nodes`.
fn subtree(
    nodes: &[BinaryNode],
    order: &[u32],
    triangle_count: u32,
    choices: &mut [Choice],
) -> Costs {
    let node = nodes[0];
    let as_leaf = leaf_cost(&node, order, triangle_count);
    if node.count == 1 {
        choices[0].0 = Choice::LEAF;
        return [as_leaf; WIDTH - 1];
    }
    let left_count = nodes[1].count as usize;
    let (left_nodes, right_nodes) = nodes[1..].split_at(2 * left_count - 1);
    let (choice, below) = choices.split_first_mut().expect("one choice per node");
    let (left_choices, right_choices) = below.split_at_mut(2 * left_count - 1);
    let (left_order, right_order) = order.split_at(left_count);
    let mut plan_left = || subtree(left_nodes, left_order, triangle_count, left_choices);
    let mut plan_right = || subtree(right_nodes, right_order, triangle_count, right_choices);
    let (left, right) = if node.count > PARALLEL {
        rayon::join(plan_left, plan_right)
    } else {
        (plan_left(), plan_right())
    };
    choose(choice, &node, as_leaf, &left, &right)
}

fn choose(
    choice: &mut Choice,
    node: &BinaryNode,
    as_leaf: f32,
    left: &Costs,
    right: &Costs,
) -> Costs {
    let mut costs = [0.0; WIDTH - 1];
    let (spread, share) = distribute(left, right, WIDTH);
    choice.set_share(WIDTH, share);
    let as_node = node.bounds.half_area() * NODE_COST + spread;
    if as_leaf <= as_node {
        choice.0 |= Choice::LEAF;
    }
    costs[0] = as_leaf.min(as_node);
    for budget in 2..WIDTH {
        let (spread, share) = distribute(left, right, budget);
        costs[budget - 1] = costs[budget - 2];
        if spread < costs[budget - 2] {
            costs[budget - 1] = spread;
            choice.set_share(budget, share);
        }
    }
    costs
}

/// The cheapest way to share `budget` children between two sides: its cost, and the left's share.
fn distribute(left: &Costs, right: &Costs, budget: usize) -> (f32, usize) {
    let mut best = (f32::INFINITY, 1);
    for share in 1..budget {
        let cost = left[share - 1] + right[budget - share - 1];
        if cost < best.0 {
            best = (cost, share);
        }
    }
    best
}

fn leaf_cost(node: &BinaryNode, order: &[u32], triangle_count: u32) -> f32 {
    let count = node.count as usize;
    let area = node.bounds.half_area();
    if count == 1 && order[0] >= triangle_count {
        return area * SPECIAL_COST;
    }
    let fits = count <= WIDE && order[..count].iter().all(|&id| id < triangle_count);
    match (fits, count > NARROW) {
        (false, _) => f32::INFINITY,
        (true, false) => area * NARROW_COST,
        (true, true) => area * WIDE_COST,
    }
}
