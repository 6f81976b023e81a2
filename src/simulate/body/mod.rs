//! Road users as solids in their own frame: u ahead, v to the left, z up from the ground.
//!
//! Outlines are of everyday vehicles: sloped screens, rounded corners, gaps below the sills,
//! wheels. Glass lets most rays through, spokes and frames some.

mod car;

mod cyclist;

mod person;

mod truck;

use super::solid::{Fabric, Shape, Solid, extruded};
use super::variant::{Class, Variant};

const RUBBER: f64 = 0.08;
const CLOTH: f64 = 0.35;

/// The solids of a road user after it has gone `travelled_m`.
pub(super) fn parts(variant: &Variant, travelled_m: f64) -> Vec<Solid> {
    match variant.class {
        Class::Car => car::parts(variant),
        Class::Truck => truck::parts(variant),
        Class::Cyclist => cyclist::parts(variant, travelled_m),
        Class::Pedestrian => person::parts(variant, travelled_m),
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

/// Wheels on both sides.
fn wheels(
    axles_m: &[f64],
    track_m: f64,
    radius_m: f64,
    width_m: f64,
) -> impl Iterator<Item = Solid> {
    let places = axles_m
        .iter()
        .flat_map(move |u| [(*u, track_m), (*u, -track_m)]);
    places.map(move |(u, v)| solid(wheel(u, v, radius_m, width_m), Fabric::Dense, RUBBER))
}

#[cfg(test)]
mod tests;
