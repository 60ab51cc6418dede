//! Sums by cell.

use super::CellIrradiance;

/// What was found in a cell.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Slot {
    /// 0: empty.
    key: u64,
    sum: [f64; 6],
    visits: u32,
}

const EMPTY: Slot = Slot { key: 0, sum: [0.0; 6], visits: 0 };

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
    pub(super) fn add(&mut self, key: u64, value: CellIrradiance) {
        if 2 * (self.occupied + 1) > self.slots.len() {
            self.grow();
        }
        let at = self.find(key);
        let slot = &mut self.slots[at];
        self.occupied += usize::from(slot.key == 0);
        slot.key = key;
        slot.visits += 1;
        for (sum, v) in slot.sum.iter_mut().zip(value.to_array()) {
            *sum += f64::from(v);
        }
    }

    /// Means of all cells that were visited at least `least` times.
    pub(super) fn means(&self, least: u32) -> impl Iterator<Item = (u64, CellIrradiance)> {
        let full = self.slots.iter().filter(move |slot| slot.key != 0 && slot.visits >= least);
        full.map(|slot| {
            (slot.key, CellIrradiance::from(slot.sum.map(|s| (s / f64::from(slot.visits)) as f32)))
        })
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
                table.add(i.wrapping_mul(0x9e37_79b9_7f4a_7c15), Rgb::splat((i * round) as f32));
            }
        }
        table.add(12_345, Rgb::WHITE);
        let means: Vec<(u64, Rgb)> = table.means(3).collect();
        assert_eq!(means.len(), 1999, "one cell was visited once");
        for (key, mean) in means {
            // The multiplier's inverse modulo 2^64.
            let i = key.wrapping_mul(0xf1de_83e1_9937_733d);
            assert_eq!(mean, Rgb::splat(i as f32));
        }
    }
}
