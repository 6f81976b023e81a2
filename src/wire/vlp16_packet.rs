//! VLP-16 data packets to point clouds, as the OpenDLV device service makes them: the same
//! distances and azimuths, byte for byte, its limits included.

use super::point_cloud::{ByteOrder, CompactPointCloud};

/// Length of a data packet's UDP payload (VLP-16 user manual, chapter 9).
pub const PACKET_LEN: usize = 1206;

const BLOCKS: usize = 12;
const BLOCK_LEN: usize = 100;
const BLOCK_FLAG: [u8; 2] = [0xff, 0xee];
const CHANNELS: usize = 16;
const CHANNEL_LEN: usize = 3;
/// Lasers of a firing by rising elevation: they fire as -15, 1, -13, 3, ... 15 degrees.
const LASER_BY_LAYER: [usize; CHANNELS] = [0, 2, 4, 6, 8, 10, 12, 14, 1, 3, 5, 7, 9, 11, 13, 15];
/// Distances are in units of 2 mm and leave in centimetres, cut off.
const UNITS_PER_CENTIMETRE: u16 = 5;
/// The device service stores no more columns than this (30,000 points).
const MOST_COLUMNS: usize = 30_000 / CHANNELS;

/// Why a payload is no data packet.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
pub enum PacketError {
    /// Not the length of a data packet.
    #[error("{length} bytes, a VLP-16 data packet has {PACKET_LEN}")]
    Length {
        /// Its length.
        length: usize,
    },
    /// A block does not begin with its flag.
    #[error("block {block} does not begin with ff ee")]
    Flag {
        /// Which block, from 0.
        block: usize,
    },
}

/// A revolution that is complete.
#[derive(Debug, Clone, PartialEq)]
pub struct Sweep {
    start_azimuth_deg: f32,
    end_azimuth_deg: f32,
    distances: Vec<u8>,
}

impl Sweep {
    /// The revolution as a message.
    pub fn cloud(&self) -> CompactPointCloud<'_> {
        CompactPointCloud {
            start_azimuth_deg: self.start_azimuth_deg,
            end_azimuth_deg: self.end_azimuth_deg,
            layers: CHANNELS as u8,
            distances: &self.distances,
            ..CompactPointCloud::default()
        }
    }
}

/// Puts packets together to revolutions.
#[derive(Debug, Clone, Default)]
pub struct SweepAssembler {
    start_azimuth_deg: f32,
    previous_azimuth_deg: f32,
    distances: Vec<u8>,
}

impl SweepAssembler {
    /// Columns that wait for their revolution's end.
    pub fn pending_columns(&self) -> usize {
        self.distances.len() / (2 * CHANNELS)
    }

    /// Takes one packet; gives the revolutions that it closes.
    ///
    /// # Errors
    /// [`PacketError`] when it is no data packet; it is then passed over as a whole.
    pub fn take(&mut self, packet: &[u8]) -> Result<Vec<Sweep>, PacketError> {
        if packet.len() != PACKET_LEN {
            return Err(PacketError::Length {
                length: packet.len(),
            });
        }
        let blocks: Vec<&[u8]> = packet.chunks_exact(BLOCK_LEN).take(BLOCKS).collect();
        if let Some(block) = blocks.iter().position(|block| block[..2] != BLOCK_FLAG) {
            return Err(PacketError::Flag { block });
        }
        let mut closed = vec![];
        let mut first_deg = azimuth_deg(blocks[0]);
        let mut half_step_deg = 0.0;
        for (index, block) in blocks.iter().enumerate() {
            // The last block has no next one and goes on as the one before. Azimuths past the
            // end of the circle come back by subtraction, which rounds: the device's do, too.
            let next_deg = blocks.get(index + 1).map(|next| match azimuth_deg(next) {
                next_deg if next_deg < first_deg => next_deg + 360.0,
                next_deg => next_deg,
            });
            if let Some(next_deg) = next_deg {
                half_step_deg = (next_deg - first_deg) / 2.0;
            }
            let (first, second) = block[4..].split_at(CHANNELS * CHANNEL_LEN);
            closed.extend(self.take_firing(first_deg, first));
            closed.extend(self.take_firing(on_circle(first_deg + half_step_deg), second));
            first_deg = on_circle(next_deg.unwrap_or(first_deg));
        }
        Ok(closed)
    }

    /// A step back in azimuth closes the revolution.
    fn take_firing(&mut self, azimuth_deg: f32, channels: &[u8]) -> Option<Sweep> {
        let closed = (azimuth_deg < self.previous_azimuth_deg).then(|| Sweep {
            start_azimuth_deg: std::mem::replace(&mut self.start_azimuth_deg, azimuth_deg),
            end_azimuth_deg: self.previous_azimuth_deg,
            distances: std::mem::take(&mut self.distances),
        });
        self.previous_azimuth_deg = azimuth_deg;
        if self.pending_columns() < MOST_COLUMNS {
            for laser in LASER_BY_LAYER {
                let channel = &channels[laser * CHANNEL_LEN..];
                let units = u16::from_le_bytes([channel[0], channel[1]]);
                let distance = ByteOrder::Big.split(units / UNITS_PER_CENTIMETRE);
                self.distances.extend_from_slice(&distance);
            }
        }
        closed
    }
}

/// 360 itself stays, as in the device service.
fn on_circle(azimuth_deg: f32) -> f32 {
    if azimuth_deg > 360.0 {
        azimuth_deg - 360.0
    } else {
        azimuth_deg
    }
}

fn azimuth_deg(block: &[u8]) -> f32 {
    f32::from(u16::from_le_bytes([block[2], block[3]])) / 100.0
}

#[cfg(test)]
mod tests {
    use super::*;

    fn packet(first_hundredths: u16) -> Vec<u8> {
        let mut packet = vec![];
        for block in 0..12u16 {
            packet.extend(BLOCK_FLAG);
            packet.extend(((first_hundredths + 40 * block) % 36_000).to_le_bytes());
            for channel in 0..32u16 {
                packet.extend((1000 + 5 * (channel % 16)).to_le_bytes());
                packet.push(7);
            }
        }
        packet.extend([0; 6]);
        packet
    }

    #[test]
    fn a_step_back_in_azimuth_closes_a_revolution() {
        let mut assembler = SweepAssembler::default();
        assert_eq!(assembler.take(&packet(100)), Ok(vec![]));
        let closed = assembler.take(&packet(35_900)).unwrap();
        let cloud = closed[0].cloud();
        assert_eq!((closed.len(), cloud.columns()), (1, 24 + 6));
        assert_eq!(
            (cloud.start_azimuth_deg, cloud.end_azimuth_deg),
            (0.0, 360.0)
        );
        assert_eq!(assembler.pending_columns(), 18);
    }

    #[test]
    fn layers_rise_with_elevation() {
        let mut assembler = SweepAssembler::default();
        assembler.take(&packet(0)).unwrap();
        let column = &assembler.distances[..32];
        let found: Vec<u16> = column
            .chunks(2)
            .map(|two| u16::from_be_bytes([two[0], two[1]]))
            .collect();
        assert_eq!(found[..4], [200, 202, 204, 206]);
        assert_eq!(found[8..11], [201, 203, 205]);
    }

    #[test]
    fn what_is_no_data_packet_is_named() {
        let mut assembler = SweepAssembler::default();
        assert_eq!(
            assembler.take(&[0; 512]),
            Err(PacketError::Length { length: 512 })
        );
        let mut broken = packet(0);
        broken[300] = 0;
        assert_eq!(assembler.take(&broken), Err(PacketError::Flag { block: 3 }));
        assert_eq!(assembler.pending_columns(), 0);
    }
}
