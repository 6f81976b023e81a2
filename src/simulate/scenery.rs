//! What stands around: walls, poles, hedges, trees, kerbs.

use super::solid::{Fabric, Shape, Solid, block};
use super::terrain::Terrain;

/// A thing that does not move.
#[derive(Debug, Clone)]
pub(super) struct Thing {
    /// Its origin, on the ground.
    pub(super) place_m: [f64; 3],
    pub(super) yaw_rad: f64,
    pub(super) solid: Solid,
    /// Kerbs, islands, verges: something to walk on.
    pub(super) is_ground: bool,
}

/// Things on a terrain.
#[derive(Debug, Clone, Default)]
pub(super) struct Scenery {
    pub(super) things: Vec<Thing>,
    terrain: Terrain,
}

/// Depth to which things reach below the ground, so that no slope opens a gap.
const ROOT_M: f64 = 1.0;

impl Scenery {
    pub(super) fn on(terrain: &Terrain) -> Self {
        Self {
            things: vec![],
            terrain: terrain.clone(),
        }
    }

    /// Moves everything.
    pub(super) fn shift(&mut self, by_m: [f64; 2]) {
        for thing in &mut self.things {
            for (metres, by_m) in thing.place_m.iter_mut().zip(by_m) {
                *metres += by_m;
            }
        }
    }

    fn put(&mut self, [x, y]: [f64; 2], yaw_deg: f64, solid: Solid, is_ground: bool) {
        self.things.push(Thing {
            place_m: [x, y, self.terrain.height_m(x, y)],
            yaw_rad: yaw_deg.to_radians(),
            solid,
            is_ground,
        });
    }

    /// An upright bar with its middle at a place.
    fn bar(
        &mut self,
        at_m: [f64; 2],
        yaw_deg: f64,
        [length_m, width_m]: [f64; 2],
        [low_m, high_m]: [f64; 2],
        fabric: Fabric,
        reflectance: f64,
    ) -> &mut Self {
        let (u, v) = (0.5 * length_m, 0.5 * width_m);
        let solid = Solid {
            shape: block([-u, -v, low_m], [u, v, high_m]),
            fabric,
            reflectance,
        };
        self.put(at_m, yaw_deg, solid, false);
        self
    }

    fn drum(
        &mut self,
        at_m: [f64; 2],
        radius_m: f64,
        [low_m, high_m]: [f64; 2],
        fabric: Fabric,
        reflectance: f64,
    ) -> &mut Self {
        let shape = Shape::Cylinder {
            centre_m: [0.0; 2],
            radius_m,
            low_m,
            high_m,
        };
        let solid = Solid {
            shape,
            fabric,
            reflectance,
        };
        self.put(at_m, 0.0, solid, false);
        self
    }

    pub(super) fn wall(
        &mut self,
        at_m: [f64; 2],
        yaw_deg: f64,
        length_m: f64,
        high_m: f64,
    ) -> &mut Self {
        let sizes = [length_m, 0.3];
        self.bar(at_m, yaw_deg, sizes, [-ROOT_M, high_m], Fabric::Dense, 0.4)
    }

    pub(super) fn house(
        &mut self,
        at_m: [f64; 2],
        yaw_deg: f64,
        sizes_m: [f64; 2],
        high_m: f64,
    ) -> &mut Self {
        self.bar(
            at_m,
            yaw_deg,
            sizes_m,
            [-ROOT_M, high_m],
            Fabric::Dense,
            0.35,
        )
    }

    pub(super) fn hedge(
        &mut self,
        at_m: [f64; 2],
        yaw_deg: f64,
        length_m: f64,
        high_m: f64,
    ) -> &mut Self {
        let heights = [0.05, high_m];
        let sizes = [length_m, 0.9];
        self.bar(at_m, yaw_deg, sizes, heights, Fabric::Leaves(0.25), 0.4)
    }

    /// A box on the ground: a bin, a kiosk, a container.
    pub(super) fn cabinet(
        &mut self,
        at_m: [f64; 2],
        yaw_deg: f64,
        sizes_m: [f64; 2],
        high_m: f64,
    ) -> &mut Self {
        self.bar(
            at_m,
            yaw_deg,
            sizes_m,
            [-ROOT_M, high_m],
            Fabric::Dense,
            0.3,
        )
    }

    /// A fence through which a share of the rays passes.
    pub(super) fn fence(
        &mut self,
        at_m: [f64; 2],
        yaw_deg: f64,
        length_m: f64,
        high_m: f64,
        open: f64,
    ) -> &mut Self {
        self.bar(
            at_m,
            yaw_deg,
            [length_m, 0.06],
            [0.0, high_m],
            Fabric::Open(open),
            0.3,
        )
    }

    /// A guard rail.
    pub(super) fn rail(&mut self, at_m: [f64; 2], yaw_deg: f64, length_m: f64) -> &mut Self {
        self.bar(
            at_m,
            yaw_deg,
            [length_m, 0.1],
            [0.45, 0.75],
            Fabric::Dense,
            0.6,
        )
    }

    /// A ceiling, as of a hall or below a bridge.
    pub(super) fn ceiling(&mut self, at_m: [f64; 2], sizes_m: [f64; 2], above_m: f64) -> &mut Self {
        let heights = [above_m, above_m + 0.3];
        self.bar(at_m, 0.0, sizes_m, heights, Fabric::Dense, 0.4)
    }

    pub(super) fn bush(&mut self, at_m: [f64; 2], radius_m: f64, high_m: f64) -> &mut Self {
        self.drum(at_m, radius_m, [0.0, high_m], Fabric::Leaves(0.3), 0.4)
    }

    pub(super) fn pole(&mut self, at_m: [f64; 2], radius_m: f64, high_m: f64) -> &mut Self {
        self.drum(at_m, radius_m, [-ROOT_M, high_m], Fabric::Dense, 0.3)
    }

    pub(super) fn tree(&mut self, at_m: [f64; 2], crown_m: f64) -> &mut Self {
        self.drum(at_m, 0.18, [-ROOT_M, 2.6], Fabric::Dense, 0.25);
        self.drum(at_m, crown_m, [2.3, 6.5], Fabric::Leaves(0.8), 0.4)
    }

    /// A clump of twigs and leaves: rays end within, after a mean way.
    pub(super) fn clump(
        &mut self,
        at_m: [f64; 2],
        radius_m: f64,
        heights_m: [f64; 2],
        mean_way_m: f64,
    ) -> &mut Self {
        self.drum(at_m, radius_m, heights_m, Fabric::Leaves(mean_way_m), 0.4)
    }

    /// A sign on two posts.
    pub(super) fn sign(&mut self, at_m: [f64; 2], yaw_deg: f64) -> &mut Self {
        self.bar(at_m, yaw_deg, [0.9, 0.03], [1.9, 2.7], Fabric::Dense, 0.9);
        self.pole(at_m, 0.04, 2.7)
    }

    /// Something upright and dense between two heights, on whatever holds it.
    pub(super) fn panel(
        &mut self,
        at_m: [f64; 2],
        yaw_deg: f64,
        sizes_m: [f64; 2],
        heights_m: [f64; 2],
    ) -> &mut Self {
        self.bar(at_m, yaw_deg, sizes_m, heights_m, Fabric::Dense, 0.5)
    }

    /// A pavement or an island: a kerb around level ground.
    pub(super) fn pavement(
        &mut self,
        at_m: [f64; 2],
        yaw_deg: f64,
        sizes_m: [f64; 2],
    ) -> &mut Self {
        let (u, v) = (0.5 * sizes_m[0], 0.5 * sizes_m[1]);
        let solid = Solid {
            shape: block([-u, -v, -ROOT_M], [u, v, KERB_M]),
            fabric: Fabric::Dense,
            reflectance: 0.3,
        };
        self.put(at_m, yaw_deg, solid, true);
        self
    }

    /// A round island behind a kerb.
    pub(super) fn island(&mut self, at_m: [f64; 2], radius_m: f64) -> &mut Self {
        let solid = Solid {
            shape: Shape::Cylinder {
                centre_m: [0.0; 2],
                radius_m,
                low_m: -ROOT_M,
                high_m: KERB_M,
            },
            fabric: Fabric::Dense,
            reflectance: 0.3,
        };
        self.put(at_m, 0.0, solid, true);
        self
    }

    /// Grass: rays end a little above or within it.
    pub(super) fn verge(&mut self, at_m: [f64; 2], yaw_deg: f64, sizes_m: [f64; 2]) -> &mut Self {
        self.grass(at_m, yaw_deg, sizes_m, 0.14, 0.4)
    }

    /// Grass of a height, in which rays end after a mean way.
    pub(super) fn grass(
        &mut self,
        at_m: [f64; 2],
        yaw_deg: f64,
        sizes_m: [f64; 2],
        high_m: f64,
        mean_way_m: f64,
    ) -> &mut Self {
        let (u, v) = (0.5 * sizes_m[0], 0.5 * sizes_m[1]);
        let solid = Solid {
            shape: block([-u, -v, -ROOT_M], [u, v, high_m]),
            fabric: Fabric::Leaves(mean_way_m),
            reflectance: 0.4,
        };
        self.put(at_m, yaw_deg, solid, true);
        self
    }
}

/// Height of a kerb.
const KERB_M: f64 = 0.12;
