//! The page and its pictures over HTTP.

use std::io;
use std::net::{IpAddr, SocketAddr};
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};
use std::time::Duration;

use futures_util::{SinkExt as _, StreamExt as _};
use serde::Deserialize;
use tokio::net::{TcpListener, TcpStream};
use tokio::sync::{Semaphore, mpsc, watch};
use tokio::time::{sleep, timeout};
use tokio_tungstenite::WebSocketStream;
use tokio_tungstenite::tungstenite::handshake::server::{Request, create_response};
use tokio_tungstenite::tungstenite::http::uri::Authority;
use tokio_tungstenite::tungstenite::http::{HeaderMap, Method, StatusCode, header};
use tokio_tungstenite::tungstenite::protocol::{Role, WebSocketConfig};
use tokio_tungstenite::tungstenite::{Bytes, Message};

use super::feed::{Feed, Shown};
use super::http::{self, Answer};
use super::metrics::{self, Told};
use super::picture;

/// Where the view is served if nothing else is said: for this host only.
pub const DEFAULT_ADDRESS: &str = "127.0.0.1:8111";

/// Viewers at a time; more are turned away.
const MOST_VIEWERS: usize = 64;

/// Connections at a time; more wait.
const MOST_CONNECTIONS: usize = 256;

/// A request, an answer, and a picture must be through in this time, and a viewer over whom nothing goes for so long is
/// given up; pictures go ten times a second.
const LONGEST_SILENCE: Duration = Duration::from_secs(30);

/// Until connections are taken again after none could be.
const AFTER_A_FAILURE: Duration = Duration::from_millis(100);

/// Longest message of a viewer, bytes.
const LONGEST_CONTROL: usize = 1024;

/// Messages of viewers that wait; more are left out.
const MOST_CONTROLS: usize = 16;

/// What a viewer of a recording asks for.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Control {
    /// Go on, or pause.
    Play(bool),
    /// So many times as fast as recorded.
    Speed(f64),
    /// To a time, seconds since the begin.
    Seek(f64),
    /// So many revolutions on; back, if negative.
    Step(i32),
}

#[derive(Clone)]
struct Served {
    shown: watch::Sender<Shown>,
    told: watch::Sender<Option<Told>>,
    controls: mpsc::Sender<Control>,
    viewers: Arc<Semaphore>,
    /// Viewers that came so far.
    came: Arc<AtomicU64>,
}

/// Serves the view at an address from a thread of its own for as long as the process lives.
/// Gives where pictures go in and what viewers ask for.
///
/// # Errors
/// When the address cannot be had.
pub fn serve(address: SocketAddr) -> io::Result<(Feed, mpsc::Receiver<Control>)> {
    let listener = std::net::TcpListener::bind(address)?;
    listener.set_nonblocking(true)?;
    // The system's choice, if port 0 was asked for.
    let address = listener.local_addr()?;
    let runtime = tokio::runtime::Builder::new_current_thread()
        .enable_all()
        .build()?;
    let shown = watch::Sender::new(Shown::default());
    let (controls, asked) = mpsc::channel(MOST_CONTROLS);
    let told = watch::Sender::new(None);
    let served = Served {
        shown: shown.clone(),
        told: told.clone(),
        controls,
        viewers: Arc::new(Semaphore::new(MOST_VIEWERS)),
        came: Arc::default(),
    };
    let feed = Feed::new(address, shown, told, served.came.clone());
    let serve =
        move || runtime.block_on(async { listen(TcpListener::from_std(listener)?, served).await });
    std::thread::Builder::new()
        .name("view".into())
        .spawn(serve)?;
    Ok((feed, asked))
}

macro_rules! page {
    ($($path:literal => $file:literal, $kind:literal;)*) => {
        /// The page's files, each with its path and type.
        const PAGE: &[(&str, &str, &str)] = &[
            $(($path, $kind, include_str!(concat!("page/", $file))),)*
        ];
    };
}

page! {
    "/" => "index.html", "text/html; charset=utf-8";
    "/style.css" => "style.css", "text/css; charset=utf-8";
    "/main.js" => "main.js", "text/javascript; charset=utf-8";
    "/wire.js" => "wire.js", "text/javascript; charset=utf-8";
    "/map.js" => "map.js", "text/javascript; charset=utf-8";
    "/scene.js" => "scene.js", "text/javascript; charset=utf-8";
    "/panel.js" => "panel.js", "text/javascript; charset=utf-8";
}

/// Takes connections, so many at a time.
async fn listen(listener: TcpListener, served: Served) -> io::Result<()> {
    let connections = Arc::new(Semaphore::new(MOST_CONNECTIONS));
    loop {
        // The semaphore is never closed.
        let Ok(permit) = connections.clone().acquire_owned().await else {
            return Ok(());
        };
        match listener.accept().await {
            Ok((stream, _)) => {
                // The end of a picture must not wait until its begin is acknowledged.
                let _ = stream.set_nodelay(true);
                let served = served.clone();
                tokio::spawn(async move {
                    answer(stream, served, LONGEST_SILENCE).await;
                    drop(permit);
                });
            }
            // Out of descriptors, say: others may end meanwhile.
            Err(_) => sleep(AFTER_A_FAILURE).await,
        }
    }
}

/// Answers what a connection asks for, and ends it; who says nothing for so long is not waited for.
async fn answer(mut stream: TcpStream, served: Served, patience: Duration) {
    let Ok(Ok((request, rest))) = timeout(patience, http::read(&mut stream)).await else {
        return;
    };
    let is_head = |request: &Request| request.method() == Method::HEAD;
    let with_body = !request.as_ref().is_ok_and(is_head);
    let answer = match request {
        Ok(request) if !is_own_page(request.headers()) => Answer::text(
            StatusCode::FORBIDDEN,
            "open this page by its address; only the page that is served here may look",
        ),
        Ok(request) if request.uri().path() == "/pictures" => {
            match served.viewers.clone().try_acquire_owned() {
                Ok(place) => {
                    show(stream, &request, rest, served, patience).await;
                    return drop(place);
                }
                Err(_) => Answer::text(StatusCode::SERVICE_UNAVAILABLE, "too many viewers"),
            }
        }
        Ok(request) => page(request.uri().path(), &served),
        Err(status) => Answer::text(status, ""),
    };
    // Who does not take it is gone.
    let _ = timeout(patience, http::write(&mut stream, &answer, with_body)).await;
}

/// What is found at a path.
fn page(path: &str, served: &Served) -> Answer {
    match path {
        // What Prometheus asks for; nothing where no daemon tells its Status.
        "/metrics" => {
            let told = served.told.borrow().clone();
            Answer {
                status: StatusCode::OK,
                kind: "text/plain; version=0.0.4",
                body: told
                    .map(|told| metrics::text(&told))
                    .unwrap_or_default()
                    .into(),
            }
        }
        // The same as `kreisel health` says.
        "/health" => {
            let told = served.told.borrow().clone();
            match metrics::health(told.as_ref()) {
                Ok(()) => Answer::text(StatusCode::OK, "ok"),
                Err(why) => Answer::text(StatusCode::SERVICE_UNAVAILABLE, why),
            }
        }
        _ => match PAGE.iter().find(|(own, _, _)| *own == path) {
            Some((_, kind, text)) => Answer {
                status: StatusCode::OK,
                kind,
                body: (*text).into(),
            },
            None => Answer::text(StatusCode::NOT_FOUND, ""),
        },
    }
}

/// Opens the stream of pictures, if that is what is asked for.
async fn show(
    mut stream: TcpStream,
    request: &Request,
    rest: Vec<u8>,
    served: Served,
    patience: Duration,
) {
    let Ok(switching) = create_response(request) else {
        let answer = Answer::text(StatusCode::BAD_REQUEST, "this is a WebSocket");
        let _ = timeout(patience, http::write(&mut stream, &answer, true)).await;
        return;
    };
    if !matches!(
        timeout(patience, http::write_head(&mut stream, &switching)).await,
        Ok(Ok(()))
    ) {
        return;
    }
    let limits = WebSocketConfig::default()
        .max_message_size(Some(LONGEST_CONTROL))
        .max_frame_size(Some(LONGEST_CONTROL));
    let socket =
        WebSocketStream::from_partially_read(stream, rest, Role::Server, Some(limits)).await;
    let shown = served.shown.subscribe();
    served.came.fetch_add(1, Ordering::Release);
    send_pictures(socket, shown, served.controls, patience).await;
}

/// Whether what asks is our own page, or no browser: a WebSocket is not held back by the same-origin policy, and a
/// page whose name server leads here passes for our own. What is no browser names no origin; names that anybody
/// can register have a dot.
fn is_own_page(headers: &HeaderMap) -> bool {
    let text = |name| headers.get(name).and_then(|value| value.to_str().ok());
    let Some(host) = text(header::HOST).and_then(|host| host.parse::<Authority>().ok()) else {
        return false;
    };
    let is_same = text(header::ORIGIN).is_none_or(|origin| {
        let authority = origin.split_once("://").map(|(_, authority)| authority);
        authority == Some(host.as_str())
    });
    let name = host.host().trim_matches(['[', ']']);
    is_same && (name.parse::<IpAddr>().is_ok() || !name.contains('.'))
}

/// Sends pictures to a viewer, always the newest, and takes what it asks for, until it is gone.
async fn send_pictures(
    mut socket: WebSocketStream<TcpStream>,
    mut shown: watch::Receiver<Shown>,
    controls: mpsc::Sender<Control>,
    patience: Duration,
) {
    let mut last = None;
    loop {
        tokio::select! {
            changed = shown.changed() => {
                if changed.is_err() {
                    return;
                }
                let newest = shown.borrow_and_update().clone();
                let is_behind = last.is_some_and(|last| newest.number > last + 1);
                last = Some(newest.number);
                let bytes = if is_behind {
                    picture::thinned(&newest.bytes).map_or(newest.bytes, Bytes::from)
                } else {
                    newest.bytes
                };
                let sent = timeout(patience, socket.send(Message::Binary(bytes))).await;
                if !matches!(sent, Ok(Ok(()))) {
                    return;
                }
            }
            message = timeout(patience, socket.next()) => match message {
                Ok(Some(Ok(Message::Text(text)))) => {
                    if let Ok(control) = serde_json::from_str(&text) {
                        // When nobody listens, or too much was asked for, it is left out.
                        let _ = controls.try_send(control);
                    }
                }
                Ok(Some(Ok(_))) => {}
                // It is gone, or nothing was shown for so long, either: whoever is still there comes again.
                Ok(Some(Err(_)) | None) | Err(_) => return,
            },
        }
    }
}

#[cfg(test)]
mod tests {
    use tokio::io::{AsyncReadExt as _, AsyncWriteExt as _};
    use tokio_tungstenite::tungstenite::http::HeaderValue;

    use super::*;

    #[test]
    fn only_the_page_itself_may_look() {
        let may_look = |host: &'static str, origin: Option<&'static str>| {
            let mut headers = HeaderMap::new();
            headers.insert(header::HOST, HeaderValue::from_static(host));
            if let Some(origin) = origin {
                headers.insert(header::ORIGIN, HeaderValue::from_static(origin));
            }
            is_own_page(&headers)
        };
        let here = "127.0.0.1:8111";
        assert!(may_look(here, Some("http://127.0.0.1:8111")));
        assert!(may_look("[::1]:8111", None) && may_look("[::1]", None));
        assert!(may_look("localhost:8111", None) && may_look("perception:8111", None));
        assert!(!may_look(here, Some("http://elsewhere.example")));
        assert!(!may_look(here, Some("null")));
        let misled = "elsewhere.example:8111";
        assert!(
            !may_look(misled, Some("http://elsewhere.example:8111")) && !may_look(misled, None)
        );
        assert!(!is_own_page(&HeaderMap::new()));
    }

    /// A connection that is served so patiently.
    async fn connected(patience: Duration) -> (TcpStream, Served) {
        let served = Served {
            shown: watch::Sender::default(),
            told: watch::Sender::default(),
            controls: mpsc::channel(1).0,
            viewers: Arc::new(Semaphore::new(1)),
            came: Arc::default(),
        };
        let listener = TcpListener::bind("127.0.0.1:0").await.unwrap();
        let client = TcpStream::connect(listener.local_addr().unwrap());
        let (client, accepted) = tokio::join!(client, listener.accept());
        let (stream, _) = accepted.unwrap();
        tokio::spawn(answer(stream, served.clone(), patience));
        (client.unwrap(), served)
    }

    #[tokio::test]
    async fn who_asks_for_nothing_is_given_up() {
        let (mut client, _served) = connected(Duration::from_millis(100)).await;
        client.write_all(b"GET /").await.unwrap();
        let mut answer = vec![];
        client.read_to_end(&mut answer).await.unwrap();
        assert_eq!(answer, b"");
    }

    #[tokio::test]
    async fn what_is_refused_is_told_why_and_a_head_has_no_body() {
        let answer_to = async |asked: &str| {
            let (mut client, _served) = connected(Duration::from_secs(5)).await;
            client.write_all(asked.as_bytes()).await.unwrap();
            let mut answer = String::new();
            client.read_to_string(&mut answer).await.unwrap();
            answer
        };
        let refused = answer_to("POST / HTTP/1.1\r\nHost: localhost\r\n\r\n").await;
        assert!(refused.starts_with("HTTP/1.1 405"), "{refused}");
        assert!(refused.ends_with("\r\n\r\nMethod Not Allowed"), "{refused}");
        let head = answer_to("HEAD / HTTP/1.1\r\nHost: localhost\r\n\r\n").await;
        assert!(head.starts_with("HTTP/1.1 200"), "{head}");
        assert!(head.ends_with("\r\n\r\n"), "{head}");
    }

    #[tokio::test]
    async fn a_viewer_over_whom_nothing_goes_is_given_up() {
        let (mut client, served) = connected(Duration::from_millis(300)).await;
        let asked = "GET /pictures HTTP/1.1\r\nHost: localhost\r\nConnection: Upgrade\r\n\
            Upgrade: websocket\r\nSec-WebSocket-Version: 13\r\n\
            Sec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ==\r\n\r\n";
        client.write_all(asked.as_bytes()).await.unwrap();
        let mut head = [0; 12];
        client.read_exact(&mut head).await.unwrap();
        assert_eq!(&head, b"HTTP/1.1 101");
        // As long as pictures come, it is kept.
        for _ in 0..6 {
            sleep(Duration::from_millis(100)).await;
            assert_eq!(served.viewers.available_permits(), 0);
            served.shown.send_modify(|shown| shown.number += 1);
        }
        client.read_to_end(&mut vec![]).await.unwrap();
        assert_eq!(served.viewers.available_permits(), 1);
    }

    #[test]
    fn what_a_viewer_asks_for_is_read() {
        let read = |text| serde_json::from_str::<Control>(text).ok();
        assert_eq!(read(r#"{"play":true}"#), Some(Control::Play(true)));
        assert_eq!(read(r#"{"seek":1.5}"#), Some(Control::Seek(1.5)));
        assert_eq!(read(r#"{"step":-1}"#), Some(Control::Step(-1)));
        assert_eq!(read("[]"), None);
    }
}
