//! Drives a Chromium that is on the machine: a page is opened, asked, clicked, printed and pictured as a reader would.
//!
//! The DevTools protocol is spoken over a pipe (`--remote-debugging-pipe`): JSON messages, each ended by a zero byte. No port is
//! opened and no browser is fetched. The client crates there are bring some 140 others, most of it for the whole protocol as
//! generated types; the dozen methods needed here are a few lines each.

mod chromium;
mod devtools;
mod page;

pub use chromium::{Browser, find};
pub use devtools::{BrowserError, Event};
pub use page::{Page, Size};
