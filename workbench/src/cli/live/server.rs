//! The server: it listens on the loopback address and answers only pages that it delivered itself.
//!
//! Another site's page in the same browser can send requests here. What it sends carries its own
//! `Origin`, or, if it had this machine's address put behind its own name, its own `Host`: neither
//! is answered.

use std::io::{Cursor, Read};
use std::sync::atomic::{AtomicUsize, Ordering};
use std::thread;
use std::time::Duration;

use lamc_workbench::page;
use tiny_http::{Header, Method, Request, Response, Server};

use super::super::{Outcome, fail};
use super::board::{Board, Settings};

/// How long a page is kept waiting for something new before it has to ask again.
const PATIENCE: Duration = Duration::from_secs(20);

/// Requests that may wait at a time.
const MOST: usize = 32;

/// Most bytes of a request's body.
const MOST_BYTES: u64 = 1 << 16;

type Answer = Response<Cursor<Vec<u8>>>;

/// Answers requests until the server fails.
pub fn serve(server: &Server, port: u16, title: &str, board: &Board) -> Outcome {
    let page = page::live(title);
    let waiting = AtomicUsize::new(0);
    thread::scope(|scope| {
        loop {
            let mut request = server.recv().map_err(fail)?;
            if waiting.load(Ordering::Relaxed) >= MOST {
                // An error means that the client has closed the connection, which is not a failure
                // of the server.
                let _ = request.respond(text(503, "too many requests are waiting"));
                continue;
            }
            waiting.fetch_add(1, Ordering::Relaxed);
            scope.spawn(|| {
                let answer = match is_ours(&request, port) {
                    true => answer(&mut request, &page, board),
                    false => text(403, "only pages of this server may send requests"),
                };
                let _ = request.respond(answer);
                waiting.fetch_sub(1, Ordering::Relaxed);
            });
        }
    })
}

/// Whether a request is meant for this server and comes from its own page, or from no page at all.
fn is_ours(request: &Request, port: u16) -> bool {
    let here = [format!("127.0.0.1:{port}"), format!("localhost:{port}")];
    let values = |name: &'static str| {
        let named = request.headers().iter().filter(move |header| header.field.equiv(name));
        named.map(|header| header.value.as_str())
    };
    let mut hosts = values("Host");
    let host = hosts.next().is_some_and(|host| here.iter().any(|name| name == host));
    let origin = values("Origin").all(|origin| {
        origin.strip_prefix("http://").is_some_and(|site| here.iter().any(|name| name == site))
    });
    let site = values("Sec-Fetch-Site").all(|site| site == "same-origin" || site == "none");
    host && hosts.next().is_none() && origin && site
}

fn answer(request: &mut Request, page: &str, board: &Board) -> Answer {
    let (path, query) = match request.url().split_once('?') {
        Some((path, query)) => (path, query),
        None => (request.url(), ""),
    };
    match (request.method(), path) {
        (Method::Get, "/") => typed(200, "text/html; charset=utf-8", page),
        (Method::Get, "/next") => {
            let after = query.strip_prefix("after=").and_then(|number| number.parse().ok());
            let Some(after) = after else { return text(400, "not of the form /next?after=1") };
            match board.answer_after(after, PATIENCE) {
                Some(answer) => typed(200, "application/json", &answer),
                None => text(204, ""),
            }
        }
        (Method::Post, "/set") => {
            let mut body = String::new();
            let read = request.as_reader().take(MOST_BYTES).read_to_string(&mut body);
            match (read, serde_json::from_str::<Settings>(&body)) {
                (Ok(_), Ok(settings)) => {
                    board.set(settings);
                    text(204, "")
                }
                (Err(error), _) => text(400, &error.to_string()),
                (_, Err(error)) => text(400, &error.to_string()),
            }
        }
        _ => text(404, "not found"),
    }
}

fn text(status: u16, text: &str) -> Answer {
    typed(status, "text/plain; charset=utf-8", text)
}

fn typed(status: u16, kind: &str, body: &str) -> Answer {
    let headers = [
        ("Content-Type", kind),
        ("Cache-Control", "no-store"),
        ("X-Content-Type-Options", "nosniff"),
        ("X-Frame-Options", "DENY"),
        ("Cross-Origin-Resource-Policy", "same-origin"),
    ];
    let mut answer = Response::from_data(body).with_status_code(status);
    for (name, value) in headers {
        if let Ok(header) = Header::from_bytes(name, value) {
            answer.add_header(header);
        }
    }
    answer
}
