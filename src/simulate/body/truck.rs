//! Lorries, with a box, a tipper or goods on a platform, articulated ones, and buses.

use super::{rounded, solid, wheels};
use crate::simulate::solid::{Fabric, Solid, block};
use crate::simulate::variant::{Build, Freight, LorryBuild, Variant};

/// Longer lorries have a semi-trailer.
const LONGEST_RIGID_M: f64 = 10.0;
/// What is as long and higher is one, too, and no bus.
const HIGHEST_BUS_M: f64 = 3.35;

pub(super) fn parts(variant: &Variant) -> Vec<Solid> {
    let [length_m, _, height_m] = variant.size_m;
    match variant.build {
        Build::Lorry(build) => lorry(variant, &build),
        Build::Bus { belt_m } => bus(variant, belt_m),
        _ if length_m > LONGEST_RIGID_M && height_m < HIGHEST_BUS_M => bus(variant, 1.2),
        _ => lorry(variant, &LorryBuild::of(length_m > LONGEST_RIGID_M)),
    }
}

fn bus(variant: &Variant, belt_m: f64) -> Vec<Solid> {
    let [length_m, width_m, height_m] = variant.size_m;
    let (half_m, wide_m) = (0.5 * length_m, 0.5 * width_m);
    let lintel_m = belt_m + 1.2;
    let lower = [
        [-half_m, 0.35],
        [half_m, 0.35],
        [half_m, belt_m],
        [-half_m, belt_m],
    ];
    let windows = [
        [-half_m, belt_m],
        [half_m, belt_m],
        [half_m - 0.1, lintel_m],
        [-half_m + 0.05, lintel_m],
    ];
    let roof = [
        [-half_m, lintel_m],
        [half_m - 0.1, lintel_m],
        [half_m - 0.2, height_m],
        [-half_m, height_m],
    ];
    let paint = variant.reflectance;
    let panes = Fabric::Open(0.75 * variant.glass);
    let mut parts = vec![
        solid(rounded(&lower, wide_m, 0.15), Fabric::Dense, paint),
        solid(rounded(&windows, wide_m, 0.15), panes, 0.1),
        solid(rounded(&roof, wide_m, 0.15), Fabric::Dense, paint),
    ];
    let axle_m = 0.32 * length_m;
    parts.extend(wheels(&[axle_m, -axle_m], wide_m - 0.15, 0.48, 0.28));
    parts
}

fn lorry(variant: &Variant, build: &LorryBuild) -> Vec<Solid> {
    let [length_m, width_m, height_m] = variant.size_m;
    let (half_m, wide_m) = (0.5 * length_m, 0.5 * width_m);
    let paint = variant.reflectance;
    let cab_back_m = half_m - build.cab_m;
    let cab = [
        [cab_back_m, 0.4],
        [half_m, 0.4],
        [half_m, 1.4],
        [half_m - 0.35, build.cab_high_m - 0.1],
        [cab_back_m, build.cab_high_m],
    ];
    let mut parts = vec![solid(
        rounded(&cab, wide_m - 0.1, 0.1),
        Fabric::Dense,
        paint,
    )];
    let (back_m, front_m, floor_m) = (-half_m, cab_back_m - build.gap_m, build.floor_m);
    let mut stand = |from_m: f64, to_m: f64, [low_m, high_m]: [f64; 2], wide_m: f64| {
        let goods = block([from_m, -wide_m, low_m], [to_m, wide_m, high_m]);
        parts.push(solid(goods, Fabric::Dense, build.goods_reflectance));
    };
    match build.freight {
        Freight::Box => stand(back_m, front_m, [floor_m, height_m], wide_m),
        Freight::Tipper { side_m } => {
            stand(back_m, front_m, [floor_m, floor_m + side_m], wide_m);
        }
        Freight::Platform { reach } => {
            stand(back_m, front_m, [floor_m - 0.2, floor_m], wide_m);
            let reach_m = reach.map(|share| back_m + share * (front_m - back_m));
            stand(reach_m[0], reach_m[1], [floor_m, height_m], wide_m - 0.15);
        }
    }
    if build.has_skirt {
        let axles_m = 0.3 * length_m;
        stand(-axles_m, 0.8 * axles_m, [0.45, floor_m], wide_m - 0.1);
    }
    let axles_m = if length_m > LONGEST_RIGID_M {
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
    parts.extend(wheels(&axles_m, wide_m - 0.15, 0.48, 0.28));
    parts
}
