//! Where pictures are made, if somebody looks.

use std::net::SocketAddr;
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};
use std::time::Instant;

use tokio::sync::watch;
use tokio_tungstenite::tungstenite::Bytes;

use super::labels::Around;
use super::measures::Measures;
use super::metrics::Told;
use super::newest::Newest;
use super::picture::{Painter, Player};
use crate::pipeline::{Pipeline, RevolutionReport, Step};
use crate::time::{Span, Time};
use crate::wire::Message;
use crate::wire::envelope::Postmark;
use crate::wire::status::Status;

/// The newest picture.
#[derive(Debug, Clone, Default)]
pub(super) struct Shown {
    /// Counts pictures.
    pub(super) number: u64,
    pub(super) bytes: Bytes,
}

/// The pipeline's end of the view. Without a viewer it tells the time a dozen times a revolution.
#[derive(Debug)]
pub struct Feed {
    address: SocketAddr,
    shown: watch::Sender<Shown>,
    told: watch::Sender<Option<Told>>,
    painter: Painter,
    /// When the step began that is under way.
    begun: Option<Instant>,
    measures: Measures,
    steps_ms: Vec<(&'static str, f32)>,
    /// What was published since the last picture.
    frames: Vec<u8>,
    newest: Newest,
    /// Whether the next picture must hold the newest of everything instead.
    needs_all: bool,
    /// Viewers that came so far, and those of them for whom there was a picture.
    came: Arc<AtomicU64>,
    welcomed: u64,
}

/// Instead of more frames than this since the last picture the newest of everything is sent.
const MOST_FRAME_BYTES: usize = 1 << 18;

impl Feed {
    pub(super) fn new(
        address: SocketAddr,
        shown: watch::Sender<Shown>,
        told: watch::Sender<Option<Told>>,
        came: Arc<AtomicU64>,
    ) -> Self {
        Self {
            address,
            shown,
            told,
            painter: Painter::default(),
            begun: None,
            measures: Measures::default(),
            steps_ms: vec![],
            frames: vec![],
            newest: Newest::default(),
            needs_all: false,
            came,
            welcomed: 0,
        }
    }

    /// Where the page is served.
    pub fn address(&self) -> SocketAddr {
        self.address
    }

    /// Whether anybody looks.
    pub fn is_watched(&self) -> bool {
        self.shown.receiver_count() > 0
    }

    /// How the daemon is doing, for those who ask.
    pub fn tell(&mut self, status: &Status) {
        self.told.send_replace(Some(Told {
            status: status.clone(),
            measures: self.measures.clone(),
            at: Instant::now(),
        }));
    }

    /// A revolution begins.
    pub fn begin(&mut self) {
        self.steps_ms.clear();
        self.begun = Some(Instant::now());
    }

    /// A step of it is done.
    pub fn note(&mut self, step: Step) {
        let Some(begun) = &mut self.begun else { return };
        let now = Instant::now();
        let took = now.duration_since(*begun);
        self.measures.note(step, took);
        self.steps_ms
            .push((step.name(), 1000.0 * took.as_secs_f32()));
        *begun = now;
    }

    /// A revolution was answered so long after it had come.
    pub fn answered(&mut self, latency: Span) {
        self.measures.latency.record(latency.seconds().max(0.0));
    }

    /// Bytes of messages that came in and that were sent so far.
    pub fn note_traffic(&mut self, received_bytes: u64, sent_bytes: u64) {
        self.measures.received_bytes = received_bytes;
        self.measures.sent_bytes = sent_bytes;
    }

    /// A frame was published, or came from a session; what is damaged or no list, Status or tile is left out.
    pub fn put(&mut self, frame: &[u8]) {
        if !self.is_watched() {
            // It goes on without being kept: what is known gets old.
            self.forget();
        } else if let Some(frame) = self.newest.take(frame) {
            self.frames.extend_from_slice(frame);
            if self.frames.len() > MOST_FRAME_BYTES {
                self.frames.clear();
                self.needs_all = true;
            }
        }
    }

    /// What was published means nothing any more.
    pub fn forget(&mut self) {
        self.frames.clear();
        self.newest.clear();
    }

    /// Adds a message that is not published otherwise.
    pub fn put_message<M: Message>(&mut self, time: Time, message: &M) {
        if self.is_watched() {
            let postmark = Postmark {
                sent: time,
                sampled: time,
                sender_stamp: 0,
            };
            let mut frame = vec![];
            postmark.put(&mut frame, message);
            self.put(&frame);
        }
    }

    /// Shows the pipeline's last revolution, and what was published since the last one.
    pub fn show(&mut self, pipeline: &Pipeline, report: &RevolutionReport, player: Option<Player>) {
        let around = Around::of(pipeline, report.ground.plane.height_m());
        self.send(&around, Some(pipeline), player);
    }

    /// Shows a revolution of which nobody knows what its points are.
    pub fn show_points(&mut self, around: &Around<'_>) {
        self.send(around, None, None);
    }

    fn send(&mut self, around: &Around<'_>, known: Option<&Pipeline>, player: Option<Player>) {
        if !self.is_watched() {
            return;
        }
        let came = self.came.load(Ordering::Acquire);
        self.needs_all |= std::mem::replace(&mut self.welcomed, came) != came;
        match known {
            Some(pipeline) => self.painter.labels.label(around, pipeline),
            None => self.painter.labels.label_none(around.scan),
        }
        let mut bytes = vec![];
        self.painter
            .paint(around, &self.steps_ms, player, &mut bytes);
        if std::mem::take(&mut self.needs_all) {
            self.frames.clear();
            self.newest.put(&mut bytes);
        } else {
            bytes.append(&mut self.frames);
        }
        self.shown.send_modify(|shown| {
            shown.number += 1;
            shown.bytes = bytes.into();
        });
    }
}
