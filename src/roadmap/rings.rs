//! Circles that lanes run on.

use std::collections::{BTreeMap, BTreeSet};
use std::f64::consts::{PI, TAU};

use super::circle::Circle;
use super::network::Network;
use super::polyline::distance_m;
use super::roundabout::{Ring, Roundabout, Source};
use super::{BETWEEN_LANES, LaneKind, Polyline};
use crate::ego::wrapped_rad;

/// Radii that the middle of a lane round a roundabout may have: the smallest mini roundabouts
/// have an outer diameter of 13 m, large ones 100 m.
pub(super) const RADII_M: std::ops::RangeInclusive<f64> = 3.0..=60.0;
/// Points of a lane that belong to one circle are within this of it. Maps are drawn by hand, to
/// tenths of a metre, and OpenStreetMap's circles are polygons.
pub(super) const OFF_CIRCLE_M: f64 = 0.6;
/// The same of a corner, which is shorter and meets straight lines.
const OFF_CORNER_M: f64 = 0.1;
/// Least sweep of a piece of a lane that tells a circle.
pub(super) const LEAST_SWEEP_RAD: f64 = PI / 4.0;
/// Pieces of one circle have their middles within this of each other.
pub(super) const SAME_CENTRE_M: f64 = 3.0;
/// And their radii, if they are one lane.
pub(super) const SAME_RADIUS_M: f64 = 2.0;
/// Less of the way round than this is a bend.
pub(super) const LEAST_COVERED: f64 = 0.5;

/// A piece of a lane that runs on a circle.
#[derive(Debug, Clone)]
pub(super) struct Bend {
    pub(super) lane: usize,
    points_m: Vec<[f64; 2]>,
    circle: Circle,
    /// To the left positive.
    pub(super) sweep_rad: f64,
}

/// Pieces of one lane of a circle.
pub(super) struct Group {
    pub(super) bends: Vec<Bend>,
    pub(super) circle: Circle,
}

/// Pieces that lie on the same circle, driven the same way round.
pub(super) fn grouped(kind_of: impl Fn(usize) -> LaneKind, bends: Vec<Bend>) -> Vec<Group> {
    let mut groups: Vec<Group> = vec![];
    // Groups by where they began: in squares as wide as what is near.
    let mut squares: BTreeMap<[i64; 2], Vec<usize>> = BTreeMap::new();
    for bend in bends {
        let kind = kind_of(bend.lane);
        let square = bend
            .circle
            .centre_m
            .map(|metres| (metres / SAME_CENTRE_M) as i64);
        // The middle moves a little as pieces join.
        let around = (-2..=2).flat_map(|x| (-2..=2).map(move |y| [square[0] + x, square[1] + y]));
        let near = around.filter_map(|square| squares.get(&square)).flatten();
        let home = near.copied().find(|&index| {
            let group: &Group = &groups[index];
            let first = &group.bends[0];
            kind_of(first.lane) == kind
                && first.sweep_rad.signum() == bend.sweep_rad.signum()
                && distance_m(group.circle.centre_m, bend.circle.centre_m) < SAME_CENTRE_M
                && (group.circle.radius_m - bend.circle.radius_m).abs() < SAME_RADIUS_M
        });
        let Some(index) = home else {
            squares.entry(square).or_default().push(groups.len());
            groups.push(Group {
                circle: bend.circle,
                bends: vec![bend],
            });
            continue;
        };
        let group = &mut groups[index];
        group.bends.push(bend);
        // As often as it doubles: more pieces tell little more.
        if group.bends.len().is_power_of_two() {
            let points_m: Vec<_> = group.points_m().collect();
            group.circle = Circle::fit(&points_m).unwrap_or(group.circle);
        }
    }
    groups
}

impl Group {
    fn points_m(&self) -> impl Iterator<Item = [f64; 2]> {
        self.bends
            .iter()
            .flat_map(|bend| bend.points_m.iter().copied())
    }

    /// Its pieces' points.
    pub(super) fn runs(&self) -> Vec<Vec<[f64; 2]>> {
        self.bends
            .iter()
            .map(|bend| bend.points_m.clone())
            .collect()
    }

    /// How far its pieces lead round, all together.
    pub(super) fn swept_rad(&self) -> f64 {
        self.bends.iter().map(|bend| bend.sweep_rad.abs()).sum()
    }

    /// If it is one.
    fn roundabout(&self, network: &Network<'_>) -> Option<Roundabout> {
        let lanes: BTreeSet<usize> = self.bends.iter().map(|bend| bend.lane).collect();
        if !is_closed(network, &lanes) {
            return None;
        }
        let is_clockwise = self.bends[0].sweep_rad < 0.0;
        made(
            network,
            Source::Closed,
            &lanes,
            self.circle,
            self.runs(),
            is_clockwise,
        )
    }
}

/// A roundabout of one ring without arms, unless too little of the way round is covered by the
/// runs of points that lie on the circle.
fn made(
    network: &Network<'_>,
    source: Source,
    lanes: &BTreeSet<usize>,
    circle: Circle,
    runs: Vec<Vec<[f64; 2]>>,
    is_clockwise: bool,
) -> Option<Roundabout> {
    let covered_share = covered_share(&circle, &runs);
    if covered_share < LEAST_COVERED {
        return None;
    }
    let first = &network.lanes[*lanes.first()?];
    let widths_m = lanes.iter().map(|&lane| network.lanes[lane].width_m());
    let lines = [&first.left_marking, &first.right_marking];
    let off_m = |point_m: &[f64; 2]| circle.off_m(*point_m).abs();
    Some(Roundabout {
        name: first.road_name.clone(),
        source,
        rings: vec![Ring {
            circle,
            width_m: widths_m.sum::<f64>() / lanes.len() as f64,
            kind: first.kind,
            // A broken line is what parts two lanes in one direction.
            is_marked: lines
                .iter()
                .any(|line| line.as_deref() == Some(BETWEEN_LANES)),
        }],
        is_clockwise,
        arms: vec![],
        off_circle_m: runs.iter().flatten().map(off_m).fold(0.0, f64::max),
        covered_share,
    })
}

/// By sectors of 5 degrees.
pub(super) fn covered_share(circle: &Circle, runs: &[Vec<[f64; 2]>]) -> f64 {
    const SECTORS: usize = 72;
    let mut is_covered = [false; SECTORS];
    for pair in runs.iter().flat_map(|run| run.windows(2)) {
        let [from_rad, to_rad] = [pair[0], pair[1]].map(|point_m| circle.angle_rad(point_m));
        let sweep_rad = wrapped_rad(to_rad - from_rad);
        let steps = libm::ceil(sweep_rad.abs() / TAU * SECTORS as f64) as usize;
        for step in 0..=steps {
            let share = step as f64 / steps.max(1) as f64;
            let turns = (from_rad + share * sweep_rad) / TAU;
            let sector = (turns - libm::floor(turns)) * SECTORS as f64;
            is_covered[(sector as usize).min(SECTORS - 1)] = true;
        }
    }
    is_covered.iter().filter(|&&covered| covered).count() as f64 / SECTORS as f64
}

/// Rings that lanes close which the map does not call a roundabout.
pub(super) fn closed(network: &Network<'_>) -> Vec<Roundabout> {
    let lanes = (0..network.lanes.len()).filter(|&lane| !network.lanes[lane].is_circular);
    let bends = bends_of(network, lanes);
    let groups = grouped(|lane| network.lanes[lane].kind, bends);
    let rings = groups.iter().filter_map(|group| group.roundabout(network));
    rings.collect()
}

/// The rings of what the map calls a roundabout. Such lanes are taken at their word: a circle
/// begins as the lanes' longest bend and takes in all of their points that lie near it, since a
/// drawn lane often begins or ends with a piece of the road beside it.
pub(super) fn named(network: &Network<'_>) -> Vec<Roundabout> {
    let mut found = vec![];
    for lanes in network.circular() {
        // A lane runs on one ring only.
        let mut taken: BTreeSet<usize> = BTreeSet::new();
        let mut bends = bends_of(network, lanes.iter().copied());
        if bends.is_empty() {
            bends.extend(whole(network, &lanes));
        }
        for bend in bends {
            if taken.contains(&bend.lane) {
                continue;
            }
            let (circle, runs) = trimmed(network, &lanes, bend.circle);
            let is_clockwise = bend.sweep_rad < 0.0;
            let on_it = lanes.iter().copied().filter(|&lane| {
                let points_m = network.ways[lane].points_m();
                let near = points_m.iter().filter(|&&at_m| is_near(&circle, at_m));
                2 * near.count() > points_m.len() || lane == bend.lane
            });
            let on_it = on_it.collect();
            let ring = made(network, Source::Named, &on_it, circle, runs, is_clockwise);
            if let Some(ring) = ring {
                taken.extend(on_it);
                found.push(ring);
            }
        }
    }
    found
}

/// The circle through all points of lanes that are too short to have bends of their own, as where a map parts its circle at
/// each arm.
fn whole(network: &Network<'_>, lanes: &BTreeSet<usize>) -> Option<Bend> {
    let &lane = lanes.first()?;
    let ways = lanes.iter().map(|&lane| network.ways[lane].points_m());
    let points_m: Vec<[f64; 2]> = ways.flatten().copied().collect();
    let circle = Circle::fit(&points_m)?;
    let turns = lanes
        .iter()
        .map(|&lane| sweep_rad(&circle, network.ways[lane].points_m()));
    Some(Bend {
        lane,
        sweep_rad: turns.sum(),
        points_m,
        circle,
    })
    .filter(|bend| RADII_M.contains(&bend.circle.radius_m))
}

/// Twice what a bend's points may be off: the circle is of several lanes, each drawn by hand.
fn is_near(circle: &Circle, at_m: [f64; 2]) -> bool {
    circle.off_m(at_m).abs() < 2.0 * OFF_CIRCLE_M
}

/// The circle through all points of the lanes that are near it, and those points, in runs.
fn trimmed(
    network: &Network<'_>,
    lanes: &BTreeSet<usize>,
    mut circle: Circle,
) -> (Circle, Vec<Vec<[f64; 2]>>) {
    /// What is near settles within a few.
    const ROUNDS: usize = 10;
    let runs = |circle: &Circle| -> Vec<Vec<[f64; 2]>> {
        let ways = lanes.iter().map(|&lane| thinned(&network.ways[lane]));
        ways.flat_map(|points_m| {
            let runs = points_m.chunk_by(|&a, &b| is_near(circle, a) == is_near(circle, b));
            let near = runs.filter(|run| run.first().is_some_and(|&at_m| is_near(circle, at_m)));
            near.map(<[_]>::to_vec).collect::<Vec<_>>()
        })
        .collect()
    };
    for _ in 0..ROUNDS {
        let near: Vec<_> = runs(&circle).concat();
        match Circle::fit(&near).filter(|circle| RADII_M.contains(&circle.radius_m)) {
            Some(better) => circle = better,
            None => break,
        }
    }
    (circle, runs(&circle))
}

/// The longest first.
fn bends_of(network: &Network<'_>, lanes: impl Iterator<Item = usize>) -> Vec<Bend> {
    let mut found: Vec<_> = lanes
        .flat_map(|lane| bends(lane, &network.ways[lane], OFF_CIRCLE_M))
        .collect();
    found.sort_by(|a, b| b.sweep_rad.abs().total_cmp(&a.sweep_rad.abs()));
    found
}

/// Whether one can drive round: a lane that ends where it began, or lanes that lead into each
/// other.
fn is_closed(network: &Network<'_>, lanes: &BTreeSet<usize>) -> bool {
    let ends_where_it_began = |&lane: &usize| {
        let way = &network.ways[lane];
        let (Some(&first_m), Some(&last_m)) = (way.points_m().first(), way.points_m().last())
        else {
            return false;
        };
        distance_m(first_m, last_m) < 1.0 && way.length_m() > TAU * RADII_M.start()
    };
    if lanes.iter().any(ends_where_it_began) {
        return true;
    }
    let ids: Vec<_> = lanes.iter().map(|&lane| network.lanes[lane].id).collect();
    let Some(&first) = ids.first() else {
        return false;
    };
    // Lanes that can be reached from the first; closed if it is one of them.
    let mut reached = vec![first];
    let mut next = 0;
    while let Some(&at) = reached.get(next) {
        next += 1;
        for &id in ids.iter().filter(|&&id| network.leads(at, id)) {
            if id == first {
                return true;
            }
            if !reached.contains(&id) {
                reached.push(id);
            }
        }
    }
    false
}

/// Pieces of a way that run on circles, one after the other, each as long as it goes.
pub(super) fn bends(lane: usize, way: &Polyline, off_m: f64) -> Vec<Bend> {
    let points_m = thinned(way);
    let mut found = vec![];
    let mut start = 0;
    while start + 3 < points_m.len() {
        let Some((end, circle)) = longest(&points_m, start, off_m) else {
            start += 1;
            continue;
        };
        let piece = &points_m[start..end];
        let sweep_rad = sweep_rad(&circle, piece);
        if sweep_rad.abs() >= LEAST_SWEEP_RAD {
            found.push(Bend {
                lane,
                points_m: piece.to_vec(),
                circle,
                sweep_rad,
            });
            start = end - 1;
        } else {
            // As fine as it matters, and no worse than linear in the points.
            start += 1 + piece.len() / 8;
        }
    }
    found
}

/// Points that are half a metre apart: more tell no more.
fn thinned(way: &Polyline) -> Vec<[f64; 2]> {
    const APART_M: f64 = 0.5;
    let mut kept: Vec<[f64; 2]> = vec![];
    for &point_m in way.points_m() {
        if kept
            .last()
            .is_none_or(|&last_m| distance_m(last_m, point_m) >= APART_M)
        {
            kept.push(point_m);
        }
    }
    kept
}

/// The longest piece from a point on that lies on one circle, up to once round.
fn longest(points_m: &[[f64; 2]], start: usize, off_m: f64) -> Option<(usize, Circle)> {
    /// A shorter piece of a drawn line has any radius.
    const LEAST_WAY_M: f64 = 6.0;
    let mut way_m = 0.0;
    let mut best = None;
    for end in start + 1..points_m.len() {
        way_m += distance_m(points_m[end - 1], points_m[end]);
        if end < start + 3 || way_m < LEAST_WAY_M {
            continue;
        }
        let piece = &points_m[start..=end];
        let fits = Circle::fit(piece).filter(|circle| {
            RADII_M.contains(&circle.radius_m)
                && piece.iter().all(|&at_m| circle.off_m(at_m).abs() < off_m)
                && way_m < TAU * circle.radius_m + 1.0
        });
        let Some(circle) = fits else { break };
        best = Some((end + 1, circle));
    }
    best
}

fn sweep_rad(circle: &Circle, points_m: &[[f64; 2]]) -> f64 {
    let pairs = points_m.windows(2);
    pairs
        .map(|pair| wrapped_rad(circle.angle_rad(pair[1]) - circle.angle_rad(pair[0])))
        .sum()
}

/// Bends to the right or left of a way, as circles with their sweep.
pub(super) fn circles_of(way: &Polyline) -> impl Iterator<Item = (Circle, f64)> {
    bends(0, way, OFF_CORNER_M)
        .into_iter()
        .map(|bend| (bend.circle, bend.sweep_rad))
}
