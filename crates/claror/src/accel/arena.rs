//! One piece of memory for all nodes and leaf blocks of a tree: aligned to cache lines, and on
//! Linux in huge pages where the system has them to give, because a ray's way through a large tree
//! otherwise misses the table of page addresses at almost every step.
#![expect(unsafe_code, reason = "memory with an alignment that `Vec` does not offer")]

use std::alloc::{Layout, alloc, dealloc, handle_alloc_error};
use std::ops::{Deref, DerefMut};
use std::ptr::NonNull;

/// The unit in which the arena is divided.
#[derive(Debug, Clone, Copy, PartialEq)]
#[repr(C, align(32))]
pub(super) struct Row(pub(super) [f32; 8]);

/// The same rows, cut into pieces of `N` numbers.
#[inline(always)]
pub(super) fn cut<const ROWS: usize, const N: usize, const PIECES: usize>(
    rows: &[Row; ROWS],
) -> &[[f32; N]; PIECES] {
    const { assert!(N * PIECES == 8 * ROWS) };
    // SAFETY: same size, no stronger alignment, plain floats.
    unsafe { &*std::ptr::from_ref(rows).cast() }
}

/// A huge page of x86-64 (and of most others).
const HUGE_PAGE: usize = 2 << 20;
const CACHE_LINE: usize = 64;

/// A fixed number of rows, the first at the beginning of a cache line.
pub(super) struct Arena {
    rows: NonNull<Row>,
    len: usize,
}

// SAFETY: the arena owns its rows, as a `Vec` would.
unsafe impl Send for Arena {}
// SAFETY: shared references only read.
unsafe impl Sync for Arena {}

impl Arena {
    /// `len` rows of zeros.
    pub(super) fn zeroed(len: usize) -> Self {
        if len == 0 {
            return Self { rows: NonNull::dangling(), len };
        }
        let layout = Self::layout(len);
        // SAFETY: the size is not zero.
        let start = unsafe { alloc(layout) };
        let Some(rows) = NonNull::new(start.cast::<Row>()) else { handle_alloc_error(layout) };
        advise_huge_pages(start, layout.size());
        for i in 0..len {
            // SAFETY: within the allocation.
            unsafe { rows.add(i).write(Row([0.0; 8])) };
        }
        Self { rows, len }
    }

    fn layout(len: usize) -> Layout {
        let size = len * size_of::<Row>();
        let align = if size >= HUGE_PAGE { HUGE_PAGE } else { CACHE_LINE };
        Layout::from_size_align(size, align).expect("far below the size of the address space")
    }
}

/// Asks for huge pages before the memory is touched. A hint: it may fail, and nothing depends on
/// it.
#[cfg(target_os = "linux")]
fn advise_huge_pages(start: *mut u8, size: usize) {
    if size >= HUGE_PAGE {
        // SAFETY: whole pages of our own allocation (it begins at a page, and what remains of its
        // last page is left out); the advice does not change their contents.
        let _ = unsafe {
            rustix::mm::madvise(
                start.cast(),
                size / HUGE_PAGE * HUGE_PAGE,
                rustix::mm::Advice::LinuxHugepage,
            )
        };
    }
}

#[cfg(not(target_os = "linux"))]
fn advise_huge_pages(_: *mut u8, _: usize) {}

impl Deref for Arena {
    type Target = [Row];

    #[inline(always)]
    fn deref(&self) -> &[Row] {
        // SAFETY: all `len` rows have been written.
        unsafe { std::slice::from_raw_parts(self.rows.as_ptr(), self.len) }
    }
}

impl DerefMut for Arena {
    fn deref_mut(&mut self) -> &mut [Row] {
        // SAFETY: all `len` rows have been written, and the borrow is exclusive.
        unsafe { std::slice::from_raw_parts_mut(self.rows.as_ptr(), self.len) }
    }
}

impl Clone for Arena {
    fn clone(&self) -> Self {
        let mut copy = Self::zeroed(self.len);
        copy.copy_from_slice(self);
        copy
    }
}

impl Drop for Arena {
    fn drop(&mut self) {
        if self.len > 0 {
            // SAFETY: allocated with this layout.
            unsafe { dealloc(self.rows.as_ptr().cast(), Self::layout(self.len)) };
        }
    }
}

impl std::fmt::Debug for Arena {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "Arena({} rows)", self.len)
    }
}
