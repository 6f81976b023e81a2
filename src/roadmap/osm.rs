//! Roads from OpenStreetMap (`.osm` XML as JOSM and the API write it).
//!
//! Ways with `highway` become lanes beside their middle line: one a direction where nothing else
//! is tagged. `junction=roundabout` makes a way's lanes circular (Key:junction in the project's
//! wiki). Ways that share a node are connected there.

use std::collections::BTreeMap;

use roxmltree::{Document, Node};

use super::curve::Vertex;
use super::{
    BETWEEN_LANES, Connector, Curve, Lane, LaneId, LaneKind, MapError, Origin, PointId, Polyline,
    Roadmap,
};
use crate::ego::geodesy::{Geodetic, LocalFrame};
use crate::ego::wrapped_rad;

/// The roads of an extract, in metres around the middle of all their nodes, or around `origin`.
///
/// # Errors
/// [`MapError`] with line and column where the file is no OpenStreetMap XML, and where a node has
/// no place.
pub fn read(text: &str, origin: Option<Geodetic>) -> Result<Roadmap, MapError> {
    let document = Document::parse(text).map_err(|error| {
        let position = error.pos();
        MapError {
            line: position.row as usize,
            column: position.col as usize,
            problem: format!("no XML: {error}"),
        }
    })?;
    let root = document.root_element();
    if !root.has_tag_name("osm") {
        return Err(at(
            &root,
            "no OpenStreetMap: the first element is not <osm>",
        ));
    }
    let nodes = nodes(&root)?;
    let mut reader = Reader {
        map: Roadmap {
            name: "OpenStreetMap".to_owned(),
            ..Roadmap::default()
        },
        nodes,
        frame: None,
        side: 1.0,
        places: BTreeMap::new(),
    };
    let ways: Vec<_> = root
        .children()
        .filter(|node| node.has_tag_name("way"))
        .collect();
    reader.begin(&ways, origin);
    reader.take_side(&ways);
    for way in &ways {
        reader.way(way);
    }
    let relations = root.children().filter(|node| node.has_tag_name("relation"));
    relations.for_each(|_| reader.skip("relation"));
    reader.mini_roundabouts(&root);
    reader.connect();
    Ok(reader.map)
}

fn at(node: &Node<'_, '_>, problem: &str) -> MapError {
    let position = node.document().text_pos_at(node.range().start);
    MapError {
        line: position.row as usize,
        column: position.col as usize,
        problem: problem.to_owned(),
    }
}

fn nodes<'a>(root: &Node<'a, '_>) -> Result<BTreeMap<&'a str, Geodetic>, MapError> {
    let mut nodes = BTreeMap::new();
    for node in root.children().filter(|node| node.has_tag_name("node")) {
        let degrees = |name: &str| -> Option<f64> { node.attribute(name)?.parse().ok() };
        let place = degrees("lat").zip(degrees("lon"));
        let place = place.map(|(latitude_deg, longitude_deg)| Geodetic {
            latitude_deg,
            longitude_deg,
            altitude_m: 0.0,
        });
        let place = place.filter(Geodetic::is_valid);
        match (node.attribute("id"), place) {
            (Some(id), Some(place)) => nodes.insert(id, place),
            (_, None) if node.attribute("action") == Some("delete") => None,
            _ => {
                return Err(at(
                    &node,
                    "a node without id, or without lat and lon on earth",
                ));
            }
        };
    }
    Ok(nodes)
}

struct Reader<'a> {
    map: Roadmap,
    nodes: BTreeMap<&'a str, Geodetic>,
    frame: Option<LocalFrame>,
    /// 1 where traffic drives on the right, else -1.
    side: f64,
    /// Where lanes have a point at a node, by the node.
    places: BTreeMap<&'a str, Vec<PointId>>,
}

/// What a way's tags say of its lanes.
struct Lanes {
    kind: LaneKind,
    width_m: Option<f64>,
    forward: usize,
    backward: usize,
    is_circular: bool,
    name: String,
    is_marked: bool,
}

fn tag<'a>(way: &Node<'a, '_>, key: &str) -> Option<&'a str> {
    let mut tags = way.children().filter(|node| node.has_tag_name("tag"));
    tags.find(|tag| tag.attribute("k") == Some(key))?
        .attribute("v")
}

/// For whom a way is, by its `highway` (Key:highway in the project's wiki).
fn kind(highway: &str) -> Option<LaneKind> {
    match highway {
        "cycleway" => Some(LaneKind::Bikeway),
        "footway" | "pedestrian" | "path" | "steps" | "bridleway" => Some(LaneKind::Pavement),
        "proposed" | "construction" | "abandoned" | "platform" | "services" | "rest_area" => None,
        _ => Some(LaneKind::Road),
    }
}

/// A number of metres, as `7`, `7.5` or `7.5 m`.
fn metres(text: &str) -> Option<f64> {
    let value: f64 = text.trim_end_matches('m').trim().parse().ok()?;
    (0.5..100.0).contains(&value).then_some(value)
}

impl Lanes {
    fn of(way: &Node<'_, '_>) -> Option<Self> {
        /// More are a mistake in the map.
        const MOST: usize = 12;
        let kind = kind(tag(way, "highway")?)?;
        let is_circular = matches!(tag(way, "junction"), Some("roundabout" | "circular"));
        let is_one_way = match tag(way, "oneway") {
            Some("yes" | "1" | "true" | "-1" | "reverse") => true,
            Some(_) => false,
            None => is_circular,
        };
        let is_reverse = matches!(tag(way, "oneway"), Some("-1" | "reverse"));
        let least = if is_one_way || kind != LaneKind::Road {
            1
        } else {
            2
        };
        let given = tag(way, "lanes").and_then(|lanes| lanes.parse().ok());
        let lanes = given.unwrap_or(least).clamp(least, MOST);
        let backward = match (is_one_way, is_reverse) {
            (true, true) => lanes,
            (true, false) => 0,
            (false, _) => lanes / 2,
        };
        let width_m = tag(way, "width").and_then(metres);
        let id = way.attribute("id").unwrap_or("");
        let name = tag(way, "name").map_or_else(
            || {
                let what = if is_circular { "Roundabout" } else { "Way" };
                format!("{what} {id}")
            },
            str::to_owned,
        );
        Some(Self {
            kind,
            width_m: width_m.map(|width_m| width_m / lanes as f64),
            forward: lanes - backward,
            backward,
            is_circular,
            name,
            is_marked: tag(way, "lane_markings") == Some("yes") || tag(way, "turn:lanes").is_some(),
        })
    }
}

impl<'a> Reader<'a> {
    fn skip(&mut self, name: &str) {
        *self.map.skipped.entry(name.to_owned()).or_default() += 1;
    }

    /// Around the middle of what the roads' nodes span; of nothing, if there are none.
    fn begin(&mut self, ways: &[Node<'a, '_>], origin: Option<Geodetic>) {
        let references = ways
            .iter()
            .filter(|way| Lanes::of(way).is_some())
            .flat_map(|way| way.children().filter_map(|node| node.attribute("ref")));
        let places = references.filter_map(|id| self.nodes.get(id));
        let mut low = [f64::INFINITY; 2];
        let mut high = [f64::NEG_INFINITY; 2];
        for place in places {
            for (axis, value) in [place.latitude_deg, place.longitude_deg]
                .into_iter()
                .enumerate()
            {
                low[axis] = low[axis].min(value);
                high[axis] = high[axis].max(value);
            }
        }
        let place = origin.unwrap_or(Geodetic {
            latitude_deg: (low[0] + high[0]) / 2.0,
            longitude_deg: (low[1] + high[1]) / 2.0,
            altitude_m: 0.0,
        });
        if place.is_valid() {
            self.frame = Some(LocalFrame::around(place));
            self.map.origin = Some(Origin {
                place,
                rotation_rad: 0.0,
                is_longitude_first: false,
            });
        }
    }

    /// Roundabouts are driven clockwise where traffic drives on the left.
    fn take_side(&mut self, ways: &[Node<'a, '_>]) {
        let circular = ways.iter().filter(|way| {
            Lanes::of(way).is_some_and(|lanes| lanes.is_circular && lanes.backward == 0)
        });
        let turned_rad: f64 = circular.map(|way| turned_rad(&self.known(way))).sum();
        self.side = if turned_rad < 0.0 { -1.0 } else { 1.0 };
    }

    /// A way's nodes that are in the file, with their places.
    fn known(&self, way: &Node<'a, '_>) -> Vec<(&'a str, [f64; 2])> {
        let references = way.children().filter_map(|node| node.attribute("ref"));
        references
            .filter_map(|id| {
                let [x, y, _] = self.frame.as_ref()?.local_m(*self.nodes.get(id)?);
                Some((id, [x, y]))
            })
            .collect()
    }

    fn way(&mut self, way: &Node<'a, '_>) {
        let Some(lanes) = Lanes::of(way) else {
            let what = if tag(way, "highway").is_some() {
                "highway of another kind"
            } else {
                "way without highway"
            };
            self.skip(what);
            return;
        };
        let known = self.known(way);
        let middle = Polyline::through(known.iter().map(|(_, place_m)| *place_m));
        if middle.points_m().len() < 2 {
            // Extracts are cut through roads.
            self.skip("road outside of the extract");
            return;
        }
        let road = u32::try_from(self.map.lanes.len() + 1).unwrap_or(u32::MAX);
        let width_m = lanes.width_m.unwrap_or(lanes.kind.usual_width_m());
        let total = lanes.forward + lanes.backward;
        for index in 0..total {
            // From the edge that one drives along inward: those that go forward come first.
            let is_forward = index < lanes.forward;
            let left_m = self.side * (index as f64 + 0.5 - total as f64 / 2.0) * width_m;
            let shifted = shifted(&known, left_m);
            let id = LaneId {
                layer: 1,
                road,
                lane: u32::try_from(index + 1).unwrap_or(u32::MAX),
            };
            let mut points: Vec<(&'a str, [f64; 2])> = shifted;
            if !is_forward {
                points.reverse();
            }
            let mut vertices = vec![];
            for (number, &(node, place_m)) in (1u32..).zip(&points) {
                vertices.push(Vertex {
                    id: number,
                    place_m,
                });
                self.places.entry(node).or_default().push(PointId {
                    lane: id,
                    point: number,
                });
            }
            let line = lanes.is_marked.then(|| BETWEEN_LANES.to_owned());
            self.map.lanes.push(Lane {
                id,
                road_name: lanes.name.clone(),
                kind: lanes.kind,
                width_m: lanes.width_m,
                left_marking: line,
                right_marking: None,
                curve: Curve::Points(vertices),
                is_circular: lanes.is_circular,
            });
        }
    }

    /// A roundabout that is only a point has no size.
    fn mini_roundabouts(&mut self, root: &Node<'_, '_>) {
        for node in root.children().filter(|node| node.has_tag_name("node")) {
            if tag(&node, "highway") == Some("mini_roundabout") {
                self.skip("mini roundabout that is only a point");
            }
        }
    }

    /// Where a lane ends, one may go on along every other lane that has a point there and is not
    /// ended by it; onto and off a circle anywhere.
    fn connect(&mut self) {
        let lanes: BTreeMap<_, _> = self.map.lanes.iter().map(|lane| (lane.id, lane)).collect();
        let lane_end = |point: &PointId| {
            let lane = lanes.get(&point.lane)?;
            let last = lane.curve.vertices().len();
            Some((
                point.point == 1,
                point.point as usize == last,
                lane.is_circular,
            ))
        };
        let mut connectors = vec![];
        /// More is no crossing.
        const MOST_LANES: usize = 24;
        let crossings = self.places.values();
        for points in crossings.filter(|points| (2..=MOST_LANES).contains(&points.len())) {
            let ends: Vec<_> = points
                .iter()
                .filter_map(|point| Some((point, lane_end(point)?)))
                .collect();
            for (from, (_, is_last, from_circular)) in &ends {
                for (to, (is_first, _, to_circular)) in &ends {
                    let leaves = *is_last || *from_circular;
                    let joins = *is_first || *to_circular;
                    if from.lane.road != to.lane.road && leaves && joins {
                        connectors.push(Connector {
                            from: **from,
                            to: **to,
                        });
                    }
                }
            }
        }
        self.map.connectors = connectors;
    }
}

/// How far a chain of places turns to the left.
fn turned_rad(known: &[(&str, [f64; 2])]) -> f64 {
    let steps = known.windows(2).map(|pair| {
        let [(_, [ax, ay]), (_, [bx, by])] = [pair[0], pair[1]];
        libm::atan2(by - ay, bx - ax)
    });
    let headings_rad: Vec<f64> = steps.collect();
    let turns = headings_rad.windows(2);
    turns.map(|pair| wrapped_rad(pair[1] - pair[0])).sum()
}

/// The way beside its middle line, with every node's name.
fn shifted<'a>(known: &[(&'a str, [f64; 2])], left_m: f64) -> Vec<(&'a str, [f64; 2])> {
    if left_m == 0.0 {
        return known.to_vec();
    }
    let distinct = known.chunk_by(|(_, a), (_, b)| {
        super::polyline::distance_m(*a, *b) <= super::polyline::SAME_POINT_M
    });
    let distinct: Vec<_> = distinct
        .filter_map(|chunk| chunk.first().copied())
        .collect();
    let middle = Polyline::through(distinct.iter().map(|(_, place_m)| *place_m));
    let is_loop = distinct.first().map(|(id, _)| id) == distinct.last().map(|(id, _)| id);
    let beside = middle.parallel(left_m, is_loop);
    distinct.iter().map(|(id, _)| *id).zip(beside).collect()
}

#[cfg(test)]
mod tests;
