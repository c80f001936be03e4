//! Path of a session's socket, and which users may connect.

use std::fs;
use std::io;
use std::os::unix::fs::{DirBuilderExt, MetadataExt};
use std::os::unix::net::UnixStream;
use std::path::{Path, PathBuf};

use sha2::{Digest, Sha256};

use super::error::PeerError;

/// Paths of the socket of `session`, the preferred one first: beside it, or, where that is impossible (the path of a socket is
/// at most about 100 bytes long, and not every file system has sockets), in a folder of the user, under a name derived from the
/// session's path. Neither depends on the environment, so that every terminal finds the same.
///
/// # Errors
/// When the session's folder cannot be found.
pub(super) fn places(session: &Path) -> io::Result<[PathBuf; 2]> {
    let session = fs::canonicalize(session)?;
    let mut beside = session.clone().into_os_string();
    beside.push("-control");
    let digest = Sha256::digest(session.as_os_str().as_encoded_bytes());
    let name: String = digest.iter().take(16).map(|b| format!("{b:02x}")).collect();
    Ok([PathBuf::from(beside), own_folder().join(name)])
}

/// The user's folder for sockets that cannot be beside their session.
pub(crate) fn own_folder() -> PathBuf {
    PathBuf::from(format!("/tmp/skinrig-{}", me()))
}

/// Creates the user's folder; rejects one that other users can access.
///
/// # Errors
/// When it cannot be created, or belongs to another user.
pub(crate) fn make_own_folder() -> io::Result<()> {
    let folder = own_folder();
    match fs::DirBuilder::new().mode(0o700).create(&folder) {
        Err(e) if e.kind() == io::ErrorKind::AlreadyExists => {}
        other => return other,
    }
    let found = fs::symlink_metadata(&folder)?;
    if !found.is_dir() || found.uid() != me() || found.mode() & 0o077 != 0 {
        return Err(io::Error::other(format!(
            "{}: expected a folder that only this user can access, found another",
            folder.display()
        )));
    }
    Ok(())
}

fn me() -> u32 {
    rustix::process::geteuid().as_raw()
}

/// Checks the user at the other end, as reported by the kernel. On systems that do not report it, only the permissions of the
/// socket keep other users out.
///
/// # Errors
/// [`PeerError`] if the user is rejected.
pub(crate) fn check_peer(stream: &UnixStream, may: fn(u32, u32) -> bool) -> Result<(), PeerError> {
    #[cfg(target_os = "linux")]
    {
        let peer = rustix::net::sockopt::socket_peercred(stream)
            .map_err(|e| PeerError::Unidentified(e.into()))?
            .uid
            .as_raw();
        let me = me();
        if !may(peer, me) {
            return Err(PeerError::OtherUser {
                expected: me,
                found: peer,
            });
        }
    }
    #[cfg(not(target_os = "linux"))]
    let _ = (stream, may);
    Ok(())
}

/// True if `peer` may control a run of `me`: the same user, and root.
pub(crate) const fn may_ask(peer: u32, me: u32) -> bool {
    peer == me || peer == 0
}

/// True if `me` may trust a run of `peer`: its own, and root any.
pub(crate) const fn may_answer(peer: u32, me: u32) -> bool {
    peer == me || me == 0
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn other_users_are_rejected() {
        assert!(may_ask(1000, 1000) && may_ask(0, 1000));
        assert!(!may_ask(1001, 1000) && !may_ask(1000, 0));
        assert!(may_answer(1000, 1000) && may_answer(1000, 0));
        assert!(!may_answer(1001, 1000) && !may_answer(0, 1000));
    }

    #[test]
    fn every_path_to_a_session_gives_the_same_sockets() {
        let folder = tempfile::tempdir().unwrap();
        let session = folder.path().join("a.session.sqlite");
        fs::write(&session, "").unwrap();
        let link = folder.path().join("link");
        std::os::unix::fs::symlink(folder.path(), &link).unwrap();
        let of = |p: &Path| places(p).unwrap();
        assert_eq!(of(&session), of(&link.join("a.session.sqlite")));
        fs::write(folder.path().join("b.session.sqlite"), "").unwrap();
        let other = of(&folder.path().join("b.session.sqlite"));
        assert!(of(&session)[0] != other[0] && of(&session)[1] != other[1]);
        assert!(places(&folder.path().join("none")).is_err());
    }
}
