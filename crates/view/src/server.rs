//! Owns the port: which address it opens, and until when.

use std::future::Future;
use std::io;
use std::net::{IpAddr, Ipv4Addr, SocketAddr};
use std::path::PathBuf;
use std::sync::Arc;

use tokio::net::TcpListener;
use tokio::runtime::Runtime;

use crate::access::Token;
use crate::folder::Folder;
use crate::lab::Lab;
use crate::routes::{App, router};

/// Threads that answer; what blocks runs on further ones.
const WORKERS: usize = 2;

/// Served folder, address and rights.
#[derive(Debug, Clone)]
pub struct Options {
    /// The folder of sessions.
    pub folder: PathBuf,
    /// File name of the session that the page opens first; the shelf without.
    pub first: Option<String>,
    /// Address and port; port 0 takes a free one.
    pub bind: SocketAddr,
    /// True if pages may pause, stop and annotate a run.
    pub control: bool,
}

impl Options {
    /// The default address: this machine alone, any free port.
    pub const LOOPBACK: SocketAddr = SocketAddr::new(IpAddr::V4(Ipv4Addr::LOCALHOST), 0);
}

/// Why the server does not run.
#[derive(Debug, thiserror::Error)]
pub enum ServeError {
    /// The system gives no random bytes for the token.
    #[error("expected random bytes from the system, found none: {0}")]
    Random(getrandom::Error),
    /// The address cannot be opened.
    #[error(
        "{address}: expected an address of this machine with a free port: {source}\n  next: choose another one with --bind"
    )]
    Bind {
        /// The address.
        address: SocketAddr,
        /// Error of the system.
        source: io::Error,
    },
    /// The system refuses threads or signals.
    #[error("cannot serve: {0}")]
    System(#[from] io::Error),
}

/// A server with an open port.
pub struct Server {
    runtime: Runtime,
    listener: TcpListener,
    address: SocketAddr,
    token: Token,
    options: Options,
    lab: Arc<dyn Lab>,
}

impl Server {
    /// Opens the port.
    ///
    /// # Errors
    /// [`ServeError`].
    pub fn open(options: Options, lab: impl Lab) -> Result<Self, ServeError> {
        let runtime = tokio::runtime::Builder::new_multi_thread()
            .worker_threads(WORKERS)
            .thread_name("view")
            .enable_all()
            .build()?;
        let bind = |source| ServeError::Bind {
            address: options.bind,
            source,
        };
        let listener = runtime
            .block_on(TcpListener::bind(options.bind))
            .map_err(bind)?;
        let address = listener.local_addr()?;
        Ok(Self {
            runtime,
            listener,
            address,
            token: Token::random().map_err(ServeError::Random)?,
            options,
            lab: Arc::new(lab),
        })
    }

    /// The open address.
    #[must_use]
    pub const fn address(&self) -> SocketAddr {
        self.address
    }

    /// The secret that every request needs.
    #[must_use]
    pub fn token(&self) -> &str {
        self.token.text()
    }

    /// The link with the token. A browser does not send what follows the `#`.
    #[must_use]
    pub fn link(&self) -> String {
        let ip = self.address.ip();
        let ip = match ip {
            // Every address of the machine; here, this one.
            ip if ip.is_unspecified() && ip.is_ipv6() => "[::1]".to_owned(),
            ip if ip.is_unspecified() => Ipv4Addr::LOCALHOST.to_string(),
            IpAddr::V6(ip) => format!("[{ip}]"),
            IpAddr::V4(ip) => ip.to_string(),
        };
        let session = self.options.first.as_ref();
        let session =
            session.map_or_else(String::new, |name| format!("&session={}", encoded(name)));
        format!(
            "http://{ip}:{}/#token={}{session}",
            self.address.port(),
            self.token.text()
        )
    }

    /// Which computers can reach the server, and what a page may do.
    #[must_use]
    pub fn opens(&self) -> String {
        let who = if self.address.ip().is_loopback() {
            "this computer only"
        } else {
            "every computer that reaches this address, unencrypted"
        };
        let may = if self.options.control {
            "pages can pause, stop and annotate runs"
        } else {
            "read-only"
        };
        format!(
            "{} on {}: {who}; {may}",
            self.options.folder.display(),
            self.address
        )
    }

    /// Serves until ctrl-C or SIGTERM.
    ///
    /// # Errors
    /// [`ServeError::System`].
    pub fn run(self) -> Result<(), ServeError> {
        self.run_until(ended())
    }

    /// Serves until `end` is ready. Streams of live sessions are cut off then.
    ///
    /// # Errors
    /// [`ServeError::System`].
    pub fn run_until(
        self,
        end: impl Future<Output = io::Result<()>> + Send,
    ) -> Result<(), ServeError> {
        let app = App::new(
            self.token,
            Folder::new(self.options.folder),
            self.lab,
            self.options.control,
        );
        let served = self.runtime.block_on(async {
            let serve = axum::serve(self.listener, router(app));
            tokio::select! {
                served = serve.into_future() => served,
                ended = end => ended,
            }
        });
        // A follower that reads is not waited for.
        self.runtime.shutdown_background();
        Ok(served?)
    }
}

/// Ctrl-C or SIGTERM.
async fn ended() -> io::Result<()> {
    #[cfg(unix)]
    {
        let mut terminate =
            tokio::signal::unix::signal(tokio::signal::unix::SignalKind::terminate())?;
        tokio::select! {
            pressed = tokio::signal::ctrl_c() => pressed,
            _ = terminate.recv() => Ok(()),
        }
    }
    #[cfg(not(unix))]
    tokio::signal::ctrl_c().await
}

/// A name as part of an address: everything but unreserved characters as `%` and two hex digits.
fn encoded(name: &str) -> String {
    use std::fmt::Write as _;
    let mut out = String::new();
    for byte in name.bytes() {
        if byte.is_ascii_alphanumeric() || b"-._~".contains(&byte) {
            out.push(char::from(byte));
        } else {
            // Writing to a string cannot fail.
            let _ = write!(out, "%{byte:02X}");
        }
    }
    out
}
