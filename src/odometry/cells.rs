//! A table of what is in the cells of space around the sensor: it holds so much and no more, and forgets first
//! what was not met for the longest time.

use nalgebra::Vector3;

/// Side of a cell.
pub(super) const CELL_M: f64 = 1.0;
/// Cells with the same hash.
const WAYS: usize = 4;
/// Way of the sensor after which a cell that was not met is forgotten: by then the odometry has drifted.
const KEPT_WAY_M: f32 = 80.0;

/// Things in cells.
#[derive(Debug, Clone)]
pub(super) struct Cells<T> {
    /// What tells the cells apart lies together: most of what is looked up is not there.
    labels: Box<[Labels]>,
    contents: Box<[[T; WAYS]]>,
    /// How far the sensor has gone.
    way_m: f64,
    /// Counts the revolutions, to tell old cells.
    turn: u32,
}

/// Of the cells with one hash.
#[derive(Debug, Clone, Copy)]
#[repr(align(64))]
struct Labels {
    keys: [u64; WAYS],
    /// Where the sensor was on its way when each was last met, and when.
    met_m: [f32; WAYS],
    turns: [u32; WAYS],
}

const UNUSED: Labels = Labels {
    keys: [u64::MAX; WAYS],
    met_m: [f32::NEG_INFINITY; WAYS],
    turns: [0; WAYS],
};

impl Labels {
    fn find(&self, key: u64, oldest_m: f32) -> Option<usize> {
        (0..WAYS).find(|way| self.keys[*way] == key && self.met_m[*way] >= oldest_m)
    }
}

impl<T: Copy + Default> Cells<T> {
    /// Room for four times `sets` cells, a power of two.
    pub(super) fn new(sets: usize) -> Self {
        Self {
            labels: vec![UNUSED; sets].into_boxed_slice(),
            contents: vec![[T::default(); WAYS]; sets].into_boxed_slice(),
            way_m: 0.0,
            turn: 0,
        }
    }

    pub(super) fn clear(&mut self) {
        self.labels.fill(UNUSED);
        (self.way_m, self.turn) = (0.0, 0);
    }

    /// The sensor has gone so far in a revolution.
    pub(super) fn advance(&mut self, way_m: f64) {
        self.way_m += way_m;
        self.turn += 1;
    }

    pub(super) fn get(&self, key: u64) -> Option<&T> {
        let set = self.set_of(key);
        let way = self.labels[set].find(key, self.way_m as f32 - KEPT_WAY_M)?;
        Some(&self.contents[set][way])
    }

    /// What is in a cell, to be changed; the cell counts as met now.
    pub(super) fn meet(&mut self, key: u64) -> &mut T {
        let set = self.set_of(key);
        let labels = &mut self.labels[set];
        let way_m = self.way_m as f32;
        let way = labels.find(key, way_m - KEPT_WAY_M).unwrap_or_else(|| {
            let turns = &labels.turns;
            let oldest = (1..WAYS).fold(0, |a, b| if turns[b] < turns[a] { b } else { a });
            labels.keys[oldest] = key;
            self.contents[set][oldest] = T::default();
            oldest
        });
        (labels.met_m[way], labels.turns[way]) = (way_m, self.turn);
        &mut self.contents[set][way]
    }

    /// Fibonacci hashing (Knuth, volume 3, section 6.4).
    fn set_of(&self, key: u64) -> usize {
        let mixed = (key ^ key >> 32).wrapping_mul(0x9e37_79b9_7f4a_7c15);
        // The length is a power of two: no set lies beyond it.
        (mixed >> 40) as usize & (self.labels.len() - 1)
    }
}

/// The key of the cell of a place, and the cell's middle.
pub(super) fn cell_of(at_m: &Vector3<f64>) -> (u64, Vector3<f64>) {
    /// Cells along an axis, beyond which places repeat.
    const SIDE: u64 = (1 << 21) - 1;
    let cells = at_m.map(|metres| floor(metres * (1.0 / CELL_M)));
    let part = |cell: i64| cell as u64 & SIDE;
    let key = part(cells.x) | part(cells.y) << 21 | part(cells.z) << 42;
    (key, cells.map(|cell| (cell as f64 + 0.5) * CELL_M))
}

/// The greatest whole number that is no more; in a few instructions, unlike the library's.
fn floor(value: f64) -> i64 {
    let whole = value as i64;
    whole - i64::from(whole as f64 > value)
}
