//! Local servers for tests, on real sockets: SMTP and HTTP, each with the answers that a test chooses.

use std::io::{BufRead, BufReader, Read, Write};
use std::net::{TcpListener, TcpStream};
use std::sync::mpsc::{Receiver, Sender, channel};

/// A server on a free port of the loopback address; it runs until the test program ends.
pub(crate) struct Server<T> {
    pub(crate) port: u16,
    received: Receiver<T>,
}

impl<T: Send + 'static> Server<T> {
    /// Serves one connection after the other; `serve` passes on what the client sent before it accepts it.
    fn start(mut serve: impl FnMut(TcpStream, &Sender<T>) -> Option<()> + Send + 'static) -> Self {
        let listener = TcpListener::bind("127.0.0.1:0").unwrap();
        let port = listener.local_addr().unwrap().port();
        let (sender, received) = channel();
        std::thread::spawn(move || {
            for stream in listener.incoming() {
                // `None`: the client left.
                let _ = serve(stream.unwrap(), &sender);
            }
        });
        Self { port, received }
    }

    /// Everything received so far.
    pub(crate) fn received(&self) -> Vec<T> {
        self.received.try_iter().collect()
    }
}

/// A port on which nobody listens.
pub(crate) fn closed_port() -> u16 {
    let listener = TcpListener::bind("127.0.0.1:0").unwrap();
    listener.local_addr().unwrap().port()
}

/// A server that accepts connections and never answers.
pub(crate) fn silent() -> Server<()> {
    let mut open = Vec::new();
    Server::start(move |stream, _: &Sender<()>| {
        open.push(stream);
        Some(())
    })
}

/// A mail as the server got it.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct ReceivedMail {
    /// Commands before the data.
    pub(crate) commands: Vec<String>,
    /// Header and body.
    pub(crate) data: String,
}

/// A mail server. `answer` gives the reply to a command, or `None` for the usual one; `EHLO` is the greeting's follow-up,
/// `.` the end of the data.
pub(crate) fn smtp(
    mut answer: impl FnMut(&str) -> Option<&'static str> + Send + 'static,
) -> Server<ReceivedMail> {
    Server::start(move |stream, received| {
        let mut lines = BufReader::new(stream.try_clone().unwrap()).lines();
        let say = |text: &str| (&stream).write_all(format!("{text}\r\n").as_bytes());
        say("220 test").ok()?;
        let mut mail = ReceivedMail {
            commands: Vec::new(),
            data: String::new(),
        };
        while let Some(Ok(line)) = lines.next() {
            mail.commands.push(line.clone());
            let word = line.split(' ').next().unwrap_or_default().to_owned();
            let reply = answer(&line);
            if word == "DATA" && reply.is_none() {
                say("354 go on").ok()?;
                for line in lines.by_ref().map_while(Result::ok) {
                    if line == "." {
                        break;
                    }
                    mail.data.push_str(&line);
                    mail.data.push('\n');
                }
                match answer(".") {
                    Some(reply) => say(reply).ok()?,
                    None => {
                        received.send(mail.clone()).ok()?;
                        say("250 taken").ok()?;
                    }
                }
                continue;
            }
            let usual = match word.as_str() {
                "EHLO" => "250-test\r\n250 AUTH PLAIN LOGIN",
                "AUTH" => "235 welcome",
                "QUIT" => "221 bye",
                _ => "250 ok",
            };
            say(reply.unwrap_or(usual)).ok()?;
            if word == "QUIT" {
                break;
            }
        }
        Some(())
    })
}

/// A request as the server got it.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct ReceivedRequest {
    /// Request line and headers.
    pub(crate) head: String,
    pub(crate) body: String,
}

/// A web server that answers with these status codes in turn, then with the last one.
pub(crate) fn http(codes: &[u16]) -> Server<ReceivedRequest> {
    let mut codes: Vec<u16> = codes.iter().rev().copied().collect();
    Server::start(move |stream, received| {
        let mut reader = BufReader::new(stream.try_clone().unwrap());
        let mut head = String::new();
        while !head.ends_with("\r\n\r\n") {
            if reader.read_line(&mut head).ok()? == 0 {
                return None;
            }
        }
        let length = head.lines().find_map(|line| {
            let (name, value) = line.split_once(':')?;
            let is_length = name.eq_ignore_ascii_case("content-length");
            is_length.then(|| value.trim().parse::<usize>().ok())?
        });
        let mut body = vec![0; length?];
        reader.read_exact(&mut body).ok()?;
        let code = match codes.len() {
            1 => codes[0],
            _ => codes.pop().unwrap(),
        };
        let answer = format!(
            "HTTP/1.1 {code} test\r\ncontent-length: 0\r\nlocation: http://127.0.0.1:1/\r\nconnection: close\r\n\r\n"
        );
        let body = String::from_utf8(body).unwrap();
        received.send(ReceivedRequest { head, body }).ok()?;
        (&stream).write_all(answer.as_bytes()).ok()
    })
}
