//! Owns the newest values of a followed session, as blocks of server-sent events.

use axum::body::Bytes;
use serde::Serialize;
use tokio::sync::watch;

/// Newest value of one part, as a server-sent event.
#[derive(Clone)]
struct Part {
    name: &'static str,
    version: u64,
    event: Bytes,
}

/// Newest values of all parts.
#[derive(Default)]
pub(super) struct Parts {
    /// Of the newest part.
    pub version: u64,
    parts: Vec<Part>,
}

impl Parts {
    /// Replaces a part; false if its value is the same.
    pub(super) fn set(&mut self, name: &'static str, value: &impl Serialize) -> bool {
        let Ok(json) = serde_json::to_string(value) else {
            return false;
        };
        let event = Bytes::from(format!("event: {name}\ndata: {json}\n\n"));
        let place = self.parts.iter_mut().find(|p| p.name == name);
        if place.as_ref().is_some_and(|p| p.event == event) {
            return false;
        }
        self.version += 1;
        let part = Part {
            name,
            version: self.version,
            event,
        };
        match place {
            Some(place) => *place = part,
            None => self.parts.push(part),
        }
        true
    }

    /// All parts newer than `last_version`, as one block.
    pub(super) fn since(&self, last_version: u64) -> Bytes {
        let new = self.parts.iter().filter(|p| p.version > last_version);
        let blocks: Vec<&[u8]> = new.map(|p| p.event.as_ref()).collect();
        Bytes::from(blocks.concat())
    }
}

pub(super) type Sender = watch::Sender<Parts>;

/// Replaces a part for all pages, if it changed.
pub(super) fn publish(to: &Sender, name: &'static str, value: &impl Serialize) {
    to.send_if_modified(|parts| parts.set(name, value));
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_page_gets_the_newest_value_of_each_part_once() {
        let mut parts = Parts::default();
        assert!(parts.set("run", &1));
        assert!(parts.set("presses", &"a"));
        assert!(!parts.set("run", &1));
        let all = parts.since(0);
        assert_eq!(
            &all[..],
            b"event: run\ndata: 1\n\nevent: presses\ndata: \"a\"\n\n"
        );
        let last_version = parts.version;
        assert!(parts.since(last_version).is_empty());
        assert!(parts.set("run", &2) && parts.set("run", &3));
        assert_eq!(&parts.since(last_version)[..], b"event: run\ndata: 3\n\n");
    }
}
