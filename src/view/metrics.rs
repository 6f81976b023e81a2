//! Status as Prometheus reads it (text format 0.0.4): `GET /metrics`, and `GET /health`.

use std::fmt::Write as _;
use std::time::{Duration, Instant};

use crate::wire::status::Status;

/// The latest Status, and when it was told.
#[derive(Debug, Clone)]
pub(super) struct Told {
    pub(super) status: Status,
    pub(super) at: Instant,
}

/// A daemon that has told nothing for so long hangs: it tells its Status every second.
const SILENCE: Duration = Duration::from_secs(3);

/// Whether the daemon receives and keeps up, or why it does not.
pub(super) fn health(told: Option<&Told>) -> Result<(), &'static str> {
    match told {
        None => Err("nothing is known yet"),
        Some(told) if told.at.elapsed() > SILENCE => Err("the daemon does not answer"),
        Some(told) if !told.status.healthy => {
            Err("no revolution is answered, or some were dropped")
        }
        Some(_) => Ok(()),
    }
}

/// All that Status counts and measures.
pub(super) fn text(status: &Status) -> String {
    let mut out = String::new();
    let counters = [
        (
            "revolutions_received",
            status.revolutions_received,
            "Point clouds that came in whole",
        ),
        (
            "revolutions_published",
            status.revolutions_published,
            "Object lists sent",
        ),
        (
            "revolutions_refused",
            status.revolutions_refused,
            "Point clouds refused",
        ),
        (
            "revolutions_queue_dropped",
            status.revolutions_queue_dropped,
            "Point clouds dropped because the pipeline was behind",
        ),
        (
            "datagrams_received",
            status.datagrams_received,
            "Datagrams of the session",
        ),
        (
            "datagrams_kernel_dropped",
            status.datagrams_kernel_dropped,
            "Datagrams that the kernel dropped for want of buffer",
        ),
        (
            "datagrams_damaged",
            status.datagrams_damaged,
            "Datagrams that were no sound envelope",
        ),
        (
            "poses_received",
            status.poses_received,
            "Pose messages read",
        ),
        (
            "pose_jumps",
            status.pose_jumps,
            "Jumps of a pose source that stayed",
        ),
        (
            "odometry_restarts",
            status.odometry_restarts.into(),
            "Times that the odometry frame began anew",
        ),
        (
            "ground_held",
            status.ground_held,
            "Revolutions that kept the last good ground plane",
        ),
        (
            "ground_fallback",
            status.ground_fallback,
            "Revolutions that fell back to the configured sensor height",
        ),
    ];
    for (name, value, help) in counters {
        put(
            &mut out,
            &format!("{name}_total"),
            "counter",
            help,
            &[("", f64_of(value))],
        );
    }
    let faults: Vec<(String, f64)> = status
        .faults
        .split_whitespace()
        .filter_map(|fault| {
            let (name, count) = fault.split_once('=')?;
            Some((format!("{{fault=\"{name}\"}}"), count.parse().ok()?))
        })
        .collect();
    put(
        &mut out,
        "faults_total",
        "counter",
        "What could not be used, by name",
        &faults,
    );
    let gauges = [
        ("uptime_seconds", status.uptime, "Since start"),
        (
            "healthy",
            f64::from(u8::from(status.healthy)),
            "Whether it receives and keeps up",
        ),
        (
            "rotation_hertz",
            status.rotation_rate.into(),
            "Revolutions a second",
        ),
        (
            "ground_height_metres",
            status.ground_height.into(),
            "Sensor above the ground plane",
        ),
        (
            "ground_tilt_radians",
            status.ground_tilt.into(),
            "Ground plane against the sensor",
        ),
        (
            "odometry_deviation_metres",
            status.odometry_deviation.into(),
            "Standard deviation of the place in its worst direction",
        ),
        (
            "pose_disagreement_metres",
            status.pose_disagreement.into(),
            "Pose source and odometry apart",
        ),
        (
            "latency_longest_seconds",
            status.latency_max.into(),
            "Arrival to list sent, since start",
        ),
    ];
    for (name, value, help) in gauges {
        put(&mut out, name, "gauge", help, &[("", value)]);
    }
    let latencies = [
        ("{quantile=\"0.5\"}", f64::from(status.latency_median)),
        ("{quantile=\"0.99\"}", status.latency_p99.into()),
        ("{quantile=\"0.999\"}", status.latency_p999.into()),
    ];
    let help = "Arrival of a point cloud to its list sent, of the latest 6,000 to 12,000";
    put(&mut out, "latency_seconds", "gauge", help, &latencies);
    let labels = format!(
        "{{version=\"{}\",profile=\"{}\",sensor=\"{}\",byte_order=\"{}\",odometry=\"{}\",pose_source=\"{}\"}}",
        status.version,
        status.profile,
        status.sensor,
        status.byte_order,
        status.odometry,
        status.pose_source
    );
    put(
        &mut out,
        "info",
        "gauge",
        "What runs, and what was found",
        &[(&labels, 1.0)],
    );
    out
}

/// Counters stay far below what a float holds exactly.
fn f64_of(count: u64) -> f64 {
    count as f64
}

fn put(out: &mut String, name: &str, kind: &str, help: &str, values: &[(impl AsRef<str>, f64)]) {
    // Writing to a string never fails.
    let _ = writeln!(
        out,
        "# HELP kreisel_{name} {help}.\n# TYPE kreisel_{name} {kind}"
    );
    for (labels, value) in values {
        let _ = writeln!(out, "kreisel_{name}{} {value}", labels.as_ref());
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_line_is_a_comment_or_a_name_with_a_value() {
        let status = Status {
            revolutions_received: 7,
            faults: "time_order=3 length=1".into(),
            latency_p99: 0.5,
            version: "1".into(),
            ..Status::default()
        };
        let text = text(&status);
        for line in text.lines().filter(|line| !line.starts_with('#')) {
            let (name, value) = line.rsplit_once(' ').unwrap();
            assert!(
                name.starts_with("kreisel_") && value.parse::<f64>().is_ok(),
                "{line}"
            );
        }
        for line in [
            "kreisel_revolutions_received_total 7",
            "kreisel_faults_total{fault=\"time_order\"} 3",
            "kreisel_latency_seconds{quantile=\"0.99\"} 0.5",
        ] {
            assert!(text.lines().any(|own| own == line), "{line}: {text}");
        }
    }

    #[test]
    fn who_tells_nothing_or_that_it_is_not_well_is_not_healthy() {
        let told = |healthy, seconds| Told {
            status: Status {
                healthy,
                ..Status::default()
            },
            at: Instant::now() - Duration::from_secs(seconds),
        };
        assert!(health(None).is_err());
        assert!(health(Some(&told(true, 4))).is_err());
        assert!(health(Some(&told(false, 0))).is_err());
        assert_eq!(health(Some(&told(true, 1))), Ok(()));
    }
}
