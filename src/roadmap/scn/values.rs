//! What stands behind a key.

use super::lines::Line;
use crate::roadmap::{Connector, Junction, LaneId, LaneKind, MapError, PointId};

/// Farther from its origin no map has a place; nor a radius or width.
pub(super) const FARTHEST_M: f64 = 1e6;

type Read<T> = Result<T, MapError>;

pub(super) fn number(line: &Line<'_>) -> Read<f64> {
    let value: Result<f64, _> = line.rest.parse();
    let finite = value.ok().filter(|value| value.is_finite());
    finite.ok_or_else(|| line.rest_error(format!("{:?} is no number", shortened(line.rest))))
}

pub(super) fn length(line: &Line<'_>) -> Read<f64> {
    let value = number(line)?;
    if (0.0..=FARTHEST_M).contains(&value) {
        Ok(value)
    } else {
        Err(line.rest_error(format!("{} of {value}", line.key)))
    }
}

pub(super) fn whole(line: &Line<'_>) -> Read<u32> {
    let problem = || line.rest_error(format!("{:?} is no whole number", shortened(line.rest)));
    line.rest.parse().map_err(|_| problem())
}

pub(super) fn kind(line: &Line<'_>) -> Read<LaneKind> {
    LaneKind::of(line.rest).ok_or_else(|| {
        line.rest_error(format!(
            "{:?} is neither road nor bikeway nor pavement",
            shortened(line.rest)
        ))
    })
}

pub(super) fn is_clockwise(line: &Line<'_>) -> Read<bool> {
    match line.rest {
        "clockwise" => Ok(true),
        "counterclockwise" => Ok(false),
        other => {
            let found = shortened(other);
            Err(line.rest_error(format!(
                "{found:?} is neither clockwise nor counterclockwise"
            )))
        }
    }
}

/// As `[ 0 1.57 ]`.
pub(super) fn interval(line: &Line<'_>) -> Read<[f64; 2]> {
    let problem = || line.rest_error("an interval is written [ from to ]");
    let inner = line.rest.strip_prefix('[').ok_or_else(problem)?;
    let inner = inner.trim_end().strip_suffix(']').ok_or_else(problem)?;
    let mut parts = inner.split_whitespace().map(str::parse);
    let mut next = || -> Read<f64> {
        let value: f64 = parts.next().ok_or_else(problem)?.map_err(|_| problem())?;
        Some(value)
            .filter(|value| value.abs() < 1e3)
            .ok_or_else(problem)
    };
    Ok([next()?, next()?])
}

/// As `(1.2.3.4) -> (1.5.6.7)`.
pub(super) fn connector(line: &Line<'_>) -> Read<Connector> {
    let problem = || {
        line.rest_error("a connector is written (layer.road.lane.point) -> (layer.road.lane.point)")
    };
    let (from, to) = line.rest.split_once("->").ok_or_else(problem)?;
    Ok(Connector {
        from: point_id(from).ok_or_else(problem)?,
        to: point_id(to).ok_or_else(problem)?,
    })
}

/// As `ENTRY (1.2.3.4) -> 1` or `EXIT 1 -> (1.2.3.4)`.
pub(super) fn junction(line: &Line<'_>) -> Read<Junction> {
    let problem = || {
        line.rest_error(
            "a junction is written ENTRY (layer.road.lane.point) -> circle, or EXIT circle -> (...)",
        )
    };
    let (from, to) = line.rest.split_once("->").ok_or_else(problem)?;
    let is_entry = line.key == "ENTRY";
    let (lane, circle) = if is_entry { (from, to) } else { (to, from) };
    Ok(Junction {
        lane: point_id(lane).ok_or_else(problem)?,
        is_entry,
        circle: circle.trim().parse().map_err(|_| problem())?,
    })
}

fn point_id(text: &str) -> Option<PointId> {
    let inner = text.trim().strip_prefix('(')?.strip_suffix(')')?;
    let mut parts = inner.split('.').map(|part| part.trim().parse().ok());
    let mut next = || parts.next().flatten();
    let (layer, road, lane) = (next()?, next()?, next()?);
    let point = next()?;
    Some(PointId {
        lane: LaneId { layer, road, lane },
        point,
    })
}

/// Enough of a value to recognise it.
fn shortened(text: &str) -> String {
    text.chars().take(40).collect()
}
