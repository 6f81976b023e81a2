//! The scenes themselves. Traffic drives on the right; x is east, y north.

mod chance;
mod groups;
mod overgrown;
mod passage;
mod pavement;
mod places;
mod roads;
mod roundabouts;
mod strangers;
mod traffic;

use super::path::Path;
use super::scenario::{Actor, Scenario};
use super::variant::Variant;
use crate::random::Random;

pub(super) const ALL: &[Scenario] = &[
    Scenario {
        name: "roundabout",
        summary: "a small roundabout of 30 m: three cars, three cyclists, a pedestrian; the \
                  vehicle approaches, gives way, enters and leaves",
        build: roundabouts::roundabout,
        roads: Some(roundabouts::small_roads),
    },
    Scenario {
        name: "roundabout-waiting",
        summary: "the same roundabout from an entry, where the vehicle stands and has no pose",
        build: roundabouts::roundabout_waiting,
        roads: Some(roundabouts::waiting_roads),
    },
    Scenario {
        name: "mini-roundabout",
        summary: "a mini roundabout among hedges, trees and verges: two cars, a cyclist, two \
                  pedestrians side by side",
        build: roundabouts::mini_roundabout,
        roads: Some(roundabouts::mini_roads),
    },
    Scenario {
        name: "roundabout-traffic",
        summary: "a small roundabout with cars that come from all arms and leave by all, two cyclists \
                  and a pedestrian; the vehicle waits before the circle",
        build: traffic::small,
        roads: Some(traffic::small_roads),
    },
    Scenario {
        name: "two-lane-roundabout",
        summary: "the same with two lanes and an outer diameter of 42 m",
        build: traffic::two_lane,
        roads: Some(traffic::two_lane_roads),
    },
    Scenario {
        name: "mini-traffic",
        summary: "the same, a mini roundabout with an outer diameter of 18 m, without cyclists",
        build: traffic::mini,
        roads: Some(traffic::mini_roads),
    },
    Scenario {
        name: "roundabout-entry",
        summary: "the small roundabout with traffic; the vehicle comes from 60 m before it, and stands before it",
        build: traffic::small_entry,
        roads: Some(traffic::small_roads),
    },
    Scenario {
        name: "two-lane-entry",
        summary: "the same at the one with two lanes",
        build: traffic::two_lane_entry,
        roads: Some(traffic::two_lane_roads),
    },
    Scenario {
        name: "mini-entry",
        summary: "the same at the mini roundabout",
        build: traffic::mini_entry,
        roads: Some(traffic::mini_roads),
    },
    Scenario {
        name: "street",
        summary: "a street with parked cars, oncoming traffic, a bus, a cyclist, pedestrians, \
                  and a turn to the right",
        build: roads::street,
        roads: None,
    },
    Scenario {
        name: "car-park",
        summary: "a car park: two rows of parked cars, one that leaves, two pedestrians",
        build: places::car_park,
        roads: None,
    },
    Scenario {
        name: "hill",
        summary: "a road over a hill, with verges and oncoming traffic",
        build: roads::hill,
        roads: None,
    },
    Scenario {
        name: "occlusion",
        summary: "a standing sensor; cars, cyclists and pedestrians pass behind a lorry, a \
                  board and a van for a second or two",
        build: places::occlusion,
        roads: None,
    },
    Scenario {
        name: "standing",
        summary: "a standing sensor beside a road, with traffic at all ranges",
        build: roads::standing,
        roads: None,
    },
    Scenario {
        name: "strangers",
        summary: "a street that chance furnishes: parked vehicles, people with loads and in groups, \
                  traffic, hedges, walls, bins, signs; no two seeds are alike",
        build: strangers::strangers,
        roads: None,
    },
    Scenario {
        name: "furniture",
        summary: "the same without any road user: vegetation and street furniture",
        build: strangers::furniture,
        roads: None,
    },
    Scenario {
        name: "overgrown",
        summary: "a street that chance furnishes, too, among gardens: ragged trees, thickets and fronts \
                  close behind parked vehicles and above them",
        build: overgrown::overgrown,
        roads: None,
    },
    Scenario {
        name: "groups",
        summary: "a street with cyclists and people on foot in groups, one behind another and side by \
                  side, whom the vehicle follows, overtakes and meets",
        build: groups::groups,
        roads: None,
    },
    Scenario {
        name: "pavement",
        summary: "a street between fronts, walls and hedges, close to which people walk and wait, before and \
                  behind parked vehicles",
        build: pavement::pavement,
        roads: None,
    },
];

/// Standard deviation of a range at right angles (VLP-16 user manual: accuracy of 3 cm,
/// "typical"; a surface at rest shows 1 to 2 cm).
const RANGE_DEVIATION_M: f64 = 0.015;
/// Height of the sensor above the road: on the roof of a large car.
const SENSOR_M: f64 = 2.0;
/// From the middle of a road to the middle of a lane.
const LANE_M: f64 = 1.75;

/// A factor around 1.
fn about(random: &mut Random, deviation: f64) -> f64 {
    1.0 + deviation * (2.0 * random.uniform() - 1.0)
}

fn actor(variant: Variant, path: Path) -> Actor {
    Actor { variant, path }
}
