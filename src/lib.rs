//! planish: certified one-to-one quadratic parametrizations of poor surface triangulations.
//!
//! This is the shell around the pure crate [`planish_core`], as a library so that tests reach it: the only code that
//! touches disk, clock, threads and environment. The verbs are in [`verbs`]; an input travels as a [`job::Job`] through
//! the [`stages`], which [`conveyor`] runs on threads.

pub mod begun;
pub mod chain;
pub mod cli;
pub mod conveyor;
pub mod daemon;
pub mod disk;
pub mod formats;
pub mod hand_off;
pub mod health;
pub mod holding;
pub mod hooks;
pub mod inbox;
pub mod inputs;
pub mod job;
mod lease;
pub mod ledger;
pub mod logging;
pub mod look;
pub mod machine;
pub mod metrics;
pub mod outcome;
pub mod own;
pub mod passing;
pub mod places;
pub mod publish;
pub mod pulse;
pub mod put_away;
pub mod regular;
pub mod reload;
pub mod replace;
pub mod report;
pub mod retention;
pub mod room;
pub mod settings;
pub mod shown;
pub mod signals;
pub mod stages;
pub mod staging;
pub mod status;
pub mod supervisor;
pub mod verbs;
pub mod vitals;
pub mod watch;
pub mod withdraw;
