use std::f64::consts::FRAC_PI_2;

use super::*;
use crate::roadmap::{Curve, LaneKind, Roadmap};

const SMALL: &str = "\
SCENARIO Small
VERSION v1.0
DATE July-27-2012
ORIGINCOORDINATESYSTEM
WGS84
ORIGIN
VERTEX2
X -98.607031
Y 29.445996
ROTATION 0
GROUND G
SURROUNDING
SHAPENAME Box
POLYGON
HEIGHT 1
COLOR
VERTEX3
X 1
Y 1
Z 1
VERTEX2
X 21.5
Y 44.4
ENDGROUND
LAYER One
LAYERID 1
HEIGHT None
ROAD
ROADID 7
ROADNAME In the  woods
LANE
LANEID 2
LANEWIDTH 4.0
/* kreisel: LANETYPE bikeway */ /* and a remark */
LEFTLANEMARKING broken_white
(1.7.2.2) -> (1.7.3.1)
TRAFFICSIGN
VALUE stopline
NAME StopLine
ID 1
VERTEX2
X 1.75
Y 40.5
SHAPENAME Line
POLYGON
HEIGHT 1
FUNCTIONMODEL
ARC
RADIUS 16.2
[ 0 1.5707963267948966 ]
START
ID 1
VERTEX2
X 0
Y 63.5
END
ID 2
VERTEX2
X -16.2
Y 79.7
ROTZ 1.5707963267948966
ENDFUNCTIONMODEL
ENDLANE
LANE
LANEID 3
POINTMODEL
ID 1
VERTEX2
X -5.8
Y -28.4
ID 2
VERTEX2
X -5.8
Y -28.4
ID 3
VERTEX2
X 1e1
Y 0
ENDPOINTMODEL
ENDLANE
ENDROAD
ZONE
ZONEID 1
PERIMETER
ID 1
VERTEX2
X 0
Y 0
ENDZONE
ENDLAYER
/* kreisel:
ROUNDABOUT
ROUNDABOUTID 1
ROUNDABOUTNAME West
VERTEX2
X -218.5
Y 78.2
CIRCLE
CIRCLEID 1
LANETYPE road
INNERRADIUS 9
OUTERRADIUS 13
ENDCIRCLE
ENTRY (1.7.2.2) -> 1
EXIT 1 -> (1.7.3.1)
ENDROUNDABOUT
*/
ENDSCENARIO
";

#[test]
fn roads_are_read_and_the_rest_is_counted() {
    let map = read(SMALL).unwrap();
    assert_eq!(map.name, "Small");
    let origin = map.origin.unwrap();
    assert!(origin.is_longitude_first);
    assert_eq!(origin.place.latitude_deg, 29.445996);
    let [bend, straight] = &map.lanes[..] else {
        panic!("{} lanes", map.lanes.len());
    };
    assert_eq!(
        (bend.id.to_string(), bend.kind),
        ("1.7.2".to_owned(), LaneKind::Bikeway)
    );
    assert_eq!(bend.road_name, "In the  woods");
    assert_eq!(bend.width_m, Some(4.0));
    assert!((bend.curve.polyline().length_m() - 16.2 * FRAC_PI_2).abs() < 0.05);
    assert_eq!(straight.width_m, None);
    assert!(matches!(&straight.curve, Curve::Points(vertices) if vertices.len() == 3));
    assert_eq!(map.repeated_points(), 1);
    assert_eq!(map.connectors.len(), 1);
    assert_eq!(map.declared[0].circles[0].outer_m, 13.0);
    assert!(map.declared[0].junctions[0].is_entry);
    let skipped: Vec<_> = map.skipped.keys().map(String::as_str).collect();
    assert_eq!(skipped, ["POLYGON", "TRAFFICSIGN", "ZONE"]);
}

#[test]
fn what_is_written_is_read_as_the_same_map() {
    let map = Roadmap {
        skipped: Default::default(),
        ..read(SMALL).unwrap()
    };
    let again = read(&write(&map)).unwrap();
    // Blanks within a name are not kept.
    assert_eq!(again.lanes[0].road_name, "In the woods");
    assert_eq!(again.lanes[0].curve, map.lanes[0].curve);
    assert_eq!(again.lanes[1].curve, map.lanes[1].curve);
    assert_eq!(
        (again.connectors, again.declared),
        (map.connectors, map.declared)
    );
    assert_eq!((again.origin, again.skipped), (map.origin, map.skipped));
}

/// OpenDaVINCI's grammar knows nothing of ours.
#[test]
fn what_we_add_stands_in_comments() {
    let text = write(&read(SMALL).unwrap());
    let mut outside = String::new();
    let mut rest = text.as_str();
    while let Some((before, behind)) = rest.split_once("/*") {
        outside.push_str(before);
        rest = behind.split_once("*/").unwrap().1;
    }
    outside.push_str(rest);
    assert!(
        !outside.contains("LANETYPE") && !outside.contains("ROUNDABOUT"),
        "{outside}"
    );
}

#[track_caller]
fn refused(from: &str, to: &str, expected: &str) {
    let text = SMALL.replacen(from, to, 1);
    assert_ne!(text, SMALL, "nothing was replaced");
    assert_eq!(read(&text).unwrap_err().to_string(), expected);
}

#[test]
fn errors_name_line_and_column() {
    refused(
        "SCENARIO",
        "SCENERY",
        "line 1, column 1: no scenario: the first line is not SCENARIO",
    );
    refused(
        "X -5.8",
        "X  -5,8",
        "line 69, column 4: \"-5,8\" is no number",
    );
    refused("X -5.8", "X inf", "line 69, column 3: \"inf\" is no number");
    refused(
        "LANEID 2",
        "LANEID -2",
        "line 32, column 8: \"-2\" is no whole number",
    );
    refused("RADIUS 16.2\n", "", "line 48, column 1: ARC without RADIUS");
    refused(
        "ENDSCENARIO",
        "",
        "line 108, column 1: the file ends, ENDSCENARIO is missing",
    );
    refused(
        "bikeway */",
        "bikeway",
        "line 34, column 22: \"bikeway /* and a remark\" is neither road nor bikeway nor pavement",
    );
    refused(
        "ENDROUNDABOUT\n*/",
        "ENDROUNDABOUT",
        "line 91, column 1: this comment does not end",
    );
    refused(
        "(1.7.2.2) ->",
        "(1.7.2.2)",
        "line 36, column 1: a connector is written (layer.road.lane.point) -> (layer.road.lane.point)",
    );
    refused(
        "OUTERRADIUS 13",
        "OUTERRADIUS 9",
        "line 98, column 1: OUTERRADIUS is not above INNERRADIUS",
    );
}
