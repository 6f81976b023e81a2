//! A data packet: twelve blocks of two firings of sixteen lasers.

/// Length of a data packet's UDP payload.
pub const PACKET_LEN: usize = 1206;
/// Blocks in a packet.
pub const BLOCKS: usize = 12;
/// Firings of all lasers in a block.
pub const FIRINGS_PER_BLOCK: usize = 2;
/// Lasers.
pub const LASERS: usize = 16;
/// Metres per unit of distance.
pub const UNIT_M: f32 = 0.002;
/// From one laser to the next, seconds.
pub const LASER_PERIOD_S: f64 = 2.304e-6;
/// Lasers by rising elevation: they fire as -15, 1, -13, 3, ... 15 degrees.
pub const LASER_BY_LAYER: [usize; LASERS] = [0, 2, 4, 6, 8, 10, 12, 14, 1, 3, 5, 7, 9, 11, 13, 15];

const BLOCK_LEN: usize = 100;
const BLOCK_FLAG: [u8; 2] = [0xff, 0xee];
const RETURN_LEN: usize = 3;
const FIRING_LEN: usize = LASERS * RETURN_LEN;
const TIME_AT: usize = BLOCKS * BLOCK_LEN;
/// Hundredths of a degree in a circle.
const CIRCLE: u16 = 36_000;

/// Which return of a pulse is reported (user manual, table 9-2).
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum ReturnMode {
    /// The strongest.
    Strongest,
    /// The farthest.
    Last,
    /// Both: the blocks of a pair look in the same direction.
    Dual,
}

impl ReturnMode {
    /// How logs and Status name it.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Strongest => "strongest return",
            Self::Last => "last return",
            Self::Dual => "dual return",
        }
    }

    const fn byte(self) -> u8 {
        match self {
            Self::Strongest => 0x37,
            Self::Last => 0x38,
            Self::Dual => 0x39,
        }
    }
}

/// What came back of one laser's pulse.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Return {
    /// In [`UNIT_M`]; 0 where nothing came back.
    pub distance: u16,
    /// Calibrated reflectivity: up to 100 of diffuse surfaces, above of retroreflectors.
    pub reflectivity: u8,
}

/// Why a payload is no data packet.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
pub enum PacketError {
    /// Not the length of a data packet.
    #[error("{length} bytes, a VLP-16 data packet has {PACKET_LEN}")]
    Length {
        /// Its length.
        length: usize,
    },
    /// A block does not begin with its flag.
    #[error("block {block} does not begin with ff ee")]
    Flag {
        /// Which block, from 0.
        block: usize,
    },
}

/// A data packet, whose blocks all begin as they should.
#[derive(Debug, Clone, Copy)]
pub struct DataPacket<'a> {
    bytes: &'a [u8; PACKET_LEN],
}

impl<'a> DataPacket<'a> {
    /// A view of a payload.
    ///
    /// # Errors
    /// [`PacketError`] when it is no data packet.
    pub fn new(payload: &'a [u8]) -> Result<Self, PacketError> {
        let wrong_length = |_| PacketError::Length {
            length: payload.len(),
        };
        let packet = Self {
            bytes: payload.try_into().map_err(wrong_length)?,
        };
        match (0..BLOCKS).find(|block| packet.block(*block)[..2] != BLOCK_FLAG) {
            Some(block) => Err(PacketError::Flag { block }),
            None => Ok(packet),
        }
    }

    fn block(&self, block: usize) -> &'a [u8] {
        &self.bytes[block * BLOCK_LEN..][..BLOCK_LEN]
    }

    /// Azimuth of a block's first firing in hundredths of a degree; `None` off the circle.
    pub fn azimuth(&self, block: usize) -> Option<u16> {
        let block = self.block(block);
        let azimuth = u16::from_le_bytes([block[2], block[3]]);
        (azimuth < CIRCLE).then_some(azimuth)
    }

    /// The same in degrees, whatever it is.
    pub(super) fn raw_azimuth_deg(&self, block: usize) -> f32 {
        let block = self.block(block);
        f32::from(u16::from_le_bytes([block[2], block[3]])) / 100.0
    }

    /// What came back of a laser in a block's first or second firing.
    pub fn at(&self, block: usize, firing: usize, laser: usize) -> Return {
        let bytes = &self.block(block)[4 + firing * FIRING_LEN + laser * RETURN_LEN..];
        Return {
            distance: u16::from_le_bytes([bytes[0], bytes[1]]),
            reflectivity: bytes[2],
        }
    }

    /// When the first laser of the first block fired, microseconds past the hour.
    pub fn time_us(&self) -> u32 {
        let bytes = &self.bytes[TIME_AT..];
        u32::from_le_bytes([bytes[0], bytes[1], bytes[2], bytes[3]])
    }

    /// Which returns it holds; `None` for a byte that no manual knows.
    pub fn return_mode(&self) -> Option<ReturnMode> {
        [ReturnMode::Strongest, ReturnMode::Last, ReturnMode::Dual]
            .into_iter()
            .find(|mode| mode.byte() == self.bytes[TIME_AT + 4])
    }

    /// The factory byte that says which sensor it is.
    pub fn product(&self) -> u8 {
        self.bytes[TIME_AT + 5]
    }
}

/// A data packet that is being written.
#[derive(Debug, Clone)]
pub struct PacketWriter {
    bytes: [u8; PACKET_LEN],
}

impl PacketWriter {
    /// Of a sensor with a factory byte, in a mode of return; without any return.
    pub fn new(mode: ReturnMode, product: u8) -> Self {
        let mut bytes = [0; PACKET_LEN];
        for block in 0..BLOCKS {
            bytes[block * BLOCK_LEN..][..2].copy_from_slice(&BLOCK_FLAG);
        }
        bytes[TIME_AT + 4..].copy_from_slice(&[mode.byte(), product]);
        Self { bytes }
    }

    /// Says where a block's first firing looks, in hundredths of a degree.
    pub fn set_azimuth(&mut self, block: usize, azimuth: u16) {
        let azimuth = azimuth % CIRCLE;
        self.bytes[block * BLOCK_LEN + 2..][..2].copy_from_slice(&azimuth.to_le_bytes());
    }

    /// Says what came back of a laser.
    pub fn set(&mut self, block: usize, firing: usize, laser: usize, found: Return) {
        let at = block * BLOCK_LEN + 4 + firing * FIRING_LEN + laser * RETURN_LEN;
        let [low, high] = found.distance.to_le_bytes();
        self.bytes[at..][..RETURN_LEN].copy_from_slice(&[low, high, found.reflectivity]);
    }

    /// Says when the first laser fired, microseconds past the hour.
    pub fn set_time_us(&mut self, time_us: u32) {
        self.bytes[TIME_AT..][..4].copy_from_slice(&time_us.to_le_bytes());
    }

    /// The packet.
    pub fn bytes(&self) -> &[u8; PACKET_LEN] {
        &self.bytes
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_written_is_read() {
        let mut writer = PacketWriter::new(ReturnMode::Dual, 0x22);
        let found = Return {
            distance: 12_345,
            reflectivity: 77,
        };
        writer.set_azimuth(11, 36_017);
        writer.set(11, 1, 15, found);
        writer.set_time_us(3_599_999_999);
        let packet = DataPacket::new(writer.bytes()).unwrap();
        assert_eq!(packet.azimuth(11), Some(17));
        assert_eq!(
            (packet.at(11, 1, 15), packet.at(11, 0, 15)),
            (found, Return::default())
        );
        assert_eq!(packet.time_us(), 3_599_999_999);
        assert_eq!(
            (packet.return_mode(), packet.product()),
            (Some(ReturnMode::Dual), 0x22)
        );
    }

    #[test]
    fn what_is_no_data_packet_is_named() {
        let error = |bytes: &[u8]| DataPacket::new(bytes).unwrap_err();
        assert_eq!(error(&[0; 512]), PacketError::Length { length: 512 });
        let mut bytes = *PacketWriter::new(ReturnMode::Last, 0x22).bytes();
        bytes[300] = 0;
        assert_eq!(error(&bytes), PacketError::Flag { block: 3 });
        bytes[300] = 0xff;
        bytes[2..4].copy_from_slice(&36_000u16.to_le_bytes());
        bytes[TIME_AT + 4] = 0;
        let packet = DataPacket::new(&bytes).unwrap();
        assert_eq!((packet.azimuth(0), packet.return_mode()), (None, None));
    }
}
