//! A position packet: what the sensor's GPS receiver says, and how far the sensor follows it.

use crate::time::Time;

/// Length of a position packet's UDP payload.
pub const PACKET_LEN: usize = 512;

const TIME_AT: usize = 198;
const PPS_AT: usize = 202;
const NMEA_AT: usize = 206;
/// The sensor's clock follows the receiver's pulse.
const PPS_LOCKED: u8 = 2;

/// What a position packet says of time.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct PositionPacket {
    /// By the sensor's clock, microseconds past the hour.
    pub time_us: u32,
    /// Whether that clock follows the pulse of a GPS receiver.
    pub is_locked: bool,
    /// What the receiver said last, if it knows the time; up to two seconds old.
    pub utc: Option<Time>,
}

impl PositionPacket {
    /// Reads a payload; `None` if its length is not that of a position packet.
    pub fn read(payload: &[u8]) -> Option<Self> {
        let payload: &[u8; PACKET_LEN] = payload.try_into().ok()?;
        let time = &payload[TIME_AT..];
        Some(Self {
            time_us: u32::from_le_bytes([time[0], time[1], time[2], time[3]]),
            is_locked: payload[PPS_AT] == PPS_LOCKED,
            utc: utc_of(&payload[NMEA_AT..]),
        })
    }

    /// Appends a payload.
    pub fn put(&self, out: &mut Vec<u8>) {
        let mut payload = [0; PACKET_LEN];
        payload[TIME_AT..][..4].copy_from_slice(&self.time_us.to_le_bytes());
        payload[PPS_AT] = if self.is_locked { PPS_LOCKED } else { 0 };
        if let Some(utc) = self.utc {
            let sentence = sentence_of(utc);
            payload[NMEA_AT..][..sentence.len()].copy_from_slice(sentence.as_bytes());
        }
        out.extend_from_slice(&payload);
    }
}

const DAY_S: i64 = 86_400;

/// Time and date of a valid GPRMC sentence (NMEA 0183) with a sound checksum.
fn utc_of(bytes: &[u8]) -> Option<Time> {
    let sentence = bytes.strip_prefix(b"$")?;
    let end = sentence.iter().position(|byte| *byte == b'*')?;
    let (content, rest) = (
        std::str::from_utf8(&sentence[..end]).ok()?,
        &sentence[end + 1..],
    );
    let stated = std::str::from_utf8(rest.get(..2)?).ok()?;
    if u8::from_str_radix(stated, 16).ok()? != checksum(content) {
        return None;
    }
    let fields: Vec<&str> = content.split(',').collect();
    let (kind, time, status, date) = (fields[0], fields.get(1)?, fields.get(2)?, fields.get(9)?);
    if !kind.ends_with("RMC") || *status != "A" {
        return None;
    }
    let [hour, minute, second] = two_digits(time)?;
    let [day, month, year] = two_digits(date)?;
    let is_possible = hour < 24 && minute < 60 && second < 61;
    let is_day = (1..=12).contains(&month) && (1..=31).contains(&day);
    if !is_possible || !is_day {
        return None;
    }
    let days = days_since_1970(2000 + year, month, day);
    let seconds = days * DAY_S + 3600 * hour + 60 * minute + second;
    Some(Time::from_micros(1_000_000 * seconds))
}

/// Exclusive or of all characters between `$` and `*`.
fn checksum(content: &str) -> u8 {
    content.bytes().fold(0, |sum, byte| sum ^ byte)
}

/// The first three numbers of two digits.
fn two_digits(text: &str) -> Option<[i64; 3]> {
    let number = |from| text.get(from..from + 2)?.parse::<u8>().ok().map(i64::from);
    Some([number(0)?, number(2)?, number(4)?])
}

/// Days from 1970-01-01 to a day of the Gregorian calendar from the year 1 on.
fn days_since_1970(year: i64, month: i64, day: i64) -> i64 {
    // Years that begin in March have their leap day at the end.
    let (year, month) = if month > 2 {
        (year, month - 3)
    } else {
        (year - 1, month + 9)
    };
    let before_year = 365 * year + year / 4 - year / 100 + year / 400;
    let before_month = (153 * month + 2) / 5;
    before_year + before_month + day - 1 - 719_468
}

/// Year, month and day.
fn date_of(days: i64) -> [i64; 3] {
    let mut year = 1970 + days / 366;
    while days_since_1970(year + 1, 1, 1) <= days {
        year += 1;
    }
    let month = (2..=12)
        .take_while(|month| days_since_1970(year, *month, 1) <= days)
        .last()
        .unwrap_or(1);
    [year, month, days - days_since_1970(year, month, 1) + 1]
}

/// A GPRMC sentence of a receiver that stands in Gothenburg.
fn sentence_of(utc: Time) -> String {
    let seconds = utc.micros().div_euclid(1_000_000);
    let [year, month, day] = date_of(seconds.div_euclid(DAY_S));
    let second = seconds.rem_euclid(DAY_S);
    let content = format!(
        "GPRMC,{:02}{:02}{:02},A,5742.7000,N,01156.5000,E,000.0,000.0,{day:02}{month:02}{:02},,,A",
        second / 3600,
        second / 60 % 60,
        second % 60,
        year % 100,
    );
    format!("${content}*{:02X}\r\n", checksum(&content))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_sentence_of_a_real_sensor_is_read() {
        let real =
            b"$GPRMC,214106,A,3707.8178,N,12139.2690,W,010.3,188.2,230715,013.8,E,D*05\r\n\0\0";
        assert_eq!(utc_of(real), Some(Time::from_micros(1_437_687_666_000_000)));
        let real =
            b"$GPRMC,081802.00,A,3649.7478558,N,00224.4542928,W,0.034,212.5,210116,0.0,E,A*2E\r\n";
        assert_eq!(utc_of(real), Some(Time::from_micros(1_453_364_282_000_000)));
    }

    #[test]
    fn damaged_and_void_sentences_tell_nothing() {
        let real = "$GPRMC,214106,A,3707.8178,N,12139.2690,W,010.3,188.2,230715,013.8,E,D*05\r\n";
        for wrong in [
            real.replace("*05", "*06"),
            real.replace("*05", ""),
            real.replace(",A,3707", ",V,3707").replace("*05", "*12"),
            real[..40].into(),
            String::new(),
        ] {
            assert_eq!(utc_of(wrong.as_bytes()), None, "{wrong}");
        }
        let content = "GPRMC,256106,A,,,,,,,320015,,,";
        let impossible = format!("${content}*{:02X}", checksum(content));
        assert_eq!(utc_of(impossible.as_bytes()), None);
    }

    #[test]
    fn what_is_written_is_read() {
        for utc_s in [
            1_700_000_000,
            1_709_164_799,
            1_709_164_800,
            1_767_225_599,
            951_782_400,
        ] {
            let position = PositionPacket {
                time_us: 123_456_789,
                is_locked: true,
                utc: Some(Time::from_micros(1_000_000 * utc_s)),
            };
            let mut payload = vec![];
            position.put(&mut payload);
            assert_eq!(PositionPacket::read(&payload), Some(position));
        }
        assert_eq!(PositionPacket::read(&[0; 511]), None);
    }
}
