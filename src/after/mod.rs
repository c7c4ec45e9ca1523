//! What follows when a result stands: commands run on it ([`hooks`]), and its input is kept, moved or deleted
//! ([`archive`]), in that order ([`post_process`]).

pub mod archive;
pub mod holding;
pub mod hooks;
pub mod post_process;
#[cfg(test)]
mod scenes;
