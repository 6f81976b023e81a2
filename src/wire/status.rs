//! How the service is doing: `kreisel.Status`, once a second.

super::message! {
    /// Counters since start, settings that were found from the data, and latency.
    pub struct Status = 2023 "kreisel.Status" {
        /// Seconds since start.
        1 => uptime: f64,
        /// Point clouds that came in whole.
        2 => revolutions_received: u64,
        /// Object lists sent.
        3 => revolutions_published: u64,
        /// Point clouds refused; `faults` says why.
        4 => revolutions_refused: u64,
        /// Point clouds dropped because the pipeline was behind.
        5 => revolutions_queue_dropped: u64,
        /// Datagrams of the session.
        6 => datagrams_received: u64,
        /// Datagrams that the kernel dropped for want of buffer.
        7 => datagrams_kernel_dropped: u64,
        /// Datagrams that were no sound envelope; `faults` says why.
        8 => datagrams_damaged: u64,
        /// Our own datagrams, heard back and ignored.
        9 => datagrams_own: u64,
        /// Pose messages read.
        10 => poses_received: u64,
        /// Every fault with its count, as `name=count` with spaces between.
        11 => faults: String,
        /// Arrival of a point cloud to its list sent, median of the latest 6,000 to 12,000, seconds.
        12 => latency_median: f32,
        /// The same, 99th percentile.
        13 => latency_p99: f32,
        /// The same, greatest since start.
        14 => latency_max: f32,
        /// Sensor that was found.
        15 => sensor: String,
        /// Columns of the last revolution.
        16 => columns: u32,
        /// Layers of the last revolution.
        17 => layers: u32,
        /// Revolutions a second, from the step between columns.
        18 => rotation_rate: f32,
        /// Byte order of the distances.
        19 => byte_order: String,
        /// How the byte order is known: configured, detected or assumed.
        20 => byte_order_source: String,
        /// Metres per unit of distance.
        21 => distance_unit: f32,
        /// Bits of each distance that hold the intensity.
        22 => intensity_bits: u32,
        /// Height of the sensor above the ground plane, metres.
        23 => ground_height: f32,
        /// Tilt of the ground plane against the sensor, radians.
        24 => ground_tilt: f32,
        /// Revolutions that kept the last good plane.
        25 => ground_held: u64,
        /// Revolutions that fell back to the configured height.
        26 => ground_fallback: u64,
        /// Receive buffer that the kernel granted, bytes.
        27 => receive_buffer: u32,
        /// Whether revolutions come in and none was dropped lately.
        28 => healthy: bool,
        /// Profile that the configuration began from.
        29 => profile: String,
        /// Version of the program.
        30 => version: String,
        /// The same as `latency_p99`, 99.9th percentile.
        31 => latency_p999: f32,
        /// How the sensor's own motion is followed: off, begun, following, degenerate (what is seen does not tell all
        /// of it), or lost.
        32 => odometry: String,
        /// Standard deviation of the place that a revolution gives, in the direction in which it tells least, metres.
        33 => odometry_deviation: f32,
        /// How often the odometry frame began anew, and with it tracks and map.
        34 => odometry_restarts: u32,
        /// The source of poses in use: none, applanix, geolocation, wgs84 or simulation.
        35 => pose_source: String,
        /// How far that source and the odometry were apart when they were compared last, metres.
        36 => pose_disagreement: f32,
        /// How often a source jumped and stayed there, so that the local frame was tied to the odometry anew.
        37 => pose_jumps: u64,
        /// How far the own vehicle is seen in the sensor frame, metres: lowest x; 0 with the next three if it is not seen.
        38 => own_vehicle_left: f32,
        /// Highest x.
        39 => own_vehicle_right: f32,
        /// Lowest y.
        40 => own_vehicle_back: f32,
        /// Highest y.
        41 => own_vehicle_front: f32,
        /// Packets of a sensor that is listened to without any other service.
        42 => packets_received: u64,
        /// Packets that never came, by the sensor's time stamps.
        43 => packets_lost: u64,
        /// Packets that came out of order and were put in their place.
        44 => packets_late: u64,
        /// Which returns the packets hold: strongest return, last return or dual return.
        45 => return_mode: String,
        /// Whose time revolutions of packets have: the sensor's where a GPS receiver keeps it (synchronised), or that of the
        /// arrival, because none does (free), it is more than 10 s away (apart), or so configured (configured).
        46 => sensor_clock: String,
        /// How far the clock that stamps the poses in use is behind that of the revolutions, seconds; up to 2 s are made up for.
        47 => pose_clock_behind: f32,
        /// A source of poses that does not go as the sensor does and is not used; empty if there is none.
        48 => pose_distrusted: String,
        /// Revolutions that were not answered between two that were, by their time stamps.
        49 => revolutions_missed: u64,
        /// How the service is, in a word, and why: ok, degraded (it answers, but not all that there is), or blind.
        50 => health: String,
        /// Frames that could not be sent.
        51 => frames_not_sent: u64,
        /// Fragmented datagrams that the kernel could not put together, of the whole host.
        52 => fragmented_lost: u64,
        /// Returns that were left out because they hang in the air: snow, rain, spray, dust.
        53 => airborne_returns: u64,
    }
}
