//! A roundabout where it lies in the local frame, and the ways into it and out of it.

use std::f64::consts::TAU;

use super::bend::{self, Bend, round_mps};
use super::on_lane::{OnLane, Place};
use crate::ego::geodesy::LocalFrame;
use crate::ego::wrapped_rad;
use crate::roadmap::{Access, DrivenRoundabout, LaneKind, Origin, Polyline, Ring, Roundabout};

/// How a map's places become the local frame's.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Placing {
    /// WGS84 place around which the local frame lies.
    pub(super) reference: Option<crate::ego::geodesy::Geodetic>,
    /// Of the map.
    pub(super) origin: Option<Origin>,
    /// Where the map's origin lies in a local frame without reference.
    pub(super) shift_m: [f64; 2],
    /// How far the map's x axis is turned from that frame's.
    pub(super) turn_rad: f64,
}

impl Placing {
    /// By the earth where both frames lie on it, else as configured.
    fn place_m(&self, [x, y]: [f64; 2]) -> [f64; 2] {
        let turned = |turn_rad: f64| {
            let (sine, cosine) = libm::sincos(turn_rad);
            [x * cosine - y * sine, x * sine + y * cosine]
        };
        if let (Some(reference), Some(origin)) = (self.reference, self.origin) {
            let [east_m, north_m] = turned(origin.rotation_rad);
            let place = LocalFrame::around(origin.place).geodetic([east_m, north_m, 0.0]);
            let [x, y, _] = LocalFrame::around(reference).local_m(place);
            return [x, y];
        }
        let [x, y] = turned(self.turn_rad);
        [x + self.shift_m[0], y + self.shift_m[1]]
    }
}

/// A way in.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Entry {
    /// To where it meets the middle of the outermost road lane.
    pub(super) way: Polyline,
    pub(super) width_m: f64,
    /// Where it meets the circle.
    pub(super) mouth_rad: f64,
    /// Where along it the bend into the circle begins.
    pub(super) bend_m: f64,
    /// What it crosses, in the order in which it is met.
    pub(super) conflicts: Vec<Conflict>,
}

/// A way out.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Exit {
    /// From the circle on.
    pub(super) way: Polyline,
    pub(super) width_m: f64,
    /// Where it leaves the circle.
    pub(super) mouth_rad: f64,
    /// Bikeways and pavements that it crosses, in the order in which they are met.
    pub(super) conflicts: Vec<Conflict>,
}

/// Where the way in or out of an arm crosses a ring.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Conflict {
    /// In [`Site::rings`].
    pub(super) ring: usize,
    /// Whose ring it is.
    pub(super) kind: LaneKind,
    /// Direction from the middle.
    pub(super) angle_rad: f64,
    /// Along the way.
    pub(super) along_m: f64,
    /// From where to where along the way a vehicle is in the way of those on the ring: it may meet it at any angle.
    pub(super) zone_m: [f64; 2],
}

/// An arm.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct SiteArm {
    pub(super) bearing_rad: f64,
    pub(super) entries: Vec<Entry>,
    pub(super) exits: Vec<Exit>,
}

/// Circles and arms in the local frame.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Site {
    pub(super) name: String,
    pub(super) centre_m: [f64; 2],
    pub(super) outer_m: f64,
    pub(super) rings: Vec<Ring>,
    pub(super) is_clockwise: bool,
    pub(super) arms: Vec<SiteArm>,
    /// That there is one.
    pub(super) confidence: f64,
}

impl Site {
    pub(super) fn placed(roundabout: &Roundabout, placing: &Placing) -> Self {
        let rings = roundabout.rings.iter().map(|ring| {
            let mut ring = *ring;
            ring.circle.centre_m = placing.place_m(ring.circle.centre_m);
            ring
        });
        let mut site = Self {
            name: roundabout.name.clone(),
            centre_m: placing.place_m(roundabout.centre_m()),
            outer_m: roundabout.outer_m(),
            rings: rings.collect(),
            is_clockwise: roundabout.is_clockwise,
            arms: vec![],
            confidence: 1.0,
        };
        let arms = roundabout.arms.iter().map(|arm| {
            let roads = |accesses: &[Access]| -> Vec<(Polyline, f64)> {
                let roads = accesses
                    .iter()
                    .filter(|access| access.kind == LaneKind::Road);
                roads
                    .map(|access| {
                        let points_m = access.way.points_m().iter();
                        let placed = points_m.map(|&at_m| placing.place_m(at_m));
                        (Polyline::through(placed), access.width_m)
                    })
                    .collect()
            };
            let entries = roads(&arm.entries);
            let exits = roads(&arm.exits);
            let entries = entries
                .into_iter()
                .filter_map(|(way, width_m)| site.entry(&way, width_m));
            let exits = exits
                .into_iter()
                .filter_map(|(way, width_m)| site.exit(&way, width_m));
            let (entries, exits): (Vec<_>, Vec<_>) = (entries.collect(), exits.collect());
            SiteArm {
                bearing_rad: site.bearing_rad(&entries, &exits),
                entries,
                exits,
            }
        });
        site.arms = arms.collect();
        site
    }

    /// One that was found where it lies in the local frame.
    pub(super) fn found(found: &DrivenRoundabout) -> Self {
        let here = Placing {
            reference: None,
            origin: None,
            shift_m: [0.0; 2],
            turn_rad: 0.0,
        };
        Self {
            confidence: found.confidence,
            ..Self::placed(&found.roundabout, &here)
        }
    }

    /// How many rings, and how many ways in and out of each arm.
    pub(super) fn lanes(&self) -> (usize, Vec<[usize; 2]>) {
        let arms = self.arms.iter();
        let ways = arms.map(|arm| [arm.entries.len(), arm.exits.len()]);
        (self.rings.len(), ways.collect())
    }

    fn bearing_rad(&self, entries: &[Entry], exits: &[Exit]) -> f64 {
        let ends = entries
            .iter()
            .filter_map(|entry| entry.way.points_m().first());
        let ends = ends.chain(exits.iter().filter_map(|exit| exit.way.points_m().last()));
        let [x, y] = ends.fold([0.0; 2], |[x, y], &at_m| {
            let (sine, cosine) = libm::sincos(self.angle_rad(at_m));
            [x + cosine, y + sine]
        });
        libm::atan2(y, x)
    }

    /// Direction from the middle to a place.
    pub(super) fn angle_rad(&self, [x, y]: [f64; 2]) -> f64 {
        libm::atan2(y - self.centre_m[1], x - self.centre_m[0])
    }

    /// How far it is round from one direction to another, as one drives, in [0, 2 pi).
    pub(super) fn round_rad(&self, from_rad: f64, to_rad: f64) -> f64 {
        let turn_rad = if self.is_clockwise {
            from_rad - to_rad
        } else {
            to_rad - from_rad
        };
        turn_rad - TAU * libm::floor(turn_rad / TAU)
    }

    /// 1 where one drives round counter-clockwise, -1 where clockwise.
    pub(super) fn side(&self) -> f64 {
        if self.is_clockwise { -1.0 } else { 1.0 }
    }

    /// Direction in which one drives at a direction from the middle.
    pub(super) fn tangent_rad(&self, angle_rad: f64) -> f64 {
        let quarter_rad = if self.is_clockwise {
            -TAU / 4.0
        } else {
            TAU / 4.0
        };
        wrapped_rad(angle_rad + quarter_rad)
    }

    /// The outermost lane for cars.
    pub(super) fn outermost_road(&self) -> Option<usize> {
        let roads = self.rings.iter().enumerate();
        let roads = roads.filter(|(_, ring)| ring.kind == LaneKind::Road);
        roads.map(|(index, _)| index).next_back()
    }

    /// The bend before somebody on a way in; elsewhere he is in it.
    pub(super) fn bend_before(&self, on: &OnLane) -> Bend {
        let left_m = match on.place {
            Place::Entry(arm, lane) => self.arms[arm].entries[lane].bend_m - on.along_m,
            _ => 0.0,
        };
        let outermost = self.outermost_road().map(|road| self.rings[road].circle);
        Bend {
            left_m,
            speed_mps: outermost.map_or(f64::INFINITY, |circle| round_mps(circle.radius_m)),
        }
    }

    /// A way that ends before the circle goes straight on to it.
    fn entry(&self, way: &Polyline, width_m: f64) -> Option<Entry> {
        let road = self.outermost_road()?;
        let way = self.prolonged(way, road)?;
        let mut conflicts = self.crossings(&way);
        conflicts.retain(|conflict| conflict.ring != road);
        conflicts.push(self.conflict(&way, road, way.length_m()));
        Some(Entry {
            mouth_rad: self.angle_rad(*way.points_m().last()?),
            bend_m: bend::begin_m(&way, self.rings[road].circle.radius_m),
            way,
            width_m,
            conflicts,
        })
    }

    fn exit(&self, way: &Polyline, width_m: f64) -> Option<Exit> {
        let road = self.outermost_road()?;
        let way = self.prolonged(&way.reversed(), road)?.reversed();
        let mut conflicts = self.crossings(&way);
        conflicts.retain(|conflict| conflict.kind != LaneKind::Road);
        Some(Exit {
            mouth_rad: self.angle_rad(*way.points_m().first()?),
            way,
            width_m,
            conflicts,
        })
    }

    /// Up to the middle of a ring: cut there, or straight on to it.
    fn prolonged(&self, way: &Polyline, ring: usize) -> Option<Polyline> {
        let circle = self.rings[ring].circle;
        /// A way that touches the circle from outside may pass it by so much.
        const TOUCHES_M: f64 = 0.3;
        let points_m = way.points_m();
        let inside = |at_m: &[f64; 2]| circle.off_m(*at_m) < TOUCHES_M;
        if let Some(first) = points_m.iter().position(inside) {
            let [before_m, met_m] = [*points_m.get(first.checked_sub(1)?)?, points_m[first]];
            let [from_m, to_m] = [before_m, met_m].map(|at_m| circle.off_m(at_m));
            let share = ((from_m - TOUCHES_M) / (from_m - to_m)).clamp(0.0, 1.0);
            let share = if to_m < -TOUCHES_M { share } else { 1.0 };
            let cut_m = [0, 1].map(|axis| before_m[axis] + share * (met_m[axis] - before_m[axis]));
            return Some(Polyline::through(
                points_m[..first].iter().copied().chain([cut_m]),
            ));
        }
        let (end_m, heading_rad) = way.at(way.length_m());
        let (sine, cosine) = libm::sincos(heading_rad);
        let [x, y] = [0, 1].map(|axis| end_m[axis] - circle.centre_m[axis]);
        // |(x, y) + t (cosine, sine)| = radius.
        let half = x * cosine + y * sine;
        let square = half * half - (x * x + y * y - circle.radius_m * circle.radius_m);
        let step_m = if square >= 0.0 {
            -half - libm::sqrt(square)
        } else {
            // It passes by: as near as it comes.
            -half
        };
        let step_m = step_m.max(0.0);
        let met_m = [end_m[0] + step_m * cosine, end_m[1] + step_m * sine];
        Some(Polyline::through(points_m.iter().copied().chain([met_m])))
    }

    /// Rings whose middle a way crosses.
    fn crossings(&self, way: &Polyline) -> Vec<Conflict> {
        let mut found = vec![];
        for (index, ring) in self.rings.iter().enumerate() {
            let mut along_m = 0.0;
            for pair in way.points_m().windows(2) {
                let length_m = libm::hypot(pair[1][0] - pair[0][0], pair[1][1] - pair[0][1]);
                let [from_m, to_m] = [pair[0], pair[1]].map(|at_m| ring.circle.off_m(at_m));
                if from_m * to_m < 0.0 {
                    let share = from_m / (from_m - to_m);
                    found.push(self.conflict(way, index, along_m + share * length_m));
                }
                along_m += length_m;
            }
        }
        found.sort_by(|a, b| a.along_m.total_cmp(&b.along_m));
        found
    }

    /// Where a way meets the middle of a ring.
    fn conflict(&self, way: &Polyline, index: usize, along_m: f64) -> Conflict {
        const STEP_M: f64 = 0.25;
        let ring = &self.rings[index];
        let is_on = |along_m: f64| ring.circle.off_m(way.at(along_m).0).abs() < ring.width_m / 2.0;
        let (mut begin_m, mut end_m) = (along_m, along_m);
        while begin_m > 0.0 && is_on(begin_m - STEP_M) {
            begin_m -= STEP_M;
        }
        while end_m < way.length_m() && is_on(end_m + STEP_M) {
            end_m += STEP_M;
        }
        Conflict {
            ring: index,
            kind: ring.kind,
            angle_rad: self.angle_rad(way.at(along_m).0),
            along_m,
            zone_m: [begin_m.max(0.0), end_m.min(way.length_m())],
        }
    }
}
