//! Writing scenarios.

use std::collections::BTreeMap;
use std::fmt::Write as _;

use super::lines::OURS;
use crate::roadmap::curve::Vertex;
use crate::roadmap::{
    BETWEEN_LANES, Connector, Curve, DeclaredRoundabout, Lane, LaneId, LaneKind, PointId, Roadmap,
};

/// By the lane from which they lead.
type Connectors<'a> = BTreeMap<LaneId, Vec<&'a Connector>>;

/// A scenario with the map's roads; what the reader makes of it has the same lanes,
/// connectors and declared roundabouts. That a lane is circular is only in its road's name.
pub fn write(map: &Roadmap) -> String {
    let mut out = Lines::default();
    out.put("SCENARIO", one_line(&map.name, "roads"));
    out.put("VERSION", "v1.0");
    // The grammar wants a date; a map as such has none.
    out.put("DATE", "January-01-1970");
    out.bare("ORIGINCOORDINATESYSTEM");
    out.bare("WGS84");
    out.bare("ORIGIN");
    let place = map.origin.map_or([0.0; 2], |origin| {
        let place = origin.place;
        if origin.is_longitude_first {
            [place.longitude_deg, place.latitude_deg]
        } else {
            [place.latitude_deg, place.longitude_deg]
        }
    });
    out.vertex(place);
    out.put(
        "ROTATION",
        map.origin.map_or(0.0, |origin| origin.rotation_rad),
    );
    out.put("GROUND", "Ground");
    out.bare("ENDGROUND");
    let mut connectors = Connectors::new();
    for connector in &map.connectors {
        connectors
            .entry(connector.from.lane)
            .or_default()
            .push(connector);
    }
    let layers = map.lanes.chunk_by(|a, b| a.id.layer == b.id.layer);
    for lanes in layers {
        out.layer(lanes, &connectors);
    }
    for roundabout in &map.declared {
        out.roundabout(roundabout);
    }
    out.bare("ENDSCENARIO");
    out.text
}

/// A name as one line that is not empty.
fn one_line<'a>(name: &'a str, otherwise: &'a str) -> String {
    let words: Vec<_> = name.split_whitespace().collect();
    let joined = words.join(" ").replace("/*", "").replace("*/", "");
    if joined.is_empty() {
        otherwise.to_owned()
    } else {
        joined
    }
}

#[derive(Default)]
struct Lines {
    text: String,
}

impl Lines {
    fn bare(&mut self, key: &str) {
        self.text.push_str(key);
        self.text.push('\n');
    }

    fn put(&mut self, key: &str, value: impl std::fmt::Display) {
        // Writing to a string does not fail.
        let _ = writeln!(self.text, "{key} {value}");
    }

    fn vertex(&mut self, [x, y]: [f64; 2]) {
        self.bare("VERTEX2");
        self.put("X", x);
        self.put("Y", y);
    }

    fn identified(&mut self, vertex: &Vertex) {
        self.put("ID", vertex.id);
        self.vertex(vertex.place_m);
    }

    fn layer(&mut self, lanes: &[Lane], connectors: &Connectors<'_>) {
        let layer = lanes.first().map_or(0, |lane| lane.id.layer);
        self.put("LAYER", format_args!("Layer{layer}"));
        self.put("LAYERID", layer);
        self.put("HEIGHT", 0);
        for road in lanes.chunk_by(|a, b| a.id.road == b.id.road) {
            self.bare("ROAD");
            if let Some(first) = road.first() {
                self.put("ROADID", first.id.road);
                if !first.road_name.is_empty() {
                    self.put("ROADNAME", one_line(&first.road_name, "road"));
                }
            }
            for lane in road {
                self.lane(lane, connectors);
            }
            self.bare("ENDROAD");
        }
        self.bare("ENDLAYER");
    }

    fn lane(&mut self, lane: &Lane, connectors: &Connectors<'_>) {
        self.bare("LANE");
        self.put("LANEID", lane.id.lane);
        if let Some(width_m) = lane.width_m {
            self.put("LANEWIDTH", width_m);
        }
        if lane.kind != LaneKind::Road {
            let name = lane.kind.name();
            self.put("/*", format_args!("{OURS} LANETYPE {name} */"));
        }
        if let Some(marking) = &lane.left_marking {
            self.put("LEFTLANEMARKING", marking);
        }
        if let Some(marking) = &lane.right_marking {
            self.put("RIGHTLANEMARKING", marking);
        }
        for connector in connectors.get(&lane.id).into_iter().flatten() {
            let [from, to] = [connector.from, connector.to].map(address);
            self.bare(&format!("{from} -> {to}"));
        }
        self.curve(&lane.curve);
        self.bare("ENDLANE");
    }

    fn curve(&mut self, curve: &Curve) {
        if let Curve::Points(vertices) = curve {
            self.bare("POINTMODEL");
            for vertex in vertices {
                self.identified(vertex);
            }
            self.bare("ENDPOINTMODEL");
            return;
        }
        self.bare("FUNCTIONMODEL");
        match curve {
            Curve::Points(_) => {}
            Curve::Line { ends } => {
                self.bare("STRAIGHTLINE");
                self.ends(ends);
            }
            Curve::Arc {
                radius_m,
                interval_rad: [from, to],
                ends,
                heading_rad,
            } => {
                self.bare("ARC");
                self.put("RADIUS", radius_m);
                self.bare(&format!("[ {from} {to} ]"));
                self.ends(ends);
                self.put("ROTZ", heading_rad);
            }
            Curve::Clothoid {
                curvature_growth_per_m2,
                curvature_per_m,
                ends,
                heading_rad,
            } => {
                self.bare("CLOTHOID");
                self.put("DK", curvature_growth_per_m2);
                self.put("K", curvature_per_m);
                self.ends(ends);
                self.put("ROTZ", heading_rad);
            }
        }
        self.bare("ENDFUNCTIONMODEL");
    }

    fn ends(&mut self, [start, end]: &[Vertex; 2]) {
        self.bare("START");
        self.identified(start);
        self.bare("END");
        self.identified(end);
    }

    fn roundabout(&mut self, roundabout: &DeclaredRoundabout) {
        self.put("/*", OURS);
        self.bare("ROUNDABOUT");
        self.put("ROUNDABOUTID", roundabout.id);
        if !roundabout.name.is_empty() {
            self.put("ROUNDABOUTNAME", one_line(&roundabout.name, "roundabout"));
        }
        self.vertex(roundabout.centre_m);
        if let Some(is_clockwise) = roundabout.is_clockwise {
            let word = if is_clockwise {
                "clockwise"
            } else {
                "counterclockwise"
            };
            self.put("DIRECTION", word);
        }
        for circle in &roundabout.circles {
            self.bare("CIRCLE");
            self.put("CIRCLEID", circle.id);
            self.put("LANETYPE", circle.kind.name());
            self.put("INNERRADIUS", circle.inner_m);
            self.put("OUTERRADIUS", circle.outer_m);
            if circle.is_marked {
                self.put("MARKING", BETWEEN_LANES);
            }
            self.bare("ENDCIRCLE");
        }
        for junction in &roundabout.junctions {
            let (lane, circle) = (address(junction.lane), junction.circle);
            if junction.is_entry {
                self.put("ENTRY", format_args!("{lane} -> {circle}"));
            } else {
                self.put("EXIT", format_args!("{circle} -> {lane}"));
            }
        }
        self.bare("ENDROUNDABOUT");
        self.bare("*/");
    }
}

fn address(point: PointId) -> String {
    format!("({}.{})", point.lane, point.point)
}
