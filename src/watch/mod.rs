//! The daemon: it sees files ([`watcher`]), knows which have settled ([`inbox`]), and turns them into jobs ([`daemon`]).

pub mod daemon;
pub mod inbox;
pub mod signals;
pub mod stop;
pub mod watcher;
