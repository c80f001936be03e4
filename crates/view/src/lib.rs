//! Local server and page for a folder of sessions, during and after their recording.
//!
//! [`Server::open`] binds the port and prints nothing; [`Server::run`] serves until ctrl-C or SIGTERM. It reads sessions through
//! [`SessionReader`](skinrig_recorder::SessionReader), reopened for each answer so that a run can seal its session, and everything else
//! through a [`Lab`], which the command line implements. It writes nothing, and controls runs only if opened with control.
//!
//! - `access`: the token, and the checks against other pages and other names of this machine.
//! - `routes`: the table of addresses. `assets`: the page itself.
//! - `shelf`, `document`, `events`, `poses`, `clusters`, `download`, `differences`: one answer each.
//! - `live`: one follower per running session, shared by all its pages.

mod access;
mod assets;
mod clocks;
mod clusters;
mod control;
mod differences;
mod document;
mod download;
mod events;
mod folder;
mod lab;
mod live;
mod open_session;
mod poses;
mod problem;
mod routes;
mod server;
mod shelf;

pub use lab::{
    AnalysisEntry, Lab, LabError, NewestBytes, RunState, SettingDifference, SettingValues,
    ShelfSession,
};
pub use server::{Options, ServeError, Server};
