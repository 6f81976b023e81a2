//! What chance draws: vehicles, people, and what stands beside a street.

use super::actor;
use crate::random::Random;
use crate::simulate::path::Path;
use crate::simulate::scenario::Actor;
use crate::simulate::scenery::Scenery;
use crate::simulate::variant::{Build, CarBuild, Freight, Load, LorryBuild, Variant};

/// Longer lorries have a semi-trailer.
const LONGEST_RIGID_M: f64 = 8.3;

/// Something between two bounds, all of it alike.
pub(super) fn between(random: &mut Random, low: f64, high: f64) -> f64 {
    low + (high - low) * random.uniform()
}

/// How rough a sensor's ranges are: from half of what a real VLP-16's are to a third more than those of recordings that
/// were cut from other sensors.
pub(super) fn range_deviation_m(random: &mut Random) -> f64 {
    libm::exp(between(random, libm::log(0.004), libm::log(0.04)))
}

/// Which of so many shares chance picks; none if it lies beyond them all.
pub(super) fn pick(random: &mut Random, shares: &[f64]) -> Option<usize> {
    let mut left = random.uniform();
    shares.iter().position(|share| {
        left -= share;
        left < 0.0
    })
}

/// Paint and panes of its own for a vehicle.
fn painted(random: &mut Random, variant: Variant) -> Variant {
    Variant {
        reflectance: between(random, 0.04, 0.7),
        glass: between(random, 0.2, 0.95),
        ..variant
    }
}

/// Kinds of cars: which share of all they are, and from which length, width and height to which.
const CARS: [(f64, [[f64; 2]; 3]); 8] = [
    // Small ones, compact ones, and notchbacks and estates.
    (0.17, [[3.4, 4.0], [1.58, 1.72], [1.42, 1.62]]),
    (0.25, [[4.0, 4.5], [1.72, 1.85], [1.38, 1.56]]),
    (0.2, [[4.5, 5.1], [1.78, 1.95], [1.38, 1.52]]),
    // Off-roaders, people carriers, sports cars, pick-ups.
    (0.16, [[4.1, 5.0], [1.78, 2.0], [1.58, 1.88]]),
    (0.07, [[4.3, 5.0], [1.78, 1.95], [1.6, 1.9]]),
    (0.03, [[3.9, 4.6], [1.7, 1.9], [1.15, 1.35]]),
    (0.02, [[5.0, 5.6], [1.85, 2.0], [1.7, 1.9]]),
    // Vans and large vans.
    (0.1, [[4.2, 7.0], [1.8, 2.1], [1.8, 2.8]]),
];
/// Vans from this length on are as high as somebody who stands in them.
const LARGE_VAN_M: f64 = 5.3;
const VAN: usize = CARS.len() - 1;
const PICK_UP: usize = VAN - 1;

/// A car or a van of any kind.
pub(super) fn car(random: &mut Random) -> Variant {
    let shares = CARS.map(|(share, _)| share);
    let kind = pick(random, &shares).unwrap_or(VAN);
    let mut size_m = CARS[kind]
        .1
        .map(|[low_m, high_m]| between(random, low_m, high_m));
    if kind == VAN && size_m[0] > LARGE_VAN_M {
        size_m[2] = size_m[2].max(2.2);
    }
    let [length_m, _, height_m] = size_m;
    let carries_goods = kind == VAN && random.uniform() < 0.7;
    let belt_m = height_m * between(random, 0.55, 0.68);
    let over_belt_m = height_m - belt_m;
    let build = CarBuild {
        bonnet_m: length_m
            * match kind {
                VAN => between(random, 0.06, 0.2),
                _ => between(random, 0.18, 0.32),
            },
        boot_m: match kind {
            PICK_UP => length_m * between(random, 0.25, 0.4),
            2 | 5 if random.uniform() < 0.6 => length_m * between(random, 0.08, 0.2),
            _ => between(random, 0.0, 0.15),
        },
        belt_m,
        screen_m: over_belt_m * between(random, 0.4, 1.6),
        rear_screen_m: over_belt_m
            * if kind == VAN {
                0.1
            } else {
                between(random, 0.1, 1.2)
            },
        sill_m: between(random, 0.14, 0.36),
        lean_rad: between(random, 0.05, 0.4),
        corner_m: between(random, 0.1, 0.45),
        carries_goods,
        roof_box_m: if random.uniform() < 0.05 {
            between(random, 0.2, 0.5)
        } else {
            0.0
        },
    };
    let own = Variant {
        size_m,
        build: Build::Car(build),
        ..Variant::car(random)
    };
    painted(random, own)
}

/// A car or a van that is no longer than its bay.
pub(super) fn car_in_bay(random: &mut Random) -> Variant {
    const LONGEST_M: f64 = 5.4;
    loop {
        let car = car(random);
        if car.size_m[0] < LONGEST_M {
            return car;
        }
    }
}

/// A lorry: one in three with a semi-trailer.
pub(super) fn lorry(random: &mut Random) -> Variant {
    let length_m = between(random, 5.8, 9.5);
    let is_rigid = length_m < LONGEST_RIGID_M;
    let mut size_m = if is_rigid {
        [
            length_m,
            between(random, 2.1, 2.55),
            between(random, 2.4, 3.9),
        ]
    } else {
        [
            11.0 + 5.0 * (length_m - LONGEST_RIGID_M),
            between(random, 2.45, 2.55),
            between(random, 3.5, 4.0),
        ]
    };
    let freight = match pick(random, &[0.65, 0.15]) {
        Some(0) => Freight::Box,
        Some(1) => Freight::Tipper {
            side_m: between(random, 0.4, 1.6),
        },
        _ => {
            let from = between(random, 0.0, 0.6);
            let reach = [from, from + between(random, 0.1, 1.0 - from)];
            Freight::Platform { reach }
        }
    };
    let build = LorryBuild {
        cab_m: between(random, 1.5, 2.3),
        cab_high_m: between(random, 2.2, 3.6).min(size_m[2]),
        gap_m: between(random, 0.05, 0.8),
        floor_m: between(random, 0.55, 1.25),
        freight,
        goods_reflectance: between(random, 0.1, 0.8),
        has_skirt: random.uniform() < 0.5,
    };
    if let Freight::Tipper { side_m } = build.freight {
        size_m[2] = build.cab_high_m.max(build.floor_m + side_m);
    }
    let own = Variant {
        size_m,
        build: Build::Lorry(build),
        ..Variant::lorry()
    };
    painted(random, own)
}

pub(super) fn bus(random: &mut Random) -> Variant {
    let size_m = [
        between(random, 8.0, 14.0),
        between(random, 2.4, 2.55),
        between(random, 2.8, 3.6),
    ];
    let belt_m = between(random, 0.9, 1.5);
    let own = Variant {
        size_m,
        build: Build::Bus { belt_m },
        ..Variant::bus()
    };
    painted(random, own)
}

/// Who rides on two or three wheels.
pub(super) fn rider(random: &mut Random) -> Variant {
    let own = Variant::cyclist(random);
    match pick(random, &[0.3, 0.1]) {
        Some(0) => {
            let size_m = [
                between(random, 1.75, 2.25),
                between(random, 0.65, 0.9),
                between(random, 1.5, 1.8),
            ];
            let build = Build::Motorcycle;
            Variant {
                size_m,
                build,
                ..own
            }
        }
        Some(1) => {
            let [_, width_m, height_m] = own.size_m;
            let size_m = [between(random, 2.3, 2.7), width_m.max(0.65), height_m];
            let build = Build::CargoBicycle;
            Variant {
                size_m,
                build,
                ..own
            }
        }
        _ => own,
    }
}

pub(super) fn parked(random: &mut Random, [x, y]: [f64; 2]) -> Actor {
    let (variant, y) = match pick(random, &[0.8, 0.12, 0.03]) {
        Some(0) => (car(random), y),
        Some(1) => {
            let lorry = lorry(random);
            (lorry, y + 0.5 * lorry.size_m[0] - 1.0)
        }
        Some(2) => {
            let bus = bus(random);
            (bus, y + 0.5 * bus.size_m[0] - 2.0)
        }
        _ => (rider(random), y),
    };
    let turn_deg = if random.uniform() < 0.5 { 90.0 } else { -90.0 };
    let slant_deg = between(random, -4.0, 4.0);
    actor(variant, Path::parked([x, y], turn_deg + slant_deg))
}

pub(super) fn person(random: &mut Random) -> Variant {
    let own = Variant::pedestrian(random);
    // Children, too.
    let scale = if random.uniform() < 0.15 {
        between(random, 0.65, 0.9)
    } else {
        1.0
    };
    let load = match pick(random, &[0.1, 0.08, 0.08, 0.1, 0.05]) {
        Some(0) => Load::Pack,
        Some(1) => Load::Umbrella,
        Some(2) => Load::Pram,
        Some(3) => Load::Suitcase,
        Some(4) => Load::Wheelchair,
        _ => Load::None,
    };
    Variant {
        size_m: own.size_m.map(|metres| metres * scale),
        load,
        ..own
    }
}

pub(super) fn stand_at_kerb(random: &mut Random, scenery: &mut Scenery, [x, y]: [f64; 2]) {
    let turn_deg = between(random, 0.0, 180.0);
    match pick(random, &[0.12, 0.12, 0.1, 0.06, 0.06, 0.08, 0.05, 0.15]) {
        Some(0) => {
            let radius_m = between(random, 0.05, 0.2);
            let high_m = between(random, 2.5, 7.0);
            scenery.pole([x, y], radius_m, high_m);
        }
        Some(1) => {
            for bin in 0..1 + random.below(4) {
                let sizes_m = [between(random, 0.45, 1.3), between(random, 0.5, 1.0)];
                let high_m = between(random, 0.9, 1.4);
                scenery.cabinet([x, y + 1.4 * bin as f64], 90.0, sizes_m, high_m);
            }
        }
        Some(2) => {
            scenery.sign([x, y], turn_deg);
        }
        Some(3) => {
            for bollard in 0..3 {
                let radius_m = between(random, 0.05, 0.12);
                let high_m = between(random, 0.6, 1.1);
                scenery.pole([x, y + 1.5 * f64::from(bollard)], radius_m, high_m);
            }
        }
        Some(4) => {
            let radius_m = between(random, 0.3, 0.8);
            let high_m = between(random, 0.5, 1.8);
            scenery.bush([x, y], radius_m, high_m);
        }
        Some(5) => {
            let crown_m = between(random, 1.0, 2.5);
            scenery.tree([x, y], crown_m);
        }
        Some(6) => {
            let length_m = between(random, 1.5, 5.5);
            scenery.rail([x, y], 90.0, length_m);
        }
        Some(7) => mast(random, scenery, [x, y]),
        _ => {}
    }
}

/// Something slender with things on it: traffic lights, signs and boxes on a post, a young tree.
fn mast(random: &mut Random, scenery: &mut Scenery, [x, y]: [f64; 2]) {
    let radius_m = between(random, 0.03, 0.18);
    let high_m = between(random, 1.2, 6.0);
    scenery.pole([x, y], radius_m, high_m);
    for _ in 0..1 + random.below(3) {
        let at_m = [
            x + between(random, -0.15, 0.15),
            y + between(random, -0.15, 0.15),
        ];
        let turn_deg = between(random, 0.0, 180.0);
        let sizes_m = [between(random, 0.15, 0.8), between(random, 0.04, 0.45)];
        let low_m = between(random, 0.1, 2.6);
        let heights_m = [low_m, low_m + between(random, 0.2, 1.2)];
        scenery.panel(at_m, turn_deg, sizes_m, heights_m);
    }
}
