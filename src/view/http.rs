//! HTTP/1.1 as far as the view needs it: one request a connection, answered whole.

use std::borrow::Cow;
use std::io;

use tokio::io::{AsyncReadExt as _, AsyncWriteExt as _};
use tokio::net::TcpStream;
use tokio_tungstenite::tungstenite::Error;
use tokio_tungstenite::tungstenite::error::ProtocolError;
use tokio_tungstenite::tungstenite::handshake::machine::TryParse as _;
use tokio_tungstenite::tungstenite::handshake::server::{Request, Response, write_response};
use tokio_tungstenite::tungstenite::http::{HeaderValue, Method, StatusCode, header};

/// Longest head of a request, bytes.
///
/// Cookies belong to a host, whatever else it serves.
const LONGEST_HEAD: usize = 1 << 15;

/// Of what comes behind a request, so much is read before the connection is closed, bytes.
const MOST_UNREAD: usize = 1 << 16;

/// The page loads nothing from elsewhere, and no other page may frame it.
const POLICY: &str = "default-src 'self'; img-src 'self' data:; frame-ancestors 'none'";

/// What is answered.
#[derive(Debug, PartialEq)]
pub(super) struct Answer {
    pub(super) status: StatusCode,
    /// Type of the body.
    pub(super) kind: &'static str,
    pub(super) body: Cow<'static, str>,
}

impl Answer {
    /// A line for a person; by default what the status means.
    pub(super) fn text(status: StatusCode, line: impl Into<Cow<'static, str>>) -> Self {
        let line = line.into();
        Self {
            status,
            kind: "text/plain; charset=utf-8",
            body: if line.is_empty() {
                status.canonical_reason().unwrap_or_default().into()
            } else {
                line
            },
        }
    }
}

/// Reads a request's head, or tells what is to be said of it, with what came behind it.
///
/// # Errors
/// When the connection ends before.
pub(super) async fn read(
    stream: &mut TcpStream,
) -> io::Result<(Result<Request, StatusCode>, Vec<u8>)> {
    /// A HEAD is a GET whose answer has no body; the parser knows GET alone.
    const HEAD: &[u8] = b"HEAD ";
    let mut head = vec![];
    let mut is_head = false;
    loop {
        if stream.read_buf(&mut head).await? == 0 {
            return Err(io::ErrorKind::UnexpectedEof.into());
        }
        if head.len() < HEAD.len() {
            continue;
        }
        if head.starts_with(HEAD) {
            head.splice(..HEAD.len(), *b"GET ");
            is_head = true;
        }
        let refused = match Request::try_parse(&head) {
            Ok(Some((length, mut request))) => {
                if is_head {
                    *request.method_mut() = Method::HEAD;
                }
                return Ok((Ok(request), head.split_off(length)));
            }
            Ok(None) if head.len() < LONGEST_HEAD => continue,
            Ok(None) => StatusCode::REQUEST_HEADER_FIELDS_TOO_LARGE,
            Err(Error::Protocol(ProtocolError::WrongHttpMethod)) => StatusCode::METHOD_NOT_ALLOWED,
            Err(Error::Protocol(ProtocolError::WrongHttpVersion)) => {
                StatusCode::HTTP_VERSION_NOT_SUPPORTED
            }
            Err(_) => StatusCode::BAD_REQUEST,
        };
        return Ok((Err(refused), vec![]));
    }
}

/// Sends an answer, with its body or without, the last one of a connection.
///
/// # Errors
/// When the connection ends before.
pub(super) async fn write(
    stream: &mut TcpStream,
    answer: &Answer,
    with_body: bool,
) -> io::Result<()> {
    let mut response = Response::new(());
    *response.status_mut() = answer.status;
    let headers = response.headers_mut();
    for (name, value) in [
        (header::CONTENT_TYPE, answer.kind),
        (header::CONTENT_SECURITY_POLICY, POLICY),
        (header::X_CONTENT_TYPE_OPTIONS, "nosniff"),
        (header::CACHE_CONTROL, "no-cache"),
        (header::CONNECTION, "close"),
        (header::ALLOW, "GET, HEAD"),
    ] {
        headers.insert(name, HeaderValue::from_static(value));
    }
    headers.insert(header::CONTENT_LENGTH, answer.body.len().into());
    write_head(stream, &response).await?;
    if with_body {
        stream.write_all(answer.body.as_bytes()).await?;
    }
    stream.shutdown().await?;
    // What is left unread when a connection is closed takes the answer with it.
    let mut rest = [0; 1024];
    for _ in 0..MOST_UNREAD / rest.len() {
        if stream.read(&mut rest).await? == 0 {
            break;
        }
    }
    Ok(())
}

/// Sends the head of a response alone.
///
/// # Errors
/// When the connection ends before.
pub(super) async fn write_head(stream: &mut TcpStream, response: &Response) -> io::Result<()> {
    let mut head = vec![];
    write_response(&mut head, response).map_err(io::Error::other)?;
    stream.write_all(&head).await
}

#[cfg(test)]
mod tests {
    use tokio::net::TcpListener;

    use super::*;

    /// What is read of what somebody sends, piece by piece, before the connection is closed.
    async fn read_of(pieces: &[&[u8]]) -> io::Result<(Result<Request, StatusCode>, Vec<u8>)> {
        let listener = TcpListener::bind("127.0.0.1:0").await.unwrap();
        let mut client = TcpStream::connect(listener.local_addr().unwrap())
            .await
            .unwrap();
        client.set_nodelay(true).unwrap();
        let (mut stream, _) = listener.accept().await.unwrap();
        let read = tokio::spawn(async move { read(&mut stream).await });
        for piece in pieces {
            client.write_all(piece).await.unwrap();
            tokio::time::sleep(std::time::Duration::from_millis(20)).await;
        }
        drop(client);
        read.await.unwrap()
    }

    #[tokio::test]
    async fn a_request_may_come_in_pieces_and_with_more_behind_it() {
        let pieces = [
            &b"GET /health HT"[..],
            b"TP/1.1\r\nHost: localhost\r",
            b"\n\r\nmore",
        ];
        let (request, rest) = read_of(&pieces).await.unwrap();
        let request = request.unwrap();
        assert_eq!(request.uri().path(), "/health");
        assert_eq!(request.headers()["host"], "localhost");
        assert_eq!(rest, b"more");
        let (request, _) = read_of(&[b"HE", b"AD / HTTP/1.1\r\n\r\n"]).await.unwrap();
        assert_eq!(request.unwrap().method(), Method::HEAD);
    }

    #[tokio::test]
    async fn what_is_no_request_is_refused_by_name() {
        let refused =
            async |piece: &[u8]| read_of(&[piece]).await.map(|(request, _)| request.err());
        let post = b"POST / HTTP/1.1\r\n\r\n";
        assert_eq!(
            refused(post).await.unwrap(),
            Some(StatusCode::METHOD_NOT_ALLOWED)
        );
        assert_eq!(
            refused(&[0xff; 4096]).await.unwrap(),
            Some(StatusCode::BAD_REQUEST)
        );
        let old = b"GET / HTTP/1.0\r\n\r\n";
        assert_eq!(
            refused(old).await.unwrap(),
            Some(StatusCode::HTTP_VERSION_NOT_SUPPORTED)
        );
        let long = [&b"GET / HTTP/1.1\r\nHost: "[..], &[b'x'; LONGEST_HEAD]].concat();
        assert_eq!(
            refused(&long).await.unwrap(),
            Some(StatusCode::REQUEST_HEADER_FIELDS_TOO_LARGE)
        );
        assert!(refused(b"GET / HTTP/1.1\r\n").await.is_err());
    }
}
