//! What chance draws: vehicles, people, and what stands beside a street.

use super::actor;
use crate::random::Random;
use crate::simulate::path::Path;
use crate::simulate::scenario::{Actor, Load, Variant};
use crate::simulate::scenery::Scenery;

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

/// A vehicle with paint and panes of its own.
pub(super) fn vehicle(random: &mut Random, variant: Variant) -> Variant {
    let scale = between(random, 0.94, 1.06);
    Variant {
        size_m: variant.size_m.map(|metres| metres * scale),
        reflectance: between(random, 0.04, 0.7),
        glass: between(random, 0.2, 0.95),
        ..variant
    }
}

/// A lorry: one in three with a semi-trailer.
pub(super) fn lorry(random: &mut Random) -> Variant {
    let length_m = between(random, 5.8, 9.5);
    let size_m = if length_m < LONGEST_RIGID_M {
        [
            length_m,
            between(random, 2.2, 2.5),
            between(random, 2.5, 3.7),
        ]
    } else {
        [
            11.0 + 5.0 * (length_m - LONGEST_RIGID_M),
            between(random, 2.45, 2.55),
            between(random, 3.7, 4.0),
        ]
    };
    let own = Variant {
        size_m,
        ..Variant::lorry()
    };
    let reflectance = between(random, 0.1, 0.8);
    Variant { reflectance, ..own }
}

pub(super) fn parked(random: &mut Random, [x, y]: [f64; 2]) -> Actor {
    let (variant, y) = match pick(random, &[0.8, 0.12, 0.03]) {
        Some(0) => (Variant::car(random), y),
        Some(1) => {
            let lorry = lorry(random);
            (lorry, y + 0.5 * lorry.size_m[0] - 1.0)
        }
        Some(2) => (Variant::bus(), y + 4.0),
        _ => (Variant::cyclist(random), y),
    };
    let variant = vehicle(random, variant);
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
