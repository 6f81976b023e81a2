//! Is the daemon receiving and keeping up? Answered on an abstract Unix socket: it needs no
//! file system, no port and no shell, and is seen only on this host and in its network
//! namespace.

use std::cell::RefCell;
use std::fmt;
use std::io::Read as _;
use std::os::linux::net::SocketAddrExt as _;
use std::os::unix::net::{SocketAddr, UnixListener, UnixStream};
use std::time::{Duration, Instant};

use tokio::io::AsyncWriteExt as _;
use tracing::info;

/// Without an answered revolution for this long, the daemon is not receiving: five revolutions at the slowest.
const SILENCE: Duration = Duration::from_secs(1);
/// What went wrong counts for this long.
const MEMORY: Duration = Duration::from_secs(10);
/// Name of the sockets, before the session's number and the process'.
const NAME_PREFIX: &str = "kreisel-health-";

/// How the daemon is, in one word, and why.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Health {
    /// It receives and keeps up.
    Well,
    /// It answers, but not all that there is.
    Degraded(String),
    /// It perceives nothing.
    Blind(String),
}

impl fmt::Display for Health {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Well => write!(f, "ok"),
            Self::Degraded(why) => write!(f, "degraded: {why}"),
            Self::Blind(why) => write!(f, "blind: {why}"),
        }
    }
}

/// What health is judged by.
#[derive(Debug)]
pub struct Vitals {
    most_missed_share: f64,
    state: RefCell<State>,
}

#[derive(Debug)]
struct State {
    last_answer: Option<Instant>,
    dropped: u64,
    /// Revolutions that were answered and missed since a time, and in the same time before.
    begun: Instant,
    now: [u64; 2],
    before: [u64; 2],
    /// What went wrong last, and when.
    trouble: Option<(Instant, String)>,
    /// Why nothing can come in.
    cut_off: Option<String>,
}

impl Vitals {
    /// Of a daemon that may miss such a share of the revolutions.
    pub(super) fn new(most_missed_share: f64) -> Self {
        let state = State {
            last_answer: None,
            dropped: 0,
            begun: Instant::now(),
            now: [0; 2],
            before: [0; 2],
            trouble: None,
            cut_off: None,
        };
        Self {
            most_missed_share,
            state: RefCell::new(state),
        }
    }

    /// Notes that a revolution was answered, and how many were missed before it.
    pub(super) fn answered(&self, missed: u64) {
        let mut state = self.state.borrow_mut();
        state.last_answer = Some(Instant::now());
        if state.begun.elapsed() > MEMORY {
            state.begun = Instant::now();
            state.before = std::mem::take(&mut state.now);
        }
        state.now[0] += 1;
        state.now[1] += missed;
    }

    /// Notes how many datagrams and revolutions were dropped so far.
    pub(super) fn dropped(&self, total: u64) {
        let is_more = total > self.state.borrow().dropped;
        if is_more {
            self.state.borrow_mut().dropped = total;
            self.trouble(format!("not keeping up: {total} dropped so far"));
        }
    }

    /// Notes that something went wrong.
    pub(super) fn trouble(&self, why: String) {
        self.state.borrow_mut().trouble = Some((Instant::now(), why));
    }

    /// Notes why nothing can come in, or that it can again.
    pub(super) fn cut_off(&self, why: Option<String>) {
        self.state.borrow_mut().cut_off = why;
    }

    /// How the daemon is.
    pub(super) fn verdict(&self) -> Health {
        let state = self.state.borrow();
        if let Some(why) = &state.cut_off {
            return Health::Blind(why.clone());
        }
        match state.last_answer {
            None => return Health::Blind("no revolution was answered yet".into()),
            Some(last) if last.elapsed() > SILENCE => {
                let seconds = last.elapsed().as_secs_f64();
                return Health::Blind(format!("no revolution was answered for {seconds:.1} s"));
            }
            Some(_) => {}
        }
        if let Some((at, why)) = &state.trouble
            && at.elapsed() < MEMORY
        {
            let seconds = at.elapsed().as_secs_f64();
            return Health::Degraded(format!("{why}, {seconds:.1} s ago"));
        }
        let [answered, missed] = [0, 1].map(|count| state.now[count] + state.before[count]);
        let share = missed as f64 / (answered + missed).max(1) as f64;
        if share > self.most_missed_share {
            let percent = 100.0 * share;
            return Health::Degraded(format!("{percent:.0} % of the revolutions are missed"));
        }
        Health::Well
    }
}

/// Answers health checks for ever. Without the socket the daemon works all the same.
pub(super) async fn serve(cid: u8, vitals: &Vitals) {
    /// After a failure, which is one of the system that will not be over at once.
    const PAUSE: Duration = Duration::from_secs(1);
    let listener = match listen(cid) {
        Ok(listener) => listener,
        Err(error) => {
            info!("no health checks: {error}");
            return std::future::pending().await;
        }
    };
    loop {
        match listener.accept().await {
            // A client that does not read has no claim to an answer.
            Ok((mut stream, _)) => {
                let answer = vitals.verdict().to_string();
                let _ = stream.write_all(answer.as_bytes()).await;
            }
            Err(_) => tokio::time::sleep(PAUSE).await,
        }
    }
}

fn listen(cid: u8) -> std::io::Result<tokio::net::UnixListener> {
    let name = format!("{NAME_PREFIX}{cid}-{}", std::process::id());
    let listener = UnixListener::bind_addr(&SocketAddr::from_abstract_name(name)?)?;
    listener.set_nonblocking(true)?;
    tokio::net::UnixListener::from_std(listener)
}

/// Asks every daemon on this host, or those of one session; `Err` says what is wrong with the first that is not well.
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
        let vitals = Vitals::new(0.05);
        assert!(matches!(vitals.verdict(), Health::Blind(why) if why.contains("yet")));
        vitals.answered(0);
        assert_eq!(vitals.verdict(), Health::Well);
        vitals.dropped(0);
        assert_eq!(vitals.verdict(), Health::Well);
        vitals.dropped(3);
        let verdict = vitals.verdict().to_string();
        assert!(
            verdict.starts_with("degraded: not keeping up: 3 dropped"),
            "{verdict}"
        );
        vitals.cut_off(Some("the interface is gone".into()));
        assert_eq!(vitals.verdict().to_string(), "blind: the interface is gone");
    }

    #[test]
    fn a_share_of_missed_revolutions_is_told() {
        let vitals = Vitals::new(0.05);
        for number in 0..100 {
            vitals.answered(u64::from(number % 50 == 7));
        }
        assert_eq!(vitals.verdict(), Health::Well);
        (0..10).for_each(|_| vitals.answered(1));
        let verdict = vitals.verdict().to_string();
        assert_eq!(verdict, "degraded: 10 % of the revolutions are missed");
    }
}
