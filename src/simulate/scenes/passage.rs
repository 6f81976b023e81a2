//! Ways through a roundabout, and the map that they are drawn from.

use crate::roadmap::{
    Curve, DeclaredCircle, DeclaredRoundabout, Junction, Lane, LaneId, LaneKind, Origin, PointId,
    Roadmap, Vertex,
};
use crate::simulate::fixes::REFERENCE;
use crate::simulate::path::Path;

/// On this way a driver turns the front wheels from one bend to the other: at 5 m/s by some 40 degrees in a second.
pub(super) const STEERING_M: f64 = 5.0;

/// A way through a roundabout: straight on in the right lane, a bend to the right that touches
/// the circle, round to the exit, out.
#[derive(Clone, Copy)]
pub(super) struct Passage {
    pub(super) centre_m: [f64; 2],
    /// Of the way round.
    pub(super) radius_m: f64,
    /// Of the bends in and out.
    pub(super) bend_m: f64,
    /// From the middle of the approach road to the way in.
    pub(super) lane_m: f64,
}

impl Passage {
    /// Driving towards `heading_deg` for `approach_m` before the bend, leaving at the exit with
    /// this number, the right one being 1.
    pub(super) fn path(&self, heading_deg: f64, approach_m: f64, exit: u32) -> Path {
        let touching_m = self.radius_m + self.bend_m;
        let aside_m = self.bend_m + self.lane_m;
        let before_m = libm::sqrt(touching_m * touching_m - aside_m * aside_m);
        let bend_deg = libm::acos(aside_m / touching_m).to_degrees();
        let round_deg = 2.0 * bend_deg + 90.0 * (f64::from(exit) - 2.0);
        let (sine, cosine) = libm::sincos(heading_deg.to_radians());
        let back_m = before_m + approach_m;
        let [x, y] = self.centre_m;
        let start_m = [
            x - back_m * cosine + self.lane_m * sine,
            y - back_m * sine - self.lane_m * cosine,
        ];
        Path::from(start_m, heading_deg)
            .line(approach_m)
            .arc(-self.bend_m, bend_deg)
            .arc(self.radius_m, round_deg)
            .arc(-self.bend_m, bend_deg)
    }

    /// How long the way round to an exit is, from the begin of the bend in to the end of the bend out.
    pub(super) fn inside_m(&self, exit: u32) -> f64 {
        self.path(0.0, 0.0, exit).length_m()
    }

    /// The way in of the arm that is driven towards `heading_deg`.
    fn entry(&self, heading_deg: f64) -> Vec<[f64; 2]> {
        let way = self.path(heading_deg, ARM_M, 1);
        way.points(0.0, ARM_M + self.corner_m())
    }

    /// The way out of the arm that is left towards `heading_deg`.
    fn exit(&self, heading_deg: f64) -> Vec<[f64; 2]> {
        // Driven to from the arm opposite.
        let way = self.path(heading_deg, 0.0, 2).line(ARM_M);
        let length_m = way.length_m();
        way.points(length_m - ARM_M - self.corner_m(), length_m)
    }

    fn corner_m(&self) -> f64 {
        let cosine = (self.bend_m + self.lane_m) / (self.radius_m + self.bend_m);
        self.bend_m * libm::acos(cosine)
    }
}

/// A ring of a roundabout: inner and outer edge.
#[derive(Clone, Copy)]
pub(super) struct Circle {
    kind: LaneKind,
    inner_m: f64,
    outer_m: f64,
}

impl Circle {
    pub(super) const fn road(inner_m: f64, outer_m: f64) -> Self {
        Self {
            kind: LaneKind::Road,
            inner_m,
            outer_m,
        }
    }

    pub(super) const fn bikeway(inner_m: f64, outer_m: f64) -> Self {
        Self {
            kind: LaneKind::Bikeway,
            inner_m,
            outer_m,
        }
    }

    pub(super) const fn pavement(inner_m: f64, outer_m: f64) -> Self {
        Self {
            kind: LaneKind::Pavement,
            inner_m,
            outer_m,
        }
    }
}

/// Where the road of all lanes begins and ends.
pub(super) fn road_edges_m(circles: &[Circle]) -> [f64; 2] {
    let roads = circles
        .iter()
        .filter(|circle| circle.kind == LaneKind::Road);
    roads.fold([f64::INFINITY, 0.0], |[inner_m, outer_m], road| {
        [inner_m.min(road.inner_m), outer_m.max(road.outer_m)]
    })
}

/// Length of an arm's lanes on the map, before the corner.
const ARM_M: f64 = 60.0;
/// Headings of the ways in.
pub(super) const HEADINGS_DEG: [f64; 4] = [0.0, 90.0, 180.0, 270.0];

/// The map of a roundabout with four arms: its circles, and each arm's lanes along the outermost
/// passage.
pub(super) fn roads(name: &str, passages: &[Passage], circles: &[Circle]) -> Roadmap {
    let mut map = Roadmap {
        name: name.to_owned(),
        origin: Some(Origin {
            place: REFERENCE,
            rotation_rad: 0.0,
            is_longitude_first: false,
        }),
        ..Roadmap::default()
    };
    let Some(passage) = passages.last() else {
        return map;
    };
    let circle_of_arms = circles
        .iter()
        .filter(|circle| circle.kind == LaneKind::Road)
        .count() as u32;
    let mut junctions = vec![];
    for (road, heading_deg) in (1u32..).zip(HEADINGS_DEG) {
        let ways = [
            passage.entry(heading_deg),
            passage.exit(heading_deg + 180.0),
        ];
        for (lane, points_m) in (1u32..).zip(ways) {
            let id = LaneId {
                layer: 1,
                road,
                lane,
            };
            let is_entry = lane == 1;
            let vertices = (1u32..)
                .zip(points_m)
                .map(|(id, place_m)| Vertex { id, place_m });
            let vertices: Vec<_> = vertices.collect();
            let point = if is_entry { vertices.len() as u32 } else { 1 };
            junctions.push(Junction {
                lane: PointId { lane: id, point },
                is_entry,
                circle: circle_of_arms,
            });
            map.lanes.push(Lane {
                id,
                road_name: format!("Arm{road}"),
                kind: LaneKind::Road,
                width_m: Some(3.5),
                left_marking: None,
                right_marking: None,
                curve: Curve::Points(vertices),
                is_circular: false,
            });
        }
    }
    map.declared.push(DeclaredRoundabout {
        id: 1,
        name: name.to_owned(),
        centre_m: passage.centre_m,
        is_clockwise: Some(false),
        circles: (1u32..)
            .zip(circles)
            .map(|(id, circle)| DeclaredCircle {
                id,
                kind: circle.kind,
                inner_m: circle.inner_m,
                outer_m: circle.outer_m,
                is_marked: false,
            })
            .collect(),
        junctions,
    });
    map
}
