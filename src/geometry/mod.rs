//! What more than one stage measures with: boxes from above, places and directions in space.

mod rectangle;
mod rigid;

pub(crate) use rectangle::{DIRECTIONS, Extent, closest_rad, mean_closeness, turned};
pub use rectangle::{Outline, Rectangle};
pub use rigid::Rigid;
pub(crate) use rigid::{angular, linear, turn};
