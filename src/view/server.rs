//! The page and its pictures over HTTP.

use std::io;
use std::net::{IpAddr, SocketAddr};
use std::pin::Pin;
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};
use std::task::{Context, Poll};
use std::time::Duration;

use axum::Router;
use axum::body::Bytes;
use axum::extract::ws::{Message, WebSocket, WebSocketUpgrade};
use axum::extract::{Request, State};
use axum::http::uri::Authority;
use axum::http::{HeaderMap, HeaderValue, StatusCode, header};
use axum::middleware::{self, Next};
use axum::response::{IntoResponse, Response};
use axum::routing::get;
use serde::Deserialize;
use tokio::io::{AsyncRead, AsyncWrite, ReadBuf};
use tokio::net::{TcpListener, TcpStream};
use tokio::sync::{OwnedSemaphorePermit, Semaphore, mpsc, watch};
use tokio::time::{Instant, Sleep, sleep};

use super::feed::{Feed, Shown};
use super::metrics::{self, Told};
use super::picture;

/// Where the view is served if nothing else is said: for this host only.
pub const DEFAULT_ADDRESS: &str = "127.0.0.1:8111";

/// Viewers at a time; more are turned away.
const MOST_VIEWERS: usize = 64;

/// Connections at a time; more wait.
const MOST_CONNECTIONS: usize = 256;

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
    let serve = move || {
        runtime.block_on(async {
            let listener = Limited {
                listener: TcpListener::from_std(listener)?,
                connections: Arc::new(Semaphore::new(MOST_CONNECTIONS)),
            };
            axum::serve(listener, router(served)).await
        })
    };
    std::thread::Builder::new()
        .name("view".into())
        .spawn(serve)?;
    Ok((feed, asked))
}

/// A listener that takes so many connections at a time.
struct Limited {
    listener: TcpListener,
    connections: Arc<Semaphore>,
}

impl axum::serve::Listener for Limited {
    type Io = Connection;
    type Addr = SocketAddr;

    async fn accept(&mut self) -> (Self::Io, Self::Addr) {
        loop {
            // The semaphore is never closed.
            let Ok(permit) = self.connections.clone().acquire_owned().await else {
                return std::future::pending().await;
            };
            let (stream, address) = axum::serve::Listener::accept(&mut self.listener).await;
            if stream.set_nodelay(true).is_ok() {
                return (Connection::new(stream, LONGEST_SILENCE, permit), address);
            }
        }
    }

    fn local_addr(&self) -> io::Result<Self::Addr> {
        self.listener.local_addr()
    }
}

/// A connection over which nothing goes for so long is given up; pictures go ten times a second.
const LONGEST_SILENCE: Duration = Duration::from_secs(30);

/// A connection, counted for as long as it lives.
struct Connection {
    stream: TcpStream,
    /// How long nothing may go over it.
    patience: Duration,
    /// When it is given up.
    end: Pin<Box<Sleep>>,
    _permit: OwnedSemaphorePermit,
}

impl Connection {
    fn new(stream: TcpStream, patience: Duration, permit: OwnedSemaphorePermit) -> Self {
        Self {
            stream,
            patience,
            end: Box::pin(sleep(patience)),
            _permit: permit,
        }
    }

    /// What came of reading or writing, unless nothing has come of it for too long.
    fn or_end<T>(
        &mut self,
        context: &mut Context<'_>,
        result: Poll<io::Result<T>>,
    ) -> Poll<io::Result<T>> {
        if result.is_ready() {
            self.end.as_mut().reset(Instant::now() + self.patience);
            result
        } else {
            let ended = self.end.as_mut().poll(context);
            ended.map(|()| Err(io::ErrorKind::TimedOut.into()))
        }
    }
}

impl AsyncRead for Connection {
    fn poll_read(
        mut self: Pin<&mut Self>,
        context: &mut Context<'_>,
        buffer: &mut ReadBuf<'_>,
    ) -> Poll<io::Result<()>> {
        let read = Pin::new(&mut self.stream).poll_read(context, buffer);
        self.or_end(context, read)
    }
}

impl AsyncWrite for Connection {
    fn poll_write(
        mut self: Pin<&mut Self>,
        context: &mut Context<'_>,
        bytes: &[u8],
    ) -> Poll<io::Result<usize>> {
        let written = Pin::new(&mut self.stream).poll_write(context, bytes);
        self.or_end(context, written)
    }

    fn poll_flush(mut self: Pin<&mut Self>, context: &mut Context<'_>) -> Poll<io::Result<()>> {
        Pin::new(&mut self.stream).poll_flush(context)
    }

    fn poll_shutdown(mut self: Pin<&mut Self>, context: &mut Context<'_>) -> Poll<io::Result<()>> {
        Pin::new(&mut self.stream).poll_shutdown(context)
    }
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

/// The page loads nothing from elsewhere, and no other page may frame it.
const POLICY: &str = "default-src 'self'; img-src 'self' data:; frame-ancestors 'none'";

fn router(served: Served) -> Router {
    let files = PAGE
        .iter()
        .fold(Router::new(), |router, (path, kind, text)| {
            let headers = [
                (header::CONTENT_TYPE, *kind),
                (header::CONTENT_SECURITY_POLICY, POLICY),
                (header::X_CONTENT_TYPE_OPTIONS, "nosniff"),
                (header::CACHE_CONTROL, "no-cache"),
            ];
            router.route(path, get(move || async move { (headers, *text) }))
        });
    files
        .route("/pictures", get(pictures))
        .route("/metrics", get(metrics))
        .route("/health", get(health))
        .layer(middleware::from_fn(refuse_strangers))
        .with_state(served)
}

/// What Prometheus asks for; nothing where no daemon tells its Status.
async fn metrics(State(served): State<Served>) -> Response {
    let told = served.told.borrow().clone();
    let text = told.map(|told| metrics::text(&told)).unwrap_or_default();
    ([(header::CONTENT_TYPE, "text/plain; version=0.0.4")], text).into_response()
}

/// The same as `kreisel health` says.
async fn health(State(served): State<Served>) -> Response {
    let told = served.told.borrow().clone();
    match metrics::health(told.as_ref()) {
        Ok(()) => "ok".into_response(),
        Err(why) => (StatusCode::SERVICE_UNAVAILABLE, why).into_response(),
    }
}

/// Opens the stream of pictures.
async fn pictures(State(served): State<Served>, upgrade: WebSocketUpgrade) -> Response {
    let Ok(place) = served.viewers.clone().try_acquire_owned() else {
        return (StatusCode::SERVICE_UNAVAILABLE, "too many viewers").into_response();
    };
    let upgrade = upgrade
        .max_message_size(LONGEST_CONTROL)
        .max_frame_size(LONGEST_CONTROL);
    upgrade.on_upgrade(move |socket| async move {
        let shown = served.shown.subscribe();
        served.came.fetch_add(1, Ordering::Release);
        send_pictures(socket, shown, served.controls).await;
        drop(place);
    })
}

/// Refuses what a page from elsewhere asks for.
async fn refuse_strangers(request: Request, next: Next) -> Response {
    if is_own_page(request.headers()) {
        next.run(request).await
    } else {
        let why = "open this page by its address; only the page that is served here may look";
        (StatusCode::FORBIDDEN, why).into_response()
    }
}

/// Whether what asks is our own page, or no browser: a WebSocket is not held back by the same-origin policy, and a
/// page whose name server leads here passes for our own. What is no browser names no origin; names that anybody
/// can register have a dot.
fn is_own_page(headers: &HeaderMap) -> bool {
    let text = |name| {
        headers
            .get(name)
            .and_then(|value: &HeaderValue| value.to_str().ok())
    };
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
    mut socket: WebSocket,
    mut shown: watch::Receiver<Shown>,
    controls: mpsc::Sender<Control>,
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
                if socket.send(Message::Binary(bytes)).await.is_err() {
                    return;
                }
            }
            message = socket.recv() => match message {
                Some(Ok(Message::Text(text))) => {
                    if let Ok(control) = serde_json::from_str(&text) {
                        // When nobody listens, or too much was asked for, it is left out.
                        let _ = controls.try_send(control);
                    }
                }
                Some(Ok(_)) => {}
                Some(Err(_)) | None => return,
            },
        }
    }
}

#[cfg(test)]
mod tests {
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

    #[tokio::test]
    async fn a_connection_over_which_nothing_goes_is_given_up() {
        use tokio::io::AsyncReadExt as _;
        use tokio::io::AsyncWriteExt as _;
        let listener = TcpListener::bind("127.0.0.1:0").await.unwrap();
        let mut client = TcpStream::connect(listener.local_addr().unwrap())
            .await
            .unwrap();
        let (stream, _) = listener.accept().await.unwrap();
        let connections = Arc::new(Semaphore::new(1));
        let permit = connections.clone().acquire_owned().await.unwrap();
        let mut connection = Connection::new(stream, Duration::from_millis(300), permit);
        // What says something in time is kept.
        for _ in 0..4 {
            tokio::time::sleep(Duration::from_millis(100)).await;
            client.write_all(b"x").await.unwrap();
            assert_eq!(connection.read_u8().await.unwrap(), b'x');
        }
        let error = connection.read_u8().await.unwrap_err();
        assert_eq!(error.kind(), io::ErrorKind::TimedOut);
        drop(connection);
        assert_eq!(connections.available_permits(), 1);
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
