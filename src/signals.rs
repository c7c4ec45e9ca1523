//! Ctrl-C and SIGTERM.

use crate::watch::Stop;

/// From now on Ctrl-C, SIGTERM and SIGHUP ask to stop instead of ending the program.
///
/// # Errors
/// Where the system does not allow it.
pub fn listen() -> Result<Stop, ctrlc::Error> {
    let stop = Stop::default();
    let asked = stop.clone();
    ctrlc::set_handler(move || asked.ask())?;
    Ok(stop)
}
