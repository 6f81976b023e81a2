//! What the pipeline says of an envelope and of a revolution.

use crate::cloud::Dialect;
use crate::ego::{EgoReport, Frame, Pose};
use crate::ground::GroundReport;
use crate::time::Time;

/// What an envelope was.
#[expect(
    clippy::large_enum_variant,
    reason = "it lives on the stack for a moment; a box would allocate for every revolution"
)]
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Outcome {
    /// A revolution that is to be answered.
    Revolution(RevolutionReport),
    /// Packets of a sensor that close no revolution.
    Packets,
    /// A pose of the vehicle.
    Pose,
    /// Our own message, heard back.
    Own,
    /// Nothing that concerns us.
    Other,
}

/// A step that a revolution goes through.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Step {
    /// Bytes to points.
    Cloud,
    /// Points to the sensor's motion.
    Ego,
    /// Points to ground and what stands on it.
    Ground,
    /// Points to clusters.
    Cluster,
    /// Clusters to objects.
    Track,
    /// Static returns to the map.
    Map,
}

impl Step {
    /// A word for it.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Cloud => "cloud",
            Self::Ego => "ego",
            Self::Ground => "ground",
            Self::Cluster => "cluster",
            Self::Track => "track",
            Self::Map => "map",
        }
    }
}

/// What the steps say about a revolution.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RevolutionReport {
    /// Counts answered revolutions, from 0.
    pub number: u32,
    /// End of the sweep.
    pub time: Time,
    /// Revolutions that were missed since the one before, by their times; of a pause none.
    pub missed: u64,
    /// Whether time jumped, so that tracks began anew.
    pub time_jumped: bool,
    /// Name of the sensor.
    pub sensor: &'static str,
    /// How distances are written.
    pub dialect: Dialect,
    /// Columns in the revolution.
    pub columns: usize,
    /// Revolutions a second, from the step between columns.
    pub rotation_hz: f64,
    /// Returns that are not used because they hang in the air.
    pub airborne: usize,
    /// Points with a return that is used.
    pub returns: usize,
    /// The ground.
    pub ground: GroundReport,
    /// Where the vehicle is in the local frame, if that is known.
    pub vehicle: Option<Pose>,
    /// The frame that this is in.
    pub frame: Frame,
    /// How the sensor's motion was found.
    pub ego: EgoReport,
    /// Clusters that were found.
    pub clusters: usize,
    /// Objects to be published.
    pub objects: usize,
}
