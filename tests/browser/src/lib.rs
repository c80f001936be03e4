//! Drives an installed Chromium: opens a page, evaluates, clicks, prints and takes screenshots like a reader.
//!
//! Speaks the DevTools protocol over a pipe (`--remote-debugging-pipe`): JSON messages, each terminated by a zero byte. It
//! opens no port and downloads no browser. Existing client crates pull in about 140 others, mostly generated types for the
//! whole protocol; the dozen methods needed here are a few lines each.

mod chromium;
mod devtools;
mod page;

pub use chromium::{Browser, find};
pub use devtools::{BrowserError, Event};
pub use page::{Page, Size};
