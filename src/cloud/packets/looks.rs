//! Where the firings of a packet looked.

use super::PacketRefusal;
use crate::wire::velodyne::data::{
    BLOCKS, DataPacket, FIRINGS_PER_BLOCK, LASERS, Return, ReturnMode,
};

/// Firings of a packet in which every pulse has one return.
const MOST: usize = BLOCKS * FIRINGS_PER_BLOCK;

/// Steps from firing to firing that a VLP-16 can make, in degrees: from 4 to 22 turns a second, of blocks whose azimuths
/// are rounded to 0.01.
const STEPS_DEG: std::ops::RangeInclusive<f64> = 0.075..=0.45;

/// The firings of a packet.
#[derive(Debug, Clone, Copy)]
pub(super) struct Looks {
    azimuths_deg: [f64; MOST],
    step_deg: f64,
    /// Blocks for each pair of firings: two where pulses have two returns.
    blocks: usize,
}

impl Looks {
    /// Of a packet. A block says where its first firing looked; the second one looked half way to the
    /// next block (user manual, section 9.5).
    ///
    /// # Errors
    /// Where no sensor that turns can have looked so.
    pub(super) fn of(data: &DataPacket<'_>, mode: ReturnMode) -> Result<Self, PacketRefusal> {
        let blocks = if mode == ReturnMode::Dual { 2 } else { 1 };
        let mut looks = Self {
            azimuths_deg: [0.0; MOST],
            step_deg: 0.0,
            blocks,
        };
        let degrees_of = |block| -> Result<f64, PacketRefusal> {
            let hundredths = data
                .azimuth(block)
                .ok_or(PacketRefusal::Azimuth { block })?;
            Ok(f64::from(hundredths) / 100.0)
        };
        let pairs = BLOCKS / blocks;
        let (mut turned_deg, mut half_deg) = (0.0, 0.0);
        for pair in 0..pairs {
            let block = pair * blocks;
            let first_deg = degrees_of(block)?;
            // Both returns of a pulse lie in the same direction.
            if blocks == 2 && degrees_of(block + 1)? != first_deg {
                return Err(PacketRefusal::Azimuth { block: block + 1 });
            }
            if pair + 1 < pairs {
                half_deg = 0.5 * (degrees_of(block + blocks)? - first_deg).rem_euclid(360.0);
                if !STEPS_DEG.contains(&half_deg) {
                    return Err(PacketRefusal::Azimuth {
                        block: block + blocks,
                    });
                }
                turned_deg += 2.0 * half_deg;
            }
            looks.azimuths_deg[2 * pair] = first_deg;
            looks.azimuths_deg[2 * pair + 1] = (first_deg + half_deg).rem_euclid(360.0);
        }
        looks.step_deg = turned_deg / (2 * (pairs - 1)) as f64;
        Ok(looks)
    }

    /// How many firings there are.
    pub(super) fn len(&self) -> usize {
        MOST / self.blocks
    }

    /// Where the first laser of a firing looked.
    pub(super) fn azimuth_deg(&self, firing: usize) -> f64 {
        self.azimuths_deg[firing]
    }

    /// From firing to firing on average.
    pub(super) fn step_deg(&self) -> f64 {
        self.step_deg
    }

    /// Whether pulses have two returns.
    pub(super) fn is_dual(&self) -> bool {
        self.blocks == 2
    }

    /// The nearest return of a laser in a firing, and the farthest.
    pub(super) fn returns(
        &self,
        data: &DataPacket<'_>,
        firing: usize,
        laser: usize,
    ) -> [Return; 2] {
        debug_assert!(laser < LASERS);
        let (block, second) = (firing / 2 * self.blocks, firing % 2);
        let one = data.at(block, second, laser);
        if !self.is_dual() {
            return [one, one];
        }
        let other = data.at(block + 1, second, laser);
        match (one.distance, other.distance) {
            (0, _) => [other, other],
            (_, 0) => [one, one],
            (distance, than) if distance <= than => [one, other],
            _ => [other, one],
        }
    }
}
