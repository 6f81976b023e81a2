//! Message 49, one revolution of a LiDAR, in every dialect that is on vehicles.
//!
//! Two schemas share the number: OpenDaVINCI's `CompactPointCloud`, whose fields 6 and 7 are
//! enums, and OpenDLV's `PointCloudReading`, whose field 6 is a layout and field 7 bytes. The
//! wire type of field 7 tells them apart. Byte order is not in the message at all: it is
//! found from the distances ([`CompactPointCloud::roughness`]).

use multiversion::multiversion;

use super::WireError;
use super::message::FieldValue;
use super::protobuf::{Reader, Value, put_key, put_length_delimited, unzigzag};

/// The envelope's `dataType` of a point cloud.
pub const POINT_CLOUD_ID: i32 = 49;

/// A point cloud whose distances still lie in the datagram.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct CompactPointCloud<'a> {
    /// Azimuth of the first column in degrees, clockwise from the y axis.
    pub start_azimuth_deg: f32,
    /// Azimuth of the last column in degrees.
    pub end_azimuth_deg: f32,
    /// Layers in a column.
    pub layers: u8,
    /// Two bytes a distance: columns in time order, layers by increasing elevation.
    pub distances: &'a [u8],
    /// How many bits of a distance hold the intensity.
    pub intensity_bits: u8,
    /// What the sender's schema says in fields 6 and 7.
    pub schema: Schema<'a>,
}

/// Fields 6 and 7 in the meaning of the schema that the sender uses.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Schema<'a> {
    /// Neither field: OpenDLV up to v0.9.1, whose VLP-16 service is the most common sender,
    /// and OpenDaVINCI before 4.6.0.
    #[default]
    Bare,
    /// OpenDaVINCI since 4.6.0.
    OpenDaVinci {
        /// Field 6.
        placement: IntensityPlacement,
        /// Field 7.
        encoding: DistanceEncoding,
    },
    /// OpenDLV since v0.9.7.
    OpenDlv {
        /// Field 6: 0 HDL-32E (and default), 1 VLP-32C, 2 RPLidar.
        vertical_layout: u8,
        /// Field 7: azimuths of an RPLidar, else empty.
        azimuth_angles: &'a [u8],
    },
}

/// Where in a distance the intensity stands.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum IntensityPlacement {
    /// In the higher bits, which costs range.
    Higher,
    /// In the lower bits, which costs resolution.
    Lower,
    /// A code of a later schema.
    Unknown(i32),
}

/// The unit of a distance.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum DistanceEncoding {
    /// Centimetres.
    Centimetre,
    /// Two millimetres (the schema calls it MM).
    TwoMillimetres,
    /// A code of a later schema.
    Unknown(i32),
}

/// The order of the two bytes of a distance.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum ByteOrder {
    /// Network order: every service since January 2017.
    Big,
    /// Host order of older recordings and of the thesis' programs.
    Little,
}

/// The vertical layout code of an RPLidar, whose distances are floats.
pub const LAYOUT_RPLIDAR: u8 = 2;
/// The vertical layout code of a VLP-32C.
pub const LAYOUT_VLP32C: u8 = 1;

impl Schema<'_> {
    /// Field 6 in the meaning that field 7 has decided.
    fn with_field_6(self, raw: Option<u64>) -> Self {
        match (self, raw) {
            (Self::OpenDaVinci { encoding, .. }, _) => Self::OpenDaVinci {
                placement: IntensityPlacement::from_code(unzigzag(raw.unwrap_or(0)) as i32),
                encoding,
            },
            (Self::OpenDlv { azimuth_angles, .. }, _) => Self::OpenDlv {
                vertical_layout: raw.unwrap_or(0) as u8,
                azimuth_angles,
            },
            (Self::Bare, Some(raw)) => Self::OpenDlv {
                vertical_layout: raw as u8,
                azimuth_angles: &[],
            },
            (Self::Bare, None) => Self::Bare,
        }
    }
}

impl ByteOrder {
    /// How logs and Status name it.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Big => "big-endian",
            Self::Little => "little-endian",
        }
    }

    /// Puts two bytes together.
    pub const fn join(self, bytes: [u8; 2]) -> u16 {
        match self {
            Self::Big => u16::from_be_bytes(bytes),
            Self::Little => u16::from_le_bytes(bytes),
        }
    }

    /// Takes a distance apart.
    pub const fn split(self, distance: u16) -> [u8; 2] {
        match self {
            Self::Big => distance.to_be_bytes(),
            Self::Little => distance.to_le_bytes(),
        }
    }
}

impl<'a> CompactPointCloud<'a> {
    /// Decodes the payload of an envelope; `base` is the payload's offset.
    ///
    /// # Errors
    /// [`WireError`] with the offset of the first byte that does not fit.
    pub fn decode(payload: &'a [u8], base: usize) -> Result<Self, WireError> {
        let mut cloud = Self::default();
        let mut layers = 0u64;
        let mut field_6 = None;
        let mut reader = Reader::new(payload, base);
        while let Some(field) = reader.next_field()? {
            let end = reader.offset();
            match (field.id, field.value) {
                (1, value) => cloud.start_azimuth_deg.merge(value, end)?,
                (2, value) => cloud.end_azimuth_deg.merge(value, end)?,
                (3, Value::Varint(raw)) => layers = raw,
                (4, Value::Bytes(bytes)) => cloud.distances = bytes,
                (5, value) => cloud.intensity_bits.merge(value, end)?,
                (6, Value::Varint(raw)) => field_6 = Some(raw),
                (7, Value::Varint(raw)) => {
                    cloud.schema = Schema::OpenDaVinci {
                        placement: IntensityPlacement::Unknown(0),
                        encoding: DistanceEncoding::from_code(unzigzag(raw) as i32),
                    };
                }
                (7, Value::Bytes(azimuth_angles)) => {
                    cloud.schema = Schema::OpenDlv {
                        vertical_layout: 0,
                        azimuth_angles,
                    };
                }
                _ => {}
            }
        }
        cloud.layers = u8::try_from(layers).unwrap_or(u8::MAX);
        cloud.schema = cloud.schema.with_field_6(field_6);
        Ok(cloud)
    }

    /// Appends the payload as the sender's schema writes it.
    pub fn encode(&self, out: &mut Vec<u8>) {
        self.start_azimuth_deg.put(out, 1);
        self.end_azimuth_deg.put(out, 2);
        self.layers.put(out, 3);
        put_bytes(out, 4, self.distances);
        self.intensity_bits.put(out, 5);
        match self.schema {
            Schema::Bare => {}
            Schema::OpenDaVinci {
                placement,
                encoding,
            } => {
                placement.code().put(out, 6);
                encoding.code().put(out, 7);
            }
            Schema::OpenDlv {
                vertical_layout,
                azimuth_angles,
            } => {
                vertical_layout.put(out, 6);
                put_bytes(out, 7, azimuth_angles);
            }
        }
    }

    /// Whole columns in the message; 0 where there are no layers.
    pub fn columns(&self) -> usize {
        self.distances
            .len()
            .checked_div(2 * usize::from(self.layers))
            .unwrap_or(0)
    }

    /// Which bits of a distance hold the distance.
    pub fn distance_mask(&self) -> u16 {
        let bits = u32::from(self.intensity_bits);
        let lower = matches!(
            self.schema,
            Schema::OpenDaVinci {
                placement: IntensityPlacement::Lower,
                ..
            }
        );
        if lower {
            u16::MAX.checked_shl(bits).unwrap_or(0)
        } else {
            u16::MAX.checked_shr(bits).unwrap_or(0)
        }
    }

    /// How rough the cloud is when read in `order`: the sum of differences between
    /// neighbouring columns in a layer, over every eighth pair of columns and over pairs that
    /// both have a return. Surfaces are smooth, so the wrong order is 20 to 150 times rougher
    /// on real clouds.
    pub fn roughness(&self, order: ByteOrder) -> u64 {
        self.inner_difference(order).0
    }

    /// How much rougher the step from the last column to the first is than a step between
    /// neighbours. About 1 where the message is a whole turn, large where it is a piece of
    /// one; `None` where too few layers return at both ends.
    pub fn seam_roughness(&self, order: ByteOrder) -> Option<f64> {
        const LEAST_PAIRS: u64 = 4;
        let mut columns = self.column_bytes()?;
        let (first, last) = (columns.next()?, columns.next_back()?);
        let (seam, seam_pairs) = difference(last, first, order, self.distance_mask());
        let (inner, inner_pairs) = self.inner_difference(order);
        if seam_pairs < LEAST_PAIRS || inner_pairs < LEAST_PAIRS {
            return None;
        }
        // A cloud of constant distances has no steps at all.
        let mean = |sum: u64, pairs: u64| (sum as f64 / pairs as f64).max(1.0);
        Some(mean(seam, seam_pairs) / mean(inner, inner_pairs))
    }

    fn column_bytes(&self) -> Option<std::slice::ChunksExact<'a, u8>> {
        let length = 2 * usize::from(self.layers);
        (length > 0).then(|| self.distances.chunks_exact(length))
    }

    /// Sum and number of differences over every eighth pair of neighbouring columns.
    fn inner_difference(&self, order: ByteOrder) -> (u64, u64) {
        let length = 2 * usize::from(self.layers);
        inner_difference(self.distances, length, order, self.distance_mask())
    }
}

/// Sum and number of differences over every eighth pair of neighbouring columns of so many bytes.
#[multiversion(targets("x86_64+avx2+bmi1+bmi2+lzcnt+popcnt"))]
fn inner_difference(distances: &[u8], length: usize, order: ByteOrder, mask: u16) -> (u64, u64) {
    const PAIR_STRIDE: usize = 8;
    if length == 0 {
        return (0, 0);
    }
    let pairs = distances.windows(2 * length).step_by(PAIR_STRIDE * length);
    let differences = pairs.map(|pair| {
        let (left, right) = pair.split_at(length);
        difference(left, right, order, mask)
    });
    differences.fold((0, 0), |total, pair| (total.0 + pair.0, total.1 + pair.1))
}

/// Sum and number of differences between two columns, where both return.
#[inline(always)]
fn difference(left: &[u8], right: &[u8], order: ByteOrder, mask: u16) -> (u64, u64) {
    // No column has more than 255 layers: 32 bits hold the sum.
    let (mut sum, mut pairs) = (0u32, 0u32);
    for (left, right) in left.as_chunks().0.iter().zip(right.as_chunks().0) {
        let [left, right] = [left, right].map(|bytes| order.join(*bytes) & mask);
        let both = (left != 0) & (right != 0);
        sum += if both {
            u32::from(left.abs_diff(right))
        } else {
            0
        };
        pairs += u32::from(both);
    }
    (u64::from(sum), u64::from(pairs))
}

impl IntensityPlacement {
    const fn from_code(code: i32) -> Self {
        match code {
            0 => Self::Higher,
            1 => Self::Lower,
            other => Self::Unknown(other),
        }
    }

    const fn code(self) -> i32 {
        match self {
            Self::Higher => 0,
            Self::Lower => 1,
            Self::Unknown(code) => code,
        }
    }
}

impl DistanceEncoding {
    const fn from_code(code: i32) -> Self {
        match code {
            0 => Self::Centimetre,
            1 => Self::TwoMillimetres,
            other => Self::Unknown(other),
        }
    }

    const fn code(self) -> i32 {
        match self {
            Self::Centimetre => 0,
            Self::TwoMillimetres => 1,
            Self::Unknown(code) => code,
        }
    }
}

fn put_bytes(out: &mut Vec<u8>, id: u32, bytes: &[u8]) {
    put_key(out, id, 2);
    put_length_delimited(out, |out| out.extend_from_slice(bytes));
}

#[cfg(test)]
mod tests;
