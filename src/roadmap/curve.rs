//! How a lane's middle runs: points, or one of the scenario format's functions.

use std::f64::consts::TAU;

use super::Polyline;
use super::polyline::{SAME_POINT_M, distance_m};

/// A point with the number by which connectors name it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Vertex {
    /// Within the lane.
    pub id: u32,
    /// Its place.
    pub place_m: [f64; 2],
}

/// Where a lane's middle runs.
#[derive(Debug, Clone, PartialEq)]
pub enum Curve {
    /// From point to point.
    Points(Vec<Vertex>),
    /// Straight on.
    Line {
        /// First and last point.
        ends: [Vertex; 2],
    },
    /// A bend of one radius, to the left where its interval rises.
    Arc {
        /// Of the bend.
        radius_m: f64,
        /// Angles from where to where, counted from the start.
        interval_rad: [f64; 2],
        /// First and last point.
        ends: [Vertex; 2],
        /// Direction in which it starts.
        heading_rad: f64,
    },
    /// A bend whose curvature grows with the way.
    Clothoid {
        /// Growth of the curvature.
        curvature_growth_per_m2: f64,
        /// Curvature where it starts, to the left positive.
        curvature_per_m: f64,
        /// First and last point.
        ends: [Vertex; 2],
        /// Direction in which it starts.
        heading_rad: f64,
    },
}

/// How far a chain of points may be off its arc.
const SAGITTA_M: f64 = 0.01;
/// Step in which clothoids are followed.
const CLOTHOID_STEP_M: f64 = 0.25;
/// A clothoid is followed no farther than this many times the distance of its ends: beyond it
/// turns in on itself.
const LONGEST_CLOTHOID: f64 = 4.0;

impl Curve {
    /// It as points.
    pub fn polyline(&self) -> Polyline {
        match self {
            Self::Points(vertices) => {
                Polyline::through(vertices.iter().map(|vertex| vertex.place_m))
            }
            Self::Line { ends } => Polyline::through(ends.map(|end| end.place_m)),
            Self::Arc {
                radius_m,
                interval_rad,
                ends,
                heading_rad,
            } => arc(*radius_m, *interval_rad, ends, *heading_rad),
            Self::Clothoid {
                curvature_growth_per_m2,
                curvature_per_m,
                ends,
                heading_rad,
            } => clothoid(
                *curvature_growth_per_m2,
                *curvature_per_m,
                ends,
                *heading_rad,
            ),
        }
    }

    /// Its numbered points.
    pub fn vertices(&self) -> &[Vertex] {
        match self {
            Self::Points(vertices) => vertices,
            Self::Line { ends } | Self::Arc { ends, .. } | Self::Clothoid { ends, .. } => ends,
        }
    }

    pub(super) fn given_points(&self) -> usize {
        self.vertices().len()
    }

    pub(super) fn repeated(&self) -> usize {
        let pairs = self.vertices().windows(2);
        let is_repeated = |pair: &&[Vertex]| match pair {
            [first, second] => distance_m(first.place_m, second.place_m) <= SAME_POINT_M,
            _ => false,
        };
        pairs.filter(is_repeated).count()
    }
}

/// The circle touches the heading at the start (OpenDaVINCI's own drawing of scenarios; in its
/// example files the written end lies on that circle, up to a step of 5 degrees before the end of
/// the interval). Where the written end lies on the circle it is the end; else the interval says.
fn arc(radius_m: f64, interval_rad: [f64; 2], ends: &[Vertex; 2], heading_rad: f64) -> Polyline {
    let [start, end] = ends.map(|vertex| vertex.place_m);
    let given_rad = interval_rad[1] - interval_rad[0];
    let side = 1f64.copysign(given_rad);
    let (sine, cosine) = libm::sincos(heading_rad);
    let centre_m = [
        start[0] - side * radius_m * sine,
        start[1] + side * radius_m * cosine,
    ];
    let first_rad = libm::atan2(start[1] - centre_m[1], start[0] - centre_m[0]);
    let last_rad = libm::atan2(end[1] - centre_m[1], end[0] - centre_m[0]);
    let off_m = (distance_m(centre_m, end) - radius_m).abs();
    let sweep_rad = if off_m < SAME_POINT_M.max(0.02 * radius_m) {
        let turns = libm::round((given_rad - (last_rad - first_rad)) / TAU);
        last_rad - first_rad + turns * TAU
    } else {
        given_rad
    };
    let step_rad = 2.0 * libm::acos((1.0 - SAGITTA_M / radius_m.max(2.0 * SAGITTA_M)).max(0.0));
    let steps = libm::ceil(sweep_rad.abs() / step_rad).clamp(1.0, 10_000.0) as usize;
    Polyline::through((0..=steps).map(|step| {
        let angle_rad = first_rad + sweep_rad * step as f64 / steps as f64;
        let (sine, cosine) = libm::sincos(angle_rad);
        [
            centre_m[0] + radius_m * cosine,
            centre_m[1] + radius_m * sine,
        ]
    }))
}

/// Followed to where it comes nearest to its end.
fn clothoid(
    growth_per_m2: f64,
    curvature_per_m: f64,
    ends: &[Vertex; 2],
    heading_rad: f64,
) -> Polyline {
    let [start_m, end_m] = ends.map(|vertex| vertex.place_m);
    let most_m = LONGEST_CLOTHOID * distance_m(start_m, end_m);
    let steps = libm::ceil(most_m / CLOTHOID_STEP_M).clamp(1.0, 100_000.0) as usize;
    let mut points_m = vec![start_m];
    let mut at_m = start_m;
    let (mut nearest_m, mut nearest) = (distance_m(at_m, end_m), 0);
    for step in 0..steps {
        let middle_m = (step as f64 + 0.5) * CLOTHOID_STEP_M;
        let turned_rad = curvature_per_m * middle_m + growth_per_m2 * middle_m * middle_m / 2.0;
        let (sine, cosine) = libm::sincos(heading_rad + turned_rad);
        at_m = [
            at_m[0] + CLOTHOID_STEP_M * cosine,
            at_m[1] + CLOTHOID_STEP_M * sine,
        ];
        points_m.push(at_m);
        let left_m = distance_m(at_m, end_m);
        if left_m < nearest_m {
            (nearest_m, nearest) = (left_m, points_m.len() - 1);
        }
    }
    points_m.truncate(nearest + 1);
    points_m.push(end_m);
    Polyline::through(points_m)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn ends(start_m: [f64; 2], end_m: [f64; 2]) -> [Vertex; 2] {
        [(1, start_m), (2, end_m)].map(|(id, place_m)| Vertex { id, place_m })
    }

    #[test]
    fn an_arc_turns_left_from_its_heading() {
        let quarter = Curve::Arc {
            radius_m: 10.0,
            interval_rad: [0.0, TAU / 4.0],
            ends: ends([0.0, 0.0], [-10.0, 10.0]),
            heading_rad: TAU / 4.0,
        };
        let way = quarter.polyline();
        assert!(
            (way.length_m() - 10.0 * TAU / 4.0).abs() < 0.05,
            "{}",
            way.length_m()
        );
        let station = way.nearest([-10.0 + 10.0 * 0.5f64.sqrt(), 10.0 * 0.5f64.sqrt()]);
        assert!(station.unwrap().distance_m <= SAGITTA_M);
    }

    #[test]
    fn a_falling_interval_turns_right() {
        let quarter = Curve::Arc {
            radius_m: 10.0,
            interval_rad: [0.0, -TAU / 4.0],
            ends: ends([0.0, 0.0], [10.0, 10.0]),
            heading_rad: TAU / 4.0,
        };
        assert!(quarter.polyline().nearest([2.93, 7.07]).unwrap().distance_m < 0.02);
    }

    /// The file's end may stop a drawing step before the interval does.
    #[test]
    fn an_arc_ends_where_its_end_lies_on_the_circle() {
        let angle_rad = 135f64.to_radians();
        let end_m = [-16.2 + 16.2 * angle_rad.cos(), 16.2 * angle_rad.sin()];
        let bend = Curve::Arc {
            radius_m: 16.2,
            interval_rad: [0.0, 2.443],
            ends: ends([0.0, 0.0], end_m),
            heading_rad: TAU / 4.0,
        };
        let way = bend.polyline();
        assert!((way.length_m() - 16.2 * angle_rad).abs() < 0.05);
    }

    #[test]
    fn a_clothoid_without_growth_is_an_arc() {
        let bend = Curve::Clothoid {
            curvature_growth_per_m2: 0.0,
            curvature_per_m: 0.1,
            ends: ends([0.0, 0.0], [10.0, 10.0]),
            heading_rad: 0.0,
        };
        let way = bend.polyline();
        assert!(
            (way.length_m() - 10.0 * TAU / 4.0).abs() < 0.3,
            "{}",
            way.length_m()
        );
        assert!(way.nearest([7.07, 2.93]).unwrap().distance_m < 0.05);
    }
}
