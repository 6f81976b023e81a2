//! The vehicle's own messages about where it is, with a receiver's noise.

use super::path::Moment;
use super::scenario::PoseMessages;
use crate::ego::geodesy::{Geodetic, LocalFrame};
use crate::random::Random;
use crate::time::Time;
use crate::wire::envelope::Postmark;
use crate::wire::pose::{ApplanixGroup1, GeodeticHeadingReading, GeodeticWgs84Reading};

/// Where simulated worlds lie: the origin of their frame.
pub(super) const REFERENCE: Geodetic = Geodetic {
    latitude_deg: 57.71,
    longitude_deg: 11.94,
    altitude_m: 60.0,
};
/// Standard deviation of a fix from the next, of a good receiver with corrections.
const WHITE_M: f64 = 0.008;
/// Standard deviation of what wanders slowly, and how slowly.
const WANDER_M: f64 = 0.03;
const WANDER_S: f64 = 30.0;
/// Standard deviation of a heading of two antennas.
const HEADING_DEG: f64 = 0.08;
/// Time between two fixes.
pub(super) const PERIOD_S: f64 = 0.01;

/// A receiver.
#[derive(Debug, Clone)]
pub(super) struct Receiver {
    messages: PoseMessages,
    frame: LocalFrame,
    random: Random,
    wander_m: [f64; 2],
}

impl Receiver {
    pub(super) fn new(messages: PoseMessages, seed: u64) -> Self {
        Self {
            messages,
            frame: LocalFrame::around(REFERENCE),
            random: Random::new(seed ^ 0x6b8b_4567),
            wander_m: [0.0; 2],
        }
    }

    /// Appends what is sent at a time.
    pub(super) fn put(&mut self, out: &mut Vec<u8>, time: Time, moment: &Moment, height_m: f64) {
        let kept = 1.0 - PERIOD_S / WANDER_S;
        let fresh_m = WANDER_M * libm::sqrt(1.0 - kept * kept);
        let mut position_m = [moment.position_m[0], moment.position_m[1], height_m];
        for (wander_m, metres) in self.wander_m.iter_mut().zip(&mut position_m) {
            *wander_m = kept * *wander_m + fresh_m * self.random.normal();
            *metres += *wander_m + WHITE_M * self.random.normal();
        }
        let place = self.frame.geodetic(position_m);
        let heading_deg = 90.0 - moment.yaw_rad.to_degrees() + HEADING_DEG * self.random.normal();
        let heading_deg = heading_deg - 360.0 * libm::floor(heading_deg / 360.0);
        let postmark = Postmark {
            sent: time,
            sampled: time,
            sender_stamp: 0,
        };
        let (sine, cosine) = libm::sincos(moment.yaw_rad);
        match self.messages {
            PoseMessages::None => {}
            PoseMessages::Applanix => postmark.put(
                out,
                &ApplanixGroup1 {
                    lat: place.latitude_deg,
                    lon: place.longitude_deg,
                    alt: place.altitude_m,
                    vel_north: (moment.speed_mps * sine) as f32,
                    vel_east: (moment.speed_mps * cosine) as f32,
                    heading: heading_deg,
                    speed: moment.speed_mps as f32,
                    arate_down: -moment.yaw_rate_radps.to_degrees() as f32,
                    ..ApplanixGroup1::default()
                },
            ),
            PoseMessages::OpenDlv => {
                postmark.put(
                    out,
                    &GeodeticWgs84Reading {
                        latitude: place.latitude_deg,
                        longitude: place.longitude_deg,
                    },
                );
                let north_heading = heading_deg as f32;
                postmark.put(out, &GeodeticHeadingReading { north_heading });
            }
        }
    }
}
