//! Roundabouts that no map knows, by the ways of those who drive round them.
//!
//! Numbers without another source were set with `scripts/evaluate-roundabouts --seeds 1-6`.

use std::f64::consts::PI;

use super::arms::{access, arms};
use super::circle::Circle;
use super::edges::{Edges, lay_out};
use super::polyline::distance_m;
use super::rings::{
    Bend, Group, LEAST_COVERED, LEAST_SWEEP_RAD, OFF_CIRCLE_M, RADII_M, SAME_CENTRE_M,
    SAME_RADIUS_M, bends, covered_share, grouped,
};
use super::roundabout::{Access, Ring, Roundabout, Source};
use super::{LaneId, LaneKind, Polyline};
use crate::ego::wrapped_rad;

/// A way that somebody went.
#[derive(Debug, Clone)]
pub struct DrivenWay {
    kind: LaneKind,
    way: Polyline,
    bends: Vec<Bend>,
}

/// A roundabout that was found so.
#[derive(Debug, Clone, PartialEq)]
pub struct DrivenRoundabout {
    /// Its circles, and arms where somebody came in or left.
    pub roundabout: Roundabout,
    /// How much speaks for it, below 1: the share of the way round that was driven, and how often. It is no calibrated
    /// probability.
    pub confidence: f64,
    /// Radii at which the innermost and the outermost driver goes round.
    pub driven_m: [f64; 2],
}

/// Less than this, all together, leads round no circle.
const LEAST_SWEPT_RAD: f64 = 1.5 * PI;
/// Who comes round so far, comes round: loop ramps end before where they began.
const WHOLE_SHARE: f64 = 0.9;
/// Directions of a way are told from points so many apart: measured places scatter.
const APART: usize = 4;
/// So much of it is looked at before and behind its turns.
const AROUND: usize = 6;

impl DrivenWay {
    /// Through places a metre or so apart; nothing if it leads round no piece of a circle.
    pub fn new(kind: LaneKind, points_m: &[[f64; 2]]) -> Option<Self> {
        let [from, to] = turning(points_m)?;
        let turns = Polyline::through(points_m[from..to].iter().copied());
        let bends = bends(0, &turns, OFF_CIRCLE_M);
        (!bends.is_empty()).then(|| Self {
            kind,
            way: Polyline::through(points_m.iter().copied()),
            bends,
        })
    }
}

/// The part of a way in which it turns by as much as a piece of a circle does.
fn turning(points_m: &[[f64; 2]]) -> Option<[usize; 2]> {
    /// As the widest circle turns, where points are a metre apart.
    const STEP_RAD: f64 = APART as f64 / *RADII_M.end();
    let heading_rad = |index: usize| {
        let [from_m, to_m] = [points_m[index], points_m[index + APART]];
        libm::atan2(to_m[1] - from_m[1], to_m[0] - from_m[0])
    };
    let count = points_m.len().checked_sub(2 * APART)?;
    let step_rad = |index: usize| wrapped_rad(heading_rad(index + APART) - heading_rad(index));
    let is_turn = |index: &usize| step_rad(*index).abs() > STEP_RAD;
    let first = (0..count).find(is_turn)?;
    let last = (first..count).rfind(is_turn)?;
    let turned_rad: f64 = (first..=last).map(|index| step_rad(index).abs()).sum();
    let to = (last + 2 * APART + AROUND).min(points_m.len());
    (turned_rad / APART as f64 >= LEAST_SWEEP_RAD).then_some([first.saturating_sub(AROUND), to])
}

/// Roundabouts that ways lead round. `edges` are those that are seen of the road around a middle.
pub fn driven_roundabouts(
    ways: &[DrivenWay],
    edges: impl Fn([f64; 2]) -> Edges,
) -> Vec<DrivenRoundabout> {
    let bends = ways.iter().enumerate().flat_map(|(lane, way)| {
        way.bends.iter().cloned().map(move |mut bend| {
            bend.lane = lane;
            bend
        })
    });
    let mut bends: Vec<Bend> = bends.collect();
    bends.sort_by(|a, b| b.sweep_rad.abs().total_cmp(&a.sweep_rad.abs()));
    let groups = grouped(|lane| ways[lane].kind, bends);
    let mut found: Vec<DrivenRoundabout> = vec![];
    // How little cars went round may be, where others went round more.
    for group in groups.iter().filter(|group| is_road(ways, group, PI / 3.0)) {
        let centre_m = group.circle.centre_m;
        let is_known = |known: &DrivenRoundabout| {
            distance_m(known.roundabout.centre_m(), centre_m) < known.roundabout.outer_m()
        };
        if !found.iter().any(is_known) {
            found.extend(around(ways, &groups, group, &edges));
        }
    }
    found
}

/// Whether cars drove on it, so far round all together.
fn is_road(ways: &[DrivenWay], group: &Group, least_rad: f64) -> bool {
    kind(ways, group) == LaneKind::Road && group.swept_rad() >= least_rad
}

fn kind(ways: &[DrivenWay], group: &Group) -> LaneKind {
    ways[group.bends[0].lane].kind
}

/// All that leads around the middle of a group, if it leads round: cyclists and people on foot, who go round outside of the
/// cars, say so, too.
fn around(
    ways: &[DrivenWay],
    groups: &[Group],
    first: &Group,
    edges: impl Fn([f64; 2]) -> Edges,
) -> Option<DrivenRoundabout> {
    let is_clockwise = first.bends[0].sweep_rad < 0.0;
    let belongs = |group: &&Group| {
        let is_near = distance_m(group.circle.centre_m, first.circle.centre_m) < SAME_CENTRE_M;
        let is_same_way = (group.bends[0].sweep_rad < 0.0) == is_clockwise;
        let is_inside = group.circle.radius_m < first.circle.radius_m;
        is_near
            && match kind(ways, group) {
                LaneKind::Road => {
                    std::ptr::eq(*group, first) || (is_same_way && is_road(ways, group, PI))
                }
                // Few go there, and not far in the time that one watches.
                LaneKind::Bikeway | LaneKind::Pavement => {
                    !is_inside && group.swept_rad() >= PI / 2.0
                }
            }
    };
    let members: Vec<&Group> = groups.iter().filter(belongs).collect();
    let centre_m = common_centre_m(&members, first.circle.centre_m);
    let circle = Circle {
        centre_m,
        ..first.circle
    };
    let runs: Vec<_> = members.iter().flat_map(|group| group.runs()).collect();
    let covered_share = covered_share(&circle, &runs);
    let swept_rad: f64 = members.iter().map(|group| group.swept_rad()).sum();
    if covered_share < LEAST_COVERED || swept_rad < LEAST_SWEPT_RAD {
        return None;
    }
    let roads: Vec<&Group> = members
        .iter()
        .copied()
        .filter(|group| kind(ways, group) == LaneKind::Road)
        .collect();
    let mut rings = rings(ways, &members, centre_m);
    let road_m = rings.iter().filter(|ring| ring.kind == LaneKind::Road);
    let mut road_m = road_m.map(|ring| ring.circle.radius_m);
    let inner_m = road_m.next()?;
    let driven_m = [inner_m, road_m.next_back().unwrap_or(inner_m)];
    lay_out(&mut rings, edges(centre_m));
    let off_m = |at_m: &[f64; 2]| circle.off_m(*at_m).abs();
    let mut roundabout = Roundabout {
        name: String::new(),
        source: Source::Driven,
        rings,
        is_clockwise,
        arms: vec![],
        off_circle_m: first.runs().iter().flatten().map(off_m).fold(0.0, f64::max),
        covered_share,
    };
    // Cyclists on the road have no way of their own.
    let outer_m = roundabout.outer_m();
    roundabout
        .rings
        .retain(|ring| ring.kind == LaneKind::Road || ring.circle.radius_m > outer_m);
    let (entries, exits) = accesses(ways, &roundabout, &roads);
    // All come in at one place and leave at one place: a loop ramp.
    if covered_share < WHOLE_SHARE && [entries.len(), exits.len()] == [1, 1] {
        return None;
    }
    roundabout.arms = arms(entries, exits, is_clockwise);
    Some(DrivenRoundabout {
        roundabout,
        // Each half turn halves what speaks against it.
        confidence: covered_share * (1.0 - libm::pow(0.5, swept_rad / PI)),
        driven_m,
    })
}

/// The middle of circles around one place: least squares of the distances from each of them, by Gauss and Newton.
fn common_centre_m(groups: &[&Group], begin_m: [f64; 2]) -> [f64; 2] {
    const ROUNDS: usize = 4;
    let mut centre_m = begin_m;
    for _ in 0..ROUNDS {
        let mut normal = nalgebra::Matrix2::zeros();
        let mut right = nalgebra::Vector2::zeros();
        for group in groups {
            // Without what all of its points have in common, which is its radius.
            let rows: Vec<_> = group
                .runs()
                .concat()
                .iter()
                .map(|at_m| {
                    let [x, y] = [at_m[0] - centre_m[0], at_m[1] - centre_m[1]];
                    let away_m = libm::hypot(x, y).max(1e-6);
                    (nalgebra::Vector2::new(x / away_m, y / away_m), away_m)
                })
                .collect();
            let count = rows.len().max(1) as f64;
            let mean = rows
                .iter()
                .map(|(row, _)| row)
                .sum::<nalgebra::Vector2<f64>>()
                / count;
            let mean_m = rows.iter().map(|(_, away_m)| away_m).sum::<f64>() / count;
            for (row, away_m) in rows {
                let row = row - mean;
                normal += row * row.transpose();
                right += row * (away_m - mean_m);
            }
        }
        let Some(step) = normal.lu().solve(&right) else {
            break;
        };
        centre_m = [centre_m[0] + step[0], centre_m[1] + step[1]];
    }
    if distance_m(centre_m, begin_m) < SAME_CENTRE_M {
        centre_m
    } else {
        begin_m
    }
}

/// From the inside out. Groups that were fitted apart may turn out to be one around the common middle.
fn rings(ways: &[DrivenWay], groups: &[&Group], centre_m: [f64; 2]) -> Vec<Ring> {
    let mut radii: Vec<(LaneKind, f64, usize)> = groups
        .iter()
        .map(|group| {
            let points_m = group.runs().concat();
            let away_m = points_m.iter().map(|&at_m| distance_m(at_m, centre_m));
            let count = points_m.len().max(1);
            (kind(ways, group), away_m.sum::<f64>() / count as f64, count)
        })
        .collect();
    radii.sort_by(|a, b| a.1.total_cmp(&b.1));
    let mut merged: Vec<(LaneKind, f64, usize)> = vec![];
    for (kind, radius_m, count) in radii {
        let same = merged.iter_mut().find(|(other, other_m, _)| {
            *other == kind && (radius_m - *other_m).abs() < SAME_RADIUS_M
        });
        match same {
            Some((_, mean_m, before)) => {
                let all = (*before + count) as f64;
                *mean_m = (*mean_m * *before as f64 + radius_m * count as f64) / all;
                *before += count;
            }
            None => merged.push((kind, radius_m, count)),
        }
    }
    let rings = merged.into_iter().map(|(kind, radius_m, _)| Ring {
        circle: Circle { centre_m, radius_m },
        width_m: 0.0,
        kind,
        is_marked: false,
    });
    rings.collect()
}

/// Where somebody came into the circle, and where somebody left it: of ways at one place the longest.
fn accesses(
    ways: &[DrivenWay],
    roundabout: &Roundabout,
    roads: &[&Group],
) -> (Vec<Access>, Vec<Access>) {
    /// A shorter way does not say where it comes from.
    const LEAST_M: f64 = 8.0;
    const SAME_MOUTH_RAD: f64 = 0.35;
    let Some(outermost) = roundabout.roads().last() else {
        return (vec![], vec![]);
    };
    let centre_m = roundabout.centre_m();
    let around_m = roundabout
        .rings
        .iter()
        .map(Ring::outer_m)
        .fold(0.0, f64::max);
    let (mut entries, mut exits): (Vec<Access>, Vec<Access>) = (vec![], vec![]);
    let mut lanes: Vec<usize> = roads
        .iter()
        .flat_map(|group| group.bends.iter().map(|bend| bend.lane))
        .collect();
    lanes.sort_unstable();
    lanes.dedup();
    for lane in lanes {
        let DrivenWay { way, kind, .. } = &ways[lane];
        let points_m = way.points_m();
        let is_on = |at_m: &[f64; 2]| outermost.circle.off_m(*at_m) < OFF_CIRCLE_M;
        let (Some(first), Some(last)) = (
            points_m.iter().position(is_on),
            points_m.iter().rposition(is_on),
        ) else {
            continue;
        };
        let pieces = [(&points_m[..=first], true), (&points_m[last..], false)];
        for (piece, is_entry) in pieces {
            let piece = Polyline::through(piece.iter().copied());
            let (far_m, _) = piece.at(if is_entry { 0.0 } else { piece.length_m() });
            // Who has not come past all that it crosses does not say what that is.
            if piece.length_m() < LEAST_M || distance_m(far_m, centre_m) < around_m {
                continue;
            }
            let id = LaneId {
                layer: 0,
                road: lane as u32,
                lane: 1,
            };
            let found = access(id, kind.usual_width_m(), *kind, piece, roundabout, is_entry);
            let home = if is_entry { &mut entries } else { &mut exits };
            let known = home.iter_mut().find(|known| {
                wrapped_rad(known.mouth_rad - found.mouth_rad).abs() < SAME_MOUTH_RAD
            });
            match known {
                Some(known) if known.way.length_m() < found.way.length_m() => *known = found,
                Some(_) => {}
                None => home.push(found),
            }
        }
    }
    (entries, exits)
}

#[cfg(test)]
mod tests;
