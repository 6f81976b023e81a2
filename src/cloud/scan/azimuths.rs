//! Where the columns of a scan look.

use std::f64::consts::TAU;

/// Where the columns of a scan look.
#[derive(Debug, Clone, Copy, Default)]
pub struct Azimuths {
    pub(super) columns: usize,
    pub(super) start_rad: f64,
    pub(super) step_rad: f64,
    pub(super) sees_all_round: bool,
}

impl Azimuths {
    /// How many there are.
    pub fn columns(&self) -> usize {
        self.columns
    }

    /// Between two columns, in radians clockwise.
    pub fn step_rad(&self) -> f64 {
        self.step_rad
    }

    /// The column so many after another one, where there is one.
    pub fn column_beside(&self, column: usize, after: isize) -> Option<usize> {
        let columns = self.columns as isize;
        let beside = column as isize + after;
        if (0..columns).contains(&beside) {
            Some(beside as usize)
        } else {
            let around = || beside.rem_euclid(columns.max(1)) as usize;
            self.sees_all_round.then(around)
        }
    }

    /// The column nearest to an azimuth, in radians clockwise from y.
    pub fn column_at(&self, azimuth_rad: f64) -> usize {
        let turn_rad = azimuth_rad - self.start_rad;
        let turn_rad = turn_rad - TAU * libm::floor(turn_rad / TAU);
        let beyond_rad = turn_rad - self.columns as f64 * libm::fabs(self.step_rad);
        if !self.sees_all_round && beyond_rad > 0.5 * (TAU - turn_rad + beyond_rad) {
            return 0;
        }
        let column = libm::round(turn_rad / libm::fabs(self.step_rad).max(1e-9)) as usize;
        let column = column.min(self.columns.saturating_sub(1));
        if self.step_rad < 0.0 {
            (self.columns - column) % self.columns.max(1)
        } else {
            column
        }
    }
}
