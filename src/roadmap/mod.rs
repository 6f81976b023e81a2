//! Maps of roads: lanes, how they connect, and the roundabouts among them.
//!
//! A map comes from OpenDaVINCI's scenario format ([`scn`]) or from OpenStreetMap ([`osm`]).
//! Places are metres east and north of the map's origin.

mod arms;
mod circle;
mod curve;
mod draw;
mod driven;
mod edges;
mod elements;
mod find;
mod network;
pub mod osm;
mod polyline;
mod rings;
mod roundabout;
pub mod scn;
mod simplify;

use std::collections::BTreeMap;

use crate::ego::geodesy::Geodetic;

pub use circle::Circle;
pub use curve::{Curve, Vertex};
pub use draw::svg;
pub use driven::{DrivenRoundabout, DrivenWay, driven_roundabouts};
pub use edges::Edges;
pub use elements::{ArmElements, Contradiction, Elements, Kind};
pub use find::roundabouts;
pub use polyline::{Polyline, Station};
pub use roundabout::{Access, Arm, Ring, Roundabout, Source};
pub use simplify::{SIMPLIFIED_WITHIN_M, Simplified, simplified};

/// Why a map cannot be read.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("line {line}, column {column}: {problem}")]
pub struct MapError {
    /// Counted from 1.
    pub line: usize,
    /// Counted from 1, in characters.
    pub column: usize,
    /// What is wrong there.
    pub problem: String,
}

/// Lanes and what connects them.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Roadmap {
    /// What the map calls itself.
    pub name: String,
    /// Where its places are counted from.
    pub origin: Option<Origin>,
    /// In the file's order.
    pub lanes: Vec<Lane>,
    /// From one lane's point to another's.
    pub connectors: Vec<Connector>,
    /// Roundabouts that the map names itself.
    pub declared: Vec<DeclaredRoundabout>,
    /// What the file holds beside roads, by name, and how often: it was passed over.
    pub skipped: BTreeMap<String, usize>,
}

/// The marking that parts two lanes in one direction.
const BETWEEN_LANES: &str = "broken_white";

/// Where a map's places are counted from, and what turns it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Origin {
    /// WGS84.
    pub place: Geodetic,
    /// How far the map's x axis is turned counter-clockwise from east.
    pub rotation_rad: f64,
    /// Whether the file gives the longitude first.
    pub is_longitude_first: bool,
}

/// A lane's address: layer, road, lane.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub struct LaneId {
    /// Of the map.
    pub layer: u32,
    /// Within the layer.
    pub road: u32,
    /// Within the road.
    pub lane: u32,
}

impl std::fmt::Display for LaneId {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "{}.{}.{}", self.layer, self.road, self.lane)
    }
}

/// A point of a lane.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct PointId {
    /// Whose.
    pub lane: LaneId,
    /// Within the lane.
    pub point: u32,
}

/// One may drive on from here to there.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Connector {
    /// Where one comes from.
    pub from: PointId,
    /// Where one goes on.
    pub to: PointId,
}

/// For whom a lane is.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, PartialOrd, Ord)]
pub enum LaneKind {
    /// Cars, lorries, and cyclists where they have no way of their own.
    #[default]
    Road,
    /// Cyclists.
    Bikeway,
    /// People on foot.
    Pavement,
}

impl LaneKind {
    /// All of them.
    pub const ALL: [Self; 3] = [Self::Road, Self::Bikeway, Self::Pavement];

    /// The word in files.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Road => "road",
            Self::Bikeway => "bikeway",
            Self::Pavement => "pavement",
        }
    }

    /// The number in `kreisel.ConflictWindow`.
    pub const fn number(self) -> u32 {
        match self {
            Self::Road => 0,
            Self::Bikeway => 1,
            Self::Pavement => 2,
        }
    }

    fn of(name: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|kind| kind.name() == name)
    }

    /// Width where a map does not say (RASt 06: lanes of 2.75 to 3.5 m, one-way cycle paths of
    /// 1.6 to 2 m, pavements of 2.5 m).
    pub const fn usual_width_m(self) -> f64 {
        match self {
            Self::Road => 3.5,
            Self::Bikeway => 2.0,
            Self::Pavement => 2.5,
        }
    }
}

/// One lane, driven from its first point to its last.
#[derive(Debug, Clone, PartialEq)]
pub struct Lane {
    /// Its address.
    pub id: LaneId,
    /// Of its road; may be empty.
    pub road_name: String,
    /// For whom.
    pub kind: LaneKind,
    /// If the map says so.
    pub width_m: Option<f64>,
    /// Its line to the left, in the map's words.
    pub left_marking: Option<String>,
    /// And to the right.
    pub right_marking: Option<String>,
    /// Where its middle runs.
    pub curve: Curve,
    /// Whether the map calls it a part of a roundabout.
    pub is_circular: bool,
}

impl Lane {
    /// As wide as the map says, else as usual.
    pub fn width_m(&self) -> f64 {
        self.width_m.unwrap_or(self.kind.usual_width_m())
    }
}

/// A roundabout as a map may name it: perfect circles.
#[derive(Debug, Clone, PartialEq)]
pub struct DeclaredRoundabout {
    /// Of the map.
    pub id: u32,
    /// May be empty.
    pub name: String,
    /// Of all circles.
    pub centre_m: [f64; 2],
    /// Whether one drives round clockwise, if the map says so.
    pub is_clockwise: Option<bool>,
    /// From the inside out.
    pub circles: Vec<DeclaredCircle>,
    /// Lanes that lead in or out.
    pub junctions: Vec<Junction>,
}

/// One lane of the circle.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct DeclaredCircle {
    /// Within the roundabout.
    pub id: u32,
    /// For whom.
    pub kind: LaneKind,
    /// Radius of its inner edge.
    pub inner_m: f64,
    /// Radius of its outer edge.
    pub outer_m: f64,
    /// Whether a line parts it from another one.
    pub is_marked: bool,
}

/// A lane that leads to or from a circle.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Junction {
    /// Its point there.
    pub lane: PointId,
    /// Whether it leads in.
    pub is_entry: bool,
    /// The circle.
    pub circle: u32,
}

impl Roadmap {
    /// The lane of this address.
    pub fn lane(&self, id: LaneId) -> Option<&Lane> {
        self.lanes.iter().find(|lane| lane.id == id)
    }

    /// Points of all lanes as the file gives them.
    pub fn point_count(&self) -> usize {
        self.lanes
            .iter()
            .map(|lane| lane.curve.given_points())
            .sum()
    }

    /// Points that repeat the one before them; they are tolerated.
    pub fn repeated_points(&self) -> usize {
        self.lanes.iter().map(|lane| lane.curve.repeated()).sum()
    }
}

#[cfg(test)]
mod tests;
