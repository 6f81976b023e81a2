//! Lanes that lead to a circle and away from it, and the arms that they make.

use std::collections::BTreeSet;
use std::f64::consts::{PI, TAU};

use super::network::Network;
use super::rings::OFF_CIRCLE_M;
use super::roundabout::{Access, Arm, Ring, Roundabout};
use super::{Lane, LaneId, LaneKind, Polyline};

/// How far from the circle arms are followed.
pub(super) const REACH_M: f64 = 60.0;
/// An entry without a connector points at the circle and ends within this of its edge; so does an
/// exit begin. Drawn lanes stop where the corner begins.
const MOUTH_M: f64 = 12.0;
/// Exit and entry of one arm are no farther apart than this.
const ARM_RAD: f64 = 75.0 * PI / 180.0;

/// Lanes that lead into the circle, and out of it.
pub(super) fn accesses(
    network: &Network<'_>,
    roundabout: &Roundabout,
) -> (Vec<Access>, Vec<Access>) {
    let (centre_m, outer_m) = (roundabout.centre_m(), roundabout.outer_m());
    let rings_m = roundabout.rings.iter().map(Ring::outer_m);
    let reach_m = rings_m.fold(outer_m, f64::max) + MOUTH_M;
    // Of a large map nearly all lanes are far away.
    let is_near = |way: &Polyline| way.comes_within(centre_m, reach_m);
    let lanes = || network.lanes.iter().zip(&network.ways);
    let rings = lanes()
        .filter(|(_, way)| is_near(way) && runs_on(roundabout, way))
        .map(|(lane, _)| lane.id);
    let rings: BTreeSet<LaneId> = rings.collect();
    let into_ring: BTreeSet<LaneId> = network
        .leads
        .iter()
        .filter(|(_, targets)| !targets.is_disjoint(&rings))
        .map(|(&from, _)| from)
        .collect();
    let from_ring = rings
        .iter()
        .filter_map(|ring| network.leads.get(ring))
        .flatten();
    let from_ring: BTreeSet<LaneId> = from_ring.copied().collect();
    let (mut entries, mut exits) = (vec![], vec![]);
    for (index, (lane, way)) in lanes().enumerate() {
        if rings.contains(&lane.id)
            || !(is_near(way) || into_ring.contains(&lane.id) || from_ring.contains(&lane.id))
        {
            continue;
        }
        // Who leads on elsewhere, or comes from elsewhere, does not begin or end here.
        let (leads_on, comes_from) = (network.leads_on(lane.id), network.comes_from(lane.id));
        if into_ring.contains(&lane.id) || (!leads_on && meets(roundabout, way, true)) {
            entries.push(access_by(lane, network.way_to(index), roundabout, true));
        }
        if from_ring.contains(&lane.id) || (!comes_from && meets(roundabout, way, false)) {
            exits.push(access_by(lane, network.way_from(index), roundabout, false));
        }
    }
    (entries, exits)
}

/// Whether most of a way lies on a ring, or much of it: a drawn lane may begin or end with a piece of the road.
fn runs_on(roundabout: &Roundabout, way: &Polyline) -> bool {
    /// Fewer points are not much, though they be a third of them.
    const MUCH: usize = 8;
    let points_m = way.points_m();
    roundabout.rings.iter().any(|ring| {
        let on = |&&at_m: &&[f64; 2]| ring.circle.off_m(at_m).abs() < 2.0 * OFF_CIRCLE_M;
        let near = points_m.iter().filter(on).count();
        2 * near > points_m.len() || (near >= MUCH && 3 * near > points_m.len())
    })
}

/// Whether a way that nothing is connected to runs into the circle beyond its end, or came out of it before its
/// beginning.
fn meets(roundabout: &Roundabout, way: &Polyline, is_entry: bool) -> bool {
    let outer_m = roundabout.outer_m();
    let (end_m, heading_rad) = way.at(if is_entry { way.length_m() } else { 0.0 });
    let [x, y] = [0, 1].map(|axis| roundabout.centre_m()[axis] - end_m[axis]);
    let side = if is_entry { 1.0 } else { -1.0 };
    let (sine, cosine) = libm::sincos(heading_rad);
    let (ahead_m, beside_m) = (side * (x * cosine + y * sine), y * cosine - x * sine);
    let away_m = libm::hypot(x, y) - outer_m;
    away_m < 0.0 || (away_m < MOUTH_M && ahead_m > 0.0 && beside_m.abs() < outer_m)
}

/// Longest corner: from where a lane meets the circle outward, it has the arm's direction by then.
const CORNER_M: f64 = 25.0;

/// `whole` is the way in or out, of which the lane is the last or first piece.
pub(super) fn access_by(
    lane: &Lane,
    whole: Polyline,
    roundabout: &Roundabout,
    is_entry: bool,
) -> Access {
    access(
        lane.id,
        lane.width_m(),
        lane.kind,
        whole,
        roundabout,
        is_entry,
    )
}

/// The same of a way that no lane of a map describes.
pub(super) fn access(
    lane: LaneId,
    width_m: f64,
    kind: LaneKind,
    whole: Polyline,
    roundabout: &Roundabout,
    is_entry: bool,
) -> Access {
    let length_m = whole.length_m();
    let way = if is_entry {
        whole.between((length_m - REACH_M).max(0.0), length_m)
    } else {
        whole.between(0.0, REACH_M.min(length_m))
    };
    let [x, y] = roundabout.centre_m();
    let angle_rad = |along_m: f64| {
        let (at_m, _) = way.at(along_m);
        libm::atan2(at_m[1] - y, at_m[0] - x)
    };
    let [mouth_rad, bearing_rad] = [0.0, CORNER_M].map(|away_m| {
        angle_rad(if is_entry {
            way.length_m() - away_m
        } else {
            away_m
        })
    });
    Access {
        lane,
        width_m,
        kind,
        mouth_rad,
        bearing_rad,
        way,
    }
}

/// Exits and entries that belong together: going round, one comes to an arm's exit before its
/// entry.
pub(super) fn arms(entries: Vec<Access>, exits: Vec<Access>, is_clockwise: bool) -> Vec<Arm> {
    let side = if is_clockwise { -1.0 } else { 1.0 };
    let round_rad = |angle_rad: f64| {
        let share = side * angle_rad / TAU;
        (share - libm::floor(share)) * TAU
    };
    let mut mouths: Vec<_> = entries.into_iter().map(|access| (true, access)).collect();
    mouths.extend(exits.into_iter().map(|access| (false, access)));
    // Where both are one, as on a road that parts, the exit comes first.
    let place = |(is_entry, access): &(bool, Access)| {
        let rounded = libm::round(round_rad(access.bearing_rad) * 1e3) as i64;
        (rounded, *is_entry)
    };
    mouths.sort_by_key(place);
    // Begin behind the widest gap.
    let count = mouths.len();
    let gap_before = |index: usize| {
        let before = &mouths[(index + count - 1) % count].1;
        let step_rad = round_rad(mouths[index].1.bearing_rad - before.bearing_rad);
        if count == 1 { TAU } else { step_rad }
    };
    let widest = (0..count).max_by(|&a, &b| gap_before(a).total_cmp(&gap_before(b)));
    mouths.rotate_left(widest.unwrap_or(0));
    let mut found: Vec<Arm> = vec![];
    let mut last_rad = 0.0;
    for (is_entry, access) in mouths {
        let step_rad = round_rad(access.bearing_rad - last_rad);
        // Rounding may have put two that are one in the other order.
        let step_rad = if step_rad > TAU - 0.01 { 0.0 } else { step_rad };
        last_rad = access.bearing_rad;
        let joins = found.last().is_some_and(|arm| {
            let home = if is_entry { &arm.entries } else { &arm.exits };
            let is_in_order = is_entry || arm.entries.is_empty();
            let most_rad = if home.is_empty() {
                ARM_RAD
            } else {
                ARM_RAD / 4.0
            };
            is_in_order && step_rad < most_rad
        });
        if !joins {
            found.push(Arm::default());
        }
        if let Some(arm) = found.last_mut() {
            let home = if is_entry {
                &mut arm.entries
            } else {
                &mut arm.exits
            };
            home.push(access);
        }
    }
    for arm in &mut found {
        let mouths = arm.entries.iter().chain(&arm.exits);
        let [x, y] = mouths.fold([0.0; 2], |[x, y], access| {
            let (sine, cosine) = libm::sincos(access.bearing_rad);
            [x + cosine, y + sine]
        });
        arm.bearing_rad = libm::atan2(y, x);
    }
    found.sort_by(|a, b| a.bearing_rad.total_cmp(&b.bearing_rad));
    found
}
