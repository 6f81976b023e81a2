//! OpenDaVINCI's scenario format, as far as roads go (`.scn`; `.scnx` is a zip archive with one).
//!
//! Two things are added to it: the type of a lane (`LANETYPE road`, `bikeway` or `pavement`) and
//! roundabouts, as the finished thesis has them. Both stand in comments that begin with
//! `kreisel:`, which OpenDaVINCI's own reader passes over:
//!
//! ```text
//! /* kreisel: LANETYPE bikeway */
//!
//! /* kreisel:
//! ROUNDABOUT
//! ROUNDABOUTID 1
//! ROUNDABOUTNAME West
//! VERTEX2
//! X -218.5
//! Y 78.2
//! DIRECTION counterclockwise
//! CIRCLE
//! CIRCLEID 1
//! LANETYPE road
//! INNERRADIUS 9
//! OUTERRADIUS 13
//! MARKING broken_white
//! ENDCIRCLE
//! ENTRY (1.9.3.158) -> 1
//! EXIT 1 -> (1.9.1.1)
//! ENDROUNDABOUT
//! */
//! ```
//!
//! Outside of comments they are read as well.

mod lines;
mod read;
mod values;
mod write;

pub use read::read;
pub use write::write;

#[cfg(test)]
mod tests;
