//! Which settings a running daemon takes up.
//!
//! What decides results, what follows them, and what is too much for an input changes at any time, for inputs that are
//! taken up from then on. Threads, channels and folders are made at the start: what says how many and which waits for the
//! next one, and so does a folder to which inputs cannot go.

use crate::settings::Settings;

/// What becomes of settings that were read again.
#[derive(Clone, Debug, PartialEq)]
pub struct Reloaded {
    /// Those that are in force from now on.
    pub settings: Settings,
    /// The names of those that are not, before the daemon starts anew.
    pub later: Vec<&'static str>,
}

/// Takes up `fresh` settings in the place of those `in_force`, as far as that can be. Whether inputs can go where the
/// settings say tells `is_possible`.
///
/// ```
/// use planish::operating::reload::take_up;
/// use planish::settings::{RawSettings, Settings};
///
/// let settings = |toml| -> Settings {
///     let said: RawSettings = toml::from_str(toml).expect("planish.toml");
///     said.check().expect("in range")
/// };
/// let in_force = settings("jobs = 2");
/// let reloaded = take_up(&in_force, settings("jobs = 2\nweld = 1e-5\nrecursive = true"), |_| true);
/// assert_eq!(reloaded.settings.weld, 1e-5);
/// // Which folders are watched is settled at the start.
/// assert_eq!((reloaded.settings.recursive, reloaded.later), (false, vec!["recursive"]));
/// ```
pub fn take_up(in_force: &Settings, fresh: Settings, is_possible: impl Fn(&Settings) -> bool) -> Reloaded {
    let mut later = Vec::new();
    let mut settings = Settings { machine_memory: in_force.machine_memory, ..fresh };
    let new = &mut settings;
    keep("out", &in_force.out, &mut new.out, &mut later);
    keep("jobs", &in_force.jobs, &mut new.jobs, &mut later);
    keep("commands", &in_force.commands, &mut new.commands, &mut later);
    keep("memory", &in_force.memory, &mut new.memory, &mut later);
    keep("poll", &in_force.poll, &mut new.poll, &mut later);
    keep("recursive", &in_force.recursive, &mut new.recursive, &mut later);
    keep("metrics", &in_force.metrics, &mut new.metrics, &mut later);
    keep("log", &in_force.log, &mut new.log, &mut later);
    keep("verbose", &in_force.verbose, &mut new.verbose, &mut later);
    keep("quiet", &in_force.quiet, &mut new.quiet, &mut later);
    let go_elsewhere = (&new.inputs, &new.refused) != (&in_force.inputs, &in_force.refused);
    if go_elsewhere && !is_possible(new) {
        keep("inputs", &in_force.inputs, &mut new.inputs, &mut later);
        keep("refused", &in_force.refused, &mut new.refused, &mut later);
    }
    Reloaded { settings, later }
}

/// Keeps what is in force; where something else was asked for, its name is noted.
fn keep<T: Clone + PartialEq>(name: &'static str, in_force: &T, asked: &mut T, later: &mut Vec<&'static str>) {
    if asked != in_force {
        asked.clone_from(in_force);
        later.push(name);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::settings::{Inputs, RawSettings};
    use planish_core::Order;

    fn settings(toml: &str) -> Settings {
        toml::from_str::<RawSettings>(toml).expect("well-formed").check().expect("in range")
    }

    const OLD: &str = "jobs = 1\nout = \"a\"\n";

    fn reloaded(fresh: &str, is_possible: bool) -> Reloaded {
        take_up(&settings(OLD), settings(fresh), |_| is_possible)
    }

    #[test]
    fn what_decides_results_changes_and_what_was_made_at_the_start_does_not() {
        let both = reloaded("jobs = 2\nout = \"b\"\norder = 1\nlog = \"json\"\n", true);
        assert_eq!(both.later, ["out", "jobs", "log"]);
        assert_eq!(both.settings, settings(&format!("{OLD}order = 1")));
        assert_eq!(both.settings.order, Order::Linear);
        let one = reloaded(&format!("{OLD}min-free = 7\nkeep-results = 3\n[limits]\ndepth = 9"), true);
        assert!(one.later.is_empty() && one.settings.min_free == 7 && one.settings.limits.depth == 9);
        assert!(one.settings.keep_results.is_some());
        assert_eq!(reloaded(OLD, false), Reloaded { settings: settings(OLD), later: vec![] });
    }

    #[test]
    fn inputs_go_elsewhere_only_where_they_can() {
        let moved = format!("{OLD}inputs = \"move:done\"");
        let [can, cannot] = [true, false].map(|is_possible| reloaded(&moved, is_possible));
        assert_eq!((can.settings.inputs, can.later), (Inputs::Move("done".into()), vec![]));
        assert_eq!((cannot.settings.inputs, cannot.later), (Inputs::Keep, vec!["inputs"]));
    }
}
