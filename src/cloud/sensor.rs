//! Sensors by the elevations of their layers, lowest first, in degrees.

use crate::wire::point_cloud::{CompactPointCloud, LAYOUT_RPLIDAR, LAYOUT_VLP32C, Schema};

/// A sensor, or the part of one that a message carries.
#[derive(Debug, PartialEq)]
pub struct Sensor {
    /// How logs and Status name it.
    pub name: &'static str,
    /// Elevation of each layer in degrees.
    pub elevation_deg: &'static [f64],
    /// From one column to the next, seconds.
    pub column_period_s: f64,
    /// How much of the circle it sees.
    pub field_deg: f64,
}

impl Sensor {
    /// Whether its columns go all round.
    pub fn sees_all_round(&self) -> bool {
        self.field_deg >= 360.0
    }
}

/// Velodyne VLP-16: 16 layers from -15 to 15 degrees (user manual, firing every 55.296 us).
pub static VLP16: Sensor = Sensor {
    name: "VLP-16",
    elevation_deg: &[
        -15.0, -13.0, -11.0, -9.0, -7.0, -5.0, -3.0, -1.0, 1.0, 3.0, 5.0, 7.0, 9.0, 11.0, 13.0,
        15.0,
    ],
    column_period_s: 55.296e-6,
    field_deg: 360.0,
};

/// Velodyne Puck Hi-Res: the same within 10 degrees up and down (user manual, table 9-1).
pub static PUCK_HI_RES: Sensor = Sensor {
    name: "Puck Hi-Res",
    elevation_deg: &[
        -10.0, -8.67, -7.33, -6.0, -4.67, -3.33, -2.0, -0.67, 0.67, 2.0, 3.33, 4.67, 6.0, 7.33,
        8.67, 10.0,
    ],
    column_period_s: VLP16.column_period_s,
    field_deg: 360.0,
};

/// The sensor whose packets bear a factory byte, if the array can hold it (user manual, table 9-3). A Puck Lite says that
/// it is a VLP-16.
pub fn of_product(product: u8) -> Option<&'static Sensor> {
    match product {
        VLP16_PRODUCT => Some(&VLP16),
        0x24 => Some(&PUCK_HI_RES),
        _ => None,
    }
}

/// The factory byte of a VLP-16.
pub const VLP16_PRODUCT: u8 = 0x22;

/// What the manufacturer calls a sensor with a factory byte.
pub const fn product_name(product: u8) -> &'static str {
    match product {
        0x21 => "HDL-32E",
        VLP16_PRODUCT => "VLP-16",
        0x24 => "Puck Hi-Res",
        0x28 => "VLP-32C",
        0x31 => "Velarray",
        0x63 | 0xa1 => "VLS-128",
        _ => "unknown sensor",
    }
}

/// Ibeo LUX 8L: two times four layers 0.8 degrees apart, 110 degrees in steps of 0.25 at 25 Hz
/// (Chen 2021, table 2.3).
pub static IBEO_LUX_8L: Sensor = Sensor {
    name: "Ibeo LUX 8L",
    elevation_deg: &[-2.8, -2.0, -1.2, -0.4, 0.4, 1.2, 2.0, 2.8],
    column_period_s: 0.25 / 360.0 / 25.0,
    field_deg: 110.0,
};

/// The three messages of a revolution of a Velodyne HDL-32E, in the order in which they come.
pub static HDL32E: [Sensor; 3] = [
    Sensor {
        name: "HDL-32E",
        elevation_deg: &[
            -30.67, -29.33, -25.33, -21.33, -17.33, -13.33, -9.33, -5.33, -1.33, 2.67, 6.67, 10.67,
        ],
        column_period_s: 46.08e-6,
        field_deg: 360.0,
    },
    Sensor {
        name: "HDL-32E",
        elevation_deg: &[
            -28.0, -26.67, -22.67, -18.67, -14.67, -10.67, -6.67, -2.67, 1.33, 5.33, 9.33,
        ],
        column_period_s: 46.08e-6,
        field_deg: 360.0,
    },
    Sensor {
        name: "HDL-32E",
        elevation_deg: &[-24.0, -20.0, -16.0, -12.0, -8.0, -4.0, 0.0, 4.0, 8.0],
        column_period_s: 46.08e-6,
        field_deg: 360.0,
    },
];

/// The three messages of a revolution of a Velodyne VLP-32C, in the order in which they come.
pub static VLP32C: [Sensor; 3] = [
    Sensor {
        name: "VLP-32C",
        elevation_deg: &[
            -25.0, -15.639, -7.254, -4.667, -3.333, -2.333, -1.333, -0.333, 0.667, 1.667, 4.667,
            15.0,
        ],
        column_period_s: 55.296e-6,
        field_deg: 360.0,
    },
    Sensor {
        name: "VLP-32C",
        elevation_deg: &[
            -11.31, -8.843, -5.333, -3.667, -2.667, -1.667, -0.667, 0.333, 1.333, 3.333, 10.333,
        ],
        column_period_s: 55.296e-6,
        field_deg: 360.0,
    },
    Sensor {
        name: "VLP-32C",
        elevation_deg: &[-6.148, -4.0, -3.0, -2.0, -1.0, 0.0, 1.0, 2.333, 7.0],
        column_period_s: 55.296e-6,
        field_deg: 360.0,
    },
];

/// The sensor that a message comes from, by its number of layers and its layout; `None` if
/// no table has it.
pub fn identify(cloud: &CompactPointCloud<'_>) -> Option<&'static Sensor> {
    let layout = match cloud.schema {
        Schema::OpenDlv {
            vertical_layout, ..
        } => vertical_layout,
        Schema::Bare | Schema::OpenDaVinci { .. } => 0,
    };
    let parts = match layout {
        LAYOUT_RPLIDAR => return None,
        LAYOUT_VLP32C => &VLP32C,
        _ => &HDL32E,
    };
    [&VLP16, &IBEO_LUX_8L]
        .into_iter()
        .chain(parts)
        .find(|sensor| sensor.elevation_deg.len() == usize::from(cloud.layers))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_parts_of_a_32_layer_sensor_are_32_different_rising_elevations() {
        for parts in [&HDL32E, &VLP32C] {
            let mut all: Vec<f64> = parts
                .iter()
                .flat_map(|part| part.elevation_deg)
                .copied()
                .collect();
            assert!(parts.iter().all(|part| part.elevation_deg.is_sorted()));
            all.sort_by(f64::total_cmp);
            all.dedup();
            assert_eq!(all.len(), 32);
        }
    }

    #[test]
    fn the_layout_tells_32_layer_sensors_apart() {
        let mut cloud = CompactPointCloud {
            layers: 12,
            ..CompactPointCloud::default()
        };
        assert_eq!(identify(&cloud), Some(&HDL32E[0]));
        cloud.schema = Schema::OpenDlv {
            vertical_layout: LAYOUT_VLP32C,
            azimuth_angles: &[],
        };
        assert_eq!(identify(&cloud), Some(&VLP32C[0]));
        cloud.layers = 16;
        assert_eq!(identify(&cloud), Some(&VLP16));
        cloud.layers = 8;
        assert_eq!(identify(&cloud), Some(&IBEO_LUX_8L));
        cloud.layers = 3;
        assert_eq!(identify(&cloud), None);
    }
}
