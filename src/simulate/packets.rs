//! What the simulated sensor itself sends: data packets, and now and then one that says what time it is.

use super::{EPOCH, ROTATION_HZ, azimuth_deg, seconds_of};
use crate::cloud::sensor::VLP16_PRODUCT;
use crate::time::{Span, Time};
use crate::wire::velodyne::data::{
    BLOCKS, FIRINGS_PER_BLOCK, LASER_BY_LAYER, LASER_PERIOD_S, LASERS, PacketWriter, Return,
    ReturnMode, UNIT_M,
};
use crate::wire::velodyne::position::PositionPacket;
use crate::wire::velodyne::{HOUR_US, Packet};

/// Firings in a packet.
pub(super) const FIRINGS: usize = BLOCKS * FIRINGS_PER_BLOCK;
/// The factory's address of a sensor.
const ADDRESS: [u8; 4] = [192, 168, 1, 201];
/// Data packets from one position packet to the next.
const PER_POSITION: u64 = 10;

/// Firings that wait to be sent.
#[derive(Debug, Clone, Default)]
pub(super) struct PacketStream {
    firings: Vec<(u64, [Return; LASERS])>,
    sent: u64,
    /// Room for a position packet.
    position: Vec<u8>,
}

/// How far the sensor has turned when a layer's laser fires, after the first one.
pub(super) fn turned_rad(layer: usize) -> f64 {
    std::f64::consts::TAU * ROTATION_HZ * LASER_BY_LAYER[layer] as f64 * LASER_PERIOD_S
}

impl PacketStream {
    /// Begins a firing.
    pub(super) fn begin(&mut self, column: u64) {
        self.firings.push((column, Default::default()));
    }

    /// Notes a return of the last firing.
    pub(super) fn put(&mut self, layer: usize, range_m: f64, reflectance: f64) {
        if let Some((_, returns)) = self.firings.last_mut() {
            returns[LASER_BY_LAYER[layer]] = Return {
                distance: libm::round(range_m / f64::from(UNIT_M)) as u16,
                reflectivity: (100.0 * reflectance) as u8,
            };
        }
    }

    /// Hands over all packets that are full.
    pub(super) fn send(&mut self, mut send: impl FnMut(&Packet<'_>)) {
        let full = self.firings.len() / FIRINGS * FIRINGS;
        for firings in self.firings[..full].chunks_exact(FIRINGS) {
            let begun = EPOCH + Span::from_seconds(seconds_of(firings[0].0));
            let arrival = EPOCH + Span::from_seconds(seconds_of(firings[FIRINGS - 1].0 + 1));
            let mut writer = PacketWriter::new(ReturnMode::Strongest, VLP16_PRODUCT);
            writer.set_time_us(begun.micros().rem_euclid(HOUR_US) as u32);
            for (number, (column, returns)) in firings.iter().enumerate() {
                let (block, firing) = (number / FIRINGS_PER_BLOCK, number % FIRINGS_PER_BLOCK);
                if firing == 0 {
                    writer.set_azimuth(block, (100.0 * azimuth_deg(*column)) as u16);
                }
                for (laser, found) in returns.iter().enumerate() {
                    writer.set(block, firing, laser, *found);
                }
            }
            if self.sent.is_multiple_of(PER_POSITION) {
                let seconds = arrival.micros().div_euclid(1_000_000);
                let position = PositionPacket {
                    time_us: arrival.micros().rem_euclid(HOUR_US) as u32,
                    is_locked: true,
                    utc: Some(Time::from_micros(1_000_000 * seconds)),
                };
                self.position.clear();
                position.put(&mut self.position);
                send(&packet(arrival, &self.position));
            }
            send(&packet(arrival, writer.bytes()));
            self.sent += 1;
        }
        self.firings.drain(..full);
    }
}

fn packet(arrival: Time, bytes: &[u8]) -> Packet<'_> {
    Packet {
        source: ADDRESS,
        arrival,
        bytes,
    }
}

#[cfg(test)]
mod tests {
    use crate::simulate::{Simulation, scenario};
    use crate::wire::velodyne::data::DataPacket;
    use crate::wire::velodyne::position::PositionPacket;

    #[test]
    fn a_revolution_of_packets_is_that_of_the_point_cloud_and_says_the_time() {
        let scenario = scenario::find("standing").unwrap();
        let (mut data, mut positions, mut last_us) = (0, 0, None);
        let mut simulation = Simulation::in_packets(scenario, 1);
        let mut truth = vec![];
        for _ in 0..2 {
            truth.push(simulation.revolve_in_packets(|packet| {
                if let Some(position) = PositionPacket::read(packet.bytes) {
                    let age = packet.arrival - position.utc.unwrap();
                    assert!((0..1_000_000).contains(&age.micros()));
                    positions += 1;
                    return;
                }
                let found = DataPacket::new(packet.bytes).unwrap();
                let passed = last_us
                    .replace(found.time_us())
                    .map(|last| found.time_us() - last);
                assert!(
                    passed.is_none_or(|us| (1327..=1328).contains(&us)),
                    "{passed:?}"
                );
                data += 1;
            }));
        }
        assert_eq!((data, positions), (3616 / 24, 15));
        let mut other = Simulation::new(scenario, 1);
        let other = [0, 1].map(|_| other.revolve(&mut vec![]));
        for (truth, other) in truth.iter().zip(other) {
            assert_eq!((truth.time, &truth.sensor_m), (other.time, &other.sensor_m));
        }
    }
}
