//! Data packets to point clouds, as the OpenDLV device service makes them: the same distances and
//! azimuths, byte for byte, its limits included.

use super::data::{BLOCKS, DataPacket, LASER_BY_LAYER, LASERS, PacketError};
use crate::wire::point_cloud::{ByteOrder, CompactPointCloud};

/// Distances are in units of 2 mm and leave in centimetres, cut off.
const UNITS_PER_CENTIMETRE: u16 = 5;
/// The device service stores no more columns than this (30,000 points).
const MOST_COLUMNS: usize = 30_000 / LASERS;

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
            layers: LASERS as u8,
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
        self.distances.len() / (2 * LASERS)
    }

    /// Takes one packet; gives the revolutions that it closes.
    ///
    /// # Errors
    /// [`PacketError`] when it is no data packet; it is then passed over as a whole.
    pub fn take(&mut self, packet: &[u8]) -> Result<Vec<Sweep>, PacketError> {
        let packet = DataPacket::new(packet)?;
        let mut closed = vec![];
        let mut first_deg = packet.raw_azimuth_deg(0);
        let mut half_step_deg = 0.0;
        for block in 0..BLOCKS {
            // The last block has no next one and goes on as the one before. Azimuths past the
            // end of the circle come back by subtraction, which rounds: the device's do, too.
            let next_deg = (block + 1 < BLOCKS).then(|| match packet.raw_azimuth_deg(block + 1) {
                next_deg if next_deg < first_deg => next_deg + 360.0,
                next_deg => next_deg,
            });
            if let Some(next_deg) = next_deg {
                half_step_deg = (next_deg - first_deg) / 2.0;
            }
            let second_deg = on_circle(first_deg + half_step_deg);
            for (firing, azimuth_deg) in [first_deg, second_deg].into_iter().enumerate() {
                let distances =
                    LASER_BY_LAYER.map(|laser| packet.at(block, firing, laser).distance);
                closed.extend(self.take_firing(azimuth_deg, distances));
            }
            first_deg = on_circle(next_deg.unwrap_or(first_deg));
        }
        Ok(closed)
    }

    /// A step back in azimuth closes the revolution.
    fn take_firing(&mut self, azimuth_deg: f32, distances: [u16; LASERS]) -> Option<Sweep> {
        let closed = (azimuth_deg < self.previous_azimuth_deg).then(|| Sweep {
            start_azimuth_deg: std::mem::replace(&mut self.start_azimuth_deg, azimuth_deg),
            end_azimuth_deg: self.previous_azimuth_deg,
            distances: std::mem::take(&mut self.distances),
        });
        self.previous_azimuth_deg = azimuth_deg;
        if self.pending_columns() < MOST_COLUMNS {
            let centimetres = distances.map(|units| units / UNITS_PER_CENTIMETRE);
            self.distances.extend(
                centimetres
                    .into_iter()
                    .flat_map(|distance| ByteOrder::Big.split(distance)),
            );
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::wire::velodyne::data::{PacketWriter, Return, ReturnMode};

    fn packet(first_hundredths: u16) -> Vec<u8> {
        let mut packet = PacketWriter::new(ReturnMode::Strongest, 0x22);
        for block in 0..BLOCKS {
            packet.set_azimuth(block, (first_hundredths + 40 * block as u16) % 36_000);
            for channel in 0..2 * LASERS {
                let found = Return {
                    distance: 1000 + 5 * (channel % LASERS) as u16,
                    reflectivity: 7,
                };
                packet.set(block, channel / LASERS, channel % LASERS, found);
            }
        }
        packet.bytes().to_vec()
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
    fn what_is_no_data_packet_is_passed_over() {
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
