//! Who rides on two or three wheels.

use super::{CLOTH, RUBBER, solid, wheel};
use crate::simulate::solid::{Fabric, Shape, Solid, block, extruded};
use crate::simulate::variant::{Build, Variant};

pub(super) fn parts(variant: &Variant, travelled_m: f64) -> Vec<Solid> {
    match variant.build {
        Build::Motorcycle => motorcycle(variant),
        Build::CargoBicycle => cargo_bicycle(variant, travelled_m),
        _ => bicycle(variant, variant.size_m[0], travelled_m),
    }
}

/// Thin wheels and frame, the rider leaning a little forward.
fn bicycle(variant: &Variant, length_m: f64, travelled_m: f64) -> Vec<Solid> {
    let [_, width_m, height_m] = variant.size_m;
    let radius_m = 0.34;
    let axle_m = 0.5 * length_m - radius_m;
    let pedal_m = 0.17 * libm::sin(travelled_m / 1.1 * 2.0);
    let hip_m = 0.55 * height_m;
    let neck_m = height_m - 0.28;
    let half_m = 0.5 * width_m;
    let torso = [
        [-0.32, hip_m],
        [-0.08, hip_m - 0.02],
        [0.26, neck_m],
        [0.02, neck_m + 0.03],
    ];
    let leg = |v: f64, shift_m: f64| {
        block(
            [-0.05 + shift_m, v - 0.06, 0.28 + 0.5 * shift_m.abs()],
            [0.11 + shift_m, v + 0.06, hip_m],
        )
    };
    vec![
        solid(
            wheel(axle_m, 0.0, radius_m, 0.04),
            Fabric::Open(0.55),
            RUBBER,
        ),
        solid(
            wheel(-axle_m, 0.0, radius_m, 0.04),
            Fabric::Open(0.55),
            RUBBER,
        ),
        solid(
            block([-0.45, -0.03, 0.35], [0.5, 0.03, 0.85]),
            Fabric::Open(0.6),
            0.2,
        ),
        // Handlebar.
        solid(
            block([0.42, -0.28, 0.95], [0.5, 0.28, 1.05]),
            Fabric::Open(0.3),
            0.2,
        ),
        solid(
            Shape::Convex(extruded(&torso, 0.8 * half_m)),
            Fabric::Dense,
            variant.reflectance,
        ),
        solid(leg(0.13, pedal_m), Fabric::Dense, CLOTH),
        solid(leg(-0.13, -pedal_m), Fabric::Dense, CLOTH),
        solid(
            block([0.1, -half_m, neck_m - 0.35], [0.45, half_m, neck_m - 0.1]),
            Fabric::Open(0.65),
            CLOTH,
        ),
        solid(
            Shape::Cylinder {
                centre_m: [0.2, 0.0],
                radius_m: 0.1,
                low_m: neck_m,
                high_m: height_m,
            },
            Fabric::Dense,
            0.3,
        ),
    ]
}

/// A bicycle with a box before the rider.
fn cargo_bicycle(variant: &Variant, travelled_m: f64) -> Vec<Solid> {
    let [length_m, width_m, _] = variant.size_m;
    let half_m = 0.5 * length_m;
    let mut parts = bicycle(variant, length_m, travelled_m);
    let box_m = block(
        [half_m - 1.0, -0.5 * width_m, 0.3],
        [half_m - 0.1, 0.5 * width_m, 0.85],
    );
    parts.push(solid(box_m, Fabric::Dense, variant.reflectance));
    parts
}

/// Broad wheels, the engine between them, and a rider who sits upright behind the handlebar.
fn motorcycle(variant: &Variant) -> Vec<Solid> {
    let [length_m, width_m, height_m] = variant.size_m;
    let (half_m, radius_m) = (0.5 * length_m, 0.3);
    let (seat_m, neck_m) = (0.45 * height_m, height_m - 0.3);
    let dense =
        |low_m, high_m, reflectance| solid(block(low_m, high_m), Fabric::Dense, reflectance);
    vec![
        solid(
            wheel(half_m - radius_m, 0.0, radius_m, 0.12),
            Fabric::Dense,
            RUBBER,
        ),
        solid(
            wheel(radius_m - half_m, 0.0, radius_m, 0.14),
            Fabric::Dense,
            RUBBER,
        ),
        dense([-0.6, -0.2, 0.3], [0.5, 0.2, seat_m], variant.reflectance),
        // Shield and lamp.
        dense([0.45, -0.2, 0.55], [0.65, 0.2, 1.1], variant.reflectance),
        // Handlebar and mirrors.
        solid(
            block([0.35, -0.5 * width_m, 0.95], [0.5, 0.5 * width_m, 1.15]),
            Fabric::Open(0.5),
            0.2,
        ),
        // Thighs, shins and feet.
        dense(
            [-0.2, -0.27, seat_m - 0.15],
            [0.3, 0.27, seat_m + 0.05],
            CLOTH,
        ),
        dense([0.15, -0.28, 0.15], [0.3, 0.28, seat_m], CLOTH),
        dense(
            [-0.35, -0.22, seat_m],
            [-0.05, 0.22, neck_m],
            variant.reflectance,
        ),
        solid(
            Shape::Cylinder {
                centre_m: [-0.1, 0.0],
                radius_m: 0.14,
                low_m: neck_m,
                high_m: height_m,
            },
            Fabric::Dense,
            0.3,
        ),
    ]
}
