//! Tells the supervisor that started the daemon, if it is one that asks (systemd's notify protocol, sd_notify(3)).

use sd_notify::NotifyState;

use super::health::Health;

/// What a supervisor is told. Where there is none, or none that listens, nothing happens.
fn tell(states: &[NotifyState<'_>]) {
    // A supervisor that cannot be told restarts what it does not hear of.
    let _ = sd_notify::notify(states);
}

/// Sockets are open.
pub(super) fn ready() {
    tell(&[NotifyState::Ready]);
}

/// The one thread still turns.
pub(super) fn alive() {
    tell(&[NotifyState::Watchdog]);
}

/// How the daemon is.
pub(super) fn well(health: &Health) {
    tell(&[NotifyState::Status(&health.to_string())]);
}

/// It ends.
pub(super) fn stopping() {
    tell(&[NotifyState::Stopping]);
}
