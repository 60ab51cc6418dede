//! The stack of nodes still to visit: fixed in size and not initialised, because clearing it would
//! cost a short ray more than tracing it.
#![expect(unsafe_code, reason = "reads of entries below the stack pointer, all of them written")]

use super::node::{Child, MAX_DEPTH, WIDTH};
use std::mem::MaybeUninit;

/// A node leaves at most seven of its children behind.
const CAPACITY: usize = MAX_DEPTH * (WIDTH - 1) + 1;

/// A child and where the ray enters it, as the bits of a non-negative float above those of the
/// child, so that entries compare like their distances.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub(super) struct Entry(u64);

impl Entry {
    #[inline(always)]
    pub(super) fn new(t: f32, child: Child) -> Self {
        Self(u64::from(t.to_bits()) << 32 | u64::from(child.0))
    }

    /// A node and those of its children (one bit each) that are still to visit.
    #[inline(always)]
    pub(super) fn rest(mask: u32, node: Child) -> Self {
        Self(u64::from(mask) << 32 | u64::from(node.0))
    }

    #[inline(always)]
    pub(super) fn mask(self) -> u32 {
        (self.0 >> 32) as u32
    }

    #[inline(always)]
    pub(super) fn t(self) -> f32 {
        f32::from_bits((self.0 >> 32) as u32)
    }

    #[inline(always)]
    pub(super) fn child(self) -> Child {
        Child(self.0 as u32)
    }
}

/// The stack. How many entries it holds is kept by its user, in a register.
pub(super) struct Stack {
    entries: [MaybeUninit<u64>; CAPACITY],
}

/// Number of entries, all of them written. Made only by [`Stack`].
#[derive(Clone, Copy, PartialEq, Eq)]
pub(super) struct Height(usize);

impl Height {
    pub(super) const EMPTY: Self = Self(0);
}

impl Stack {
    #[inline(always)]
    pub(super) fn new() -> Self {
        Self { entries: [const { MaybeUninit::uninit() }; CAPACITY] }
    }

    /// Panics when full, which the depth of the trees rules out.
    #[inline(always)]
    pub(super) fn push(&mut self, height: &mut Height, entry: Entry) {
        self.entries[height.0].write(entry.0);
        height.0 += 1;
    }

    #[inline(always)]
    pub(super) fn pop(&self, height: &mut Height) -> Option<Entry> {
        height.0 = height.0.checked_sub(1)?;
        // SAFETY: entries below the old height have been written.
        Some(Entry(unsafe { self.entries[height.0].assume_init() }))
    }

    /// Pushes onto the part from `base` upwards, which is kept in descending order.
    #[inline(always)]
    pub(super) fn insert(&mut self, base: Height, height: &mut Height, entry: Entry) {
        let mut i = height.0;
        self.push(height, entry);
        while i > base.0 {
            // SAFETY: `i - 1` lies below the old height.
            let below = unsafe { self.entries[i - 1].assume_init() };
            if below >= entry.0 {
                break;
            }
            self.entries[i].write(below);
            i -= 1;
        }
        self.entries[i].write(entry.0);
    }
}
