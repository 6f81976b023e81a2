//! Reading scenarios.

use super::lines::{Line, Lines};
use super::values::{connector, interval, is_clockwise, junction, kind, length, number, whole};
use crate::ego::geodesy::Geodetic;
use crate::roadmap::curve::Vertex;
use crate::roadmap::{
    BETWEEN_LANES, Curve, DeclaredCircle, DeclaredRoundabout, Lane, LaneId, LaneKind, MapError,
    Origin, Roadmap,
};

/// The roads of a scenario. What is no road is passed over and counted by name.
///
/// # Errors
/// [`MapError`] with line and column where the file is no scenario, where a number, a point or an
/// end is missing, and where an address is used twice.
pub fn read(text: &str) -> Result<Roadmap, MapError> {
    let mut reader = Reader {
        lines: Lines::of(text.trim_start_matches('\u{feff}'))?,
        map: Roadmap::default(),
    };
    reader.scenario()?;
    Ok(reader.map)
}

struct Reader<'a> {
    lines: Lines<'a>,
    map: Roadmap,
}

type Read<T> = Result<T, MapError>;

impl<'a> Reader<'a> {
    fn skip(&mut self, name: &str) {
        // What is counted by name comes from the file: no more names than a person reads.
        const MOST_NAMES: usize = 100;
        if self.map.skipped.len() < MOST_NAMES || self.map.skipped.contains_key(name) {
            *self.map.skipped.entry(name.to_owned()).or_default() += 1;
        }
    }

    fn scenario(&mut self) -> Read<()> {
        let first = self.lines.next("SCENARIO")?;
        if first.key != "SCENARIO" {
            return Err(first.error("no scenario: the first line is not SCENARIO"));
        }
        self.map.name = first.rest.to_owned();
        let mut place: Option<[(f64, Line<'a>); 2]> = None;
        let mut rotation_rad = 0.0;
        loop {
            let line = self.lines.next("ENDSCENARIO")?;
            match line.key {
                "VERSION" | "DATE" | "ORIGINCOORDINATESYSTEM" | "WGS84" => {}
                "ORIGIN" => place = Some(self.located_vertex()?),
                "ROTATION" => rotation_rad = number(&line)?,
                "GROUND" => self.ground()?,
                "LAYER" => self.layer()?,
                "ROUNDABOUT" => self.roundabout()?,
                "ENDSCENARIO" => break,
                key => self.skip(key),
            }
        }
        if let Some(place) = place {
            self.map.origin = Some(origin(place, rotation_rad)?);
        }
        Ok(())
    }

    /// Pictures and shapes of the surroundings.
    fn ground(&mut self) -> Read<()> {
        loop {
            let line = self.lines.next("ENDGROUND")?;
            match line.key {
                "ENDGROUND" => return Ok(()),
                "AERIALIMAGE" | "HEIGHTIMAGE" | "POLYGON" | "CYLINDER" | "COMPLEXMODEL" => {
                    self.skip(line.key);
                }
                _ => {}
            }
        }
    }

    fn layer(&mut self) -> Read<()> {
        let mut layer = 0;
        loop {
            let line = self.lines.next("ENDLAYER")?;
            match line.key {
                "LAYERID" => layer = whole(&line)?,
                "HEIGHT" => {}
                "ROAD" => self.road(layer)?,
                "ZONE" => self.zone()?,
                "ROUNDABOUT" => self.roundabout()?,
                "ENDLAYER" => return Ok(()),
                key => self.skip(key),
            }
        }
    }

    fn zone(&mut self) -> Read<()> {
        self.skip("ZONE");
        while self.lines.next("ENDZONE")?.key != "ENDZONE" {}
        Ok(())
    }

    fn road(&mut self, layer: u32) -> Read<()> {
        let (mut road, mut name) = (0, String::new());
        loop {
            let line = self.lines.next("ENDROAD")?;
            match line.key {
                "ROADID" => road = whole(&line)?,
                "ROADNAME" => name = line.rest.to_owned(),
                "LANE" => self.lane(line, layer, road, &name)?,
                "ENDROAD" => return Ok(()),
                key => self.skip(key),
            }
        }
    }

    fn lane(&mut self, begin: Line<'a>, layer: u32, road: u32, name: &str) -> Read<()> {
        let mut lane = 0;
        let mut found = Lane {
            id: LaneId { layer, road, lane },
            road_name: name.to_owned(),
            kind: LaneKind::default(),
            width_m: None,
            left_marking: None,
            right_marking: None,
            curve: Curve::Points(vec![]),
            is_circular: is_roundabout_name(name),
        };
        let mut has_curve = false;
        loop {
            let line = self.lines.next("ENDLANE")?;
            match line.key {
                "LANEID" => lane = whole(&line)?,
                "LANEWIDTH" => found.width_m = Some(length(&line)?),
                "LANETYPE" => found.kind = kind(&line)?,
                "LEFTLANEMARKING" => found.left_marking = Some(line.rest.to_owned()),
                "RIGHTLANEMARKING" => found.right_marking = Some(line.rest.to_owned()),
                "(" => {
                    let connector = connector(&line)?;
                    self.map.connectors.push(connector);
                }
                "TRAFFICLIGHT" | "TRAFFICSIGN" => self.traffic_control(&line),
                "POINTMODEL" => {
                    found.curve = self.points()?;
                    has_curve = true;
                }
                "FUNCTIONMODEL" => {
                    found.curve = self.function()?;
                    has_curve = true;
                }
                "ENDLANE" => break,
                key => self.skip(key),
            }
        }
        found.id.lane = lane;
        if !has_curve {
            return Err(begin.error(format!("lane {} has no model", found.id)));
        }
        self.map.lanes.push(found);
        Ok(())
    }

    /// Up to the lane's model: a sign has a place and a shape of its own.
    fn traffic_control(&mut self, line: &Line<'_>) {
        self.skip(line.key);
        let is_lanes_own = |key: &str| {
            matches!(
                key,
                "POINTMODEL" | "FUNCTIONMODEL" | "ENDLANE" | "TRAFFICLIGHT" | "TRAFFICSIGN" | "("
            )
        };
        while let Some(line) = self.lines.peek()
            && !is_lanes_own(line.key)
        {
            self.lines.next_if(line.key);
        }
    }

    fn points(&mut self) -> Read<Curve> {
        let mut vertices = vec![];
        loop {
            let line = self.lines.next("ENDPOINTMODEL")?;
            match line.key {
                "ID" => vertices.push(self.vertex_of(whole(&line)?)?),
                "ENDPOINTMODEL" if vertices.is_empty() => {
                    return Err(line.error("a lane without points"));
                }
                "ENDPOINTMODEL" => return Ok(Curve::Points(vertices)),
                key => return Err(line.error(format!("ID or ENDPOINTMODEL wanted, {key} found"))),
            }
        }
    }

    fn function(&mut self) -> Read<Curve> {
        let kind = self.lines.next("the function")?;
        let mut fields = Fields::default();
        loop {
            let line = self.lines.next("ENDFUNCTIONMODEL")?;
            match line.key {
                "START" => fields.start = Some(self.identified_vertex()?),
                "END" => fields.end = Some(self.identified_vertex()?),
                "RADIUS" => fields.radius_m = Some(length(&line)?),
                "[" => fields.interval_rad = Some(interval(&line)?),
                "ROTZ" => fields.heading_rad = Some(number(&line)?),
                "K" => fields.curvature_per_m = Some(number(&line)?),
                "DK" => fields.curvature_growth_per_m2 = Some(number(&line)?),
                "ENDFUNCTIONMODEL" => break,
                key => return Err(line.error(format!("{key} is not a part of {}", kind.key))),
            }
        }
        fields.curve(&kind)
    }

    fn identified_vertex(&mut self) -> Read<Vertex> {
        let line = self.lines.next("ID")?;
        if line.key != "ID" {
            return Err(line.error(format!("ID wanted, {} found", line.key)));
        }
        self.vertex_of(whole(&line)?)
    }

    fn vertex_of(&mut self, id: u32) -> Read<Vertex> {
        Ok(Vertex {
            id,
            place_m: self.vertex()?,
        })
    }

    fn vertex(&mut self) -> Read<[f64; 2]> {
        Ok(self.located_vertex()?.map(|(metres, _)| metres))
    }

    fn located_vertex(&mut self) -> Read<[(f64, Line<'a>); 2]> {
        let line = self.lines.next("VERTEX2")?;
        if line.key != "VERTEX2" {
            return Err(line.error(format!("VERTEX2 wanted, {} found", line.key)));
        }
        self.coordinates()
    }

    fn coordinates(&mut self) -> Read<[(f64, Line<'a>); 2]> {
        let mut read = |key: &str| {
            let line = self.lines.next(key)?;
            if line.key != key {
                return Err(line.error(format!("{key} wanted, {} found", line.key)));
            }
            let value = number(&line)?;
            if value.abs() > super::values::FARTHEST_M {
                return Err(line.rest_error(format!("{value} is out of any map")));
            }
            Ok((value, line))
        };
        Ok([read("X")?, read("Y")?])
    }

    fn roundabout(&mut self) -> Read<()> {
        let mut found = DeclaredRoundabout {
            id: 0,
            name: String::new(),
            centre_m: [0.0; 2],
            is_clockwise: None,
            circles: vec![],
            junctions: vec![],
        };
        loop {
            let line = self.lines.next("ENDROUNDABOUT")?;
            match line.key {
                "ROUNDABOUTID" => found.id = whole(&line)?,
                "ROUNDABOUTNAME" => found.name = line.rest.to_owned(),
                "VERTEX2" => found.centre_m = self.coordinates()?.map(|(metres, _)| metres),
                "DIRECTION" => found.is_clockwise = Some(is_clockwise(&line)?),
                "CIRCLE" => found.circles.push(self.circle(&line)?),
                "ENTRY" | "EXIT" => found.junctions.push(junction(&line)?),
                "ENDROUNDABOUT" if found.circles.is_empty() => {
                    return Err(line.error("a roundabout without a CIRCLE"));
                }
                "ENDROUNDABOUT" => break,
                key => {
                    return Err(line.error(format!("{key} is not a part of ROUNDABOUT")));
                }
            }
        }
        self.map.declared.push(found);
        Ok(())
    }

    fn circle(&mut self, begin: &Line<'_>) -> Read<DeclaredCircle> {
        let mut found = DeclaredCircle {
            id: 0,
            kind: LaneKind::default(),
            inner_m: 0.0,
            outer_m: 0.0,
            is_marked: false,
        };
        loop {
            let line = self.lines.next("ENDCIRCLE")?;
            match line.key {
                "CIRCLEID" => found.id = whole(&line)?,
                "LANETYPE" => found.kind = kind(&line)?,
                "INNERRADIUS" => found.inner_m = length(&line)?,
                "OUTERRADIUS" => found.outer_m = length(&line)?,
                "MARKING" => found.is_marked = line.rest == BETWEEN_LANES,
                "ENDCIRCLE" if found.outer_m <= found.inner_m => {
                    return Err(begin.error("OUTERRADIUS is not above INNERRADIUS"));
                }
                "ENDCIRCLE" => return Ok(found),
                key => return Err(line.error(format!("{key} is not a part of CIRCLE"))),
            }
        }
    }
}

#[derive(Default)]
struct Fields {
    start: Option<Vertex>,
    end: Option<Vertex>,
    radius_m: Option<f64>,
    interval_rad: Option<[f64; 2]>,
    heading_rad: Option<f64>,
    curvature_per_m: Option<f64>,
    curvature_growth_per_m2: Option<f64>,
}

impl Fields {
    fn curve(self, kind: &Line<'_>) -> Read<Curve> {
        let missing = |what: &str| kind.error(format!("{} without {what}", kind.key));
        let ends = [
            self.start.ok_or_else(|| missing("START"))?,
            self.end.ok_or_else(|| missing("END"))?,
        ];
        let heading_rad = self.heading_rad.ok_or_else(|| missing("ROTZ"));
        match kind.key {
            "STRAIGHTLINE" => Ok(Curve::Line { ends }),
            "ARC" => Ok(Curve::Arc {
                radius_m: self.radius_m.ok_or_else(|| missing("RADIUS"))?,
                interval_rad: self.interval_rad.ok_or_else(|| missing("an interval"))?,
                ends,
                heading_rad: heading_rad?,
            }),
            "CLOTHOID" => Ok(Curve::Clothoid {
                curvature_growth_per_m2: self
                    .curvature_growth_per_m2
                    .ok_or_else(|| missing("DK"))?,
                curvature_per_m: self.curvature_per_m.ok_or_else(|| missing("K"))?,
                ends,
                heading_rad: heading_rad?,
            }),
            key => Err(kind.error(format!("unknown function {key}"))),
        }
    }
}

/// The thesis' files give the latitude first, others the longitude: what cannot be a latitude is
/// none.
fn origin([first, second]: [(f64, Line<'_>); 2], rotation_rad: f64) -> Read<Origin> {
    let is_longitude_first = first.0.abs() > 90.0;
    let (latitude_deg, longitude_deg) = if is_longitude_first {
        (second.0, first.0)
    } else {
        (first.0, second.0)
    };
    let place = Geodetic {
        latitude_deg,
        longitude_deg,
        altitude_m: 0.0,
    };
    if !place.is_valid() {
        return Err(first.1.rest_error("no place on earth"));
    }
    Ok(Origin {
        place,
        rotation_rad,
        is_longitude_first,
    })
}

/// Whether a road is called a roundabout.
fn is_roundabout_name(name: &str) -> bool {
    name.to_lowercase().contains("roundabout") || name.to_lowercase().contains("kreisverkehr")
}
