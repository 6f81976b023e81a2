//! How distances are written: what the message says, what the data shows, what the user set.

use super::{ByteOrderSetting, CloudParameters, UnitSetting};
use crate::wire::point_cloud::{ByteOrder, CompactPointCloud, DistanceEncoding, Schema};

/// How a byte order is known.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum ByteOrderSource {
    /// Its source knows one only.
    Defined,
    /// The configuration says it.
    Configured,
    /// The data shows it.
    Detected,
    /// Neither; network order, as every service since 2017 sends.
    Assumed,
}

impl ByteOrderSource {
    /// How logs and Status name it.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Defined => "defined",
            Self::Configured => "configured",
            Self::Detected => "detected",
            Self::Assumed => "assumed",
        }
    }
}

/// Everything that is needed to read a distance.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Dialect {
    /// Order of its two bytes.
    pub byte_order: ByteOrder,
    /// How that is known.
    pub byte_order_source: ByteOrderSource,
    /// Which bits are distance.
    pub distance_mask: u16,
    /// Metres per unit.
    pub unit_m: f32,
    /// How many bits are intensity.
    pub intensity_bits: u8,
}

/// How much rougher the other order must be to count as evidence. The weakest real cloud
/// tried (3 intensity bits) gives 2.1; a cloud of one distance gives 1.
const CLEAR_RATIO: f64 = 1.5;

/// Revolutions in a row that must speak against an order once found: one odd revolution
/// does not turn the sensor's data around.
const TURN_AFTER: u32 = 3;

/// Follows the byte order from message to message.
#[derive(Debug, Clone, Default)]
pub(super) struct DialectDetector {
    found: Option<ByteOrder>,
    against: u32,
}

impl DialectDetector {
    /// How to read `cloud`, or `None` if it uses an encoding that nobody has documented.
    pub(super) fn dialect(
        &mut self,
        cloud: &CompactPointCloud<'_>,
        parameters: &CloudParameters,
    ) -> Option<Dialect> {
        // First what can refuse the message: a refused one shows nothing.
        let unit_m = unit_m(cloud, parameters.distance_unit)?;
        let (byte_order, byte_order_source) = match parameters.byte_order {
            ByteOrderSetting::Big => (ByteOrder::Big, ByteOrderSource::Configured),
            ByteOrderSetting::Little => (ByteOrder::Little, ByteOrderSource::Configured),
            ByteOrderSetting::Auto => self.detect(cloud),
        };
        Some(Dialect {
            byte_order,
            byte_order_source,
            distance_mask: cloud.distance_mask(),
            unit_m,
            intensity_bits: cloud.intensity_bits,
        })
    }

    fn detect(&mut self, cloud: &CompactPointCloud<'_>) -> (ByteOrder, ByteOrderSource) {
        let shown = shown_order(cloud);
        match (self.found, shown) {
            (None, Some(order)) => self.found = Some(order),
            (Some(found), Some(order)) if found != order => {
                self.against += 1;
                if self.against == TURN_AFTER {
                    (self.found, self.against) = (Some(order), 0);
                }
            }
            _ => self.against = 0,
        }
        match self.found {
            Some(order) => (order, ByteOrderSource::Detected),
            None => (ByteOrder::Big, ByteOrderSource::Assumed),
        }
    }
}

/// The byte order that the data of one message shows, if it shows any.
pub fn shown_order(cloud: &CompactPointCloud<'_>) -> Option<ByteOrder> {
    let big = cloud.roughness(ByteOrder::Big) as f64;
    let little = cloud.roughness(ByteOrder::Little) as f64;
    if little > CLEAR_RATIO * big {
        Some(ByteOrder::Big)
    } else if big > CLEAR_RATIO * little {
        Some(ByteOrder::Little)
    } else {
        None
    }
}

fn unit_m(cloud: &CompactPointCloud<'_>, setting: UnitSetting) -> Option<f32> {
    const CENTIMETRE_M: f32 = 0.01;
    const TWO_MILLIMETRES_M: f32 = 0.002;
    const TWO_CENTIMETRES_M: f32 = 0.02;
    match (setting, cloud.schema) {
        (UnitSetting::Centimetre, _) => Some(CENTIMETRE_M),
        (UnitSetting::TwoMillimetres, _) => Some(TWO_MILLIMETRES_M),
        (UnitSetting::TwoCentimetres, _) => Some(TWO_CENTIMETRES_M),
        (UnitSetting::Auto, Schema::Bare | Schema::OpenDlv { .. }) => Some(CENTIMETRE_M),
        (UnitSetting::Auto, Schema::OpenDaVinci { encoding, .. }) => match encoding {
            DistanceEncoding::Centimetre => Some(CENTIMETRE_M),
            DistanceEncoding::TwoMillimetres => Some(TWO_MILLIMETRES_M),
            DistanceEncoding::Unknown(_) => None,
        },
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::parameter::Profile;

    fn distances(order: ByteOrder) -> Vec<u8> {
        (0..32u16)
            .flat_map(|column| (0..16u16).map(move |layer| 1000 + 3 * column + 50 * layer))
            .flat_map(|distance| order.split(distance))
            .collect()
    }

    fn order_of(detector: &mut DialectDetector, distances: &[u8]) -> (ByteOrder, ByteOrderSource) {
        let cloud = CompactPointCloud {
            layers: 16,
            distances,
            ..CompactPointCloud::default()
        };
        let parameters = CloudParameters::profile(Profile::Default);
        let dialect = detector.dialect(&cloud, &parameters).unwrap();
        (dialect.byte_order, dialect.byte_order_source)
    }

    #[test]
    fn either_order_is_found_at_once() {
        for order in [ByteOrder::Big, ByteOrder::Little] {
            let mut detector = DialectDetector::default();
            assert_eq!(
                order_of(&mut detector, &distances(order)),
                (order, ByteOrderSource::Detected)
            );
        }
    }

    #[test]
    fn an_empty_cloud_is_assumed_to_be_in_network_order() {
        let mut detector = DialectDetector::default();
        assert_eq!(
            order_of(&mut detector, &[0; 1024]),
            (ByteOrder::Big, ByteOrderSource::Assumed)
        );
    }

    #[test]
    fn a_single_odd_revolution_turns_nothing_around() {
        let (big, little) = (distances(ByteOrder::Big), distances(ByteOrder::Little));
        let mut detector = DialectDetector::default();
        let orders: Vec<_> = [&big, &little, &big, &little, &little, &little]
            .map(|distances| order_of(&mut detector, distances).0)
            .into();
        assert_eq!(orders[..5], [ByteOrder::Big; 5]);
        assert_eq!(orders[5], ByteOrder::Little);
    }
}
