//! A roundabout as a picture.

use std::fmt::Write as _;

use super::roundabout::{Access, Roundabout};
use super::{Elements, LaneKind, Roadmap};

/// Around the outermost ring.
const MARGIN_M: f64 = 25.0;
/// Between two pictures.
const APART_M: f64 = 6.0;
/// Of a line.
const LINE_M: f64 = 0.15;

const fn colour(kind: LaneKind) -> &'static str {
    match kind {
        LaneKind::Road => "#5b6470",
        LaneKind::Bikeway => "#a8554e",
        LaneKind::Pavement => "#b9b4a6",
    }
}

/// Roundabouts beside each other, from above, north up, with lanes to scale, names, diameters and
/// a scale of 10 m. A drawing in SVG 1.1 without any script or outside reference.
pub fn svg(map: &Roadmap, roundabouts: &[(Roundabout, Elements)]) -> String {
    let half_m = roundabouts
        .iter()
        .flat_map(|(one, _)| one.rings.iter().map(|ring| ring.outer_m()))
        .fold(10.0, f64::max)
        + MARGIN_M;
    let pitch_m = 2.0 * half_m + APART_M;
    let width_m = pitch_m * roundabouts.len().max(1) as f64 - APART_M;
    let mut out = format!(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {width_m:.2} {:.2}\" \
         width=\"{:.0}\" font-family=\"sans-serif\" font-size=\"2.4\">\n<title>{}</title>\n",
        2.0 * half_m,
        6.0 * width_m,
        escaped(&map.name),
    );
    for (index, (roundabout, elements)) in roundabouts.iter().enumerate() {
        let left_m = index as f64 * pitch_m;
        let _ = writeln!(
            out,
            "<svg x=\"{left_m:.2}\" width=\"{0:.2}\" height=\"{0:.2}\" viewBox=\"{1:.2} {1:.2} {0:.2} {0:.2}\">\n\
             <rect x=\"{1:.2}\" y=\"{1:.2}\" width=\"{0:.2}\" height=\"{0:.2}\" fill=\"#e3ead8\"/>",
            2.0 * half_m,
            -half_m,
        );
        one(&mut out, roundabout, elements, half_m);
        out.push_str("</svg>\n");
    }
    out.push_str("</svg>\n");
    out
}

fn one(out: &mut String, roundabout: &Roundabout, elements: &Elements, half_m: f64) {
    let [x, y] = roundabout.centre_m();
    for arm in &roundabout.arms {
        for access in arm.entries.iter().chain(&arm.exits) {
            lane(out, access, [x, y]);
        }
    }
    for ring in &roundabout.rings {
        let [cx, cy] = ring.circle.centre_m;
        let _ = writeln!(
            out,
            "<circle cx=\"{:.2}\" cy=\"{:.2}\" r=\"{:.2}\" fill=\"none\" stroke=\"{}\" stroke-width=\"{:.2}\"/>",
            cx - x,
            y - cy,
            ring.circle.radius_m,
            colour(ring.kind),
            ring.width_m,
        );
        if ring.kind == LaneKind::Road {
            for radius_m in [ring.inner_m(), ring.outer_m()] {
                let _ = writeln!(
                    out,
                    "<circle cx=\"{:.2}\" cy=\"{:.2}\" r=\"{:.2}\" fill=\"none\" stroke=\"#fff\" stroke-width=\"{LINE_M}\"/>",
                    cx - x,
                    y - cy,
                    radius_m.max(0.0),
                );
            }
        }
    }
    let name = if roundabout.name.is_empty() {
        "roundabout"
    } else {
        &roundabout.name
    };
    let _ = writeln!(
        out,
        "<text x=\"{0:.2}\" y=\"{0:.2}\" dx=\"2\" dy=\"4\">{1}: {2}, D {3:.1} m, D1 {4:.1} m</text>",
        -half_m,
        escaped(name),
        elements.kind.name(),
        elements.outer_diameter_m,
        elements.inner_diameter_m,
    );
    // Scale, and north.
    let _ = writeln!(
        out,
        "<path d=\"M{0:.2} {1:.2}h10\" stroke=\"#222\" stroke-width=\"0.4\"/>\
         <text x=\"{0:.2}\" y=\"{1:.2}\" dy=\"-1\">10 m</text>\
         <path d=\"M{2:.2} {1:.2}v-8m-1.5 3l1.5 -3l1.5 3\" fill=\"none\" stroke=\"#222\" stroke-width=\"0.4\"/>\
         <text x=\"{2:.2}\" y=\"{1:.2}\" dx=\"1.5\">N</text>",
        2.0 - half_m,
        half_m - 2.0,
        half_m - 6.0,
    );
}

fn lane(out: &mut String, access: &Access, [x, y]: [f64; 2]) {
    let mut path = String::new();
    for (index, [px, py]) in access.way.points_m().iter().enumerate() {
        let command = if index == 0 { 'M' } else { 'L' };
        let _ = write!(path, "{command}{:.2} {:.2}", px - x, y - py);
    }
    let _ = writeln!(
        out,
        "<path d=\"{path}\" fill=\"none\" stroke=\"{}\" stroke-width=\"{:.2}\"/>\
         <path d=\"{path}\" fill=\"none\" stroke=\"#fff\" stroke-width=\"{LINE_M}\" stroke-dasharray=\"1 1\"/>",
        colour(access.kind),
        access.width_m,
    );
}

/// For XML.
fn escaped(text: &str) -> String {
    let mut out = String::new();
    for letter in text.chars() {
        match letter {
            '&' => out.push_str("&amp;"),
            '<' => out.push_str("&lt;"),
            '>' => out.push_str("&gt;"),
            '"' => out.push_str("&quot;"),
            control if control.is_control() => out.push(' '),
            other => out.push(other),
        }
    }
    out
}
