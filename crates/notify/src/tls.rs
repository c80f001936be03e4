//! TLS of webhooks: the certificates that this computer trusts, as for mail.

use ureq::tls::{RootCerts, TlsConfig};

/// TLS with the certificates of this computer.
pub(crate) fn of_this_computer() -> TlsConfig {
    // Fails if another part of the program chose a provider: that one is used then.
    let _ = rustls::crypto::ring::default_provider().install_default();
    TlsConfig::builder()
        .root_certs(RootCerts::PlatformVerifier)
        .build()
}
