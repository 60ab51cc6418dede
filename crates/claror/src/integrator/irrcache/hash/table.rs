//! Sums by cell.

use super::CellIrradiance;
use crate::spectrum::Rgb;

/// What was found in a cell.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Slot {
    /// 0: empty.
    key: u64,
    /// Of indirect and direct irradiance.
    sum: [f64; 6],
    /// Of the squares of the luminance of direct irradiance.
    squares: f64,
    visits: u32,
}

/// Direct irradiance is known from so many visits on, where its standard error is at most this
/// share of it: light sampling may be much noisier than what it is to stand for.
const LEAST_LIT: u32 = 16;
const LARGEST_ERROR: f64 = 0.15;

impl Slot {
    fn mean(&self) -> CellIrradiance {
        let n = f64::from(self.visits);
        let [a, b, c, d, e, f] = self.sum.map(|s| (s / n) as f32);
        let direct = Rgb::from([d, e, f]);
        let mean = f64::from(direct.luminance());
        let variance = (self.squares / n - mean * mean).max(0.0) / n;
        let is_known = self.visits >= LEAST_LIT && variance <= (LARGEST_ERROR * mean).powi(2);
        CellIrradiance { indirect: Rgb::from([a, b, c]), direct: is_known.then_some(direct) }
    }
}

const EMPTY: Slot = Slot { key: 0, sum: [0.0; 6], squares: 0.0, visits: 0 };

/// Open addressing; a power of two of slots, at most half of them occupied.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Table {
    slots: Vec<Slot>,
    occupied: usize,
}

impl Table {
    pub(super) fn new() -> Self {
        Self { slots: vec![EMPTY; 16], occupied: 0 }
    }

    pub(super) fn is_empty(&self) -> bool {
        self.occupied == 0
    }

    /// Adds a value to a cell; sums depend on the order of the calls. `key` is a hash, not 0.
    pub(super) fn add(&mut self, key: u64, indirect: Rgb, direct: Rgb) {
        if 2 * (self.occupied + 1) > self.slots.len() {
            self.grow();
        }
        let at = self.find(key);
        let slot = &mut self.slots[at];
        self.occupied += usize::from(slot.key == 0);
        slot.key = key;
        slot.visits += 1;
        slot.squares += f64::from(direct.luminance()).powi(2);
        let values = indirect.to_array().into_iter().chain(direct.to_array());
        for (sum, v) in slot.sum.iter_mut().zip(values) {
            *sum += f64::from(v);
        }
    }

    /// Means of all cells that were visited at least `least` times.
    pub(super) fn means(&self, least: u32) -> impl Iterator<Item = (u64, CellIrradiance)> {
        let full = self.slots.iter().filter(move |slot| slot.key != 0 && slot.visits >= least);
        full.map(|slot| (slot.key, slot.mean()))
    }

    /// The slot of this key, or the empty one where it would be.
    fn find(&self, key: u64) -> usize {
        let mask = self.slots.len() - 1;
        let mut at = key as usize & mask;
        while self.slots[at].key != 0 && self.slots[at].key != key {
            at = (at + 1) & mask;
        }
        at
    }

    fn grow(&mut self) {
        let old = std::mem::take(&mut self.slots);
        self.slots = vec![EMPTY; 2 * old.len()];
        for slot in old.into_iter().filter(|slot| slot.key != 0) {
            let at = self.find(slot.key);
            self.slots[at] = slot;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn cells_keep_their_means_while_the_table_grows() {
        let mut table = Table::new();
        for round in 0..3 {
            for i in 1..2000_u64 {
                let value = Rgb::splat((i * round) as f32);
                table.add(i.wrapping_mul(0x9e37_79b9_7f4a_7c15), value, Rgb::WHITE);
            }
        }
        table.add(12_345, Rgb::WHITE, Rgb::WHITE);
        let means: Vec<(u64, CellIrradiance)> = table.means(3).collect();
        assert_eq!(means.len(), 1999, "one cell was visited once");
        for (key, mean) in means {
            // The multiplier's inverse modulo 2^64.
            let i = key.wrapping_mul(0xf1de_83e1_9937_733d);
            assert_eq!(mean, CellIrradiance { indirect: Rgb::splat(i as f32), direct: None });
        }
    }
    #[test]
    fn direct_irradiance_is_known_where_it_is_certain() {
        let direct = |values: &[f32]| {
            let mut table = Table::new();
            values.iter().for_each(|&v| table.add(7, Rgb::BLACK, Rgb::splat(v)));
            table.means(1).next().expect("one cell").1.direct
        };
        assert_eq!(direct(&[2.0; 16]), Some(Rgb::splat(2.0)));
        assert_eq!(direct(&[0.0; 16]), Some(Rgb::BLACK));
        assert_eq!(direct(&[2.0; 15]), None, "few visits");
        // Half of them lit: a relative deviation of 1, of the mean 1/4 and 1/8.
        let mixed = |n: usize| (0..n).map(|i| 2.0 * (i % 2) as f32).collect::<Vec<f32>>();
        assert_eq!(direct(&mixed(16)), None);
        assert_eq!(direct(&mixed(64)), Some(Rgb::WHITE));
    }
}
