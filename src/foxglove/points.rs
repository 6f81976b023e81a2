//! Returns as a point cloud.

use foxglove::messages::packed_element_field::NumericType;
use foxglove::messages::{PackedElementField, PointCloud, Pose};

use super::{LOCAL, stamp, turned, vector};
use crate::time::Time;
use crate::view::{Around, Labels};

/// The returns of a revolution, in the directions of the local frame around the sensor.
pub(super) fn message(around: &Around<'_>, labels: &Labels, time: Time) -> PointCloud {
    let scan = around.scan;
    let reflectivity = scan.reflectivity();
    let mut data = Vec::with_capacity(STRIDE * scan.returns());
    for point in (0..scan.len()).filter(|point| scan.has_return(*point)) {
        for metres in labels.offset_m(around, point) {
            data.extend_from_slice(&(metres as f32).to_le_bytes());
        }
        let bright = reflectivity.get(point).copied().unwrap_or_default();
        data.extend_from_slice(&[labels.kind(point), bright]);
    }
    let field = |name: &str, offset, number: NumericType| PackedElementField {
        name: name.into(),
        offset,
        r#type: number.into(),
    };
    PointCloud {
        timestamp: Some(stamp(time)),
        frame_id: LOCAL.into(),
        pose: Some(Pose {
            position: Some(vector(around.sensor.position_m)),
            orientation: Some(turned(0.0)),
        }),
        point_stride: STRIDE as u32,
        fields: vec![
            field("x", 0, NumericType::Float32),
            field("y", 4, NumericType::Float32),
            field("z", 8, NumericType::Float32),
            field("kind", 12, NumericType::Uint8),
            field("intensity", 13, NumericType::Uint8),
        ],
        data: data.into(),
    }
}

/// Bytes of a point.
const STRIDE: usize = 14;
