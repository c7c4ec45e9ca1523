//! Ctrl-C, SIGTERM and SIGHUP.

use super::stop::Stop;
use signal_hook::consts::{SIGHUP, SIGINT, SIGTERM};
use signal_hook::iterator::Signals;
use std::time::Duration;

/// What SIGHUP asks for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Hangup {
    /// To stop: the terminal is gone.
    Stop,
    /// To read the settings again, as services do.
    Reload,
}

/// How long an end may take that was asked for. A disk that hangs may hold it up for ever; and whatever is on its way then,
/// nothing is lost: a kill at any moment is safe.
const DEADLINE: Duration = Duration::from_secs(20);

/// From now on Ctrl-C and SIGTERM, and perhaps SIGHUP, ask to stop instead of ending the program. But one that was ignored when the
/// program was started stays ignored: `nohup` is there for that, and a shell has its background jobs ignore Ctrl-C.
///
/// # Errors
/// Where the system does not allow it.
pub fn listen(hangup: Hangup, drains: bool) -> std::io::Result<Stop> {
    let stop = Stop::default();
    let asked = stop.clone();
    let ignored = ignored();
    let heard = [SIGINT, SIGTERM, SIGHUP].into_iter().filter(|s| *s == SIGTERM || !is_in(ignored, *s));
    let mut signals = Signals::new(heard)?;
    std::thread::Builder::new().name("signals".to_owned()).spawn(move || {
        // Who drains has all the time there is, until it is asked again.
        let mut before_it_must_end: i64 = if drains { 2 } else { 1 };
        // Ends with the program.
        for signal in signals.forever() {
            if (signal, hangup) == (SIGHUP, Hangup::Reload) {
                asked.ask_to_reload();
                continue;
            }
            asked.ask();
            before_it_must_end -= 1;
            if before_it_must_end == 0 {
                end_in_time();
            }
        }
    })?;
    Ok(stop)
}

/// Ends the program when its end takes too long. Where there is no thread for that, whoever asked has others means.
fn end_in_time() {
    let _ = std::thread::Builder::new().name("deadline".to_owned()).spawn(|| {
        std::thread::sleep(DEADLINE);
        // The log may be what hangs.
        std::process::exit(1);
    });
}

/// The signals that this process ignores, a bit each; none where the system does not tell.
fn ignored() -> u64 {
    let status = std::fs::read_to_string("/proc/self/status").unwrap_or_default();
    status.lines().find_map(mask).unwrap_or(0)
}

fn mask(line: &str) -> Option<u64> {
    u64::from_str_radix(line.strip_prefix("SigIgn:")?.trim(), 16).ok()
}

fn is_in(mask: u64, signal: i32) -> bool {
    mask >> (signal - 1) & 1 == 1
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ignored_signals_are_read_from_their_mask() {
        let of_nohup = mask("SigIgn:\t0000000000001001").expect("a mask");
        assert!(is_in(of_nohup, SIGHUP) && !is_in(of_nohup, SIGINT) && !is_in(of_nohup, SIGTERM));
        assert!(mask("SigCgt:\t0000000000001001").is_none() && mask("SigIgn:\tnone").is_none());
    }
}
