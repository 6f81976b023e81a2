//! What the log says of revolutions: what changed, and what is wrong.

use tracing::{info, trace, warn};

use super::fault_log::FaultLog;
use super::health::Health;
use crate::cloud::{ClockState, Dialect, PacketIntake};
use crate::ego::EgoReport;
use crate::ground::Origin;
use crate::odometry::Quality;
use crate::pipeline::RevolutionReport;
use crate::wire::velodyne::data::ReturnMode;

/// Remembers what it said last.
#[derive(Debug)]
pub(super) struct Teller {
    sensor: ToldOfSensor,
    ego: Option<EgoReport>,
    health: Health,
}

#[derive(Debug, Default, PartialEq, Clone, Copy)]
struct ToldOfSensor {
    dialect: Option<(Dialect, usize)>,
    clock: Option<(ClockState, ReturnMode)>,
}

impl Default for Teller {
    fn default() -> Self {
        Self {
            sensor: ToldOfSensor::default(),
            ego: None,
            health: Health::Well,
        }
    }
}

impl Teller {
    /// Says how the daemon is when that is another word than before.
    pub(super) fn tell_health(&mut self, health: Health) {
        let kind = std::mem::discriminant::<Health>;
        if kind(&self.health) != kind(&health) {
            match &health {
                Health::Well => info!("health: ok"),
                health => warn!("health: {health}"),
            }
        }
        self.health = health;
    }

    /// Says what changed with a revolution, and what is wrong with it.
    pub(super) fn tell(
        &mut self,
        report: &RevolutionReport,
        packets: &PacketIntake,
        log: &mut FaultLog,
    ) {
        self.tell_sensor(report, packets);
        self.tell_ego(report, log);
        tell_faults(report, log);
        trace!(
            "revolution {}: {} returns, ground {:.2} m below, {} clusters, {} objects",
            report.number,
            report.returns,
            report.ground.plane.height_m(),
            report.clusters,
            report.objects,
        );
    }

    fn tell_sensor(&mut self, report: &RevolutionReport, packets: &PacketIntake) {
        let Dialect {
            byte_order,
            byte_order_source,
            unit_m,
            intensity_bits,
            ..
        } = report.dialect;
        let told = ToldOfSensor {
            dialect: Some((report.dialect, packets.firings_per_column())),
            clock: packets.mode().map(|mode| (packets.clock(), mode)),
        };
        let before = std::mem::replace(&mut self.sensor, told);
        if before.dialect != told.dialect {
            info!(
                "{}: {} columns at {:.1} Hz{}, distances {} ({}), unit {} mm, {intensity_bits} bits of intensity",
                report.sensor,
                report.columns,
                report.rotation_hz,
                match packets.firings_per_column() {
                    1 => "",
                    _ => ", each of two firings",
                },
                byte_order.name(),
                byte_order_source.name(),
                1000.0 * unit_m,
            );
        }
        if let Some(mode) = packets.mode().filter(|_| before.clock != told.clock) {
            let ahead_s = packets.clock_ahead().seconds();
            let mode = mode.name();
            match packets.clock() {
                ClockState::Free => info!(
                    "{mode}; no GPS receiver keeps the sensor's clock: revolutions have the time of their arrival"
                ),
                ClockState::Configured => {
                    info!("{mode}; revolutions have the time of their arrival, as configured")
                }
                ClockState::Synchronised => info!(
                    "{mode}; revolutions have the sensor's time, which is {ahead_s:.3} s ahead of this computer's"
                ),
                ClockState::Apart => warn!(
                    "{mode}; the sensor's time is {ahead_s:.0} s ahead of this computer's: revolutions have that of their arrival"
                ),
            }
        }
    }

    fn tell_ego(&mut self, report: &RevolutionReport, log: &mut FaultLog) {
        if let Some(last) = self.ego.replace(report.ego) {
            if last.source != report.ego.source {
                info!("poses: {}", report.ego.source);
            }
            if last.jumps != report.ego.jumps {
                let source = report.ego.source;
                log.note("pose_jump", || {
                    format!("{source} jumped: the local frame is tied to the odometry anew")
                });
            }
            let is_behind = |ego: &EgoReport| ego.behind_s != 0.0;
            if !is_behind(&last) && is_behind(&report.ego) {
                let behind_s = report.ego.behind_s;
                log.note("pose_behind", || {
                    format!("poses are stamped {behind_s:.2} s behind the revolutions, which is made up for")
                });
            }
            if let Some(name) = report.ego.distrusted.filter(|_| last.distrusted.is_none()) {
                log.note("pose_disagrees", || {
                    format!("{name} does not go as the sensor does: it is not used")
                });
            }
            if last.restarts != report.ego.restarts {
                log.note("odometry_restart", || {
                    "what is seen did not fit for too long: a new map begins".into()
                });
            }
        }
    }
}

fn tell_faults(report: &RevolutionReport, log: &mut FaultLog) {
    if report.time_jumped {
        log.note("time_jump", || {
            format!("to {:.3} s: tracks begin anew", report.time.seconds())
        });
    }
    if report.airborne > 0 {
        let returns = report.airborne;
        log.note("airborne", || {
            format!("snow, rain, spray or dust: {returns} returns near the sensor left out")
        });
    }
    match report.ego.odometry.quality {
        Quality::Off | Quality::Begun | Quality::Following => {}
        Quality::Degenerate => log.note("odometry_degenerate", || {
            format!(
                "what is seen tells the place to {:.1} m only: prediction and poses ({}) tell the rest",
                report.ego.odometry.deviation_m, report.ego.source
            )
        }),
        Quality::Lost => log.note("odometry_lost", || {
            "what is seen does not fit what was seen before".into()
        }),
    }
    match report.ground.origin {
        Origin::Found => {}
        Origin::Held => log.note("ground_held", || {
            "no plausible ground plane: the last one is kept".into()
        }),
        Origin::Fallback => log.note("ground_fallback", || {
            format!(
                "no plausible ground plane yet: taken {} m below the sensor",
                report.ground.plane.height_m()
            )
        }),
    }
}
