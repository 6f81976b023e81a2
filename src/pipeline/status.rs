//! What the pipeline says of itself.

use super::Pipeline;
use crate::wire::status::Status;

impl Pipeline {
    /// What the pipeline knows of its state. Sockets and latency are the caller's to add.
    pub fn status(&self) -> Status {
        let mut status = Status {
            revolutions_received: self.counts.revolutions,
            revolutions_published: self.last.map_or(0, |last| u64::from(last.number) + 1),
            revolutions_refused: self.counts.refused,
            datagrams_damaged: self.counts.damaged,
            revolutions_missed: self.counts.missed,
            airborne_returns: self.counts.airborne,
            packets_received: self.counts.packets,
            packets_lost: self.counts.packets_lost,
            packets_late: self.counts.packets_late,
            poses_received: self.counts.poses,
            faults: self.counts.faults.to_string(),
            ground_held: self.counts.ground_held,
            ground_fallback: self.counts.ground_fallback,
            profile: self.configuration.profile.name().into(),
            version: env!("CARGO_PKG_VERSION").into(),
            ..Status::default()
        };
        if let Some(last) = self.last {
            status.sensor = last.sensor.into();
            status.columns = last.columns as u32;
            status.layers = crate::cloud::MAX_LAYERS as u32;
            status.rotation_rate = last.rotation_hz as f32;
            status.byte_order = last.dialect.byte_order.name().into();
            status.byte_order_source = last.dialect.byte_order_source.name().into();
            status.distance_unit = last.dialect.unit_m;
            status.intensity_bits = last.dialect.intensity_bits.into();
            status.ground_height = last.ground.plane.height_m() as f32;
            status.ground_tilt = last.ground.plane.tilt_rad() as f32;
            status.odometry = last.ego.odometry.quality.name().into();
            status.odometry_deviation = last.ego.odometry.deviation_m as f32;
            status.odometry_restarts = last.ego.restarts;
            status.pose_source = last.ego.source.into();
            status.pose_disagreement = last.ego.disagreement_m as f32;
            status.pose_jumps = last.ego.jumps;
            status.pose_clock_behind = last.ego.behind_s as f32;
            status.pose_distrusted = last.ego.distrusted.unwrap_or_default().into();
        }
        if let Some(mode) = self.packets.mode() {
            status.return_mode = mode.name().into();
            status.sensor_clock = self.packets.clock().name().into();
        }
        if let Some(extent) = self.own_vehicle.extent() {
            [status.own_vehicle_left, status.own_vehicle_back, _] = extent.low_m;
            [status.own_vehicle_right, status.own_vehicle_front, _] = extent.high_m;
        }
        status
    }
}
