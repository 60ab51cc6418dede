//! From the binary tree to the wide one: which nodes of the binary tree become children of which
//! wide node.
//!
//! Of all ways that with the least cost, by dynamic programming from the leaves up as Ylitie,
//! Karras and Laine 2017 do it (Efficient incoherent ray traversal on GPUs through compressed wide
//! BVHs, sec. 3.1). The cost of a wide node is the probability of coming by, for which its lights'
//! intensity stands, and its memory.

use super::build::{Binary, BinaryLink};
use super::node::WIDTH;
use arrayvec::ArrayVec;

/// Cost of a node that is never visited, where visiting one that all lights are below costs 1:
/// it keeps others out of the cache. Found by measuring with 10⁵ lights.
const MEMORY: f32 = 4e-5;

/// How to collapse a binary tree.
pub(super) struct Collapse<'a> {
    binary: &'a [Binary],
    /// Per binary node and number of roots that it may be cut into (one more than the index), how
    /// many of them the first child gets; 0 where one root less costs no more. For a single root,
    /// how many of its children the first child gets.
    cuts: Vec<[u8; WIDTH]>,
}

impl<'a> Collapse<'a> {
    /// Plans it for this tree, whose nodes follow their parents.
    pub(super) fn new(binary: &'a [Binary]) -> Self {
        let mut cuts = vec![[0; WIDTH]; binary.len()];
        // Per number of roots, the cost of all wide nodes below and with them.
        let mut costs = vec![[0.0; WIDTH]; binary.len()];
        let total = binary[0].cluster.intensity;
        for (i, node) in binary.iter().enumerate().rev() {
            let BinaryLink::First(first) = node.link else { continue };
            let [a, b] = [first, first + 1].map(|child| costs[child as usize]);
            let own = (node.cluster.intensity / total) as f32 + MEMORY;
            let (cost, cut) = (&mut costs[i], &mut cuts[i]);
            for roots in 2..=WIDTH {
                let (least, first_gets) = (1..roots)
                    .map(|k| (a[k - 1] + b[roots - k - 1], k as u8))
                    .fold((f32::INFINITY, 0), |best, new| if new.0 < best.0 { new } else { best });
                (cost[roots - 1], cut[roots - 1]) = (least, first_gets);
            }
            // A single root is a wide node, cut as well as its width allows.
            (cost[0], cut[0]) = (cost[WIDTH - 1] + own, cut[WIDTH - 1]);
            for roots in 2..=WIDTH {
                if cost[roots - 2] <= cost[roots - 1] {
                    (cost[roots - 1], cut[roots - 1]) = (cost[roots - 2], 0);
                }
            }
        }
        Self { binary, cuts }
    }

    /// The nodes that become the children of the wide node over the lights of this one (it itself,
    /// if that is a leaf).
    pub(super) fn children(&self, index: u32) -> ArrayVec<u32, WIDTH> {
        let BinaryLink::First(first) = self.binary[index as usize].link else {
            return ArrayVec::from_iter([index]);
        };
        let first_gets = usize::from(self.cuts[index as usize][0]);
        let mut children = ArrayVec::new();
        // Nodes and the number of roots that each may be cut into.
        let mut open: ArrayVec<_, WIDTH> =
            ArrayVec::from_iter([(first + 1, WIDTH - first_gets), (first, first_gets)]);
        while let Some((node, roots)) = open.pop() {
            let cuts = &self.cuts[node as usize];
            let cut = (2..=roots).rev().find(|&r| cuts[r - 1] != 0);
            match (self.binary[node as usize].link, cut) {
                (BinaryLink::First(first), Some(roots)) => {
                    let first_gets = usize::from(cuts[roots - 1]);
                    open.extend([(first + 1, roots - first_gets), (first, first_gets)]);
                }
                _ => children.push(node),
            }
        }
        children
    }
}
