//! planish: certified one-to-one quadratic parametrizations of poor surface triangulations.
//!
//! This is the shell around the pure crate [`pipeline`], as a library so that tests reach it: the only code that
//! touches disk, clock, threads and environment. The verbs are in [`verbs`]; an input travels as a [`job::Job`].

pub mod cli;
pub mod formats;
pub mod hand_off;
pub mod hooks;
pub mod inputs;
pub mod job;
pub mod logging;
pub mod outcome;
pub mod publish;
pub mod report;
pub mod settings;
pub mod verbs;
