//! The server of `lamc live` under what no browser sends: broken requests, clients that are slow, and a thousand of
//! them.

use std::io::{BufRead, BufReader, Read, Write};
use std::net::{Shutdown, SocketAddr, TcpStream};
use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};
use std::{fs, thread};

use super::common::{example, lamc};

/// A server, ended when it is dropped.
struct Live {
    process: Child,
    address: SocketAddr,
}

impl Drop for Live {
    fn drop(&mut self) {
        let _ = self.process.kill();
        let _ = self.process.wait();
    }
}

impl Live {
    fn started(mut command: Command) -> Self {
        let mut process = command.stdout(Stdio::piped()).spawn().unwrap();
        let mut line = String::new();
        BufReader::new(process.stdout.take().unwrap()).read_line(&mut line).unwrap();
        let address = line.split(['/', ' ']).find_map(|part| part.parse().ok());
        let address = address.unwrap_or_else(|| panic!("no address in {line}"));
        Self { process, address }
    }

    fn new() -> Self {
        let mut command = lamc();
        command.args(["live", &example("pendulum.yaml"), "--port", "0"]);
        Self::started(command)
    }

    fn connect(&self) -> TcpStream {
        let stream = TcpStream::connect(self.address).unwrap();
        stream.set_read_timeout(Some(Duration::from_secs(10))).unwrap();
        stream
    }

    /// Sends bytes, perhaps as all there will be, and returns the beginning of the answer: empty if the connection
    /// was closed.
    fn ask(&self, bytes: &[u8], is_all: bool) -> String {
        let mut stream = self.connect();
        let _ = stream.write_all(bytes);
        if is_all {
            let _ = stream.shutdown(Shutdown::Write);
        }
        let mut answer = vec![0; 300];
        let read = stream.read(&mut answer).unwrap_or(0);
        String::from_utf8_lossy(&answer[..read]).into_owned()
    }

    /// The page is there, soon.
    fn answers(&mut self) {
        assert!(self.process.try_wait().unwrap().is_none(), "the server has ended");
        let begin = Instant::now();
        let request =
            format!("GET / HTTP/1.1\r\nHost: {}\r\nConnection: close\r\n\r\n", self.address);
        let answer = self.ask(request.as_bytes(), false);
        assert!(answer.starts_with("HTTP/1.1 200 "), "{answer}");
        assert!(begin.elapsed() < Duration::from_secs(2), "{:?}", begin.elapsed());
    }

    /// Threads, and kilobytes of memory.
    #[cfg(target_os = "linux")]
    fn size(&self) -> [usize; 2] {
        let status = fs::read_to_string(format!("/proc/{}/status", self.process.id())).unwrap();
        ["Threads:", "VmRSS:"].map(|key| {
            let line = status.lines().find_map(|line| line.strip_prefix(key)).unwrap();
            line.trim().trim_end_matches(" kB").parse().unwrap()
        })
    }
}

#[test]
fn broken_requests() {
    let mut live = Live::new();
    let host = format!("Host: {}\r\n", live.address);
    let long = "a".repeat(1 << 20);
    let deep = "[".repeat(60_000);
    let post = |length: usize, body: &str| {
        format!("POST /set HTTP/1.1\r\n{host}Content-Length: {length}\r\n\r\n{body}")
    };
    let requests = [
        String::new(),
        "\r\n\r\n".to_owned(),
        "\0\x01\x02\u{7f}\r\n\r\n".to_owned(),
        "GET".to_owned(),
        "GET /\r\n\r\n".to_owned(),
        "GET / HTTP/9.9\r\n\r\n".to_owned(),
        "GET / HTTP/1.1\r\n\r\n".to_owned(),
        format!("BREW / HTTP/1.1\r\n{host}\r\n"),
        format!("GET /next?after=-1 HTTP/1.1\r\n{host}\r\n"),
        format!("GET /next?after=99999999999999999999999 HTTP/1.1\r\n{host}\r\n"),
        format!("GET /../../etc/passwd HTTP/1.1\r\n{host}\r\n"),
        format!("GET /{long} HTTP/1.1\r\n{host}\r\n"),
        format!("GET / HTTP/1.1\r\n{host}X: {long}\r\n\r\n"),
        format!("GET / HTTP/1.1\r\n{host}{host}\r\n"),
        format!("GET / HTTP/1.1\r\n{}\r\n", "X: y\r\n".repeat(20_000)),
        format!("POST /set HTTP/1.1\r\n{host}Content-Length: -1\r\n\r\n"),
        format!("POST /set HTTP/1.1\r\n{host}Transfer-Encoding: chunked\r\n\r\nzz\r\n{{}}\r\n"),
        format!("POST /set HTTP/1.1\r\n{host}Expect: nothing\r\n\r\n"),
        post(usize::MAX, "{}"),
        post(1 << 40, "{"),
        post(deep.len(), &deep),
        post(2, "{}"),
        post(4, "null"),
        post(46, r#"{"parameters":{"k":1e999},"initial":{"j0":[]}}"#),
    ];
    for request in requests {
        let answer = live.ask(request.as_bytes(), true);
        let is_error = answer.split(' ').nth(1).is_some_and(|status| status >= "400");
        assert!(answer.is_empty() || is_error, "{request:.60}: {answer}");
        live.answers();
    }
}

#[test]
fn slow_clients_and_a_thousand_connections() {
    let mut live = Live::new();
    live.answers();
    // The motion has been simulated.
    thread::sleep(Duration::from_millis(500));
    let before = live.size();
    let mut clients: Vec<TcpStream> = (0..1000).map(|_| live.connect()).collect();
    live.answers();
    for letter in b"GET / HT" {
        for client in &mut clients {
            let _ = client.write_all(&[*letter]);
        }
        live.answers();
    }
    let during = live.size();
    drop(clients);
    let begin = Instant::now();
    while live.size()[0] > before[0] + 40 {
        assert!(begin.elapsed() < Duration::from_secs(20), "{:?} of {before:?}", live.size());
        thread::sleep(Duration::from_millis(50));
    }
    live.answers();
    println!("threads and kB of memory: {before:?}, with a thousand clients {during:?}");
    assert!(during[1] < before[1] + 100_000, "{during:?} of {before:?}");
}

/// More connections than the system lets the server have.
#[cfg(unix)]
#[test]
fn no_more_connections_than_the_system_allows() {
    let mut shell = Command::new("sh");
    shell.args(["-c", "ulimit -n 64; exec \"$0\" live \"$1\" --port 0"]);
    shell.args([env!("CARGO_BIN_EXE_lamc"), &example("pendulum.yaml")]);
    let mut live = Live::started(shell);
    live.answers();
    let clients: Vec<TcpStream> = (0..120).map(|_| live.connect()).collect();
    thread::sleep(Duration::from_millis(500));
    assert!(live.process.try_wait().unwrap().is_none(), "the server has ended");
    drop(clients);
    thread::sleep(Duration::from_millis(500));
    live.answers();
}
