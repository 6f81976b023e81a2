//! Kreisel takes each revolution of a Velodyne VLP-16, from an OpenDaVINCI or OpenDLV session or from
//! the sensor's own packets, and answers it with a list of the road users around the vehicle, and with what changed
//! in a map of everything else.
//!
//! A revolution walks through the house once, front to back:
//!
//! ```text
//! datagram -> wire -> cloud -> odometry -> ego -> ground -> cluster -> track -> wire -> datagram
//!                |                        /  \ \___ beams ___________/ \-> grid -/
//!                \-> poses --------------/    \-------------------------/    /
//! map of roads -> roadmap -> roundabout (lanes, gap) ---------------------/
//! ```
//!
//! Everything but the shell is pure: no I/O, no clock, no thread, no global state. The same
//! envelopes and the same configuration give the same bytes.
#![cfg_attr(test, allow(clippy::unwrap_used, clippy::expect_used, clippy::panic))]

// Bytes to messages, messages to bytes.
pub mod wire;

// A message, or a sensor's packets, to the static array of points.
pub mod cloud;

// Boxes from above, places and directions in space.
pub mod geometry;

// How the sensor moves, from what it sees.
pub mod odometry;

// Where the vehicle was meanwhile.
pub mod ego;

// Which points are ground.
pub mod ground;

// What rays say of a place: seen empty, seen occupied, not seen.
pub mod beams;

// Which of the others belong together.
pub mod cluster;

// Which cluster is which object, from revolution to revolution.
pub mod track;

// What is static, and what is free.
pub mod grid;

// Maps of roads, and the roundabouts in them.
pub mod roadmap;

// Road users on the lanes of a roundabout, and the gap between them.
pub mod roundabout;

// Objects to messages, messages to frames.
pub mod publish;

// The steps above, in order.
pub mod pipeline;

// What a user may set: all stages' parameters.
pub mod config;

// How a stage declares its parameters: unit, range, two profiles.
pub mod parameter;

// What the pipeline says of a revolution.
mod report;

// Why an envelope was of no use.
mod fault;

// Counters by name.
pub mod tally;

// Comparisons of floats that vectorise.
mod float;

// Marks on many points.
mod marks;

// What belongs together, found by joining.
mod partition;

// Integer microseconds.
pub mod time;

// The generator behind every random choice.
pub mod random;

// A synthetic session with truth.
pub mod simulate;

// Sockets, signals: the shell around the pipeline.
#[cfg(feature = "shell")]
pub mod daemon;

// The picture in a browser.
#[cfg(feature = "shell")]
pub mod view;

// The same for other people's tools.
#[cfg(feature = "foxglove")]
pub mod foxglove;

// One file a command.
#[cfg(feature = "shell")]
pub mod cli;
