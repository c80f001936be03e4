//! Owns the access control: the token, and the checks against DNS rebinding and other sites' requests.
//!
//! Every answer below `/api` needs the token in the `Authorization` header. It is no cookie: a browser sends it for no other page, and it
//! stands behind the `#` of the link, which browsers do not send at all.

use std::net::IpAddr;

use axum::http::{HeaderMap, Method, Uri, header};

use crate::problem::Problem;

/// Random bytes of a token.
const TOKEN_BYTES: usize = 32;

/// The secret in the link.
#[derive(Clone)]
pub(crate) struct Token(String);

impl Token {
    /// A new random token.
    pub(crate) fn random() -> Result<Self, getrandom::Error> {
        use std::fmt::Write as _;
        let mut bytes = [0; TOKEN_BYTES];
        getrandom::fill(&mut bytes)?;
        let mut text = String::with_capacity(2 * TOKEN_BYTES);
        for byte in bytes {
            // Writing to a string cannot fail.
            let _ = write!(text, "{byte:02x}");
        }
        Ok(Self(text))
    }

    pub(crate) fn text(&self) -> &str {
        &self.0
    }

    /// Compares in a time that does not depend on where the texts differ.
    fn is(&self, found: &str) -> bool {
        let (a, b) = (self.0.as_bytes(), found.as_bytes());
        a.len() == b.len() && a.iter().zip(b).fold(0, |all, (a, b)| all | (a ^ b)) == 0
    }
}

/// Checks a request: its `Host` on every address; `Origin`, `Sec-Fetch-Site` and the token below `/api`.
pub(crate) fn check(
    token: &Token,
    method: &Method,
    uri: &Uri,
    headers: &HeaderMap,
) -> Result<(), Problem> {
    let host = host(headers)?;
    check_name(host)?;
    if method != Method::GET && method != Method::HEAD && method != Method::POST {
        return Err(Problem::new(
            axum::http::StatusCode::METHOD_NOT_ALLOWED,
            format!("expected GET or POST, found {method}"),
        ));
    }
    if !uri.path().starts_with("/api/") {
        return Ok(());
    }
    check_site(host, method, headers)?;
    let given = headers
        .get(header::AUTHORIZATION)
        .and_then(|value| value.to_str().ok())
        .and_then(|value| value.strip_prefix("Bearer "));
    match given {
        Some(given) if token.is(given) => Ok(()),
        found => Err(Problem::new(
            axum::http::StatusCode::UNAUTHORIZED,
            format!(
                "expected the token of this server, found {}\n  next: open the link that `skinrig view` prints",
                if found.is_some() {
                    "another one"
                } else {
                    "none"
                }
            ),
        )),
    }
}

fn host(headers: &HeaderMap) -> Result<&str, Problem> {
    let mut all = headers.get_all(header::HOST).iter();
    match (all.next(), all.next()) {
        (Some(host), None) => host
            .to_str()
            .map_err(|_| Problem::request("Host: expected a name in ASCII, found other bytes")),
        (None, _) => Err(Problem::request("expected a Host header, found none")),
        (Some(_), Some(_)) => Err(Problem::request("expected one Host header, found several")),
    }
}

/// Only an address and `localhost` are names of this server: a name that another site's DNS points here is none.
fn check_name(host: &str) -> Result<(), Problem> {
    let name = match host.rsplit_once(':') {
        Some((name, port)) if port.bytes().all(|b| b.is_ascii_digit()) => name,
        _ => host,
    };
    let bare = name.strip_prefix('[').and_then(|n| n.strip_suffix(']'));
    let is_address = bare.unwrap_or(name).parse::<IpAddr>().is_ok();
    if is_address || name.eq_ignore_ascii_case("localhost") {
        return Ok(());
    }
    Err(Problem::forbidden(format!(
        "Host: expected an address or localhost, found `{}`\n  next: open the link with the machine's address",
        host.escape_debug()
    )))
}

/// A request from another site is rejected, whatever it carries.
fn check_site(host: &str, method: &Method, headers: &HeaderMap) -> Result<(), Problem> {
    let text = |name| {
        let value = headers.get(name);
        value.map(|v: &axum::http::HeaderValue| v.to_str().unwrap_or("other bytes"))
    };
    if let Some(origin) = text(header::ORIGIN)
        && origin != format!("http://{host}")
    {
        return Err(Problem::forbidden(format!(
            "Origin: expected http://{host}, found `{}`",
            origin.escape_debug()
        )));
    }
    let site = text(header::HeaderName::from_static("sec-fetch-site"));
    if site.is_some_and(|site| !matches!(site, "same-origin" | "none")) {
        return Err(Problem::forbidden(
            "Sec-Fetch-Site: expected same-origin, found another site",
        ));
    }
    let is_json = || {
        text(header::CONTENT_TYPE)
            .is_some_and(|kind| kind.split(';').next() == Some("application/json"))
    };
    if method == Method::POST && !is_json() {
        return Err(Problem::request("Content-Type: expected application/json"));
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn headers(pairs: &[(&'static str, &str)]) -> HeaderMap {
        let mut map = HeaderMap::new();
        for (name, value) in pairs {
            map.append(*name, value.parse().unwrap());
        }
        map
    }

    #[test]
    fn names_of_this_server_are_addresses_and_localhost() {
        for host in [
            "127.0.0.1:80",
            "localhost",
            "LOCALHOST:9",
            "[::1]:80",
            "10.0.0.7",
        ] {
            assert!(check_name(host).is_ok(), "{host}");
        }
        for host in [
            "",
            "evil.example",
            "127.0.0.1.evil.example:80",
            "localhost.evil:1",
            "[::1",
        ] {
            assert!(check_name(host).is_err(), "{host}");
        }
    }

    #[test]
    fn a_request_needs_the_token_and_no_foreign_site() {
        let token = Token::random().unwrap();
        let bearer = format!("Bearer {}", token.text());
        let (get, uri) = (Method::GET, Uri::from_static("/api/shelf"));
        let good = [("host", "127.0.0.1:1"), ("authorization", &*bearer)];
        assert!(check(&token, &get, &uri, &headers(&good)).is_ok());
        for more in [
            ("origin", "http://evil.example"),
            ("origin", "null"),
            ("origin", "https://127.0.0.1:1"),
            ("sec-fetch-site", "cross-site"),
            ("host", "127.0.0.1:1"),
        ] {
            let all = [good[0], good[1], more];
            assert!(
                check(&token, &get, &uri, &headers(&all)).is_err(),
                "{more:?}"
            );
        }
        for other in ["", "Bearer ", "Bearer 00", &bearer[..bearer.len() - 1]] {
            let all = [good[0], ("authorization", other)];
            assert!(
                check(&token, &get, &uri, &headers(&all)).is_err(),
                "{other}"
            );
        }
        let own = [good[0], good[1], ("origin", "http://127.0.0.1:1")];
        assert!(check(&token, &get, &uri, &headers(&own)).is_ok());
        // A form of another site can be posted without asking, but not as JSON.
        assert!(check(&token, &Method::POST, &uri, &headers(&own)).is_err());
    }
}
