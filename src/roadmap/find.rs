//! Roundabouts in a map: declared, named, or found because their lanes close a circle.

use super::arms::{access, accesses, arms};
use super::circle::Circle;
use super::network::Network;
use super::polyline::distance_m;
use super::rings::{self, SAME_CENTRE_M};
use super::roundabout::{Access, Ring, Roundabout, Source};
use super::{DeclaredRoundabout, Polyline, Roadmap};

/// All roundabouts of a map.
pub fn roundabouts(map: &Roadmap) -> Vec<Roundabout> {
    let declared = map.declared.iter().map(|one| from_declared(map, one));
    let mut found: Vec<_> = declared.collect();
    for mut drawn in from_lanes(map) {
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
fn from_declared(map: &Roadmap, declared: &DeclaredRoundabout) -> Roundabout {
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
            is_marked: false,
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
    let accesses = |is_entry: bool| {
        let junctions = declared.junctions.iter();
        let junctions = junctions.filter(move |junction| junction.is_entry == is_entry);
        junctions.filter_map(|junction| map.lane(junction.lane.lane))
    };
    let entries: Vec<_> = accesses(true)
        .map(|lane| access(lane, &roundabout, true))
        .collect();
    let exits: Vec<_> = accesses(false)
        .map(|lane| access(lane, &roundabout, false))
        .collect();
    roundabout.is_clockwise = is_clockwise(&roundabout, &entries, &exits);
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
fn from_lanes(map: &Roadmap) -> Vec<Roundabout> {
    let network = Network::of(map);
    let mut found: Vec<Roundabout> = vec![];
    for mut roundabout in rings::named(&network)
        .into_iter()
        .chain(rings::closed(&network))
    {
        let home = found
            .iter_mut()
            .find(|known| distance_m(known.centre_m(), roundabout.centre_m()) < SAME_CENTRE_M);
        match home {
            Some(known) => known.rings.append(&mut roundabout.rings),
            None => found.push(roundabout),
        }
    }
    for roundabout in &mut found {
        let (entries, exits) = accesses(&network, roundabout);
        roundabout.arms = arms(entries, exits, roundabout.is_clockwise);
    }
    found
}
