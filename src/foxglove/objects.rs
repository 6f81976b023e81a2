//! Objects as a scene.

use foxglove::messages::{
    ArrowPrimitive, Color, CubePrimitive, Duration, KeyValuePair, Pose, SceneEntity, SceneUpdate,
    TextPrimitive,
};

use super::{LOCAL, stamp, turned, vector};
use crate::time::Time;
use crate::track::{Class, Object};
use crate::view::Around;

/// An object that is not told of any more is gone after so long: two revolutions and a half.
const LIFETIME_NS: u32 = 250_000_000;
/// An arrow is as long as what moves gets in so many seconds.
const ARROW_S: f64 = 1.0;
/// Slower ones have no arrow.
const ARROW_MPS: f64 = 0.3;

/// The objects of a revolution, in the odometry frame, as boxes in the local one.
pub(super) fn message(objects: &[Object], around: &Around<'_>, time: Time) -> SceneUpdate {
    let entities = objects.iter().map(|object| {
        let object = object.in_local_frame(&around.anchor);
        entity(&object, time)
    });
    SceneUpdate {
        deletions: vec![],
        entities: entities.collect(),
    }
}

fn entity(object: &Object, time: Time) -> SceneEntity {
    let colour = colour(object);
    let pose = |up_m: f64, yaw_rad| {
        let [x, y, z] = object.centre_m;
        Some(Pose {
            position: Some(vector([x, y, z + up_m])),
            orientation: Some(turned(yaw_rad)),
        })
    };
    let cube = CubePrimitive {
        pose: pose(0.0, object.yaw_rad),
        size: Some(vector([object.length_m, object.width_m, object.height_m])),
        color: Some(colour),
    };
    let speed_mps = object.speed_mps;
    let text = TextPrimitive {
        pose: pose(0.5 * object.height_m + 0.6, 0.0),
        billboard: true,
        font_size: 0.6,
        scale_invariant: false,
        color: Some(Color { a: 1.0, ..colour }),
        text: format!("{} {} {speed_mps:.1} m/s", object.class.name(), object.id),
    };
    let arrow = ArrowPrimitive {
        pose: pose(
            0.0,
            object.yaw_rad
                + if speed_mps < 0.0 {
                    std::f64::consts::PI
                } else {
                    0.0
                },
        ),
        shaft_length: 0.5 * object.length_m + ARROW_S * speed_mps.abs(),
        shaft_diameter: 0.1,
        head_length: 0.4,
        head_diameter: 0.3,
        color: Some(Color { a: 1.0, ..colour }),
    };
    let said = |key: &str, value: String| KeyValuePair {
        key: key.into(),
        value,
    };
    SceneEntity {
        timestamp: Some(stamp(time)),
        frame_id: LOCAL.into(),
        id: object.id.to_string(),
        lifetime: Duration::new_checked(0, LIFETIME_NS),
        metadata: vec![
            said("class", object.class.name().into()),
            said("confidence", format!("{:.2}", object.existence)),
            said(
                "classProbability",
                format!("{:.2}", object.class_probability),
            ),
            said("speed", format!("{speed_mps:.2}")),
            said("measured", object.measured.to_string()),
            said("points", object.points.to_string()),
        ],
        arrows: (speed_mps.abs() > ARROW_MPS)
            .then_some(arrow)
            .into_iter()
            .collect(),
        cubes: vec![cube],
        texts: vec![text],
        ..SceneEntity::default()
    }
}

/// A colour of its class; what is only predicted is fainter.
fn colour(object: &Object) -> Color {
    let [r, g, b] = match object.class {
        Class::Unclassified => [0.6, 0.6, 0.6],
        Class::Car => [0.2, 0.5, 1.0],
        Class::Cyclist => [0.2, 0.8, 0.3],
        Class::Pedestrian => [1.0, 0.5, 0.1],
        Class::LargeVehicle => [0.6, 0.3, 0.9],
    };
    let a = if object.measured { 0.5 } else { 0.2 };
    Color { r, g, b, a }
}
