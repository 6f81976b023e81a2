//! Ways as chains of points.

use crate::ego::wrapped_rad;

/// A way from point to point, without repeated ones.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Polyline {
    points_m: Vec<[f64; 2]>,
    /// Way from the first point to each.
    along_m: Vec<f64>,
    /// Lowest and highest coordinates.
    extent_m: [[f64; 2]; 2],
}

/// The place of a polyline that is nearest to a point.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Station {
    /// From its beginning.
    pub along_m: f64,
    /// To the left of it positive; where the point is before the beginning or behind the end, to
    /// the left of the prolonged first or last piece.
    pub offset_m: f64,
    /// From the point to the polyline.
    pub distance_m: f64,
    /// Direction of the polyline there, counter-clockwise from east.
    pub heading_rad: f64,
}

/// Points nearer to each other than this are one.
pub(super) const SAME_POINT_M: f64 = 1e-3;

impl Polyline {
    /// Through these points; repeated ones are left out.
    pub fn through(points_m: impl IntoIterator<Item = [f64; 2]>) -> Self {
        let mut way = Self {
            extent_m: [[f64::INFINITY; 2], [f64::NEG_INFINITY; 2]],
            ..Self::default()
        };
        for point_m in points_m {
            let [low_m, high_m] = way.extent_m;
            way.extent_m = [
                [low_m[0].min(point_m[0]), low_m[1].min(point_m[1])],
                [high_m[0].max(point_m[0]), high_m[1].max(point_m[1])],
            ];
            let Some(&last_m) = way.points_m.last() else {
                way.points_m.push(point_m);
                way.along_m.push(0.0);
                continue;
            };
            let step_m = distance_m(last_m, point_m);
            if step_m > SAME_POINT_M {
                way.along_m.push(way.length_m() + step_m);
                way.points_m.push(point_m);
            }
        }
        way
    }

    /// Whether the box around it comes so near to a place.
    pub(crate) fn comes_within(&self, at_m: [f64; 2], reach_m: f64) -> bool {
        let [low_m, high_m] = self.extent_m;
        (0..2).all(|axis| low_m[axis] - reach_m < at_m[axis] && at_m[axis] < high_m[axis] + reach_m)
    }

    /// Its points.
    pub fn points_m(&self) -> &[[f64; 2]] {
        &self.points_m
    }

    /// From its beginning to its end.
    pub fn length_m(&self) -> f64 {
        self.along_m.last().copied().unwrap_or(0.0)
    }

    /// Driven the other way round.
    pub fn reversed(&self) -> Self {
        Self::through(self.points_m.iter().rev().copied())
    }

    /// Beside it, to the left where `left_m` is positive. Corners are cut along the bisector.
    pub fn beside(&self, left_m: f64) -> Self {
        Self::through(self.parallel(left_m, false))
    }

    /// For each point the one beside it; where it `is_loop`, the ends are a corner like others.
    pub(super) fn parallel(&self, left_m: f64, is_loop: bool) -> Vec<[f64; 2]> {
        let count = self.points_m.len();
        let last = count.saturating_sub(2);
        let beside = |index: usize| {
            let [before, after] = match index {
                0 if is_loop => [last, 0],
                _ if is_loop && index == count - 1 => [last, 0],
                _ => [index.saturating_sub(1), index.min(last)],
            };
            let [before, after] = [before, after].map(|piece| self.direction(piece));
            let [x, y] = [before[0] + after[0], before[1] + after[1]];
            let norm = libm::hypot(x, y).max(0.1);
            // As far as where the lines beside both pieces meet, but no more than twice.
            let away_m = left_m * (2.0 / norm).min(2.0);
            let [px, py] = self.points_m[index];
            [px - y / norm * away_m, py + x / norm * away_m]
        };
        (0..count).map(beside).collect()
    }

    /// The piece between two ways from the beginning.
    pub fn between(&self, from_m: f64, to_m: f64) -> Self {
        let inner = self.along_m.iter().zip(&self.points_m);
        let inner = inner.filter(|&(&along_m, _)| along_m > from_m && along_m < to_m);
        let ends = [self.at(from_m), self.at(to_m)].map(|(place_m, _)| place_m);
        let inner = inner.map(|(_, &point_m)| point_m);
        Self::through(std::iter::once(ends[0]).chain(inner).chain([ends[1]]))
    }

    /// Where it is after some way, and its direction there; before the beginning and behind the
    /// end, at the end itself.
    pub fn at(&self, along_m: f64) -> ([f64; 2], f64) {
        let after = self.along_m.partition_point(|&m| m <= along_m);
        let piece = after
            .saturating_sub(1)
            .min(self.points_m.len().saturating_sub(2));
        let Some(&[x, y]) = self.points_m.get(piece) else {
            return ([0.0; 2], 0.0);
        };
        let [dx, dy] = self.direction(piece);
        let on_m = (along_m.clamp(0.0, self.length_m()) - self.along_m[piece]).max(0.0);
        ([x + on_m * dx, y + on_m * dy], libm::atan2(dy, dx))
    }

    /// How much it bends there, to the left positive, by the directions a little before and after.
    pub fn curvature_per_m(&self, along_m: f64) -> f64 {
        const STEP_M: f64 = 2.0;
        let [(_, before_rad), (_, after_rad)] =
            [-STEP_M, STEP_M].map(|step_m| self.at(along_m + step_m));
        wrapped_rad(after_rad - before_rad) / (2.0 * STEP_M)
    }

    /// The place nearest to a point; nothing if there are not two points.
    pub fn nearest(&self, [x, y]: [f64; 2]) -> Option<Station> {
        let pieces = self.points_m.len().checked_sub(1)?;
        let beside = |piece: usize| {
            let [px, py] = self.points_m[piece];
            let [dx, dy] = self.direction(piece);
            let length_m = self.along_m[piece + 1] - self.along_m[piece];
            let on_m = ((x - px) * dx + (y - py) * dy).clamp(0.0, length_m);
            let [off_x, off_y] = [x - px - on_m * dx, y - py - on_m * dy];
            (off_x * off_x + off_y * off_y, piece, on_m)
        };
        let (square_m2, piece, on_m) =
            (0..pieces).map(beside).min_by(|a, b| a.0.total_cmp(&b.0))?;
        let [px, py] = self.points_m[piece];
        let [dx, dy] = self.direction(piece);
        Some(Station {
            along_m: self.along_m[piece] + on_m,
            offset_m: (y - py) * dx - (x - px) * dy,
            distance_m: libm::sqrt(square_m2),
            heading_rad: libm::atan2(dy, dx),
        })
    }

    /// Unit vector of a piece; of the only point, east.
    fn direction(&self, piece: usize) -> [f64; 2] {
        let (Some(&[ax, ay]), Some(&[bx, by])) =
            (self.points_m.get(piece), self.points_m.get(piece + 1))
        else {
            return [1.0, 0.0];
        };
        let length_m = self.along_m[piece + 1] - self.along_m[piece];
        [(bx - ax) / length_m, (by - ay) / length_m]
    }
}

pub(super) fn distance_m([ax, ay]: [f64; 2], [bx, by]: [f64; 2]) -> f64 {
    libm::hypot(bx - ax, by - ay)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_place_is_found_with_its_side_and_its_way() {
        let way = Polyline::through([[0.0, 0.0], [10.0, 0.0], [10.0, 0.0], [10.0, 10.0]]);
        let station = way.nearest([4.0, 1.0]).unwrap();
        assert_eq!((station.along_m, station.offset_m), (4.0, 1.0));
        let station = way.nearest([11.0, 5.0]).unwrap();
        assert_eq!((station.along_m, station.offset_m), (15.0, -1.0));
        assert_eq!(way.at(15.0).0, [10.0, 5.0]);
        assert_eq!(way.length_m(), 20.0);
    }

    #[test]
    fn the_way_beside_keeps_its_distance_round_a_corner() {
        let way = Polyline::through([[0.0, 0.0], [10.0, 0.0], [10.0, 10.0]]).beside(2.0);
        for (point_m, expected_m) in
            way.points_m()
                .iter()
                .zip([[0.0, 2.0], [8.0, 2.0], [8.0, 10.0]])
        {
            assert!(distance_m(*point_m, expected_m) < 1e-9, "{way:?}");
        }
    }

    #[test]
    fn a_single_point_is_no_way() {
        assert_eq!(
            Polyline::through([[1.0, 2.0], [1.0, 2.0]]).nearest([0.0; 2]),
            None
        );
        assert_eq!(Polyline::default().at(3.0).0, [0.0; 2]);
    }
}
