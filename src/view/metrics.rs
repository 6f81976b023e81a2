//! Status as Prometheus reads it (text format 0.0.4): `GET /metrics`, and `GET /health`.

use std::fmt::Write as _;
use std::time::{Duration, Instant};

use super::measures::{BOUNDS_S, Durations, Measures};
use crate::wire::status::Status;

/// The latest Status, and when it was told.
#[derive(Debug, Clone)]
pub(super) struct Told {
    pub(super) status: Status,
    pub(super) measures: Measures,
    pub(super) at: Instant,
}

/// A daemon that has told nothing for so long hangs: it tells its Status every second.
const SILENCE: Duration = Duration::from_secs(3);

/// Whether the daemon receives and keeps up, or why it does not.
pub(super) fn health(told: Option<&Told>) -> Result<(), String> {
    match told {
        None => Err("nothing is known yet".into()),
        Some(told) if told.at.elapsed() > SILENCE => Err("the daemon does not answer".into()),
        Some(told) if !told.status.healthy => Err(told.status.health.clone()),
        Some(_) => Ok(()),
    }
}

/// Values of one name, each with what follows the name: a suffix, labels, or nothing.
struct Family {
    name: &'static str,
    kind: &'static str,
    help: &'static str,
    values: Vec<(String, f64)>,
}

/// Lines of a histogram with labels of its own, which end with a comma if there are any.
fn histogram(labels: &str, durations: &Durations) -> Vec<(String, f64)> {
    let mut below = 0;
    let buckets = BOUNDS_S.iter().zip(durations.buckets).map(|(bound, own)| {
        below += own;
        (format!("_bucket{{{labels}le=\"{bound}\"}}"), below as f64)
    });
    let own = labels.trim_end_matches(',');
    let own = if own.is_empty() {
        String::new()
    } else {
        format!("{{{own}}}")
    };
    let total = durations.count as f64;
    buckets
        .chain([
            (format!("_bucket{{{labels}le=\"+Inf\"}}"), total),
            (format!("_sum{own}"), durations.sum_s),
            (format!("_count{own}"), total),
        ])
        .collect()
}

fn counter(name: &'static str, count: u64, help: &'static str) -> Family {
    // Counters stay far below what a float holds exactly.
    let values = vec![(String::new(), count as f64)];
    Family {
        name,
        kind: "counter",
        help,
        values,
    }
}

fn gauge(name: &'static str, value: impl Into<f64>, help: &'static str) -> Family {
    let values = vec![(String::new(), value.into())];
    Family {
        name,
        kind: "gauge",
        help,
        values,
    }
}

/// All that is counted and measured.
pub(super) fn text(told: &Told) -> String {
    let mut out = String::new();
    for Family {
        name,
        kind,
        help,
        values,
    } in families(&told.status)
        .into_iter()
        .chain(measured(&told.measures))
    {
        // Writing to a string never fails.
        let _ = writeln!(
            out,
            "# HELP kreisel_{name} {help}.\n# TYPE kreisel_{name} {kind}"
        );
        for (more, value) in values {
            let _ = writeln!(out, "kreisel_{name}{more} {value}");
        }
    }
    out
}

fn measured(measures: &Measures) -> Vec<Family> {
    let steps = measures
        .steps
        .iter()
        .flat_map(|(step, own)| histogram(&format!("step=\"{}\",", step.name()), own));
    vec![
        Family {
            name: "latency_seconds",
            kind: "histogram",
            help: "Arrival of a revolution to its list sent",
            values: histogram("", &measures.latency),
        },
        Family {
            name: "step_seconds",
            kind: "histogram",
            help: "Each step of a revolution",
            values: steps.collect(),
        },
        counter(
            "received_bytes_total",
            measures.received_bytes,
            "Bytes of datagrams that came in",
        ),
        counter(
            "sent_bytes_total",
            measures.sent_bytes,
            "Bytes of frames that were sent",
        ),
    ]
}

fn families(status: &Status) -> Vec<Family> {
    let faults = status.faults.split_whitespace().filter_map(|fault| {
        let (name, count) = fault.split_once('=')?;
        Some((format!("{{fault=\"{name}\"}}"), count.parse().ok()?))
    });
    let quantile =
        |share: f64, seconds: f32| (format!("{{quantile=\"{share}\"}}"), f64::from(seconds));
    let found = format!(
        "{{version=\"{}\",profile=\"{}\",sensor=\"{}\",byte_order=\"{}\",sensor_clock=\"{}\",odometry=\"{}\",pose_source=\"{}\"}}",
        status.version,
        status.profile,
        status.sensor,
        status.byte_order,
        status.sensor_clock,
        status.odometry,
        status.pose_source
    );
    vec![
        counter(
            "revolutions_received_total",
            status.revolutions_received,
            "Point clouds that came in whole",
        ),
        counter(
            "revolutions_published_total",
            status.revolutions_published,
            "Object lists sent",
        ),
        counter(
            "revolutions_refused_total",
            status.revolutions_refused,
            "Point clouds refused",
        ),
        counter(
            "revolutions_queue_dropped_total",
            status.revolutions_queue_dropped,
            "Point clouds dropped because the pipeline was behind",
        ),
        counter(
            "datagrams_received_total",
            status.datagrams_received,
            "Datagrams of the session",
        ),
        counter(
            "datagrams_kernel_dropped_total",
            status.datagrams_kernel_dropped,
            "Datagrams that the kernel dropped for want of buffer",
        ),
        counter(
            "datagrams_damaged_total",
            status.datagrams_damaged,
            "Datagrams that were no sound envelope",
        ),
        counter(
            "revolutions_missed_total",
            status.revolutions_missed,
            "Revolutions that were not answered between two that were",
        ),
        counter(
            "airborne_returns_total",
            status.airborne_returns,
            "Returns left out because they hang in the air",
        ),
        counter(
            "frames_not_sent_total",
            status.frames_not_sent,
            "Frames that could not be sent",
        ),
        counter(
            "fragmented_lost_total",
            status.fragmented_lost,
            "Fragmented datagrams that this host could not put together",
        ),
        counter(
            "packets_received_total",
            status.packets_received,
            "Packets of the sensor itself",
        ),
        counter(
            "packets_lost_total",
            status.packets_lost,
            "Packets of the sensor that never came",
        ),
        counter(
            "poses_received_total",
            status.poses_received,
            "Pose messages read",
        ),
        counter(
            "pose_jumps_total",
            status.pose_jumps,
            "Jumps of a pose source that stayed",
        ),
        counter(
            "odometry_restarts_total",
            status.odometry_restarts.into(),
            "Times that the odometry frame began anew",
        ),
        counter(
            "ground_held_total",
            status.ground_held,
            "Revolutions that kept the last good ground plane",
        ),
        counter(
            "ground_fallback_total",
            status.ground_fallback,
            "Revolutions that fell back to the configured sensor height",
        ),
        Family {
            name: "faults_total",
            kind: "counter",
            help: "What could not be used, by name",
            values: faults.collect(),
        },
        gauge("uptime_seconds", status.uptime, "Since start"),
        gauge(
            "healthy",
            u8::from(status.healthy),
            "Whether it receives and keeps up",
        ),
        gauge(
            "rotation_hertz",
            status.rotation_rate,
            "Revolutions a second",
        ),
        gauge(
            "ground_height_metres",
            status.ground_height,
            "Sensor above the ground plane",
        ),
        gauge(
            "ground_tilt_radians",
            status.ground_tilt,
            "Ground plane against the sensor",
        ),
        gauge(
            "odometry_deviation_metres",
            status.odometry_deviation,
            "Standard deviation of the place in its worst direction",
        ),
        gauge(
            "pose_disagreement_metres",
            status.pose_disagreement,
            "Pose source and odometry apart",
        ),
        gauge(
            "latency_longest_seconds",
            status.latency_max,
            "Arrival to list sent, since start",
        ),
        Family {
            name: "latency_quantile_seconds",
            kind: "gauge",
            help: "Arrival of a point cloud to its list sent, of the latest 6,000 to 12,000",
            values: vec![
                quantile(0.5, status.latency_median),
                quantile(0.99, status.latency_p99),
                quantile(0.999, status.latency_p999),
            ],
        },
        Family {
            name: "info",
            kind: "gauge",
            help: "What runs, and what was found",
            values: vec![(found, 1.0)],
        },
    ]
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::pipeline::Step;

    #[test]
    fn every_line_is_a_comment_or_a_name_with_a_value() {
        let status = Status {
            revolutions_received: 7,
            faults: "time_order=3 length=1".into(),
            latency_p99: 0.5,
            version: "1".into(),
            ..Status::default()
        };
        let mut measures = Measures::default();
        measures.latency.record(0.003);
        measures.note(Step::Track, Duration::from_millis(30));
        let at = Instant::now();
        let text = text(&Told {
            status,
            measures,
            at,
        });
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
            "kreisel_latency_quantile_seconds{quantile=\"0.99\"} 0.5",
            "kreisel_latency_seconds_bucket{le=\"0.002\"} 0",
            "kreisel_latency_seconds_bucket{le=\"0.005\"} 1",
            "kreisel_latency_seconds_bucket{le=\"+Inf\"} 1",
            "kreisel_latency_seconds_count 1",
            "kreisel_step_seconds_bucket{step=\"track\",le=\"0.05\"} 1",
            "kreisel_step_seconds_sum{step=\"track\"} 0.03",
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
            measures: Measures::default(),
            at: Instant::now() - Duration::from_secs(seconds),
        };
        assert!(health(None).is_err());
        assert!(health(Some(&told(true, 4))).is_err());
        assert!(health(Some(&told(false, 0))).is_err());
        assert_eq!(health(Some(&told(true, 1))), Ok(()));
    }
}
