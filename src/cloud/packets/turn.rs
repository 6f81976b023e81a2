//! The firings of one revolution, in the order in which they were fired.

use super::looks::Looks;
use crate::cloud::sensor::{Sensor, VLP16};
use crate::cloud::{CloudParameters, MAX_COLUMNS, Refusal};
use crate::wire::velodyne::data::{DataPacket, LASER_BY_LAYER, LASER_PERIOD_S, LASERS};

/// Firings that are kept: those of a sensor that turns at 4.52 Hz. If they are more than the array has columns, two
/// are made one.
const MOST: usize = 2 * MAX_COLUMNS;

/// Two returns nearer to each other than 0.1 m, in units of 2 mm, are of one surface, and the mean of both is better than either.
const ONE_SURFACE: u16 = 50;

/// What came back of a firing, layers by rising elevation.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(in crate::cloud) struct Firing {
    /// Whether it was heard of at all.
    pub(in crate::cloud) is_seen: bool,
    /// Distances of the nearest returns, in the unit of the packets.
    pub(in crate::cloud) nearest: [u16; LASERS],
    /// Distances of the farthest.
    pub(in crate::cloud) farthest: [u16; LASERS],
    /// Of the nearest.
    pub(in crate::cloud) reflectivity: [u8; LASERS],
}

const UNSEEN: Firing = Firing {
    is_seen: false,
    nearest: [0; LASERS],
    farthest: [0; LASERS],
    reflectivity: [0; LASERS],
};

/// A revolution as it is put together.
#[derive(Debug, Clone)]
pub struct Turn {
    /// Whose it is.
    pub(super) sensor: &'static Sensor,
    is_dual: bool,
    azimuths_deg: Vec<f64>,
    firings: Vec<Firing>,
    seen: usize,
    /// Firings that were pushed, with those for which there was no room.
    pushed: usize,
    /// Firings that were made one.
    merged: usize,
}

impl Default for Turn {
    fn default() -> Self {
        Self {
            sensor: &VLP16,
            is_dual: false,
            azimuths_deg: Vec::with_capacity(MOST),
            firings: Vec::with_capacity(MOST),
            seen: 0,
            pushed: 0,
            merged: 1,
        }
    }
}

impl Turn {
    pub(super) fn clear(&mut self) {
        self.azimuths_deg.clear();
        self.firings.clear();
        (self.is_dual, self.seen, self.pushed, self.merged) = (false, 0, 0, 1);
    }

    /// Adds a firing that was not seen yet.
    pub(super) fn push(&mut self, azimuth_deg: f64) {
        self.pushed += 1;
        if self.firings.len() < MOST {
            self.azimuths_deg.push(azimuth_deg);
            self.firings.push(UNSEEN);
        } else if let Some(last_deg) = self.azimuths_deg.last_mut() {
            *last_deg = azimuth_deg;
        }
    }

    /// Says what came back of a firing. Gives whether that was not known.
    pub(super) fn fill_in(
        &mut self,
        place: usize,
        data: &DataPacket<'_>,
        looks: &Looks,
        firing: usize,
    ) -> bool {
        let Some(into) = self.firings.get_mut(place).filter(|into| !into.is_seen) else {
            return false;
        };
        self.is_dual |= looks.is_dual();
        self.seen += 1;
        into.is_seen = true;
        for (layer, laser) in LASER_BY_LAYER.into_iter().enumerate() {
            let [nearest, farthest] = looks.returns(data, firing, laser);
            into.nearest[layer] = nearest.distance;
            into.farthest[layer] = farthest.distance;
            into.reflectivity[layer] = nearest.reflectivity;
        }
        true
    }

    /// Where the last firing looked.
    pub(super) fn last_deg(&self) -> Option<f64> {
        self.azimuths_deg.last().copied()
    }

    /// Whether it can be used.
    pub(super) fn check(&self, parameters: &CloudParameters) -> Result<(), Refusal> {
        let missing = self.pushed - self.seen;
        if self.pushed > MOST {
            Err(Refusal::TooManyColumns {
                columns: self.pushed.div_ceil(2),
            })
        } else if missing as f64 > parameters.most_lost_share * self.pushed as f64 {
            Err(Refusal::LostPackets {
                missing,
                columns: self.pushed,
            })
        } else {
            Ok(())
        }
    }

    /// Makes two firings one where there are more than the array has columns.
    pub(super) fn finish(&mut self) {
        if self.firings.len() <= MAX_COLUMNS {
            return;
        }
        let pairs = self.firings.len() / 2;
        for pair in 0..pairs {
            let [one, other] = [2 * pair, 2 * pair + 1];
            self.firings[pair] = self.firings[one].with(&self.firings[other]);
            self.azimuths_deg[pair] = self.azimuths_deg[one];
        }
        self.firings.truncate(pairs);
        self.azimuths_deg.truncate(pairs);
        self.merged = 2;
    }

    /// How many firings there are.
    pub(super) fn len(&self) -> usize {
        self.pushed / self.merged
    }

    /// How many firings are one column.
    pub(super) fn merged(&self) -> usize {
        self.merged
    }

    pub(super) fn start_deg(&self) -> f64 {
        self.azimuths_deg.first().copied().unwrap_or(0.0)
    }

    /// From column to column on average.
    pub(super) fn step_deg(&self) -> f64 {
        let span_deg = self.last_deg().unwrap_or(0.0) - self.start_deg();
        span_deg / (self.azimuths_deg.len().max(2) - 1) as f64
    }

    pub(super) fn column_period_s(&self) -> f64 {
        self.merged as f64 * VLP16.column_period_s
    }

    /// Whether pulses have two returns.
    pub(in crate::cloud) fn is_dual(&self) -> bool {
        self.is_dual
    }

    /// Where each column's first laser looked, and what came back.
    pub(in crate::cloud) fn columns(&self) -> impl Iterator<Item = (f64, &Firing)> {
        self.azimuths_deg.iter().copied().zip(&self.firings)
    }

    /// How far the sensor has turned when a layer's laser fires, degrees after the first laser.
    pub(in crate::cloud) fn laser_turns_deg(&self) -> [f64; LASERS] {
        let per_second_deg = self.step_deg() / self.column_period_s();
        LASER_BY_LAYER.map(|laser| laser as f64 * LASER_PERIOD_S * per_second_deg)
    }
}

impl Firing {
    /// Two of them as one: the nearer surface, as obstacles are.
    fn with(&self, other: &Self) -> Self {
        if !self.is_seen || !other.is_seen {
            return if self.is_seen { *self } else { *other };
        }
        let mut both = *self;
        for layer in 0..LASERS {
            let near = merged([self.nearest[layer], other.nearest[layer]]);
            if near != self.nearest[layer] && self.nearest[layer] == 0 {
                both.reflectivity[layer] = other.reflectivity[layer];
            }
            both.nearest[layer] = near;
            both.farthest[layer] = merged([self.farthest[layer], other.farthest[layer]]);
        }
        both
    }
}

fn merged([one, other]: [u16; 2]) -> u16 {
    match (one, other) {
        (0, distance) | (distance, 0) => distance,
        _ if one.abs_diff(other) < ONE_SURFACE => one.midpoint(other),
        _ => one.min(other),
    }
}
