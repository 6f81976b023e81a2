//! Cars and vans.

use super::{rounded, solid, wheels};
use crate::simulate::solid::{Fabric, Shape, Solid, block, extruded};
use crate::simulate::variant::{Build, CarBuild, Variant};

/// A body from sill to belt and a cabin above it.
pub(super) fn parts(variant: &Variant) -> Vec<Solid> {
    let [length_m, width_m, height_m] = variant.size_m;
    let build = match variant.build {
        Build::Car(build) => build,
        _ => CarBuild::of(variant.size_m),
    };
    let CarBuild {
        bonnet_m,
        boot_m,
        belt_m,
        screen_m,
        rear_screen_m,
        sill_m,
        ..
    } = build;
    let (half_m, wide_m) = (0.5 * length_m, 0.5 * width_m);
    let body = [
        [-half_m + 0.1, sill_m],
        [half_m - 0.15, sill_m],
        [half_m, sill_m + 0.15],
        [half_m - 0.03, 0.62 * belt_m + 0.1],
        [half_m - bonnet_m, belt_m],
        [-half_m + 0.05, belt_m],
        [-half_m, sill_m + 0.25],
    ];
    let roof_front_m = half_m - bonnet_m - screen_m;
    let roof_back_m = -half_m + boot_m + rear_screen_m;
    let cabin = [
        [-half_m + boot_m, belt_m],
        [half_m - bonnet_m, belt_m],
        [roof_front_m, height_m - 0.02],
        [roof_back_m + 0.2, height_m],
        [roof_back_m, height_m - 0.04],
    ];
    let mut leaning = extruded(&cabin, wide_m);
    let (sine, cosine) = libm::sincos(build.lean_rad);
    for side in [1.0, -1.0] {
        leaning.push((
            [0.0, side * cosine, sine],
            cosine * (wide_m - 0.03) + sine * belt_m,
        ));
    }
    let paint = variant.reflectance;
    let mut parts = vec![
        solid(rounded(&body, wide_m, build.corner_m), Fabric::Dense, paint),
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
    if build.carries_goods {
        // Metal from behind the front doors.
        let load = block(
            [-half_m + 0.06, -wide_m + 0.08, belt_m],
            [0.1 * length_m, wide_m - 0.08, height_m - 0.02],
        );
        parts.push(solid(load, Fabric::Dense, paint));
    }
    if build.roof_box_m > 0.0 {
        let roof_box = block(
            [roof_back_m + 0.3, -0.4, height_m + 0.08],
            [roof_front_m - 0.1, 0.4, height_m + 0.08 + build.roof_box_m],
        );
        parts.push(solid(roof_box, Fabric::Dense, 0.3));
    }
    let axle_m = 0.31 * length_m;
    parts.extend(wheels(&[axle_m, -axle_m], wide_m - 0.12, 0.31, 0.2));
    parts
}
