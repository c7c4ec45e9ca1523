//! planish: certified one-to-one quadratic parametrizations of poor surface triangulations.
//!
//! This is the shell around the pure crate [`planish_core`], as a library so that tests reach it: the only code that
//! touches disk, clock, threads and environment. Its rooms, and which of them may enter which, are in
//! docs/architecture.md. The verbs are in [`verbs`]; an input travels as an [`input::job::Job`] through the [`stages`],
//! which the [`conveyor`] runs on threads.

pub mod after;
pub mod cli;
pub mod conveyor;
pub mod export;
pub mod formats;
pub mod input;
pub mod operating;
pub mod outcome;
pub mod output;
pub mod report;
pub mod result_files;
pub mod settings;
pub mod stages;
pub mod system;
pub mod verbs;
pub mod watch;
