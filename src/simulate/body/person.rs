//! People on foot, and what they have along.

use super::{CLOTH, RUBBER, solid};
use crate::simulate::solid::{Fabric, Shape, Solid, block};
use crate::simulate::variant::{Load, Variant};

/// Trunk, head, and legs and arms that swing.
pub(super) fn parts(variant: &Variant, travelled_m: f64) -> Vec<Solid> {
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
