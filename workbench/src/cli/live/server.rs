//! The server: it listens on the loopback address and answers only pages that it delivered itself.
//!
//! Another site's page in the same browser can send requests here. What it sends carries its own
//! `Origin`, or, if it had this machine's address put behind its own name, its own `Host`: neither
//! is answered.

use std::io;
use std::net::TcpListener;
use std::sync::Arc;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::time::Duration;

use http_body_util::{BodyExt, Full, Limited};
use hyper::body::{Bytes, Incoming};
use hyper::header::{self, HeaderMap, HeaderName};
use hyper::server::conn::http1;
use hyper::service::service_fn;
use hyper::{Method, Request, Response, StatusCode};
use hyper_util::rt::{TokioIo, TokioTimer};
use lamc_workbench::page;
use tokio::runtime;
use tokio::task::spawn_blocking;
use tokio::time::{sleep, timeout};

use super::board::{Board, Settings};

/// How long a page is kept waiting for something new before it has to ask again.
const PATIENCE: Duration = Duration::from_secs(20);

/// How long a client may take for a request. What is longer on its way is given up.
const SLOWEST: Duration = Duration::from_secs(10);

/// How long after a failure to accept a connection the next is tried.
const AGAIN: Duration = Duration::from_millis(100);

/// Requests that may wait at a time.
const MOST: usize = 32;

/// Most bytes of what comes before a request's body, and of the body.
const MOST_BYTES: usize = 1 << 16;

type Answer = Response<Full<Bytes>>;

/// What there is to answer with.
struct Pages {
    page: String,
    board: Arc<Board>,
    port: u16,
    waiting: AtomicUsize,
}

/// Answers requests without end.
///
/// # Errors
/// Those of the system before the first request.
pub fn serve(listener: TcpListener, port: u16, title: &str, board: Arc<Board>) -> io::Result<()> {
    let pages = Pages { page: page::live(title), board, port, waiting: AtomicUsize::new(0) };
    let pages = Arc::new(pages);
    listener.set_nonblocking(true)?;
    let runtime = runtime::Builder::new_current_thread().enable_all().build()?;
    runtime.block_on(async {
        let listener = tokio::net::TcpListener::from_std(listener)?;
        loop {
            // There may be more connections than the system allows: until some end, others wait.
            let Ok((stream, _)) = listener.accept().await else {
                sleep(AGAIN).await;
                continue;
            };
            let pages = pages.clone();
            tokio::spawn(async move {
                let answer = service_fn(|request| pages.answer(request));
                let mut connection = http1::Builder::new();
                connection.timer(TokioTimer::new()).header_read_timeout(SLOWEST);
                connection.max_buf_size(MOST_BYTES);
                // An error means that the client has closed the connection, or broken the protocol: it is not a
                // failure of the server.
                let _ = connection.serve_connection(TokioIo::new(stream), answer).await;
            });
        }
    })
}

/// Whether a request is meant for this server and comes from its own page, or from no page at all.
fn is_ours(headers: &HeaderMap, port: u16) -> bool {
    let here = [format!("127.0.0.1:{port}"), format!("localhost:{port}")];
    let is_here = |name: &str| here.iter().any(|here| here == name);
    // What is no text is empty, and no name of this server.
    let values = |name: HeaderName| {
        headers.get_all(name).into_iter().map(|value| value.to_str().unwrap_or_default())
    };
    let mut hosts = values(header::HOST);
    let host = hosts.next().is_some_and(is_here);
    let origin =
        values(header::ORIGIN).all(|origin| origin.strip_prefix("http://").is_some_and(is_here));
    let site = values(HeaderName::from_static("sec-fetch-site"))
        .all(|site| site == "same-origin" || site == "none");
    host && hosts.next().is_none() && origin && site
}

impl Pages {
    async fn answer(&self, request: Request<Incoming>) -> Result<Answer, hyper::Error> {
        if !is_ours(request.headers(), self.port) {
            return Ok(text(StatusCode::FORBIDDEN, "only pages of this server may send requests"));
        }
        let query = request.uri().query().unwrap_or_default();
        let path = request.uri().path();
        Ok(match (request.method(), path) {
            (&Method::GET, "/") => typed(StatusCode::OK, "text/html; charset=utf-8", &self.page),
            (&Method::GET, "/next") => {
                match query.strip_prefix("after=").and_then(|number| number.parse().ok()) {
                    Some(after) => self.next(after).await,
                    None => text(StatusCode::BAD_REQUEST, "not of the form /next?after=1"),
                }
            }
            (&Method::POST, "/set") => self.set(request.into_body()).await,
            _ => text(StatusCode::NOT_FOUND, "not found"),
        })
    }

    /// What is new after the answer of this number.
    async fn next(&self, after: u64) -> Answer {
        if self.waiting.fetch_add(1, Ordering::Relaxed) >= MOST {
            self.waiting.fetch_sub(1, Ordering::Relaxed);
            return text(StatusCode::SERVICE_UNAVAILABLE, "too many requests are waiting");
        }
        let board = self.board.clone();
        let found = spawn_blocking(move || board.answer_after(after, PATIENCE)).await;
        self.waiting.fetch_sub(1, Ordering::Relaxed);
        match found {
            Ok(Some(answer)) => typed(StatusCode::OK, "application/json", &answer),
            Ok(None) => text(StatusCode::NO_CONTENT, ""),
            Err(error) => text(StatusCode::INTERNAL_SERVER_ERROR, &error.to_string()),
        }
    }

    /// The sliders were moved.
    async fn set(&self, body: Incoming) -> Answer {
        let body = match timeout(SLOWEST, Limited::new(body, MOST_BYTES).collect()).await {
            Ok(Ok(body)) => body.to_bytes(),
            Ok(Err(error)) => return text(StatusCode::BAD_REQUEST, &error.to_string()),
            Err(_) => return text(StatusCode::REQUEST_TIMEOUT, "the body has not come"),
        };
        match serde_json::from_slice::<Settings>(&body) {
            Ok(settings) => {
                self.board.set(settings);
                text(StatusCode::NO_CONTENT, "")
            }
            Err(error) => text(StatusCode::BAD_REQUEST, &error.to_string()),
        }
    }
}

fn text(status: StatusCode, text: &str) -> Answer {
    typed(status, "text/plain; charset=utf-8", text)
}

fn typed(status: StatusCode, kind: &'static str, body: &str) -> Answer {
    let mut answer = Response::new(Full::from(body.to_owned()));
    *answer.status_mut() = status;
    let headers = answer.headers_mut();
    for (name, value) in [
        (header::CONTENT_TYPE, kind),
        (header::CACHE_CONTROL, "no-store"),
        (header::X_CONTENT_TYPE_OPTIONS, "nosniff"),
        (header::X_FRAME_OPTIONS, "DENY"),
        (HeaderName::from_static("cross-origin-resource-policy"), "same-origin"),
    ] {
        headers.insert(name, header::HeaderValue::from_static(value));
    }
    answer
}
