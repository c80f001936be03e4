//! Encrypted connections to a server.
//!
//! `tls/` holds a certificate of `localhost`, its key, the authority that signed it, and another authority; elliptic curve P-256,
//! valid for 100 years. They protect nothing.

use skinrig_catalogue::{Access, Address, Catalogue, CatalogueError};

use crate::server::Server;
use crate::support::{Lab, WAIT};

/// Path of a file in `tls/`.
fn file(name: &str) -> String {
    format!("{}/tests/register/tls/{name}", env!("CARGO_MANIFEST_DIR"))
}

#[test]
fn a_connection_is_encrypted_as_its_address_demands() {
    let Some(mut server) = Server::start() else {
        return;
    };
    let lab = Lab::with_sessions(1);
    let port = server.encrypt();
    let open = |host: &str, words: &str| -> Result<Catalogue, CatalogueError> {
        let url = format!("postgres://skinrig@{host}:{port}/postgres?{words}");
        Catalogue::open(Address::parse(url.as_ref()), Access::Write, WAIT)
    };
    let refused = |host: &str, words: &str, parts: &[&str]| {
        let error = match open(host, words) {
            Err(error) => error.to_string(),
            Ok(_) => panic!("{words}: expected a refusal"),
        };
        for part in parts {
            assert!(
                error.contains(part),
                "{words}: expected {part:?} in {error}"
            );
        }
    };
    let trusted = format!("sslmode=verify-full&sslrootcert={}", file("authority.pem"));
    let mut catalogue = open("localhost", &trusted).unwrap();
    let done = catalogue.register(&[lab.session(0)]).unwrap();
    assert_eq!(done.registered, ["0.session.sqlite"]);
    // What the server itself says of its connections: this one, over TCP and encrypted.
    let encrypted = "SELECT ssl::text FROM pg_stat_ssl JOIN pg_stat_activity USING (pid) WHERE client_addr IS NOT NULL";
    assert_eq!(server.rows("postgres", encrypted), ["Some(\"true\")"]);
    drop(catalogue);

    // An authority that did not sign the certificate, another name of the server, and no encryption.
    let other = format!("sslmode=verify-full&sslrootcert={}", file("other.pem"));
    refused("localhost", &other, &["certificate", "sslrootcert"]);
    refused("127.0.0.1", &trusted, &["certificate", "sslrootcert"]);
    refused(
        "localhost",
        "sslmode=disable",
        &["no encryption", "sslmode"],
    );
    let missing = format!("sslmode=verify-full&sslrootcert={}", file("missing.pem"));
    refused("localhost", &missing, &["check the paths", "sslrootcert"]);
    // Without the name of the server, its authority suffices; a server without encryption is no server for this address.
    let any_name = format!("sslmode=verify-ca&sslrootcert={}", file("authority.pem"));
    open("127.0.0.1", &any_name).unwrap();
    server.unencrypt();
    refused("localhost", &trusted, &["sslmode"]);
    refused("localhost", "sslmode=require", &["sslmode"]);
}
