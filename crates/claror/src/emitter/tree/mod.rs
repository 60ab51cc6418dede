//! Choice of one light among many: a tree over the lights, walked down by how much those below
//! each child may contribute at the reference point.
//!
//! Conty Estevez and Kulla 2018: Importance sampling of many lights with adaptive tree splitting.
//! What is known of the lights below a child is their box, a cone that holds the directions they
//! face, how far to the side they shine, and their intensity. From these follows a bound on the
//! cosines and an estimate of the irradiance; a child gets probability 0 only where the bounds say
//! that nothing can arrive.
//!
//! Nodes have eight children, all of which are looked at together ([`node`]). They are made of
//! those of a binary tree ([`build`], [`collapse`]).

mod build;
mod collapse;
mod node;
#[cfg(test)]
mod tests;

use crate::math::{Bounds3, Vec3};
pub(super) use node::Shares;
use node::{Link, Node, Place};

/// Where a light is and where it shines to.
#[derive(Debug, Clone, Copy)]
pub(super) struct Extent {
    /// Box around it.
    pub(super) bounds: Bounds3,
    /// Middle of the directions that its surface faces, unit.
    pub(super) axis: Vec3,
    /// Cosine of the largest angle between `axis` and a normal; −1 when it faces everywhere.
    pub(super) cos_normals: f32,
    /// Cosine of the largest angle between a normal and the light that leaves there.
    pub(super) cos_emission: f32,
}

/// The tree.
#[derive(Debug, Clone, Default)]
pub(super) struct LightTree {
    /// The root first.
    nodes: Vec<Node>,
    /// Where each node stands in its parent; `None` for the root.
    parents: Vec<Option<Place>>,
    /// Where each light stands; `None` for lights that do not shine.
    places: Vec<Option<Place>>,
    /// The only light that shines, if there is only one.
    only: Option<u32>,
}

/// Where light arrives: a point and perhaps the only side from which it matters.
#[derive(Debug, Clone, Copy)]
pub(super) struct Receiver {
    pub(super) p: Vec3,
    pub(super) n: Option<Vec3>,
}

impl LightTree {
    /// Numbers the lights in the order in which they stand in the tree, so that those chosen near
    /// each other lie near each other in memory; those that do not shine come last. Returns the
    /// numbers that they had.
    pub(super) fn renumber(&mut self) -> Vec<u32> {
        let mut order: Vec<u32> = (0..self.places.len() as u32).collect();
        let key =
            |light: &u32| self.places[*light as usize].map_or((1, 0, 0), |p| (0, p.node, p.child));
        order.sort_by_key(key);
        self.places = order.iter().map(|&old| self.places[old as usize]).collect();
        for (new, place) in self.places.iter().enumerate() {
            let Some(Place { node, child }) = *place else { break };
            self.nodes[node as usize].links[child as usize] = Link::to_light(new as u32);
        }
        self.only = self.only.map(|_| 0);
        order
    }

    /// How the children of the root share the irradiance at `at`; `None` without lights.
    #[inline]
    pub(super) fn at_root(&self, at: &Receiver) -> Option<Shares> {
        self.nodes.first().map(|root| root.shares(at))
    }

    /// The light, where there is only one.
    #[inline]
    pub(super) fn only(&self) -> Option<usize> {
        self.only.map(|light| light as usize)
    }

    /// A light and its probability, given `u` in [0, 1); `None` where no light can contribute.
    #[inline]
    pub(super) fn sample(&self, at: &Receiver, u: f64) -> Option<(usize, f32)> {
        match self.only {
            Some(light) => Some((light as usize, 1.0)),
            None => self.sample_below(self.nodes.first()?, 1.0, at, u),
        }
    }

    /// [`LightTree::sample`], given what [`LightTree::at_root`] returned for the same `at`.
    #[inline]
    pub(super) fn sample_from(&self, root: &Shares, at: &Receiver, u: f64) -> Option<(usize, f32)> {
        let (child, u) = root.choose(u)?;
        let probability = root.probability(child);
        match self.nodes.first()?.links[child].follow() {
            Ok(inner) => self.sample_below(&self.nodes[inner], probability, at, u),
            Err(light) => Some((light, probability as f32)),
        }
    }

    /// A light below a node that was chosen with this probability.
    fn sample_below<'a>(
        &'a self,
        mut node: &'a Node,
        mut probability: f64,
        at: &Receiver,
        mut u: f64,
    ) -> Option<(usize, f32)> {
        loop {
            let shares = node.shares(at);
            let (child, rest) = shares.choose(u)?;
            probability *= shares.probability(child);
            match node.links[child].follow() {
                Ok(inner) => node = &self.nodes[inner],
                Err(light) => return Some((light, probability as f32)),
            }
            u = rest;
        }
    }

    /// The probability with which [`LightTree::sample`] chooses this light.
    pub(super) fn probability(&self, at: &Receiver, light: usize) -> f32 {
        if self.only.is_some_and(|only| only as usize == light) {
            return 1.0;
        }
        let mut probability = 1.0;
        let mut next = self.places[light];
        if next.is_none() {
            return 0.0;
        }
        while let Some(place) = next {
            let node = &self.nodes[place.node as usize];
            let shares = node.shares(at);
            if shares.importance(place.child as usize) == 0.0 {
                return 0.0;
            }
            probability *= shares.probability(place.child as usize);
            next = self.parents[place.node as usize];
        }
        probability as f32
    }
}
