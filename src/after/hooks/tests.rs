//! Chains of real commands.

use super::*;
use crate::settings::{Occasion, RawCommand};
use std::ffi::OsString;
use std::fs;
use std::os::unix::ffi::{OsStrExt, OsStringExt};
use std::os::unix::fs::PermissionsExt;

/// A result folder with a report, and a staging folder beside it.
struct World {
    folder: tempfile::TempDir,
    target: Target,
}

impl World {
    fn new() -> Self {
        Self::named("part.stl".as_ref())
    }

    fn named(name: &std::ffi::OsStr) -> Self {
        let folder = tempfile::tempdir().expect("a folder");
        let result = folder.path().join("out").join(name);
        fs::create_dir_all(&result).expect("made");
        fs::create_dir(folder.path().join("staging")).expect("made");
        fs::write(result.join(result_files::REPORT), "{}").expect("written");
        let target = Target::new(&folder.path().join("in").join(name), &result).expect("paths");
        Self { folder, target }
    }

    fn run_while(&self, hooks: &[Hook], wanted: &dyn Fn() -> bool) -> Result<Chain, HookError> {
        let staging = self.folder.path().join("staging");
        let ran = run(hooks, &self.target, &staging, wanted);
        assert_eq!(fs::read_dir(staging).expect("a folder").count(), 0, "nothing is left");
        ran
    }

    fn run(&self, hooks: &[Hook]) -> Account {
        let chain = self.run_while(hooks, &|| true).expect("the system helps");
        let Chain::Over(account) = chain else { panic!("an account is expected: {chain:?}") };
        let written = fs::read(self.target.folder().join(result_files::HOOKS)).expect("there");
        assert_eq!(serde_json::from_slice::<Account>(&written).expect("JSON"), account);
        account
    }
}

fn hook(command: &[&str], time_limit: f64) -> Hook {
    let command = command.iter().map(ToString::to_string).collect();
    Hook::new(RawCommand { command, time_limit }, Occasion::Certified).expect("valid")
}

fn sh(script: &str) -> Hook {
    hook(&["sh", "-c", script], 60.0)
}

fn outcomes(account: &Account) -> Vec<Outcome> {
    account.commands.iter().map(|c| c.outcome).collect()
}

#[test]
fn a_chain_runs_in_order_in_the_result_folder() {
    let world = World::new();
    let show = hook(&["sh", "-c", "cat made; pwd; echo \"$@\"", "sh", "{input}", "{name}", "{{}}"], 60.0);
    let account = world.run(&[sh("echo first > made"), show]);
    assert_eq!(outcomes(&account), [Outcome::Succeeded; 2]);
    assert!(account.failure().is_none());
    let ran = &account.commands[1];
    let (input, folder) = (world.target.input().display(), world.target.folder().display());
    assert_eq!(ran.stdout, format!("first\n{folder}\n{input} part.stl {{}}\n"));
    assert_eq!((ran.exit_code, ran.signal, &ran.message, ran.stdout_truncated), (Some(0), None, &None, false));
    assert_eq!((&ran.configured[4], &ran.command[4]), (&"{input}".to_owned(), &input.to_string()));
    assert_eq!(account.report, blake3::hash(b"{}").to_hex().to_string());
    let mode = |file| fs::metadata(world.target.folder().join(file)).expect("there").permissions().mode();
    assert_eq!(
        mode(result_files::HOOKS),
        mode(result_files::REPORT),
        "whoever may read the report may read the account"
    );
}

#[test]
fn after_a_failure_the_others_are_skipped() {
    let world = World::new();
    let account = world.run(&[sh("echo no >&2; exit 3"), sh("touch made"), sh("touch made")]);
    assert_eq!(outcomes(&account), [Outcome::Failed, Outcome::Skipped, Outcome::Skipped]);
    let failed = account.failure().expect("a failure");
    assert_eq!((failed.exit_code, failed.stderr.as_str()), (Some(3), "no\n"));
    assert!(failed.message.as_ref().is_some_and(|m| m.contains("exit code 3")));
    assert!(!world.target.folder().join("made").exists());
    let killed = world.run(&[sh("kill -9 $$")]);
    assert_eq!((killed.commands[0].exit_code, killed.commands[0].signal), (None, Some(9)));
}

#[test]
fn what_cannot_start_is_told_with_a_remedy() {
    let world = World::new();
    let script = world.target.folder().join("script");
    fs::write(&script, "true\n").expect("written");
    let told = |command: &[&str]| {
        let account = world.run(&[hook(command, 60.0)]);
        assert_eq!(outcomes(&account), [Outcome::NotStarted]);
        account.commands[0].message.clone().expect("a message")
    };
    let missing = told(&["no-such-program", "a"]);
    assert!(missing.starts_with("cannot start no-such-program: ") && missing.contains("install it"), "{missing}");
    assert!(told(&["{folder}/script"]).contains("make the file executable"));
    fs::set_permissions(&script, fs::Permissions::from_mode(0o755)).expect("set");
    assert!(told(&["{folder}/script"]).contains("must begin with #!"));
}

#[test]
fn the_time_limit_holds() {
    let account = World::new().run(&[hook(&["sh", "-c", "echo begun; sleep 1000"], 0.5), sh("true")]);
    assert_eq!(outcomes(&account), [Outcome::TimedOut, Outcome::Skipped]);
    let ran = &account.commands[0];
    assert_eq!((ran.stdout.as_str(), ran.signal), ("begun\n", Some(15)));
    assert!(ran.message.as_ref().is_some_and(|m| m.contains("0.5 s")) && (0.4..30.0).contains(&ran.seconds));
}

#[test]
fn a_chain_that_is_no_longer_wanted_leaves_no_account_and_is_due_again() {
    let world = World::new();
    let begun = world.target.folder().join("begun");
    let hooks = [sh("true"), sh("touch begun; sleep 1000"), sh("touch after")];
    assert_eq!(world.run_while(&hooks, &|| !begun.exists()).expect("the system helps"), Chain::BrokenOff);
    assert!(begun.exists() && !world.target.folder().join("after").exists());
    assert!(!world.target.folder().join(result_files::HOOKS).exists() && are_due(&hooks, &world.target));
    assert_eq!(world.run_while(&hooks, &|| false).expect("the system helps"), Chain::BrokenOff);
}

#[test]
fn a_result_that_was_replaced_meanwhile_gets_no_account() {
    let world = World::new();
    let chain = world.run_while(&[sh("echo other > report.json")], &|| true).expect("the system helps");
    assert_eq!(chain, Chain::BrokenOff);
    assert!(!world.target.folder().join(result_files::HOOKS).exists());
    fs::remove_file(world.target.folder().join(result_files::REPORT)).expect("removed");
    assert!(matches!(world.run_while(&[sh("true")], &|| true), Err(HookError::NoReport(_))));
    assert!(!are_due(&[sh("true")], &world.target), "there is no result");
}

#[test]
fn a_command_that_takes_the_result_ends_the_chain() {
    let takes = ["mv report.json elsewhere", "mv ../part.stl ../elsewhere", "rm -r ../part.stl; exit 3"];
    for script in takes {
        let world = World::new();
        let chain = world.run_while(&[sh("true"), sh(script), sh("touch ../after")], &|| true);
        assert_eq!(chain.expect("the system helps"), Chain::Taken(2), "{script}");
        assert!(!world.folder.path().join("out/after").exists(), "{script}");
    }
    let world = World::new();
    let unwanted = || world.target.is_there();
    let chain = world.run_while(&[sh("rm report.json; sleep 1000")], &unwanted).expect("the system helps");
    assert_eq!(chain, Chain::BrokenOff, "planish stops, too: the next start does it again");
}

/// What the system has no room for now is no fault of the command.
#[test]
fn errors_that_pass_are_told_from_those_of_the_command() {
    use rustix::io::Errno;
    let passes = |errno: Errno| is_for_want_of_room(&errno.into());
    let room = [Errno::AGAIN, Errno::MFILE, Errno::NFILE, Errno::NOMEM, Errno::TXTBSY];
    assert!(room.into_iter().all(passes));
    let faults = [Errno::NOENT, Errno::ACCESS, Errno::NOEXEC, Errno::ISDIR, Errno::TOOBIG, Errno::PERM];
    assert!(!faults.into_iter().any(passes));
}

#[test]
fn names_that_are_no_utf8_reach_the_command() {
    let name = OsString::from_vec(b"pa\xffrt {x}.stl".to_vec());
    let world = World::named(&name);
    let account = world.run(&[hook(&["cp", "{report}", "{folder}/{name}.copy"], 60.0)]);
    assert_eq!(outcomes(&account), [Outcome::Succeeded], "{account:?}");
    let mut copy = name;
    copy.push(".copy");
    assert!(world.target.folder().join(&copy).exists() && copy.as_bytes().contains(&0xff));
    assert!(account.commands[0].command[2].ends_with("pa\u{fffd}rt {x}.stl.copy"));
}

#[test]
fn commands_are_due_until_they_ran_for_this_report_as_they_are_configured() {
    let world = World::new();
    let due = |hooks: &[Hook]| are_due(hooks, &world.target);
    let (failing, other) = (sh("false"), sh("true"));
    assert!(due(std::slice::from_ref(&failing)) && !due(&[]), "nothing is never due");
    world.run(std::slice::from_ref(&failing));
    assert!(!due(std::slice::from_ref(&failing)), "a failure is not repeated");
    assert!(due(&[hook(&["sh", "-c", "false"], 61.0)]), "another time limit");
    assert!(due(std::slice::from_ref(&other)) && due(&[failing.clone(), other.clone()]) && !due(&[]));
    fs::write(world.target.folder().join(result_files::REPORT), "{\"new\": 1}").expect("written");
    assert!(due(std::slice::from_ref(&failing)), "another report");
    world.run(&[failing.clone(), other.clone()]);
    assert!(!due(&[failing.clone(), other.clone()]) && due(&[other.clone(), failing.clone()]));
    fs::write(world.target.folder().join(result_files::HOOKS), "{").expect("written");
    assert!(due(&[failing, other]), "an account that cannot be read");
}
