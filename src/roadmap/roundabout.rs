//! A roundabout: circles, and arms that lead to them.

use super::circle::Circle;
use super::{
    DeclaredCircle, DeclaredRoundabout, Junction, LaneId, LaneKind, PointId, Polyline, Roadmap,
};

/// Why something is taken for a roundabout.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Source {
    /// The map says so, with circles.
    Declared,
    /// The map calls its road one.
    Named,
    /// Its lanes close a circle.
    Closed,
    /// No map knows it: road users drive round it.
    Driven,
}

impl Source {
    /// For people.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Declared => "declared",
            Self::Named => "named",
            Self::Closed => "closed circle of lanes",
            Self::Driven => "driven round",
        }
    }
}

/// A lane of the circle.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Ring {
    /// Its middle.
    pub circle: Circle,
    /// From edge to edge.
    pub width_m: f64,
    /// For whom.
    pub kind: LaneKind,
    /// Whether a line parts it from another lane of the circle.
    pub is_marked: bool,
}

impl Ring {
    /// Radius of its inner edge.
    pub fn inner_m(&self) -> f64 {
        self.circle.radius_m - self.width_m / 2.0
    }

    /// Radius of its outer edge.
    pub fn outer_m(&self) -> f64 {
        self.circle.radius_m + self.width_m / 2.0
    }
}

/// A lane that leads to the circle or away from it.
#[derive(Debug, Clone, PartialEq)]
pub struct Access {
    /// In the map.
    pub lane: LaneId,
    /// As far as 60 m from the circle, in the direction of driving.
    pub way: Polyline,
    /// From edge to edge.
    pub width_m: f64,
    /// For whom.
    pub kind: LaneKind,
    /// Where it meets the circle: direction from the middle, counter-clockwise from east.
    pub mouth_rad: f64,
    /// Direction from the middle to where the corner begins.
    pub bearing_rad: f64,
}

/// Where a road meets the circle.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Arm {
    /// Direction from the middle, counter-clockwise from east.
    pub bearing_rad: f64,
    /// Into the circle.
    pub entries: Vec<Access>,
    /// Out of it.
    pub exits: Vec<Access>,
}

/// Circles and arms.
#[derive(Debug, Clone, PartialEq)]
pub struct Roundabout {
    /// As the map calls it; may be empty.
    pub name: String,
    /// Why it is taken for one.
    pub source: Source,
    /// From the inside out.
    pub rings: Vec<Ring>,
    /// Whether one drives round clockwise, as where traffic drives on the left.
    pub is_clockwise: bool,
    /// By bearing.
    pub arms: Vec<Arm>,
    /// Largest distance of the map's points from their ring.
    pub off_circle_m: f64,
    /// Share of the way round that the map has points for.
    pub covered_share: f64,
}

impl Roundabout {
    /// Middle of the innermost lane for cars.
    pub fn centre_m(&self) -> [f64; 2] {
        let first = self.roads().next().or(self.rings.first());
        first.map_or([0.0; 2], |ring| ring.circle.centre_m)
    }

    /// As a map declares it; nothing for what is declared already.
    pub fn declaration(&self, id: u32, map: &Roadmap) -> Option<DeclaredRoundabout> {
        if self.source == Source::Declared {
            return None;
        }
        let circles = (1u32..).zip(&self.rings).map(|(id, ring)| DeclaredCircle {
            id,
            kind: ring.kind,
            inner_m: ring.inner_m().max(0.0),
            outer_m: ring.outer_m(),
            is_marked: ring.is_marked,
        });
        let arms = self.arms.iter();
        let accesses = arms.flat_map(|arm| {
            let entries = arm.entries.iter().map(|access| (true, access));
            entries.chain(arm.exits.iter().map(|access| (false, access)))
        });
        let junctions = accesses.filter_map(|(is_entry, access)| {
            let vertices = map.lane(access.lane)?.curve.vertices();
            let end = if is_entry {
                vertices.last()
            } else {
                vertices.first()
            };
            Some(Junction {
                lane: PointId {
                    lane: access.lane,
                    point: end?.id,
                },
                is_entry,
                // Entries lead into the outermost road.
                circle: (1u32..)
                    .zip(&self.rings)
                    .filter(|(_, ring)| ring.kind == LaneKind::Road)
                    .last()?
                    .0,
            })
        });
        Some(DeclaredRoundabout {
            id,
            name: self.name.clone(),
            centre_m: self.centre_m(),
            is_clockwise: Some(self.is_clockwise),
            circles: circles.collect(),
            junctions: junctions.collect(),
        })
    }

    /// The rings for cars.
    pub fn roads(&self) -> impl Iterator<Item = &Ring> {
        self.rings.iter().filter(|ring| ring.kind == LaneKind::Road)
    }

    /// Radius of the outer edge of the outermost road.
    pub fn outer_m(&self) -> f64 {
        self.roads().map(Ring::outer_m).fold(0.0, f64::max)
    }
}
