//! Is the daemon receiving and keeping up? Answered on an abstract Unix socket: it needs no
//! file system, no port and no shell, and is seen only on this host and in its network
//! namespace.

use std::cell::Cell;
use std::io::Read as _;
use std::os::linux::net::SocketAddrExt as _;
use std::os::unix::net::{SocketAddr, UnixListener, UnixStream};
use std::time::{Duration, Instant};

use tokio::io::AsyncWriteExt as _;
use tracing::info;

/// Without an answered revolution for this long, the daemon is not receiving.
const SILENCE: Duration = Duration::from_secs(2);
/// After a drop, the daemon counts as not keeping up for this long.
const DROP_MEMORY: Duration = Duration::from_secs(10);
/// Name of the sockets, before the session's number and the process'.
const NAME_PREFIX: &str = "kreisel-health-";

/// What health is judged by.
#[derive(Debug, Default)]
pub struct Vitals {
    state: Cell<State>,
}

#[derive(Debug, Default, Clone, Copy)]
struct State {
    last_answer: Option<Instant>,
    last_drop: Option<Instant>,
    dropped: u64,
}

impl Vitals {
    /// Notes that a revolution was answered.
    pub(super) fn answered(&self) {
        self.state.set(State {
            last_answer: Some(Instant::now()),
            ..self.state.get()
        });
    }

    /// Notes how many datagrams and revolutions were dropped so far.
    pub(super) fn dropped(&self, total: u64) {
        let state = self.state.get();
        if total > state.dropped {
            self.state.set(State {
                last_drop: Some(Instant::now()),
                dropped: total,
                ..state
            });
        }
    }

    /// `Ok`, or what is wrong.
    pub(super) fn verdict(&self) -> Result<(), String> {
        let state = self.state.get();
        match (state.last_answer, state.last_drop) {
            (None, _) => Err("no revolution was answered yet".into()),
            (Some(last), _) if last.elapsed() > SILENCE => Err(format!(
                "no revolution was answered for {:.1} s",
                last.elapsed().as_secs_f64()
            )),
            (_, Some(last)) if last.elapsed() < DROP_MEMORY => Err(format!(
                "not keeping up: {} dropped so far, the last {:.1} s ago",
                state.dropped,
                last.elapsed().as_secs_f64()
            )),
            _ => Ok(()),
        }
    }
}

/// Answers health checks for ever. Without the socket the daemon works all the same.
pub(super) async fn serve(cid: u8, vitals: &Vitals) {
    let listener = match listen(cid) {
        Ok(listener) => listener,
        Err(error) => {
            info!("no health checks: {error}");
            return std::future::pending().await;
        }
    };
    loop {
        if let Ok((mut stream, _)) = listener.accept().await {
            let answer = match vitals.verdict() {
                Ok(()) => "ok".into(),
                Err(problem) => problem,
            };
            // A client that does not read has no claim to an answer.
            let _ = stream.write_all(answer.as_bytes()).await;
        }
    }
}

fn listen(cid: u8) -> std::io::Result<tokio::net::UnixListener> {
    let name = format!("{NAME_PREFIX}{cid}-{}", std::process::id());
    let listener = UnixListener::bind_addr(&SocketAddr::from_abstract_name(name)?)?;
    listener.set_nonblocking(true)?;
    tokio::net::UnixListener::from_std(listener)
}

/// Asks every daemon on this host, or those of one session; `Err` says what is wrong.
pub fn check(cid: Option<u8>) -> Result<(), String> {
    let names = daemons(cid);
    if names.is_empty() {
        return Err("no daemon runs on this host".into());
    }
    for name in names {
        let answer = ask(&name).map_err(|error| format!("{name} does not answer: {error}"))?;
        if answer != "ok" {
            return Err(format!("{name}: {answer}"));
        }
    }
    Ok(())
}

/// Names of the health sockets in this network namespace.
fn daemons(cid: Option<u8>) -> Vec<String> {
    let prefix = match cid {
        Some(cid) => format!("{NAME_PREFIX}{cid}-"),
        None => NAME_PREFIX.into(),
    };
    let sockets = std::fs::read_to_string("/proc/net/unix").unwrap_or_default();
    let names = sockets
        .lines()
        .filter_map(|line| line.split_whitespace().last())
        .filter_map(|path| path.strip_prefix('@'));
    let mut names: Vec<String> = names
        .filter(|name| name.starts_with(&prefix))
        .map(Into::into)
        .collect();
    names.sort();
    names.dedup();
    names
}

fn ask(name: &str) -> std::io::Result<String> {
    const PATIENCE: Duration = Duration::from_secs(1);
    const LONGEST_ANSWER: u64 = 1000;
    let stream = UnixStream::connect_addr(&SocketAddr::from_abstract_name(name)?)?;
    stream.set_read_timeout(Some(PATIENCE))?;
    let mut answer = String::new();
    stream.take(LONGEST_ANSWER).read_to_string(&mut answer)?;
    Ok(answer)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn health_needs_an_answer_and_no_drops() {
        let vitals = Vitals::default();
        assert!(vitals.verdict().unwrap_err().contains("yet"));
        vitals.answered();
        assert_eq!(vitals.verdict(), Ok(()));
        vitals.dropped(0);
        assert_eq!(vitals.verdict(), Ok(()));
        vitals.dropped(3);
        assert!(vitals.verdict().unwrap_err().contains("3 dropped"));
    }
}
