//! Road users as solids in their own frame: u ahead, v to the left, z up from the ground.
//!
//! Outlines are of everyday vehicles: sloped screens, rounded corners, gaps below the sills,
//! wheels. Glass lets most rays through, spokes and frames some.

use super::scenario::{Class, Load, Variant};
use super::solid::{Fabric, Shape, Solid, block, extruded};

const RUBBER: f64 = 0.08;
/// Trailers are higher.
const HIGHEST_BUS_M: f64 = 3.35;
const CLOTH: f64 = 0.35;

/// The solids of a road user after it has gone `travelled_m`.
pub(super) fn parts(variant: &Variant, travelled_m: f64) -> Vec<Solid> {
    match variant.class {
        Class::Car => car(variant),
        Class::Truck => truck(variant),
        Class::Cyclist => cyclist(variant, travelled_m),
        Class::Pedestrian => pedestrian(variant, travelled_m),
    }
}

fn solid(shape: Shape, fabric: Fabric, reflectance: f64) -> Solid {
    Solid {
        shape,
        fabric,
        reflectance,
    }
}

/// An outline with upright edges cut off, as bumpers are rounded.
fn rounded(outline_m: &[[f64; 2]], half_width_m: f64, cut_m: f64) -> Shape {
    let far_m = outline_m.iter().map(|[u, _]| u.abs()).fold(0.0, f64::max);
    let mut planes = extruded(outline_m, half_width_m);
    let half = std::f64::consts::FRAC_1_SQRT_2;
    let offset_m = half * (far_m + half_width_m - cut_m);
    for (u, v) in [(half, half), (half, -half), (-half, half), (-half, -half)] {
        planes.push(([u, v, 0.0], offset_m));
    }
    Shape::Convex(planes)
}

/// A wheel across the vehicle.
fn wheel(u: f64, v: f64, radius_m: f64, width_m: f64) -> Shape {
    let rim: Vec<[f64; 2]> = (0..12)
        .map(|corner| {
            let (sine, cosine) = libm::sincos(std::f64::consts::TAU * f64::from(corner) / 12.0);
            [u + radius_m * cosine, radius_m + radius_m * sine]
        })
        .collect();
    let mut planes = extruded(&rim, 0.5 * width_m);
    for (normal, offset) in &mut planes {
        *offset += normal[1] * v;
    }
    Shape::Convex(planes)
}

/// A body from sill to belt and a cabin above it: notchback, hatchback or van by its sizes.
fn car(variant: &Variant) -> Vec<Solid> {
    let [length_m, width_m, height_m] = variant.size_m;
    let (half_m, wide_m) = (0.5 * length_m, 0.5 * width_m);
    let belt_m = 0.62 * height_m;
    let is_van = height_m > 1.75;
    let bonnet_m = if is_van { 0.16 } else { 0.27 } * length_m;
    let boot_m = if length_m > 4.5 && !is_van {
        0.14 * length_m
    } else {
        0.02 * length_m
    };
    let body = [
        [-half_m + 0.1, 0.2],
        [half_m - 0.15, 0.2],
        [half_m, 0.35],
        [half_m - 0.03, 0.62 * belt_m + 0.1],
        [half_m - bonnet_m, belt_m],
        [-half_m + 0.05, belt_m],
        [-half_m, 0.45],
    ];
    let roof_front_m = half_m - bonnet_m - 0.9 * (height_m - belt_m);
    let roof_back_m = -half_m + boot_m + if is_van { 0.05 } else { 0.35 };
    let cabin = [
        [-half_m + boot_m, belt_m],
        [half_m - bonnet_m, belt_m],
        [roof_front_m, height_m - 0.02],
        [roof_back_m + 0.2, height_m],
        [roof_back_m, height_m - 0.04],
    ];
    let mut leaning = extruded(&cabin, wide_m);
    // The sides of a cabin lean in by some 15 degrees.
    let (sine, cosine) = libm::sincos(0.26);
    for side in [1.0, -1.0] {
        leaning.push((
            [0.0, side * cosine, sine],
            cosine * (wide_m - 0.03) + sine * belt_m,
        ));
    }
    let paint = variant.reflectance;
    let axle_m = 0.31 * length_m;
    let track_m = wide_m - 0.12;
    let mut parts = vec![
        solid(rounded(&body, wide_m, 0.3), Fabric::Dense, paint),
        solid(Shape::Convex(leaning), Fabric::Open(variant.glass), 0.1),
        // Roof and pillars, within the glass.
        solid(
            block(
                [roof_back_m + 0.1, -wide_m + 0.25, height_m - 0.08],
                [roof_front_m, wide_m - 0.25, height_m - 0.01],
            ),
            Fabric::Dense,
            paint,
        ),
        // Seats and people behind the glass.
        solid(
            block(
                [-0.25 * length_m, -0.6, 0.5],
                [0.1 * length_m, 0.6, 0.8 * height_m],
            ),
            Fabric::Open(0.6),
            0.1,
        ),
    ];
    if is_van {
        // Metal from behind the front doors.
        let load = block(
            [-half_m + 0.06, -wide_m + 0.08, belt_m],
            [0.1 * length_m, wide_m - 0.08, height_m - 0.02],
        );
        parts.push(solid(load, Fabric::Dense, paint));
    }
    for (u, v) in [
        (axle_m, track_m),
        (axle_m, -track_m),
        (-axle_m, track_m),
        (-axle_m, -track_m),
    ] {
        parts.push(solid(wheel(u, v, 0.31, 0.2), Fabric::Dense, RUBBER));
    }
    parts
}

/// A bus where it is long and low, else a lorry with a cab and a box, or with a semi-trailer where it is long.
fn truck(variant: &Variant) -> Vec<Solid> {
    let [length_m, width_m, height_m] = variant.size_m;
    let (half_m, wide_m) = (0.5 * length_m, 0.5 * width_m);
    let paint = variant.reflectance;
    let is_long = length_m > 10.0;
    let is_bus = is_long && height_m < HIGHEST_BUS_M;
    let mut parts = if is_bus {
        let lower = [
            [-half_m, 0.35],
            [half_m, 0.35],
            [half_m, 1.2],
            [-half_m, 1.2],
        ];
        let windows = [
            [-half_m, 1.2],
            [half_m, 1.2],
            [half_m - 0.1, 2.4],
            [-half_m + 0.05, 2.4],
        ];
        let roof = [
            [-half_m, 2.4],
            [half_m - 0.1, 2.4],
            [half_m - 0.2, height_m],
            [-half_m, height_m],
        ];
        vec![
            solid(rounded(&lower, wide_m, 0.15), Fabric::Dense, paint),
            solid(rounded(&windows, wide_m, 0.15), Fabric::Open(0.45), 0.1),
            solid(rounded(&roof, wide_m, 0.15), Fabric::Dense, paint),
        ]
    } else {
        let cab = [
            [half_m - 1.8, 0.4],
            [half_m, 0.4],
            [half_m, 1.4],
            [half_m - 0.35, 2.5],
            [half_m - 1.8, 2.6],
        ];
        let (floor_m, gap_m) = if is_long { (1.15, 0.8) } else { (0.9, 0.1) };
        let front_m = half_m - 1.8 - gap_m;
        vec![
            solid(rounded(&cab, wide_m - 0.1, 0.1), Fabric::Dense, paint),
            solid(
                block([-half_m, -wide_m, floor_m], [front_m, wide_m, height_m]),
                Fabric::Dense,
                0.6,
            ),
        ]
    };
    let axles_m = if is_long && !is_bus {
        vec![
            half_m - 1.0,
            half_m - 4.2,
            -half_m + 1.8,
            -half_m + 3.1,
            -half_m + 4.4,
        ]
    } else {
        vec![0.32 * length_m, -0.32 * length_m]
    };
    let track_m = wide_m - 0.15;
    for u in axles_m {
        for v in [track_m, -track_m] {
            parts.push(solid(wheel(u, v, 0.48, 0.28), Fabric::Dense, RUBBER));
        }
    }
    parts
}

/// Thin wheels and frame, the rider leaning a little forward.
fn cyclist(variant: &Variant, travelled_m: f64) -> Vec<Solid> {
    let [length_m, width_m, height_m] = variant.size_m;
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

/// Trunk, head, and legs and arms that swing.
fn pedestrian(variant: &Variant, travelled_m: f64) -> Vec<Solid> {
    let [_, width_m, height_m] = variant.size_m;
    let hip_m = 0.48 * height_m;
    let neck_m = 0.84 * height_m;
    // Two steps of 0.7 m are a cycle.
    let swing_m = 0.22 * libm::sin(travelled_m / 1.4 * std::f64::consts::TAU);
    let limb = |u: f64, v: f64, radius_m: f64, low_m: f64, high_m: f64| Shape::Cylinder {
        centre_m: [u, v],
        radius_m,
        low_m,
        high_m,
    };
    let reflectance = variant.reflectance;
    let side_m = 0.5 * width_m - 0.06;
    let mut parts = load(variant);
    parts.extend([
        solid(
            block(
                [-0.12, -0.5 * width_m + 0.1, hip_m - 0.05],
                [0.12, 0.5 * width_m - 0.1, neck_m],
            ),
            Fabric::Dense,
            reflectance,
        ),
        solid(limb(0.0, 0.0, 0.1, neck_m, height_m), Fabric::Dense, 0.3),
        solid(
            limb(0.5 * swing_m, 0.1, 0.08, 0.45, hip_m),
            Fabric::Dense,
            CLOTH,
        ),
        solid(
            limb(-0.5 * swing_m, -0.1, 0.08, 0.45, hip_m),
            Fabric::Dense,
            CLOTH,
        ),
        solid(limb(swing_m, 0.1, 0.06, 0.0, 0.45), Fabric::Dense, CLOTH),
        solid(limb(-swing_m, -0.1, 0.06, 0.0, 0.45), Fabric::Dense, CLOTH),
        solid(
            limb(-0.6 * swing_m, side_m, 0.05, hip_m, neck_m),
            Fabric::Dense,
            reflectance,
        ),
        solid(
            limb(0.6 * swing_m, -side_m, 0.05, hip_m, neck_m),
            Fabric::Dense,
            reflectance,
        ),
    ]);
    parts
}

/// What somebody on foot has along.
fn load(variant: &Variant) -> Vec<Solid> {
    let height_m = variant.size_m[2];
    let cloth = |shape: Shape| solid(shape, Fabric::Dense, CLOTH);
    match variant.load {
        Load::None => vec![],
        Load::Pack => {
            let pack = block(
                [-0.5, -0.22, 0.5 * height_m],
                [-0.14, 0.22, height_m + 0.55],
            );
            vec![cloth(pack)]
        }
        Load::Umbrella => vec![cloth(Shape::Cylinder {
            centre_m: [0.1, 0.0],
            radius_m: 0.5,
            low_m: height_m + 0.05,
            high_m: height_m + 0.25,
        })],
        Load::Pram => vec![
            cloth(block([0.5, -0.25, 0.45], [1.25, 0.25, 0.8])),
            cloth(block([0.5, -0.25, 0.8], [0.8, 0.25, 1.05])),
            solid(
                block([0.25, -0.27, 0.05], [1.25, 0.27, 0.45]),
                Fabric::Open(0.7),
                0.2,
            ),
        ],
        Load::Suitcase => vec![cloth(block([-0.8, -0.2, 0.05], [-0.55, 0.2, 0.75]))],
        Load::Wheelchair => vec![
            cloth(block([-0.3, -0.25, 0.3], [0.35, 0.25, 0.6])),
            solid(
                block([-0.35, -0.32, 0.0], [0.35, 0.32, 0.62]),
                Fabric::Open(0.6),
                RUBBER,
            ),
        ],
    }
}

#[cfg(test)]
mod tests;
