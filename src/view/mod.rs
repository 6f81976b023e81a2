//! The picture in a browser: points, objects and map of the last revolution, for anybody who looks.
//!
//! `labels` says what every point is, `picture` has the bytes of a revolution for the page, `feed` makes them where somebody looks, with the `newest` of
//! what was published for those who have just come,
//! `server` serves the page and sends them over `http`; `page/` is the page, and `metrics` is for those who watch a daemon by
//! machine, with what `measures` keeps. The server has a thread of its
//! own, and between it and the pipeline stands one picture, the newest: a viewer that stalls
//! misses pictures, and nothing else happens.

mod feed;

mod http;

mod labels;

mod measures;

mod metrics;

mod newest;

mod picture;

mod server;

pub use feed::Feed;
pub use labels::Around;
#[cfg(feature = "foxglove")]
pub(crate) use labels::Labels;
pub use picture::Player;
pub use server::{Control, DEFAULT_ADDRESS, serve};
