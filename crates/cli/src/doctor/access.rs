//! Permission to read and write a file: owner, group, others, and the access list through which a desktop login grants devices
//! to its user (udev's `uaccess`).

use std::path::Path;

/// The user that runs this program.
#[derive(Debug, Clone)]
pub(super) struct User {
    /// Effective user.
    pub uid: u32,
    /// Its name, or its number.
    pub name: String,
    /// Groups, including the effective one.
    pub groups: Vec<u32>,
    /// Effective capabilities, by bit (`capabilities(7)`).
    pub capabilities: u64,
}

/// `CAP_IPC_LOCK`: may lock any amount of memory.
pub(super) const CAP_IPC_LOCK: u64 = 1 << 14;
/// `CAP_SYS_NICE`: may take any priority.
pub(super) const CAP_SYS_NICE: u64 = 1 << 23;

/// Owner and permissions of a file.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct Node {
    /// Owner.
    pub uid: u32,
    /// Group.
    pub gid: u32,
    /// Permission bits.
    pub mode: u32,
    /// Entries of the access list for single users and groups; empty without a list.
    pub list: Vec<Entry>,
}

/// An entry of an access list.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Entry {
    tag: u16,
    bits: u16,
    id: u32,
}

/// Tags of the entries that matter here (`linux/posix_acl.h`).
const TAG_USER: u16 = 0x02;
const TAG_OWNING_GROUP: u16 = 0x04;
const TAG_GROUP: u16 = 0x08;
const TAG_MASK: u16 = 0x10;
/// Reading and writing.
const READ_WRITE: u32 = 0o6;

impl Node {
    /// Reads the permissions of the file at `path`, following links; `None` if it does not exist.
    #[cfg(unix)]
    pub(super) fn of(path: &Path) -> Option<Self> {
        use std::os::unix::fs::MetadataExt;

        let found = std::fs::metadata(path).ok()?;
        Some(Self {
            uid: found.uid(),
            gid: found.gid(),
            mode: found.mode() & 0o7777,
            list: list_of(path),
        })
    }

    /// Not available on this system.
    #[cfg(not(unix))]
    pub fn of(_path: &Path) -> Option<Self> {
        None
    }

    /// True if `user` may read and write.
    pub(crate) fn is_open_to(&self, user: &User) -> bool {
        if user.uid == 0 {
            return true;
        }
        let all = |bits: u32| bits & READ_WRITE == READ_WRITE;
        if user.uid == self.uid {
            return all(self.mode >> 6);
        }
        let entry = |tag: u16| self.list.iter().filter(move |e| e.tag == tag);
        // With a list, the group bits of the mode are the mask, and the owning group has its own entry.
        let mask = entry(TAG_MASK).next().map_or(0o7, |e| u32::from(e.bits));
        if let Some(own) = entry(TAG_USER).find(|e| e.id == user.uid) {
            return all(u32::from(own.bits) & mask);
        }
        let owning = entry(TAG_OWNING_GROUP).next();
        let owning = owning.map_or(self.mode >> 3, |e| u32::from(e.bits));
        let mut groups: Vec<u32> = entry(TAG_GROUP)
            .filter(|e| user.groups.contains(&e.id))
            .map(|e| u32::from(e.bits))
            .collect();
        if user.groups.contains(&self.gid) {
            groups.push(owning);
        }
        // The bits for others apply only to users in none of the file's groups.
        if groups.is_empty() {
            return all(self.mode);
        }
        groups.into_iter().any(|bits| all(bits & mask))
    }

    /// True if the file's own group may read and write.
    pub(crate) const fn is_open_to_group(&self) -> bool {
        (self.mode >> 3) & READ_WRITE == READ_WRITE
    }
}

#[cfg(target_os = "linux")]
fn list_of(path: &Path) -> Vec<Entry> {
    let mut bytes = [0; 1024];
    match rustix::fs::getxattr(path, "system.posix_acl_access", &mut bytes[..]) {
        Ok(length) => entries(&bytes[..length.min(bytes.len())]),
        Err(_) => Vec::new(),
    }
}

#[cfg(all(unix, not(target_os = "linux")))]
fn list_of(_path: &Path) -> Vec<Entry> {
    Vec::new()
}

/// Parses an access list in the kernel's format: version 2 (4 bytes), then tag (2), bits (2), id (4) of each entry, all
/// little-endian (`linux/posix_acl_xattr.h`).
fn entries(bytes: &[u8]) -> Vec<Entry> {
    let Some(([2, 0, 0, 0], rest)) = bytes.split_first_chunk() else {
        return Vec::new();
    };
    let (all, _) = rest.as_chunks::<8>();
    all.iter()
        .map(|&[a, b, c, d, e, f, g, h]| Entry {
            tag: u16::from_le_bytes([a, b]),
            bits: u16::from_le_bytes([c, d]),
            id: u32::from_le_bytes([e, f, g, h]),
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn user(uid: u32, groups: &[u32]) -> User {
        User {
            uid,
            name: "ann".to_owned(),
            groups: groups.to_vec(),
            capabilities: 0,
        }
    }

    fn node(mode: u32, list: Vec<Entry>) -> Node {
        Node {
            uid: 0,
            gid: 46,
            mode,
            list,
        }
    }

    #[test]
    fn owner_group_and_others_have_their_own_bits() {
        for (mode, who, may) in [
            (0o664, user(1000, &[1000]), false),
            (0o664, user(1000, &[1000, 46]), true),
            (0o606, user(1000, &[46]), false),
            (0o666, user(1000, &[1000]), true),
            (0o600, user(0, &[0]), true),
            (0o440, user(1000, &[46]), false),
        ] {
            assert_eq!(node(mode, Vec::new()).is_open_to(&who), may, "{mode:o}");
        }
    }

    /// Access list after `setfacl -m u:1000:rw` on a file of mode 0600.
    const ONE_USER: &[u8] = &[
        2, 0, 0, 0, // version
        1, 0, 6, 0, 255, 255, 255, 255, // owner
        2, 0, 6, 0, 232, 3, 0, 0, // user 1000
        4, 0, 0, 0, 255, 255, 255, 255, // owning group: nothing
        16, 0, 6, 0, 255, 255, 255, 255, // mask
        32, 0, 0, 0, 255, 255, 255, 255, // others
    ];

    #[test]
    fn the_access_list_alone_admits_a_desktop_user() {
        let given = node(0o660, entries(ONE_USER));
        assert!(given.is_open_to(&user(1000, &[1000])));
        assert!(!given.is_open_to(&user(1001, &[1001])));
        // The mode shows the mask, not the permissions of the group.
        assert!(!given.is_open_to(&user(1001, &[46])));
        let mut masked = ONE_USER.to_vec();
        masked[4 + 3 * 8 + 2] = 4;
        assert!(!node(0o640, entries(&masked)).is_open_to(&user(1000, &[1000])));
        assert_eq!(entries(&ONE_USER[..3]), []);
        assert_eq!(entries(&ONE_USER[..20]).len(), 2);
    }
}
