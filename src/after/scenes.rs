//! Everything that writes results and puts inputs away, killed before every change, cut off from power there, and with
//! every operation failing once, beside others who write to the same folders.
//!
//! A **scene** is one such run, what follows it, and the work done again until it is done. It is wrong where anything of
//! this does not hold: an older or newer result is whole at any time; in the end each input has one whole result, and its
//! content is where it belongs; nothing of others has gone; nothing is left over; and all of that is on disk.

use crate::after::archive::{Fate, Processed, Way, archive};
use crate::after::holding;
use crate::input;
use crate::outcome::Status;
use crate::output::ledger;
use crate::output::publish::{Content, PublishError, Publisher};
use crate::report::{Input, Output, Report};
use crate::result_files;
use crate::settings::{RawSettings, Settings};
use crate::system::disk::simulated::{Abilities, Left, Lies, Plan, Seen, Simulated};
use crate::system::disk::{Disk, Kind, replace_file};
use crate::system::fingerprint::Fingerprint;
use parking_lot::Mutex;
use rustix::io::Errno;
use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;
use std::sync::{Arc, LazyLock};

const OUT: &str = "/out";
const IN: &str = "/in";
const DONE: &str = "/done";

/// The inputs.
const NAMES: [&str; 2] = ["part.stl", "sub/b.stl"];

/// What is an operation's trouble for once.
const TROUBLES: [Errno; 7] =
    [Errno::IO, Errno::STALE, Errno::MFILE, Errno::NOMEM, Errno::TIMEDOUT, Errno::NOSPC, Errno::XDEV];

/// Those of every scene: to check them, the machine is looked at.
static SETTINGS: LazyLock<Settings> = LazyLock::new(|| RawSettings::default().check().expect("in range"));

/// After so many operations, a process has begun: no single failure ends it any more.
const STARTED: usize = 40;

/// What becomes of inputs.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Inputs {
    Keep,
    Delete,
    Move,
    /// To another disk.
    MoveFar,
}

/// What somebody else does while the work goes on.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Other {
    /// Puts a file into the result.
    AddsFile,
    /// Replaces the input by a newer one.
    ReplacesInput,
    /// Removes the input.
    RemovesInput,
    /// Puts a folder in the place of the result, where nothing is.
    TakesPlace,
    /// Puts a file where the input is to be moved to.
    TakesName,
    /// Removes what is staged.
    RemovesStaging,
    /// Removes all that is hidden in the output folder.
    RemovesHidden,
    /// Publishes the same result, and another one.
    Publishes,
}

const OTHERS: [Other; 8] = [
    Other::AddsFile,
    Other::ReplacesInput,
    Other::RemovesInput,
    Other::TakesPlace,
    Other::TakesName,
    Other::RemovesStaging,
    Other::RemovesHidden,
    Other::Publishes,
];

/// What there is before the work begins.
#[derive(Clone, Copy, Debug)]
struct Stage {
    able: Abilities,
    inputs: Inputs,
    /// Whether there is an older result, with files of others in it.
    older: bool,
    /// A file that has the name of the input in the folder that it is moved to.
    taken: Option<&'static str>,
}

impl Stage {
    fn plain(inputs: Inputs) -> Self {
        Self { able: Abilities::ALL, inputs, older: true, taken: None }
    }
}

/// What must be there in the end.
#[derive(Clone, Debug, Default)]
struct Expected {
    /// Files of others.
    theirs: BTreeMap<String, Vec<u8>>,
    /// Inputs; none where somebody has removed one.
    inputs: BTreeMap<String, Option<Vec<u8>>>,
    /// Whether something of others is in the place of the first result.
    is_blocked: bool,
    /// Another input, published by somebody else.
    other: Option<Vec<u8>>,
}

type Shared = Arc<Mutex<Expected>>;

fn older_content(name: &str) -> Vec<u8> {
    format!("older {name}").into_bytes()
}

fn input_of(name: &str, content: &[u8]) -> Input {
    let blake3 = Some(blake3::hash(content).to_hex().to_string());
    Input { name: name.to_owned(), bytes: Some(content.len() as u64), blake3, beside: vec![] }
}

fn report_of(name: &str, content: &[u8]) -> Report {
    Report { status: Status::Certified, ..Report::new(input_of(name, content), &SETTINGS) }
}

fn result_of(name: &str, content: &[u8]) -> Vec<Content> {
    let surface = [b"surface of ", content].concat();
    let outputs = vec![Output::of(result_files::SURFACE, &surface), Output::of("empty.vtp", b"")];
    let report = Report { outputs, ..report_of(name, content) }.to_json().expect("plain");
    vec![
        (result_files::SURFACE.to_owned(), surface),
        ("empty.vtp".to_owned(), vec![]),
        (result_files::REPORT.to_owned(), report),
    ]
}

/// Builds a stage; what must be there in the end if nobody does anything.
fn build(stage: &Stage) -> (Simulated, Expected) {
    let disk = Simulated::new(stage.able);
    let mut expected = Expected::default();
    [IN, OUT].iter().for_each(|folder| disk.put_folder(folder, 0o755));
    for name in NAMES {
        let content = format!("input {name}").into_bytes();
        disk.put(&format!("{IN}/{name}"), &content);
        expected.inputs.insert(name.to_owned(), Some(content));
    }
    let mut theirs = vec![
        (format!("{OUT}/other/precious.txt"), "work"),
        (format!("{OUT}/.planish/archive/work.txt"), "work"),
        (format!("{IN}/.planish-taken-evil/a.txt"), "theirs"),
    ];
    if stage.older {
        let name = NAMES[0];
        for (file, content) in result_of(name, &older_content(name)) {
            disk.put(&format!("{OUT}/{name}/{file}"), &content);
        }
        theirs.push((format!("{OUT}/{name}/mine.txt"), "mine"));
        theirs.push((format!("{OUT}/{name}/notes/june.txt"), "notes"));
        disk.put_other(&format!("{OUT}/{name}/link"), Kind::Link);
    }
    if stage.inputs == Inputs::MoveFar {
        disk.mount(DONE);
    }
    if let Some(taken) = stage.taken {
        theirs.push((format!("{DONE}/{}", NAMES[0]), taken));
    }
    for (path, content) in theirs {
        disk.put(&path, content.as_bytes());
        expected.theirs.insert(path, content.as_bytes().to_vec());
    }
    (disk, expected)
}

/// Does what a daemon does, in one process, from its start to its end. Inputs are tried again a few times.
fn work(disk: &Simulated, stage: &Stage) -> Result<(), String> {
    let publisher = Publisher::open_on(disk.clone(), OUT.as_ref()).map_err(|error| error.to_string())?;
    if stage.inputs != Inputs::Keep {
        holding::recover(disk, IN.as_ref(), true);
    }
    if [Inputs::Move, Inputs::MoveFar].contains(&stage.inputs) {
        holding::clear(disk, DONE.as_ref(), true);
    }
    let ended = NAMES.map(|name| process_until_done(disk, stage, &publisher, name));
    publisher.close();
    ended.into_iter().collect()
}

fn process_until_done(
    disk: &Simulated,
    stage: &Stage,
    publisher: &Publisher<Simulated>,
    name: &str,
) -> Result<(), String> {
    let mut ended = Ok(());
    for _ in 0..4 {
        ended = process(disk, stage, publisher, name);
        if ended.is_ok() {
            break;
        }
    }
    ended
}

fn process(disk: &Simulated, stage: &Stage, publisher: &Publisher<Simulated>, name: &str) -> Result<(), String> {
    let path = format!("{IN}/{name}");
    let (Some(content), Some(seen)) = (disk.file(&path), disk.look(&path)) else { return Ok(()) };
    publish(disk, publisher, name, &content, || disk.look(&path) == Some(seen)).or_else(lasting)?;
    if !is_whole(&disk.all(), name, &content) {
        return Ok(());
    }
    let moved = Path::new(DONE).join(name);
    let way = match stage.inputs {
        Inputs::Keep => return Ok(()),
        Inputs::Delete => Way::Nowhere,
        Inputs::Move | Inputs::MoveFar => Way::To(&moved),
    };
    publisher.secure(name.as_ref()).map_err(|error| error.to_string())?;
    let (look, hash) = (Fingerprint::of_stat(&seen), blake3::hash(&content));
    let input = Processed { inbox: IN.as_ref(), name: name.as_ref(), look: &look, hash };
    match archive(disk, &input, way).map_err(|error| error.to_string())? {
        Fate::Away | Fate::Nothing => Ok(()),
        fate => Err(format!("{fate:?}")),
    }
}

/// What stays as long as nobody changes something is not tried again.
fn lasting(error: PublishError) -> Result<(), String> {
    if error.is_lasting() { Ok(()) } else { Err(error.to_string()) }
}

/// Publishes the result of an input where it is not up to date, and writes what commands have done.
fn publish(
    disk: &Simulated,
    publisher: &Publisher<Simulated>,
    name: &str,
    content: &[u8],
    wanted: impl Fn() -> bool,
) -> Result<(), PublishError> {
    let failed = |error| PublishError::Io { path: name.into(), error };
    publisher.admits(name.as_ref())?;
    let target = publisher.target(name.as_ref());
    let beside = input::Folder::of(name.as_ref());
    let older = disk.open(&target).ok();
    let is_done = older
        .is_some_and(|older| ledger::up_to_date_in(&older, &input_of(name, content), &SETTINGS, &beside).is_some());
    if !is_done && !publisher.publish(name.as_ref(), &result_of(name, content), wanted)? {
        return Err(failed(Errno::AGAIN.into()));
    }
    let desk = disk.open(&publisher.staging()?).map_err(failed)?;
    let folder = disk.open(&target).map_err(failed)?;
    replace_file(&desk, &folder, result_files::HOOKS, b"{\"whole\": true}").map_err(failed)
}

/// Lets somebody do something before an operation.
fn let_other(disk: &Simulated, other: Other, operation: usize, expected: &Shared) {
    let expected = expected.clone();
    disk.meanwhile(operation, move |disk| act(disk, other, &mut expected.lock()));
}

fn act(disk: &Simulated, other: Other, expected: &mut Expected) {
    let name = NAMES[0];
    let target = format!("{OUT}/{name}");
    let is_there = disk.look(&target).is_some();
    let mut put = |path: String, text: &str| {
        disk.put(&path, text.as_bytes());
        expected.theirs.insert(path, text.as_bytes().to_vec());
    };
    match other {
        Other::AddsFile if is_there => put(format!("{target}/late.txt"), "late"),
        Other::TakesName if disk.look(&format!("{DONE}/{name}")).is_none() => {
            put(format!("{DONE}/{name}"), "another");
        }
        Other::TakesPlace if !is_there => {
            put(format!("{target}/precious.txt"), "work");
            expected.is_blocked = true;
        }
        Other::AddsFile | Other::TakesPlace | Other::TakesName => {}
        Other::ReplacesInput => {
            disk.put(&format!("{IN}/{name}"), b"newer input");
            expected.inputs.insert(name.to_owned(), Some(b"newer input".to_vec()));
        }
        Other::RemovesInput => {
            let path = format!("{IN}/{name}");
            if disk.look(&path).is_some() {
                disk.remove(&path);
                expected.inputs.insert(name.to_owned(), None);
            }
        }
        Other::RemovesStaging => {
            let hidden = format!("{OUT}/.planish");
            let is_run = |path: &String| path.starts_with(&format!("{hidden}/run-")) && path.matches('/').count() == 3;
            disk.all().keys().filter(|path| is_run(path)).for_each(|path| disk.remove(path));
            forget_what_lay_there(is_there, expected);
        }
        Other::RemovesHidden => {
            disk.remove(&format!("{OUT}/.planish"));
            forget_what_lay_there(is_there, expected);
            expected.theirs.retain(|path, _| !path.contains("/.planish/"));
        }
        Other::Publishes => publish_beside(disk, expected),
    }
}

/// Where folders cannot be exchanged, the older result lies with what is staged for a moment: who removes that removes it.
fn forget_what_lay_there(is_there: bool, expected: &mut Expected) {
    if !is_there {
        expected.theirs.retain(|path, _| !path.starts_with(&format!("{OUT}/{}/", NAMES[0])));
    }
}

/// Another process publishes the same result, and another one, where it need not wait for the first one.
fn publish_beside(disk: &Simulated, expected: &mut Expected) {
    if disk.is_locked(&format!("{OUT}/.planish/opening")) {
        return;
    }
    let disk = disk.process(7, Plan::default());
    let publisher = Publisher::open_on(disk.clone(), OUT.as_ref()).expect("opens");
    if let Some(Some(content)) = expected.inputs.get(NAMES[0]) {
        publisher.publish(NAMES[0].as_ref(), &result_of(NAMES[0], content), || true).expect("published");
    }
    publisher.publish("c.stl".as_ref(), &result_of("c.stl", b"other"), || true).expect("published");
    expected.other = Some(b"other".to_vec());
}

/// Whether a result is whole, and of this content.
fn is_whole(all: &BTreeMap<String, Seen>, name: &str, content: &[u8]) -> bool {
    let files = result_of(name, content);
    files.iter().all(|(file, bytes)| all.get(&format!("{OUT}/{name}/{file}")) == Some(&Seen::File(bytes.clone())))
}

/// What is wrong at any time, after a start.
fn wrong_at_any_time(all: &BTreeMap<String, Seen>, stage: &Stage, expected: &Expected) -> Vec<String> {
    let mut wrong = theirs_gone(all, expected);
    for (name, content) in &expected.inputs {
        let Some(content) = content else { continue };
        let is_newer = is_whole(all, name, content);
        let is_kept = |(path, seen): (&String, &Seen)| {
            (path.starts_with(IN) || path.starts_with(DONE)) && *seen == Seen::File(content.clone())
        };
        let is_replaced = stage.inputs == Inputs::Delete && is_newer;
        if !(is_replaced || all.iter().any(is_kept)) {
            wrong.push(format!("the content of {name} is lost"));
        }
        let is_first = name == NAMES[0];
        let had_older = is_first && stage.older;
        // A newer input may have come when the result of the one before it was in place.
        let before = [older_content(name), format!("input {name}").into_bytes()];
        let is_older = before.iter().any(|content| is_whole(all, name, content));
        let may_be_none = !had_older && !all.contains_key(&format!("{OUT}/{name}"));
        let is_blocked = is_first && expected.is_blocked;
        if !(is_newer || is_older || may_be_none || is_blocked) {
            wrong.push(format!("{name} has no whole result"));
        }
    }
    wrong
}

fn theirs_gone(all: &BTreeMap<String, Seen>, expected: &Expected) -> Vec<String> {
    let is_staged = |path: &String, content: &Seen| {
        let name = path.rsplit('/').next().unwrap_or_default();
        let is_it = |(staged, seen): (&String, &Seen)| {
            staged.contains("/.planish/run-") && staged.ends_with(name) && seen == content
        };
        // Where somebody has taken the place of the older result, that stays where it is.
        expected.is_blocked && all.iter().any(is_it)
    };
    let is_gone = |(path, content): &(&String, &Vec<u8>)| {
        let content = Seen::File((*content).clone());
        all.get(*path) != Some(&content) && !is_staged(path, &content)
    };
    expected.theirs.iter().filter(is_gone).map(|(path, _)| format!("{path} of somebody else is gone")).collect()
}

/// What is wrong when all is done.
fn wrong_in_the_end(all: &BTreeMap<String, Seen>, stage: &Stage, expected: &Expected) -> Vec<String> {
    let mut wrong = wrong_at_any_time(all, stage, expected);
    for (name, content) in &expected.inputs {
        let Some(content) = content else { continue };
        // What came in the last moment has become a part of the result.
        let is_blocked = name == NAMES[0] && expected.is_blocked && !is_whole(all, name, content);
        if !is_blocked && !is_whole(all, name, content) {
            wrong.push(format!("{name} has no result of its own"));
        }
        let at = |folder: &str| {
            let is_it =
                |(path, seen): &(&String, &Seen)| path.starts_with(folder) && **seen == Seen::File(content.clone());
            all.iter().filter(is_it).count()
        };
        let places = [at(IN), at(DONE)];
        let right = match stage.inputs {
            Inputs::Delete if !is_blocked => [0, 0],
            Inputs::Move | Inputs::MoveFar if !is_blocked => [0, 1],
            Inputs::Keep | Inputs::Delete | Inputs::Move | Inputs::MoveFar => {
                [1, usize::from(is_blocked && places[1] == 1)]
            }
        };
        if places != right {
            wrong.push(format!("{name} is in {places:?} places, not {right:?}"));
        }
    }
    if let Some(content) = &expected.other
        && !is_whole(all, "c.stl", content)
    {
        wrong.push("c.stl, published by another process, is not whole".to_owned());
    }
    wrong.extend(all.keys().filter(|path| is_left_over(path, stage, expected)).map(|p| format!("{p} is left over")));
    wrong
}

/// Whether nothing is to be under this path.
fn is_left_over(path: &str, stage: &Stage, expected: &Expected) -> bool {
    let is_theirs = expected.theirs.keys().any(|their| their == path || their.starts_with(&format!("{path}/")));
    if is_theirs {
        return false;
    }
    let hidden = [format!("{OUT}/.planish"), format!("{OUT}/.planish/opening")];
    if expected.is_blocked && stage.older && path.contains("/.planish/run-") {
        return false;
    }
    if path.contains("/.planish") {
        return !hidden.iter().any(|known| known == path) && !path.starts_with(&format!("{IN}/.planish-taken-evil"));
    }
    let mut known: BTreeSet<String> =
        [OUT, IN, DONE].iter().flat_map(|top| [(*top).to_owned(), format!("{top}/sub")]).collect();
    if stage.older {
        known.extend(["link", "notes"].map(|name| format!("{OUT}/{}/{name}", NAMES[0])));
    }
    for name in NAMES.iter().chain(&["c.stl"]) {
        let files = [result_files::SURFACE, "empty.vtp", result_files::REPORT, result_files::HOOKS];
        known.extend(files.map(|file| format!("{OUT}/{name}/{file}")));
        known.extend([OUT, IN, DONE].map(|top| format!("{top}/{name}")));
    }
    // The name was taken.
    known.extend([2, 3].map(|number| format!("{DONE}/part.{number}.stl")));
    !known.contains(path)
}

/// Counts scenes, and tells which were wrong.
#[derive(Default)]
struct Tally {
    scenes: usize,
    wrong: Vec<String>,
}

impl Tally {
    fn add(&mut self, what: impl FnOnce() -> String, wrong: Vec<String>) {
        self.scenes += 1;
        if !wrong.is_empty() {
            self.wrong.push(format!("{}: {}", what(), wrong.join("; ")));
        }
    }

    fn assert_right(&self, title: &str) {
        println!("{title}: {} scenes, {} wrong", self.scenes, self.wrong.len());
        let some: Vec<&String> = self.wrong.iter().take(12).collect();
        assert!(some.is_empty(), "{} of {} scenes are wrong, such as\n{some:#?}", self.wrong.len(), self.scenes);
    }
}

/// What follows when a process was killed or has ended: nothing, or the power goes.
fn afterwards(seeds: u64) -> Vec<Option<Left>> {
    let mut all = vec![None, Some(Left::Nothing), Some(Left::Everything)];
    all.extend((0..seeds).map(|seed| Some(Left::Some(seed))));
    all
}

/// Starts again after `left` on what `disk` was, as often as it takes; what is wrong.
fn do_again(disk: &Simulated, left: Option<Left>, stage: &Stage, expected: &Expected) -> Vec<String> {
    let after = disk.restarted(left);
    let mut wrong = Vec::new();
    let probe = after.restarted(None).process(8, Plan::default());
    drop(Publisher::open_on(probe.clone(), OUT.as_ref()));
    wrong.extend(wrong_at_any_time(&probe.all(), stage, expected));
    wrong.extend(finish(&after, stage, expected));
    if wrong.is_empty() {
        // What is done is on disk; what had been removed may be there again.
        let later = after.restarted(Some(Left::Nothing));
        wrong
            .extend(finish(&later, stage, expected).into_iter().map(|w| format!("when the power goes after all: {w}")));
    }
    wrong
}

fn finish(disk: &Simulated, stage: &Stage, expected: &Expected) -> Vec<String> {
    let ended = work(&disk.process(2, Plan::default()), stage);
    let mut wrong: Vec<String> = ended.err().into_iter().collect();
    wrong.extend(wrong_in_the_end(&disk.all(), stage, expected));
    wrong
}

/// One run, disturbed as planned; the disk, and what is to be there.
fn run(stage: &Stage, plan: Plan, other: Option<(Other, usize)>, lies: Lies) -> (Simulated, Expected, (usize, usize)) {
    let (disk, expected) = build(stage);
    disk.lie(lies);
    let expected: Shared = Arc::new(Mutex::new(expected));
    if let Some((other, operation)) = other {
        let_other(&disk, other, operation, &expected);
    }
    let first = disk.process(1, plan);
    let _ = work(&first, stage);
    let expected = expected.lock().clone();
    (disk, expected, first.counts())
}

/// How much is tried.
#[derive(Clone, Copy)]
struct Effort {
    /// Every so many-th change or operation.
    step: usize,
    seeds: u64,
}

/// Killed before every change; then started again, at once or after the power was gone.
fn kill_everywhere(stage: &Stage, other: Option<(Other, usize)>, effort: Effort, lies: Lies, tally: &mut Tally) {
    let (.., (_, changes)) = run(stage, Plan::default(), other, lies);
    for kill in (0..=changes).step_by(effort.step) {
        let plan = Plan { kill: Some(kill), fail: None };
        let (disk, expected, _) = run(stage, plan, other, lies);
        for left in afterwards(effort.seeds) {
            let what = || format!("{stage:?}, {other:?}, killed before change {kill}, {left:?}");
            tally.add(what, do_again(&disk, left, stage, &expected));
        }
    }
}

/// Killed, started again, and killed before every change of that.
fn kill_twice(stage: &Stage, effort: Effort, tally: &mut Tally) {
    let (.., (_, changes)) = run(stage, Plan::default(), None, Lies::None);
    for first in (0..=changes).step_by(effort.step) {
        let (disk, expected, _) = run(stage, Plan { kill: Some(first), fail: None }, None, Lies::None);
        for second in (0..=changes).step_by(effort.step) {
            for left in afterwards(effort.seeds) {
                let again = disk.restarted(left);
                let _ = work(&again.process(3, Plan { kill: Some(second), fail: None }), stage);
                let what = || format!("{stage:?}, killed before changes {first}, {left:?}, and {second}");
                tally.add(what, do_again(&again, None, stage, &expected));
            }
        }
    }
}

/// Every operation fails once, in these ways.
fn fail_everywhere(stage: &Stage, troubles: &[Errno], effort: Effort, tally: &mut Tally) {
    let (.., (operations, _)) = run(stage, Plan::default(), None, Lies::None);
    for operation in (0..operations).step_by(effort.step) {
        for &errno in troubles {
            let plan = Plan { kill: None, fail: Some((operation, errno)) };
            let (disk, expected, _) = run(stage, plan, None, Lies::None);
            let is_done = NAMES.iter().all(|name| {
                let content = expected.inputs[*name].as_ref().expect("nobody removes it");
                is_whole(&disk.all(), name, content)
            });
            // The first operations are those of the start.
            if errno != Errno::XDEV && operation > STARTED && !is_done {
                tally.add(
                    || format!("{stage:?}, operation {operation}: {errno}"),
                    vec!["was not tried again".to_owned()],
                );
            }
            for left in afterwards(effort.seeds) {
                let what = || format!("{stage:?}, operation {operation} fails by {errno}, {left:?}");
                tally.add(what, do_again(&disk, left, stage, &expected));
            }
        }
    }
}

/// Every operation fails once, and the process is killed some time later.
fn fail_and_kill(stage: &Stage, effort: Effort, tally: &mut Tally) {
    let (.., (operations, changes)) = run(stage, Plan::default(), None, Lies::None);
    for operation in (0..operations).step_by(effort.step) {
        // It has more to do than one that nothing happens to.
        for kill in (0..2 * changes).step_by(effort.step) {
            let plan = Plan { kill: Some(kill), fail: Some((operation, Errno::IO)) };
            let (disk, expected, (_, made)) = run(stage, plan, None, Lies::None);
            for left in [None, Some(Left::Nothing)] {
                let what = || format!("{stage:?}, operation {operation} fails, killed before change {kill}, {left:?}");
                tally.add(what, do_again(&disk, left, stage, &expected));
            }
            if made < kill {
                break;
            }
        }
    }
}

/// Somebody does something before every operation.
fn others_everywhere(stage: &Stage, effort: Effort, tally: &mut Tally) {
    let (.., (operations, _)) = run(stage, Plan::default(), None, Lies::None);
    for other in OTHERS {
        for operation in (0..operations).step_by(effort.step) {
            let (disk, expected, _) = run(stage, Plan::default(), Some((other, operation)), Lies::None);
            for left in afterwards(effort.seeds) {
                let what = || format!("{stage:?}, {other:?} before operation {operation}, {left:?}");
                tally.add(what, do_again(&disk, left, stage, &expected));
            }
        }
    }
}

fn stages() -> Vec<Stage> {
    let plain = Stage::plain;
    let mut all: Vec<Stage> = [Inputs::Keep, Inputs::Delete, Inputs::Move, Inputs::MoveFar].map(plain).into();
    all.push(Stage { older: false, ..plain(Inputs::Delete) });
    for taken in ["another", "input part.stl"] {
        all.extend([Inputs::Move, Inputs::MoveFar].map(|inputs| Stage { taken: Some(taken), ..plain(inputs) }));
    }
    let wanting = [
        Abilities { exchange: false, ..Abilities::ALL },
        Abilities { links: false, ..Abilities::ALL },
        Abilities { exchange: false, to_free: false, links: true },
    ];
    for able in wanting {
        all.extend([Inputs::Delete, Inputs::Move].map(|inputs| Stage { able, ..plain(inputs) }));
    }
    all
}

#[test]
fn the_stage_is_right_where_nobody_disturbs_anything() {
    for stage in stages() {
        let (disk, expected, counts) = run(&stage, Plan::default(), None, Lies::None);
        assert_eq!(wrong_in_the_end(&disk.all(), &stage, &expected), Vec::<String>::new(), "{stage:?}");
        assert!(counts.1 > 30, "{stage:?}: {counts:?}");
    }
}

#[test]
fn results_survive_kills_and_losses_of_power() {
    let mut tally = Tally::default();
    for stage in stages() {
        kill_everywhere(&stage, None, Effort { step: 13, seeds: 1 }, Lies::None, &mut tally);
        kill_twice(&stage, Effort { step: 61, seeds: 0 }, &mut tally);
    }
    kill_everywhere(&Stage::plain(Inputs::Keep), None, Effort { step: 1, seeds: 6 }, Lies::None, &mut tally);
    kill_everywhere(&Stage::plain(Inputs::MoveFar), None, Effort { step: 1, seeds: 1 }, Lies::None, &mut tally);
    tally.assert_right("killed before some changes");
}

#[test]
fn any_operation_may_fail_once() {
    let mut tally = Tally::default();
    for stage in stages() {
        fail_everywhere(&stage, &TROUBLES, Effort { step: 97, seeds: 0 }, &mut tally);
    }
    let found = Stage { taken: Some("input part.stl"), ..Stage::plain(Inputs::Move) };
    fail_everywhere(&found, &[Errno::IO], Effort { step: 1, seeds: 2 }, &mut tally);
    tally.assert_right("some operations fail");
}

/// Also where the one who put it in place could not bring it to disk.
#[test]
fn a_result_that_is_secured_survives_a_loss_of_power() {
    let (stage, name) = (Stage::plain(Inputs::Delete), NAMES[1]);
    let mut secured = 0;
    for operation in 0..300 {
        let (disk, _) = build(&stage);
        let plan = Plan { kill: None, fail: Some((operation, Errno::IO)) };
        let Ok(publisher) = Publisher::open_on(disk.process(1, plan), OUT.as_ref()) else { continue };
        let published = publisher.publish(name.as_ref(), &result_of(name, b"content"), || true);
        if published.is_err() && is_whole(&disk.all(), name, b"content") {
            publisher.secure(name.as_ref()).expect("no more trouble");
            let after = disk.restarted(Some(Left::Nothing));
            assert!(is_whole(&after.all(), name, b"content"), "operation {operation}");
            secured += 1;
        }
    }
    assert!(secured > 0, "the test has lost its sense");
}

/// What was taken out of its place goes only when that is on disk.
#[test]
fn nothing_is_lost_where_a_failure_is_followed_by_a_loss_of_power() {
    let (stage, name) = (Stage::plain(Inputs::Keep), NAMES[0]);
    let mut tally = Tally::default();
    for operation in 0..300 {
        let (disk, expected) = build(&stage);
        let plan = Plan { kill: None, fail: Some((operation, Errno::IO)) };
        let first = disk.process(1, plan);
        let Ok(publisher) = Publisher::open_on(first.clone(), OUT.as_ref()) else { continue };
        let content = expected.inputs[name].clone().expect("it is there");
        let _ = publisher.publish(name.as_ref(), &result_of(name, &content), || true);
        if first.counts().0 <= operation {
            break;
        }
        // Before it is in place, there is not much to lose.
        let seeds = if is_whole(&disk.all(), name, &content) { 64 } else { 2 };
        for seed in 0..seeds {
            let after = disk.restarted(Some(Left::Some(seed)));
            drop(Publisher::open_on(after.process(2, Plan::default()), OUT.as_ref()));
            let what = || format!("operation {operation} fails, and what is left is by {seed}");
            tally.add(what, wrong_at_any_time(&after.all(), &stage, &expected));
        }
    }
    tally.assert_right("the power goes after a failure");
}

#[test]
fn others_may_do_anything_between_two_operations() {
    let mut tally = Tally::default();
    for stage in stages() {
        others_everywhere(&stage, Effort { step: 101, seeds: 0 }, &mut tally);
    }
    tally.assert_right("others write between two operations");
}

/// The test can fail: a disk that tells that it has written what it has not loses results.
#[test]
fn a_disk_that_lies_is_found_out() {
    for lies in [Lies::OfFiles, Lies::OfFolders] {
        let mut tally = Tally::default();
        kill_everywhere(&Stage::plain(Inputs::Delete), None, Effort { step: 3, seeds: 1 }, lies, &mut tally);
        println!("{lies:?}: {} scenes, {} wrong", tally.scenes, tally.wrong.len());
        assert!(!tally.wrong.is_empty(), "{lies:?}");
    }
}

/// Takes minutes: `cargo test --release -- --ignored full`.
#[test]
#[ignore = "takes minutes"]
fn full_kills_failures_and_others_at_every_operation() {
    let step: usize = std::env::var("PLANISH_SCENES_STEP").ok().and_then(|step| step.parse().ok()).unwrap_or(3);
    let mut tally = Tally::default();
    for stage in stages() {
        kill_everywhere(&stage, None, Effort { step: 1, seeds: 6 }, Lies::None, &mut tally);
        fail_everywhere(&stage, &TROUBLES, Effort { step, seeds: 1 }, &mut tally);
        others_everywhere(&stage, Effort { step, seeds: 1 }, &mut tally);
        kill_twice(&stage, Effort { step: 3 * step, seeds: 1 }, &mut tally);
        fail_and_kill(&stage, Effort { step: 2 * step, seeds: 0 }, &mut tally);
        for (i, other) in OTHERS.into_iter().enumerate() {
            for operation in (20 + i..200).step_by(10 * step) {
                let effort = Effort { step: 5, seeds: 1 };
                kill_everywhere(&stage, Some((other, operation)), effort, Lies::None, &mut tally);
            }
        }
    }
    tally.assert_right("full: kills, failures and others at every operation");
    assert!(tally.scenes >= 10_000);
}
