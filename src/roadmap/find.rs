//! Roundabouts in a map: declared, named, or found because their lanes close a circle.

use std::collections::BTreeSet;

use super::arms::{access_by, accesses, arms};
use super::circle::Circle;
use super::network::Network;
use super::polyline::distance_m;
use super::rings::{self, SAME_CENTRE_M};
use super::roundabout::{Access, Ring, Roundabout, Source};
use super::{DeclaredRoundabout, LaneId, Polyline, Roadmap};

/// All roundabouts of a map.
pub fn roundabouts(map: &Roadmap) -> Vec<Roundabout> {
    let network = Network::of(map);
    let declared = map.declared.iter().map(|one| from_declared(&network, one));
    let mut found: Vec<_> = declared.collect();
    for mut drawn in from_lanes(&network) {
        let is_known = |known: &Roundabout| {
            distance_m(known.centre_m(), drawn.centre_m()) < known.outer_m().max(SAME_CENTRE_M)
        };
        if !found.iter().any(is_known) {
            drawn
                .rings
                .sort_by(|a, b| a.circle.radius_m.total_cmp(&b.circle.radius_m));
            found.push(drawn);
        }
    }
    found
}

/// As the map says.
fn from_declared(network: &Network<'_>, declared: &DeclaredRoundabout) -> Roundabout {
    let mut rings: Vec<_> = declared
        .circles
        .iter()
        .map(|circle| Ring {
            circle: Circle {
                centre_m: declared.centre_m,
                radius_m: (circle.inner_m + circle.outer_m) / 2.0,
            },
            width_m: circle.outer_m - circle.inner_m,
            kind: circle.kind,
            is_marked: circle.is_marked,
        })
        .collect();
    rings.sort_by(|a, b| a.circle.radius_m.total_cmp(&b.circle.radius_m));
    let mut roundabout = Roundabout {
        name: declared.name.clone(),
        source: Source::Declared,
        rings,
        is_clockwise: false,
        arms: vec![],
        off_circle_m: 0.0,
        covered_share: 1.0,
    };
    // Each lane once, however often it is named.
    let named: BTreeSet<(LaneId, bool)> = declared
        .junctions
        .iter()
        .map(|junction| (junction.lane.lane, junction.is_entry))
        .collect();
    let (mut entries, mut exits) = (vec![], vec![]);
    for (id, is_entry) in named {
        let Some(index) = network.index_of(id) else {
            continue;
        };
        let lane = &network.lanes[index];
        if is_entry {
            entries.push(access_by(lane, network.way_to(index), &roundabout, true));
        } else {
            exits.push(access_by(lane, network.way_from(index), &roundabout, false));
        }
    }
    let derived = || is_clockwise(&roundabout, &entries, &exits);
    roundabout.is_clockwise = declared.is_clockwise.unwrap_or_else(derived);
    roundabout.arms = arms(entries, exits, roundabout.is_clockwise);
    roundabout
}

/// Whether ways in and out pass the middle on its left: a map does not say which way round one drives.
fn is_clockwise(roundabout: &Roundabout, entries: &[Access], exits: &[Access]) -> bool {
    let [x, y] = roundabout.centre_m();
    let spin_m = |way: &Polyline, along_m: f64| {
        let ([at_x, at_y], heading_rad) = way.at(along_m);
        let (sine, cosine) = libm::sincos(heading_rad);
        (at_x - x) * sine - (at_y - y) * cosine
    };
    let inward = entries
        .iter()
        .map(|access| spin_m(&access.way, access.way.length_m()));
    let outward = exits.iter().map(|access| spin_m(&access.way, 0.0));
    inward.chain(outward).sum::<f64>() < 0.0
}

/// From its lanes alone.
fn from_lanes(network: &Network<'_>) -> Vec<Roundabout> {
    let rings = rings::named(network)
        .into_iter()
        .chain(rings::closed(network));
    let is_road = |roundabout: &Roundabout| roundabout.roads().next().is_some();
    // Ways around it belong to a road's circle, and make none by themselves.
    let (roads, around): (Vec<_>, Vec<_>) = rings.partition(is_road);
    let mut found: Vec<Roundabout> = vec![];
    let mut both_ways: Vec<[f64; 2]> = vec![];
    for mut roundabout in roads.into_iter().chain(around) {
        let centre_m = roundabout.centre_m();
        let home = found
            .iter_mut()
            .find(|known| distance_m(known.centre_m(), centre_m) < SAME_CENTRE_M);
        match home {
            Some(known) => {
                // A road that is driven both ways is a loop.
                if is_road(&roundabout) && known.is_clockwise != roundabout.is_clockwise {
                    both_ways.push(known.centre_m());
                }
                known.rings.append(&mut roundabout.rings);
            }
            None if is_road(&roundabout) => found.push(roundabout),
            None => {}
        }
    }
    found.retain(|known| {
        let is_it = |centre_m: &[f64; 2]| distance_m(known.centre_m(), *centre_m) < SAME_CENTRE_M;
        known.source == Source::Named || !both_ways.iter().any(is_it)
    });
    for roundabout in &mut found {
        let (entries, exits) = accesses(network, roundabout);
        roundabout.arms = arms(entries, exits, roundabout.is_clockwise);
    }
    found
}
