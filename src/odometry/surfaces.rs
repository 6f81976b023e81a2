//! The map of surfaces: in each cell of space those that pass through it.
//!
//! A cell keeps no points. It keeps the sum of squared distances to the tangent planes of all the
//! returns in it, which is a quadric (Garland, Heckbert 1997, section 4): of a plane it knows the
//! distance, of a corner that to each of its walls.

use nalgebra::{Matrix3, Vector3};

use super::cells::{CELL_M, Cells, cell_of};

/// Sets of cells: 2 MB.
const SETS: usize = 1 << 13;
/// Returns of a cell after which it learns no more: what was seen first is nearest to where the
/// frame began, and a map that stays as it is drifts least.
const MOST: f32 = 30.0;
/// Mean squared cosine between the normals of a cell and the one that is asked for.
const LEAST_ALIKE: f64 = 0.4;

/// Surfaces in the odometry frame.
#[derive(Debug, Clone)]
pub(super) struct Surfaces {
    cells: Cells<Quadric>,
}

/// The surfaces of a cell.
#[derive(Debug, Clone, Copy, Default)]
struct Quadric {
    /// Sum of the outer products of normals: xx, xy, xz, yy, yz, zz.
    products: [f32; 6],
    /// Sum of the normals times the distance of their planes from the cell's middle.
    offsets: [f32; 3],
    /// Returns.
    count: f32,
}

/// How a surface of the map lies to a point.
#[derive(Debug, Clone, Copy)]
pub(super) struct Nearest {
    /// Direction of the surface.
    pub(super) normal: Vector3<f64>,
    /// How far the point is before it.
    pub(super) off_m: f64,
}

impl Surfaces {
    pub(super) fn new() -> Self {
        Self {
            cells: Cells::new(SETS),
        }
    }

    pub(super) fn clear(&mut self) {
        self.cells.clear();
    }

    pub(super) fn advance(&mut self, way_m: f64) {
        self.cells.advance(way_m);
    }

    /// The surface with about this normal that passes near a point: in its own cell, or in that
    /// before or behind it.
    pub(super) fn nearest(&self, at_m: &Vector3<f64>, normal: &Vector3<f64>) -> Option<Nearest> {
        /// Steps along the normal to the neighbours.
        const STEPS_M: [f64; 3] = [0.0, -0.75 * CELL_M, 0.75 * CELL_M];
        STEPS_M.into_iter().find_map(|step_m| {
            let (key, middle_m) = cell_of(&(at_m + normal * step_m));
            self.cells.get(key)?.nearest(&(at_m - middle_m), normal)
        })
    }

    /// Takes a return in.
    pub(super) fn add(&mut self, at_m: &Vector3<f64>, normal: &Vector3<f64>) {
        let (key, middle_m) = cell_of(at_m);
        let quadric = self.cells.meet(key);
        if quadric.count < MOST {
            quadric.add(&(at_m - middle_m), normal);
        }
    }
}

impl Quadric {
    fn add(&mut self, from_middle_m: &Vector3<f64>, normal: &Vector3<f64>) {
        let [x, y, z] = [normal.x, normal.y, normal.z].map(|part| part as f32);
        let off_m = normal.dot(from_middle_m) as f32;
        let products = [x * x, x * y, x * z, y * y, y * z, z * z];
        for (sum, product) in self.products.iter_mut().zip(products) {
            *sum += product;
        }
        for (sum, part) in self.offsets.iter_mut().zip([x, y, z]) {
            *sum += part * off_m;
        }
        self.count += 1.0;
    }

    fn nearest(&self, from_middle_m: &Vector3<f64>, normal: &Vector3<f64>) -> Option<Nearest> {
        let [xx, xy, xz, yy, yz, zz] = self.products.map(f64::from);
        let products = Matrix3::new(xx, xy, xz, xy, yy, yz, xz, yz, zz);
        // One step of the power method: the cell's own normal next to the one that is asked for.
        let own = products * normal;
        if normal.dot(&own) < LEAST_ALIKE * f64::from(self.count) {
            return None;
        }
        let own = own / libm::sqrt(own.norm_squared());
        let offsets = Vector3::from(self.offsets.map(f64::from));
        let turned = products * own;
        let off_m = (turned.dot(from_middle_m) - own.dot(&offsets)) / own.dot(&turned);
        Some(Nearest { normal: own, off_m })
    }
}
