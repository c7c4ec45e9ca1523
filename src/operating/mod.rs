//! What an operator sees of a daemon, and says to it: status, health, metrics, log, signs of life, settings read again.

pub mod health;
pub mod logging;
pub mod metrics;
pub mod pulse;
pub mod reload;
pub mod status;
pub mod supervisor;
