//! The stack of nodes still to visit: fixed in size and not initialised, because clearing it would
//! cost a short ray more than tracing it.
#![expect(unsafe_code, reason = "reads of entries below the stack pointer, all of them written")]

use super::node::{Child, MAX_DEPTH, WIDTH};
use std::mem::MaybeUninit;

/// A node leaves at most seven of its children behind.
const CAPACITY: usize = MAX_DEPTH * (WIDTH - 1) + 1;

/// A child and where the ray enters it: as the bits of a non-negative float above those of the
/// child, so that entries compare like their distances.
#[derive(Debug, Clone, Copy)]
pub(super) struct Entry(pub(super) u64);

impl Entry {
    #[inline(always)]
    pub(super) fn new(t: f32, child: Child) -> Self {
        Self(u64::from(t.to_bits()) << 32 | u64::from(child.0))
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

/// The stack. Entries below `len` have been written.
pub(super) struct Stack {
    entries: [MaybeUninit<u64>; CAPACITY],
    len: usize,
}

impl Stack {
    #[inline(always)]
    pub(super) fn new() -> Self {
        Self { entries: [const { MaybeUninit::uninit() }; CAPACITY], len: 0 }
    }

    #[inline(always)]
    pub(super) fn len(&self) -> usize {
        self.len
    }

    /// Panics when full, which the depth of the trees rules out.
    #[inline(always)]
    pub(super) fn push(&mut self, entry: Entry) {
        self.entries[self.len].write(entry.0);
        self.len += 1;
    }

    #[inline(always)]
    pub(super) fn pop(&mut self) -> Option<Entry> {
        self.len = self.len.checked_sub(1)?;
        // SAFETY: entries below the old `len` have been written.
        Some(Entry(unsafe { self.entries[self.len].assume_init() }))
    }

    /// Pushes onto the part from `base` upwards, which is kept in descending order.
    #[inline(always)]
    pub(super) fn insert(&mut self, base: usize, entry: Entry) {
        let mut i = self.len;
        self.push(entry);
        while i > base {
            // SAFETY: `i - 1` lies below the old `len`.
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
