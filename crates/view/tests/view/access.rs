//! The server over HTTP: who gets an answer, and that no query breaks it.
#![expect(clippy::unwrap_used, reason = "a test without a server must fail")]

use std::io::{Read, Write};
use std::net::{SocketAddr, TcpStream};
use std::path::Path;

use skinrig::library::{ControlHandle, Program, ProtocolSource, Simulation, simulate};
use skinrig_view::{Options, Server};

/// Status and whole answer of a request.
fn send_request(to: SocketAddr, head: &str, body: &str) -> (u16, String) {
    let mut stream = TcpStream::connect(to).unwrap();
    let length = body.len();
    let text = format!("{head}\r\nConnection: close\r\nContent-Length: {length}\r\n\r\n{body}");
    stream.write_all(text.as_bytes()).unwrap();
    let mut answer = Vec::new();
    stream.read_to_end(&mut answer).unwrap();
    let answer = String::from_utf8_lossy(&answer).into_owned();
    let status = answer.split(' ').nth(1).unwrap_or("0").parse().unwrap();
    (status, answer)
}

/// A server that only reads `folder`.
fn server_of(folder: &Path) -> Server {
    let options = Options {
        folder: folder.to_owned(),
        first: None,
        bind: Options::LOOPBACK,
        control: false,
    };
    Server::open(options, Program).unwrap()
}

#[test]
fn only_the_own_page_with_the_token_is_served() {
    let folder = tempfile::tempdir().unwrap();
    let server = server_of(folder.path());
    let (to, token) = (server.address(), server.token().to_owned());
    assert!(to.ip().is_loopback() && server.link().contains(&format!("#token={token}")));
    std::thread::spawn(move || server.run_until(std::future::pending()));
    let own = format!("Host: {to}\r\nAuthorization: Bearer {token}");
    let get =
        |path: &str, more: &str| send_request(to, &format!("GET {path} HTTP/1.1\r\n{more}"), "");
    let (status, page) = get("/", &format!("Host: {to}"));
    assert!(status == 200 && page.contains("content-security-policy: default-src 'none'"));
    assert_eq!(get("/api/shelf", &own).0, 200);
    assert_eq!(get("/api/shelf", &format!("Host: {to}")).0, 401);
    assert_eq!(
        get("/api/shelf", &own.replace(&token[..8], "00000000")).0,
        401
    );
    assert_eq!(get("/", "Host: evil.example").0, 403);
    assert_eq!(
        get(
            "/api/shelf",
            &format!("{own}\r\nOrigin: http://evil.example")
        )
        .0,
        403
    );
    let json = format!("{own}\r\nContent-Type: application/json");
    let post = send_request(to, &format!("POST /api/control HTTP/1.1\r\n{json}"), "{}");
    assert!(post.0 == 403 && post.1.contains("only reads"), "{}", post.1);
    for query in [
        "/api/session",
        "/api/session?session=..%2F..%2Fetc%2Fpasswd",
        "/api/session?session=%00.session.sqlite",
        "/api/events?session=a&camera=3&from_s=0&to_s=1",
        "/api/events?session=a&camera=1&from_s=NaN&to_s=inf",
        "/api/events?session=a&camera=1&from_s=1&to_s=0",
        "/api/poses?session=a.session.sqlite&from_s=-1e300&to_s=1e300",
        "/api/clusters?session=a&press=0",
        "/api/clusters?session=a&press=99999999999999999999",
        "/api/download?session=a&what=all&format=exe&from_s=0&to_s=1",
        "/api/live?session=nothing.session.sqlite",
        "/app/..%2Fpage.html",
        "/api/unknown",
    ] {
        let (status, answer) = get(query, &own);
        assert!((400..500).contains(&status), "{query}: {answer}");
    }
    assert_eq!(get("/api/shelf", &own).0, 200);
}

#[test]
fn a_variant_without_results_is_not_found_instead_of_a_session_without_estimates() {
    let folder = tempfile::tempdir().unwrap();
    let simulation = Simulation {
        protocol: ProtocolSource::Text(
            include_str!("../../../cli/tests/fixtures/small.yaml").to_owned(),
        ),
        overrides: Vec::new(),
        folder: folder.path().to_owned(),
        level: None,
        seed: None,
        command_line: "test".to_owned(),
    };
    let session = simulate(simulation, ControlHandle::new()).unwrap();
    let name = session.file_name().unwrap().to_str().unwrap().to_owned();
    let server = server_of(folder.path());
    let (to, token) = (server.address(), server.token().to_owned());
    std::thread::spawn(move || server.run_until(std::future::pending()));
    let own = format!("Host: {to}\r\nAuthorization: Bearer {token}");
    let get = |query: &str| send_request(to, &format!("GET {query} HTTP/1.1\r\n{own}"), "");
    for query in [
        format!("/api/session?session={name}"),
        format!("/api/download?session={name}&what=presses&format=csv&from_s=0&to_s=1"),
    ] {
        let (status, answer) = get(&query);
        assert_eq!(status, 200, "{query}: {answer}");
        let (status, answer) = get(&format!("{query}&analysis=nothing"));
        assert_eq!(status, 404, "{query}: {answer}");
        assert!(
            answer.contains("expected results of the analysis `nothing`"),
            "{answer}"
        );
    }
}
