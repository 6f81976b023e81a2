//! What each pose message says, in one set of units.

use super::geodesy::Geodetic;
use super::{Frame, HeadingUnit, Pose, wrapped_rad};
use crate::wire::{Envelope, Message, WireError, pose};

/// The roll by which the thesis' simulator marks that latitude and longitude are metres.
const THESIS_SIMULATOR_ROLL: f64 = 1233.0;

/// One message about the vehicle.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Reading {
    /// A place on the earth with a yaw.
    Fix(Source, Geodetic, Direction),
    /// A place on the earth alone.
    Place(Geodetic),
    /// A direction alone.
    Heading(Direction),
    /// A pose in a frame of the sender's own.
    Local(Source, Pose),
    /// Along the vehicle's forward, as it is sent: m/s.
    Speed(f64),
    /// About the upright axis, as it is sent: services disagree on unit and sign.
    YawRate(f64),
}

/// Where whole poses come from, the more trusted first.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Source {
    Applanix,
    Geolocation,
    /// Place and heading from two messages.
    Separate,
    Simulation,
}

impl Source {
    /// How Status names it.
    pub(super) fn name(self) -> &'static str {
        match self {
            Self::Applanix => "applanix",
            Self::Geolocation => "geolocation",
            Self::Separate => "wgs84",
            Self::Simulation => "simulation",
        }
    }

    /// The frame of its poses.
    pub(super) fn frame(self) -> Frame {
        match self {
            Self::Simulation => Frame::Simulation,
            Self::Applanix | Self::Geolocation | Self::Separate => Frame::Earth,
        }
    }
}

/// Clockwise from north, in a unit that may have to be guessed.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Direction {
    Degrees(f64),
    Unknown(f64),
}

impl Direction {
    /// Counter-clockwise from east.
    pub(super) fn yaw_rad(self, unknown_is: HeadingUnit) -> f64 {
        let north_rad = match self {
            Self::Degrees(degrees) => degrees.to_radians(),
            Self::Unknown(value) => match unknown_is {
                HeadingUnit::Degrees => value.to_radians(),
                HeadingUnit::Auto | HeadingUnit::Radians => value,
            },
        };
        wrapped_rad(std::f64::consts::FRAC_PI_2 - north_rad)
    }
}

impl Reading {
    /// Reads an envelope; `None` if it holds no pose message.
    ///
    /// # Errors
    /// [`WireError`] when its bytes do not fit.
    pub(super) fn decode(envelope: &Envelope<'_>) -> Result<Option<Self>, WireError> {
        fn message<M: Message>(envelope: &Envelope<'_>) -> Result<M, WireError> {
            M::decode(envelope.payload, envelope.payload_offset)
        }
        Ok(Some(match envelope.data_type {
            pose::ApplanixGroup1::ID => applanix(&message(envelope)?),
            pose::Geolocation::ID => {
                let fix: pose::Geolocation = message(envelope)?;
                let place = Geodetic {
                    latitude_deg: fix.latitude,
                    longitude_deg: fix.longitude,
                    altitude_m: fix.altitude.into(),
                };
                let direction = Direction::Unknown(fix.heading.into());
                Self::Fix(Source::Geolocation, place, direction)
            }
            pose::GeodeticWgs84Reading::ID => {
                let fix: pose::GeodeticWgs84Reading = message(envelope)?;
                Self::Place(Geodetic {
                    latitude_deg: fix.latitude,
                    longitude_deg: fix.longitude,
                    altitude_m: 0.0,
                })
            }
            pose::GeodeticHeadingReading::ID => {
                let heading: pose::GeodeticHeadingReading = message(envelope)?;
                Self::Heading(Direction::Unknown(heading.north_heading.into()))
            }
            pose::SimulationFrame::ID => {
                let frame: pose::SimulationFrame = message(envelope)?;
                let position_m = [frame.x, frame.y, frame.z].map(f64::from);
                let yaw_rad = frame.yaw.into();
                Self::Local(
                    Source::Simulation,
                    Pose {
                        position_m,
                        yaw_rad,
                    },
                )
            }
            pose::GroundSpeedReading::ID => {
                let reading: pose::GroundSpeedReading = message(envelope)?;
                Self::Speed(reading.ground_speed.into())
            }
            pose::AngularVelocityReading::ID => {
                let reading: pose::AngularVelocityReading = message(envelope)?;
                Self::YawRate(reading.angular_velocity_z.into())
            }
            _ => return Ok(None),
        }))
    }

    /// Whether it is that of a receiver that knows no place yet, and says 0 degrees north and east.
    pub(super) fn is_without_fix(&self) -> bool {
        /// Some ten metres.
        const NOWHERE_DEG: f64 = 1e-4;
        match self {
            Self::Fix(_, place, _) | Self::Place(place) => {
                place.latitude_deg.abs() < NOWHERE_DEG && place.longitude_deg.abs() < NOWHERE_DEG
            }
            Self::Heading(_) | Self::Local(..) | Self::Speed(_) | Self::YawRate(_) => false,
        }
    }

    /// Whether its numbers can be a vehicle's on the earth.
    pub(super) fn is_plausible(&self) -> bool {
        /// Beyond this a local frame has lost its meaning.
        const FARTHEST_M: f64 = 1e6;
        /// No vehicle with a lidar is faster, nor turns faster, be it in degrees.
        const FASTEST_MPS: f64 = 150.0;
        const FASTEST_RATE: f64 = 720.0;
        let is_direction = |direction: &Direction| match direction {
            Direction::Degrees(value) | Direction::Unknown(value) => value.abs() <= 720.0,
        };
        match self {
            Self::Fix(_, place, direction) => place.is_valid() && is_direction(direction),
            Self::Place(place) => place.is_valid(),
            Self::Heading(direction) => is_direction(direction),
            Self::Local(_, pose) => {
                pose.yaw_rad.abs() <= 720.0
                    && pose
                        .position_m
                        .iter()
                        .all(|metres| metres.abs() <= FARTHEST_M)
            }
            Self::Speed(mps) => mps.abs() <= FASTEST_MPS,
            Self::YawRate(rate) => rate.abs() <= FASTEST_RATE,
        }
    }
}

fn applanix(group: &pose::ApplanixGroup1) -> Reading {
    if group.roll > THESIS_SIMULATOR_ROLL {
        return Reading::Local(
            Source::Simulation,
            Pose {
                position_m: [group.lon, group.lat, 0.0],
                yaw_rad: Direction::Degrees(group.heading).yaw_rad(HeadingUnit::Degrees),
            },
        );
    }
    let place = Geodetic {
        latitude_deg: group.lat,
        longitude_deg: group.lon,
        altitude_m: group.alt,
    };
    Reading::Fix(Source::Applanix, place, Direction::Degrees(group.heading))
}
