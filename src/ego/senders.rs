//! Whose poses are listened to: of each message the first sender's, as long as it sends.

use crate::time::{Span, Time};

/// Poses of others in a row, and the time that they span, after which the sender of the last one is followed. The first
/// sender is always welcome back.
const PATIENCE: u32 = 20;
const SILENCE: Span = Span::from_micros(1_000_000);

/// Who sends one kind of message.
#[derive(Debug, Clone, Copy)]
struct Listened {
    data_type: i32,
    home: u32,
    sender_stamp: u32,
    /// Messages of others since the last one that was taken, and when the first of them was.
    others: u32,
    since: Time,
}

/// Who sends what.
#[derive(Debug, Clone, Default)]
pub(super) struct Senders {
    listened: Vec<Listened>,
}

impl Senders {
    /// Whether a message is to be taken; if not, who is listened to.
    pub(super) fn admit(
        &mut self,
        data_type: i32,
        sender_stamp: u32,
        time: Time,
    ) -> Result<(), u32> {
        let known = self
            .listened
            .iter_mut()
            .find(|known| known.data_type == data_type);
        let Some(known) = known else {
            self.listened.push(Listened {
                data_type,
                home: sender_stamp,
                sender_stamp,
                others: 0,
                since: time,
            });
            return Ok(());
        };
        if known.sender_stamp != sender_stamp && known.home != sender_stamp {
            if known.others == 0 {
                known.since = time;
            }
            known.others += 1;
            let passed = time - known.since;
            if known.others <= PATIENCE || passed <= SILENCE {
                return Err(known.sender_stamp);
            }
        }
        (known.sender_stamp, known.others) = (sender_stamp, 0);
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn at(milliseconds: i64) -> Time {
        Time::from_micros(1000 * milliseconds)
    }

    #[test]
    fn a_second_sender_is_passed_over_while_the_first_one_sends() {
        let mut senders = Senders::default();
        for step in 0..500 {
            assert_eq!(senders.admit(1116, 0, at(10 * step)), Ok(()));
            assert_eq!(senders.admit(1116, 2, at(10 * step)), Err(0));
        }
        // Another message has another sender.
        assert_eq!(senders.admit(533, 2, at(5000)), Ok(()));
    }

    #[test]
    fn it_is_followed_when_the_first_one_is_silent_who_is_welcome_back() {
        let mut senders = Senders::default();
        assert_eq!(senders.admit(1116, 0, at(0)), Ok(()));
        let taken = (0..300).find(|step| senders.admit(1116, 2, at(10 * step)).is_ok());
        assert_eq!(taken, Some(101));
        assert_eq!(senders.admit(1116, 3, at(3000)), Err(2));
        assert_eq!(senders.admit(1116, 0, at(3000)), Ok(()));
        assert_eq!(senders.admit(1116, 2, at(3000)), Err(0));
    }
}
