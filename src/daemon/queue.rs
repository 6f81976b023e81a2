//! What stands between the socket and the pipeline: one bounded queue.

use std::collections::VecDeque;
use std::sync::{Condvar, Mutex, MutexGuard, PoisonError};

use bytes::Bytes;

use crate::time::Time;

/// Something for the worker to do.
#[derive(Debug, Clone, PartialEq)]
pub(super) enum Item {
    /// Handle an envelope.
    Job(Job),
    /// Send a Status.
    Status,
}

/// A datagram with a sound envelope.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Job {
    pub(super) datagram: Bytes,
    pub(super) arrival: Time,
    pub(super) is_revolution: bool,
}

/// Poses and the like that may wait. They are small; only a flood fills this.
const MOST_OTHERS: usize = 4096;

/// First in, first out. When a revolution comes and as many wait as may, the oldest of them
/// goes, because a late answer is of less use than the next one; and it is counted.
#[derive(Debug)]
pub(super) struct Queue {
    most_revolutions: usize,
    state: Mutex<State>,
    changed: Condvar,
}

#[derive(Debug, Default)]
struct State {
    items: VecDeque<Item>,
    revolutions: usize,
    dropped_revolutions: u64,
    dropped_others: u64,
    closed: bool,
}

impl Queue {
    pub(super) fn new(most_revolutions: usize) -> Self {
        Self {
            most_revolutions,
            state: Mutex::default(),
            changed: Condvar::new(),
        }
    }

    fn state(&self) -> MutexGuard<'_, State> {
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }

    pub(super) fn push(&self, item: Item) {
        let mut state = self.state();
        if is_revolution(&item) {
            if state.revolutions == self.most_revolutions {
                state.drop_first(is_revolution);
                state.dropped_revolutions += 1;
            }
            state.revolutions += 1;
        } else if state.items.len() - state.revolutions >= MOST_OTHERS {
            state.drop_first(|item| !is_revolution(item));
            state.dropped_others += 1;
        }
        state.items.push_back(item);
        self.changed.notify_one();
    }

    /// Waits for the next item; `None` once the queue is closed, whatever still waits.
    pub(super) fn pop(&self) -> Option<Item> {
        let mut state = self.state();
        loop {
            if state.closed {
                return None;
            }
            if let Some(item) = state.items.pop_front() {
                state.revolutions -= usize::from(is_revolution(&item));
                return Some(item);
            }
            state = self
                .changed
                .wait(state)
                .unwrap_or_else(PoisonError::into_inner);
        }
    }

    pub(super) fn close(&self) {
        self.state().closed = true;
        self.changed.notify_all();
    }

    /// Revolutions, and other messages, that were dropped so far.
    pub(super) fn dropped(&self) -> (u64, u64) {
        let state = self.state();
        (state.dropped_revolutions, state.dropped_others)
    }
}

impl State {
    fn drop_first(&mut self, unwanted: impl Fn(&Item) -> bool) {
        if let Some(index) = self.items.iter().position(unwanted)
            && let Some(item) = self.items.remove(index)
        {
            self.revolutions -= usize::from(is_revolution(&item));
        }
    }
}

fn is_revolution(item: &Item) -> bool {
    matches!(item, Item::Job(job) if job.is_revolution)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn job(name: &'static str, is_revolution: bool) -> Item {
        Item::Job(Job {
            datagram: Bytes::from_static(name.as_bytes()),
            arrival: Time::ZERO,
            is_revolution,
        })
    }

    #[test]
    fn the_oldest_revolution_goes_and_poses_stay() {
        let queue = Queue::new(2);
        for item in [
            job("a", true),
            job("pose", false),
            job("b", true),
            job("c", true),
        ] {
            queue.push(item);
        }
        assert_eq!(queue.dropped(), (1, 0));
        assert_eq!(queue.pop(), Some(job("pose", false)));
        assert_eq!(queue.pop(), Some(job("b", true)));
        queue.push(job("d", true));
        assert_eq!(queue.dropped(), (1, 0));
        assert_eq!(queue.pop(), Some(job("c", true)));
        assert_eq!(queue.pop(), Some(job("d", true)));
    }

    #[test]
    fn a_flood_of_other_messages_is_bounded() {
        let queue = Queue::new(2);
        queue.push(job("a", true));
        for _ in 0..MOST_OTHERS + 5 {
            queue.push(job("pose", false));
        }
        assert_eq!(queue.dropped(), (0, 5));
        assert_eq!(queue.pop(), Some(job("a", true)));
    }

    #[test]
    fn a_closed_queue_wakes_who_waits() {
        let queue = Queue::new(2);
        std::thread::scope(|scope| {
            let waiting = scope.spawn(|| queue.pop());
            queue.close();
            assert_eq!(waiting.join().unwrap(), None);
        });
    }
}
