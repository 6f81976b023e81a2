//! Which envelope goes where, and what is counted of it.

use super::{Fault, Outcome, Pipeline, RevolutionReport, Step};
use crate::ego::Heard;
use crate::wire::point_cloud::{CompactPointCloud, POINT_CLOUD_ID};
use crate::wire::velodyne::Packet;
use crate::wire::velodyne::captured::SensorPackets;
use crate::wire::{Envelope, Message, pose};

/// Message numbers that are ours: what we send, heard back.
pub const OWN_IDS: std::ops::RangeInclusive<i32> = 2020..=2039;

/// Message numbers of poses.
const POSE_IDS: [i32; 7] = [
    pose::ApplanixGroup1::ID,
    pose::GeodeticWgs84Reading::ID,
    pose::GeodeticHeadingReading::ID,
    pose::GroundSpeedReading::ID,
    pose::AngularVelocityReading::ID,
    pose::Geolocation::ID,
    pose::SimulationFrame::ID,
];

impl Pipeline {
    /// Whether messages of this number are of any interest.
    pub fn concerns(data_type: i32) -> bool {
        data_type == POINT_CLOUD_ID || POSE_IDS.contains(&data_type)
    }

    /// Takes one envelope.
    ///
    /// # Errors
    /// [`Fault`] when it is damaged or refused. It is counted, and no track, plane or map hears
    /// of it; what the intake remembers of it costs the next good ones at most one.
    pub fn handle(&mut self, envelope: &Envelope<'_>) -> Result<Outcome, Fault> {
        self.handle_watched(envelope, |_| ())
    }

    /// The same, and says after each step of a revolution which one is done.
    ///
    /// # Errors
    /// As [`Pipeline::handle`].
    pub fn handle_watched(
        &mut self,
        envelope: &Envelope<'_>,
        done: impl FnMut(Step),
    ) -> Result<Outcome, Fault> {
        if envelope.data_type == SensorPackets::ID {
            return self.handle_packets(envelope, done);
        }
        let outcome = self.dispatch(envelope, done);
        if let Err(fault) = &outcome {
            self.count(fault);
        }
        outcome
    }

    /// Packets of a recording, of which the last one closes a revolution. The first fault is told, if none does; all
    /// are counted.
    fn handle_packets(
        &mut self,
        envelope: &Envelope<'_>,
        done: impl FnMut(Step),
    ) -> Result<Outcome, Fault> {
        let packets = SensorPackets::decode(envelope.payload, envelope.payload_offset);
        let packets = packets.map_err(|error| {
            let fault = Fault::Damaged {
                data_type: envelope.data_type,
                error,
            };
            self.count(&fault);
            fault
        })?;
        let (mut is_closed, mut first) = (false, Ok(Outcome::Packets));
        for packet in packets.iter() {
            match self.take_packet(&packet) {
                Ok(closes) => is_closed |= closes,
                Err(fault) => first = first.and(Err(fault)),
            }
        }
        if is_closed {
            return Ok(Outcome::Revolution(self.perceive_packets(done)));
        }
        first
    }

    fn count(&mut self, fault: &Fault) {
        self.counts.faults.count(fault.name());
        match fault {
            Fault::Refused(_) => self.counts.refused += 1,
            Fault::Packet(refusal) => self.counts.damaged += u64::from(refusal.is_damage()),
            Fault::Damaged { .. } => self.counts.damaged += 1,
            Fault::Pose { refusal, .. } if refusal.is_damage() => self.counts.damaged += 1,
            Fault::Pose { .. } => self.counts.poses_refused += 1,
        }
    }

    /// Takes one packet as a sensor sends it. Gives whether it closes a revolution, which
    /// [`Pipeline::perceive_packets`] then goes through; it is replaced by the next one.
    ///
    /// # Errors
    /// [`Fault`] when the packet, or the revolution that it closes, is of no use. It is counted.
    pub fn take_packet(&mut self, packet: &Packet<'_>) -> Result<bool, Fault> {
        let result = self.take(packet);
        if let Err(fault) = &result {
            self.count(fault);
        }
        result
    }

    fn take(&mut self, packet: &Packet<'_>) -> Result<bool, Fault> {
        self.counts.packets += 1;
        let taken = self.packets.take(packet, &self.configuration.cloud)?;
        self.counts.packets_lost += taken.lost;
        self.counts.packets_late += u64::from(taken.is_late);
        let Some(closed) = taken.closed else {
            return Ok(false);
        };
        self.counts.revolutions += 1;
        closed?;
        Ok(true)
    }

    /// Perceives the last revolution that packets have closed, and says after each step which one is
    /// done.
    pub fn perceive_packets(&mut self, done: impl FnMut(Step)) -> RevolutionReport {
        let revolution = self.packets.revolution(&self.configuration.cloud);
        self.scan
            .fill(&revolution, &self.own_vehicle, &self.configuration.cloud);
        let (dialect, time_jumped) = (revolution.dialect, revolution.time_jumped);
        self.perceive(dialect, time_jumped, done)
    }

    fn dispatch(
        &mut self,
        envelope: &Envelope<'_>,
        done: impl FnMut(Step),
    ) -> Result<Outcome, Fault> {
        let damaged = |error| Fault::Damaged {
            data_type: envelope.data_type,
            error,
        };
        if envelope.data_type == POINT_CLOUD_ID {
            self.counts.revolutions += 1;
            let cloud = CompactPointCloud::decode(envelope.payload, envelope.payload_offset)
                .map_err(damaged)?;
            let accepted = self
                .intake
                .accept(envelope, cloud, &self.configuration.cloud)?;
            self.scan
                .fill(&accepted, &self.own_vehicle, &self.configuration.cloud);
            let (dialect, time_jumped) = (accepted.dialect, accepted.time_jumped);
            return Ok(Outcome::Revolution(self.perceive(
                dialect,
                time_jumped,
                done,
            )));
        }
        if OWN_IDS.contains(&envelope.data_type) {
            return Ok(Outcome::Own);
        }
        match self.ego.hear(envelope).map_err(damaged)? {
            Heard::Nothing => Ok(Outcome::Other),
            Heard::Refused(refusal) => Err(Fault::Pose {
                data_type: envelope.data_type,
                refusal,
            }),
            Heard::Pose => {
                self.counts.poses += 1;
                Ok(Outcome::Pose)
            }
        }
    }
}
