//! What stands between the socket and the pipeline: one bounded queue.

use std::collections::VecDeque;
use std::mem::replace;

use super::listener::Datagram;
use crate::time::Time;

/// A datagram with a sound envelope.
#[derive(Debug)]
pub(super) struct Job {
    pub(super) datagram: Datagram,
    pub(super) arrival: Time,
    pub(super) is_revolution: bool,
}

/// Poses and the like that may wait. They are small; only a flood fills this.
const MOST_OTHERS: usize = 4096;

/// First in, first out. When a revolution comes and as many wait as may, the oldest of them
/// goes, because a late answer is of less use than the next one; and it is counted.
///
/// Revolutions change hands with their buffers, of which there are one more than may wait.
#[derive(Debug)]
pub(super) struct Queue {
    most_revolutions: usize,
    jobs: VecDeque<Job>,
    revolutions: usize,
    spare: Vec<Datagram>,
    /// Revolutions that were dropped so far.
    pub(super) dropped_revolutions: u64,
    /// Other messages that were dropped so far.
    pub(super) dropped_others: u64,
}

impl Queue {
    pub(super) fn new(most_revolutions: usize) -> Self {
        Self {
            most_revolutions,
            jobs: VecDeque::new(),
            revolutions: 0,
            spare: vec![],
            dropped_revolutions: 0,
            dropped_others: 0,
        }
    }

    pub(super) fn is_empty(&self) -> bool {
        self.jobs.is_empty()
    }

    /// Takes a revolution over, and leaves an empty datagram in its place.
    pub(super) fn push_revolution(&mut self, datagram: &mut Datagram, arrival: Time) {
        if self.revolutions == self.most_revolutions {
            self.dropped_revolutions += 1;
            self.drop_first(true);
        }
        let empty = self.spare.pop().unwrap_or_default();
        self.revolutions += 1;
        self.jobs.push_back(Job {
            datagram: replace(datagram, empty),
            arrival,
            is_revolution: true,
        });
    }

    /// Takes a copy of another message, which is short where a buffer has room for the longest.
    pub(super) fn push_other(&mut self, datagram: &Datagram, arrival: Time) {
        if self.jobs.len() - self.revolutions >= MOST_OTHERS {
            self.dropped_others += 1;
            self.drop_first(false);
        }
        self.jobs.push_back(Job {
            datagram: datagram.bytes().into(),
            arrival,
            is_revolution: false,
        });
    }

    /// The next job, if any.
    pub(super) fn pop(&mut self) -> Option<Job> {
        let job = self.jobs.pop_front()?;
        self.revolutions -= usize::from(job.is_revolution);
        Some(job)
    }

    /// Keeps what a job that is done was received into.
    pub(super) fn recycle(&mut self, job: Job) {
        if job.is_revolution {
            self.spare.push(job.datagram);
        }
    }

    fn drop_first(&mut self, is_revolution: bool) {
        let first = self
            .jobs
            .iter()
            .position(|job| job.is_revolution == is_revolution);
        if let Some(job) = first.and_then(|index| self.jobs.remove(index)) {
            self.revolutions -= usize::from(job.is_revolution);
            self.recycle(job);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn push(queue: &mut Queue, name: &str) {
        let mut datagram = Datagram::from(name.as_bytes());
        match name {
            "pose" => queue.push_other(&datagram, Time::ZERO),
            _ => queue.push_revolution(&mut datagram, Time::ZERO),
        }
    }

    fn names(queue: &mut Queue) -> Vec<String> {
        std::iter::from_fn(|| queue.pop())
            .map(|job| String::from_utf8(job.datagram.bytes().to_vec()).unwrap())
            .collect()
    }

    #[test]
    fn the_oldest_revolution_goes_and_poses_stay() {
        let mut queue = Queue::new(2);
        for name in ["a", "pose", "b", "c", "d"] {
            push(&mut queue, name);
        }
        assert_eq!((queue.dropped_revolutions, queue.dropped_others), (2, 0));
        assert_eq!(names(&mut queue), ["pose", "c", "d"]);
        push(&mut queue, "e");
        assert_eq!(queue.dropped_revolutions, 2);
        assert_eq!(names(&mut queue), ["e"]);
    }

    #[test]
    fn a_flood_of_other_messages_is_bounded() {
        let mut queue = Queue::new(2);
        push(&mut queue, "a");
        for _ in 0..MOST_OTHERS + 5 {
            push(&mut queue, "pose");
        }
        assert_eq!((queue.dropped_revolutions, queue.dropped_others), (0, 5));
        assert_eq!(names(&mut queue).len(), 1 + MOST_OTHERS);
    }

    #[test]
    fn buffers_come_back() {
        let mut queue = Queue::new(2);
        let mut datagram = Datagram::default();
        for _ in 0..10 {
            queue.push_revolution(&mut datagram, Time::ZERO);
        }
        assert_eq!(queue.spare.len(), 0);
        while let Some(job) = queue.pop() {
            queue.recycle(job);
        }
        assert_eq!(queue.spare.len(), 2);
    }
}
