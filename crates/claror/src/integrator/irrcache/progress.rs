//! How far the first pass is, for whoever waits for it.

/// Asked between records.
pub type IsCancelled<'a> = &'a (dyn Fn() -> bool + Sync);

/// What the first pass is at.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum CachePhase {
    /// Walks that fill the hash.
    Walks,
    /// Records of the second, coarser cache.
    Deep,
    /// Records of the cache.
    Records,
}

impl CachePhase {
    /// For people and programs.
    pub fn name(self) -> &'static str {
        match self {
            Self::Walks => "walks",
            Self::Deep => "deep",
            Self::Records => "records",
        }
    }
}

/// How far it is.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CacheProgress {
    /// What it is at; phases follow each other in their order.
    pub phase: CachePhase,
    /// Share of the phase that is done, 0 to 1, which never falls; `None` if that is not known. Records
    /// are counted lattice by lattice, each the same share, since none is known to need more.
    pub fraction: Option<f64>,
    /// Stride of the lattice that is looked through, pixels.
    pub stride: Option<u32>,
    /// Records of this phase so far.
    pub records: usize,
    /// Rays of this phase so far.
    pub rays: u64,
}

/// Who watches the first pass. Nobody who watches changes what comes of it.
#[derive(Clone, Copy)]
pub struct CacheWatch<'a> {
    /// Whether to stop as soon as possible.
    pub is_cancelled: IsCancelled<'a>,
    /// Told between batches.
    pub progress: &'a (dyn Fn(&CacheProgress) + Sync),
}

impl<'a> CacheWatch<'a> {
    /// Somebody who wants to know nothing.
    pub fn silent(is_cancelled: IsCancelled<'a>) -> Self {
        Self { is_cancelled, progress: &|_| () }
    }

    pub(super) fn is_cancelled(&self) -> bool {
        (self.is_cancelled)()
    }

    pub(super) fn tell(&self, progress: &CacheProgress) {
        (self.progress)(progress);
    }
}

/// A share that is made of steps and does not fall.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Share {
    done: u32,
    all: u32,
    shown: f64,
}

impl Share {
    /// Of so many equal steps.
    pub(super) fn of(all: u32) -> Self {
        Self { done: 0, all, shown: 0.0 }
    }

    /// Ends a step; what comes after the last one counts as done.
    pub(super) fn step(&mut self) {
        self.done = (self.done + 1).min(self.all);
    }

    /// With so much of the present step done.
    pub(super) fn at(&mut self, part: f64) -> Option<f64> {
        if self.all == 0 {
            return None;
        }
        let now = (f64::from(self.done) + part.clamp(0.0, 1.0)) / f64::from(self.all);
        self.shown = self.shown.max(now.min(1.0));
        Some(self.shown)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn shares_never_fall() {
        let mut share = Share::of(2);
        assert_eq!([share.at(0.0), share.at(0.5), share.at(0.2)], [0.0, 0.25, 0.25].map(Some));
        share.step();
        assert_eq!([share.at(0.0), share.at(3.0)], [0.5, 1.0].map(Some));
        share.step();
        share.step();
        assert_eq!(share.at(0.5), Some(1.0));
        assert_eq!(Share::default().at(0.5), None);
    }
}
