//! What follows when a result stands: the commands run on it, and its input is put away.

use crate::after::archive::{ArchiveError, Fate, Processed, Way, archive};
use crate::after::hooks::{self, Chain, HookError, Target};
use crate::input::job::Job;
use crate::outcome::{Code, Status};
use crate::output::ledger;
use crate::output::publish::{PublishError, Publisher};
use crate::report::Report;
use crate::settings::{Hook, Inputs, Settings};
use crate::system::disk::System;
use blake3::Hash;
use std::time::{Duration, Instant};

/// Why what should follow did not.
#[derive(Debug, thiserror::Error)]
pub enum PostProcessError {
    /// The commands could not be run.
    #[error(transparent)]
    Hook(#[from] HookError),
    /// The result could not be brought to disk, or there is no place for what commands print.
    #[error(transparent)]
    Publish(#[from] PublishError),
    /// The input could not be put away.
    #[error(transparent)]
    Archive(#[from] ArchiveError),
}

/// How long a file must have been as it is before it is put away. A writer that pauses for longer loses what it writes
/// later; one that pauses for less is waited for.
const QUIET: Duration = Duration::from_secs(10);

/// How often it is asked whether a job is still wanted, while it waits for its input to be quiet.
const POLL: Duration = Duration::from_millis(50);

/// What became of what follows.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum PostStatus {
    /// All is done.
    Whole,
    /// The job was no longer wanted.
    BrokenOff,
    /// All is done but that the input is put away: it is too early for that.
    Until(Instant),
    /// All is done but that the input is put away: somebody has it open for writing.
    Busy,
    /// All is done but that the input is put away: its content is no longer what was processed, whether that shows or
    /// not. It is to be processed again.
    Changed,
    /// The result was moved or removed while this command ran (1 is the first). To process the input again would only
    /// have it taken again.
    Taken(usize),
}

/// What the settings say of a result with this status: the commands, and what becomes of the input.
fn follows(settings: &Settings, status: Status) -> (&[Hook], &Inputs) {
    match status {
        Status::Certified => (&settings.on_certified, &settings.inputs),
        Status::Refused | Status::Failed => (&settings.on_refused, &settings.refused),
    }
}

/// Whether anything follows a result with this status.
pub fn is_asked_for(settings: &Settings, status: Status) -> bool {
    let (hooks, inputs) = follows(settings, status);
    !hooks.is_empty() || *inputs != Inputs::Keep
}

/// Runs the commands that are due on the result of `job`. Where all of them have succeeded, puts the input away.
///
/// # Errors
/// [`PostProcessError`] where the system fails; a command that fails is told in hooks.json.
pub fn run(
    job: &Job,
    report: &Report,
    settings: &Settings,
    publisher: &Publisher,
) -> Result<PostStatus, PostProcessError> {
    let (hooks, inputs) = follows(settings, report.status);
    let target = target(job, report, publisher)?;
    if hooks::are_due(hooks, &target) {
        tracing::info!(commands = hooks.len(), "runs commands");
        match hooks::run(hooks, &target, &publisher.staging()?, &|| job.is_wanted())? {
            Chain::BrokenOff => return Ok(PostStatus::BrokenOff),
            Chain::Taken(command) => return Ok(PostStatus::Taken(command)),
            Chain::Over(account) if account.failure().is_none() => tracing::info!("commands have succeeded"),
            Chain::Over(_) => {}
        }
    }
    let all_succeeded = hooks.is_empty() || hooks::account(&target).is_some_and(|a| a.failure().is_none());
    if !all_succeeded || !may_go(job, report) {
        return Ok(PostStatus::Whole);
    }
    done_with(job, report, (inputs, &target), publisher)
}

fn target(job: &Job, report: &Report, publisher: &Publisher) -> Result<Target, HookError> {
    let target = Target::new(&job.path, &publisher.target(&job.name))?;
    Ok(match &report.reason {
        Some(reason) => target.with_code(reason.code.name()),
        None => target,
    })
}

/// Whether an input may be put away at all. With files beside it, it would lose its sense elsewhere, and they may
/// belong to others, too; so it stays, and so does one that asks for files that are not to be had. Where components
/// were refused, the result is not all of it.
fn may_go(job: &Job, report: &Report) -> bool {
    let asks_in_vain = report.reason.as_ref().is_some_and(|r| matches!(r.code, Code::MissingFile | Code::ForeignFile));
    let is_alone = report.input.beside.is_empty() && job.beside().is_empty() && !asks_in_vain;
    is_alone && report.refused_components.is_empty()
}

/// Puts the input away, as the settings say; inputs of an inbox only.
fn done_with(
    job: &Job,
    report: &Report,
    (inputs, result): (&Inputs, &Target),
    publisher: &Publisher,
) -> Result<PostStatus, PostProcessError> {
    let (Some(look), Some(since), Some(inbox)) = (&job.look, job.since, &job.within) else {
        return Ok(PostStatus::Whole);
    };
    let target;
    let way = match inputs {
        Inputs::Keep => return Ok(PostStatus::Whole),
        Inputs::Delete => Way::Nowhere,
        Inputs::Move(folder) => {
            target = folder.join(&job.name);
            Way::To(&target)
        }
    };
    // What was not read, as it is too large or not for this user, cannot be told from what is there now: it stays.
    let hash = report.input.blake3.as_ref().and_then(|hash| Hash::from_hex(hash).ok());
    let Some(hash) = hash else { return Ok(PostStatus::Whole) };
    let quiet = since + QUIET;
    if !ledger::is_final(report) {
        // Taken up later, it would not be up to date, but computed again, and its commands would run again.
        if !wait_until(quiet, job) {
            return Ok(PostStatus::BrokenOff);
        }
    } else if Instant::now() < quiet {
        return Ok(PostStatus::Until(quiet));
    }
    // Where somebody has taken the result meanwhile, the input is all that is left.
    if !result.is_there() {
        return Err(HookError::NoReport(result.folder().to_owned()).into());
    }
    // The input is all that the result could be made from again.
    publisher.secure(&job.name)?;
    Ok(match archive(&System, &Processed { inbox, name: &job.name, look, hash }, way)? {
        Fate::Busy => PostStatus::Busy,
        Fate::Changed => PostStatus::Changed,
        Fate::Away | Fate::Nothing => PostStatus::Whole,
    })
}

/// Waits until `then`, as long as the job is wanted; whether it is.
fn wait_until(then: Instant, job: &Job) -> bool {
    while job.is_wanted() && Instant::now() < then {
        std::thread::sleep(POLL);
    }
    job.is_wanted()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::outcome::Reason;
    use crate::report::Input;
    use crate::result_files;
    use crate::settings::RawSettings;
    use std::fs;
    use std::path::Path;

    /// An inbox with a file, its published result with this reason, and what the settings say.
    struct World {
        folder: tempfile::TempDir,
        publisher: Publisher,
        settings: Settings,
        report: Report,
    }

    impl World {
        fn new(code: Code) -> Self {
            let folder = tempfile::tempdir().expect("a folder");
            fs::create_dir(folder.path().join("in")).expect("made");
            fs::write(folder.path().join("in/a.stl"), "content").expect("written");
            let command = "[[on_refused]]\ncommand = [\"sh\", \"-c\", \"echo $1 >> ../../runs\", \"sh\", \"{code}\"]\n";
            let said = format!("refused = \"move:{}\"\n{command}", folder.path().join("bad").display());
            let settings = toml::from_str::<RawSettings>(&said).expect("valid").check().expect("in range");
            let blake3 = Some(blake3::hash(b"content").to_hex().to_string());
            let input = Input { name: "a.stl".to_owned(), bytes: Some(7), blake3, beside: vec![] };
            let mut report = Report::new(input, &settings);
            let reason = Reason::new(code, "for the test");
            (report.status, report.reason) = (reason.status(), Some(reason));
            let publisher = Publisher::open(&folder.path().join("out")).expect("opens");
            let files = [(result_files::REPORT.to_owned(), report.to_json().expect("JSON"))];
            assert!(publisher.publish(Path::new("a.stl"), &files, || true).expect("published"));
            Self { folder, publisher, settings, report }
        }

        /// The job of the file, which is as it is for so long.
        fn job(&self, since: Duration) -> Job {
            let inbox = self.folder.path().join("in");
            let look =
                crate::system::fingerprint::Fingerprint::at(&inbox.join("a.stl")).expect("there").expect("a file");
            let since = Instant::now().checked_sub(since).expect("the machine runs for longer");
            Job::of_inbox(&inbox, Path::new("a.stl"), look, since)
        }

        fn run(&self, job: &Job) -> Result<PostStatus, PostProcessError> {
            run(job, &self.report, &self.settings, &self.publisher)
        }

        fn has(&self, name: &str) -> bool {
            self.folder.path().join(name).exists()
        }

        fn runs(&self) -> String {
            fs::read_to_string(self.folder.path().join("runs")).unwrap_or_default()
        }
    }

    #[test]
    fn a_refused_input_is_moved_later_and_its_commands_run_once() {
        let world = World::new(Code::Malformed);
        assert!(matches!(world.run(&world.job(Duration::ZERO)), Ok(PostStatus::Until(_))));
        assert!(world.has("in/a.stl") && world.runs() == "malformed\n");
        assert!(matches!(world.run(&world.job(QUIET)), Ok(PostStatus::Whole)));
        assert!(world.has("bad/a.stl") && !world.has("in/a.stl") && world.runs() == "malformed\n");
    }

    /// Taken up later, a failure is not up to date: its commands would run twice.
    #[test]
    fn a_failed_input_is_waited_for() {
        let world = World::new(Code::Internal);
        let job = world.job(QUIET - Duration::from_millis(500));
        assert!(matches!(world.run(&job), Ok(PostStatus::Whole)));
        assert!(world.has("bad/a.stl") && !world.has("in/a.stl") && world.runs() == "internal\n");
        let world = World::new(Code::Internal);
        let job = world.job(Duration::ZERO);
        std::thread::scope(|s| {
            let ran = s.spawn(|| world.run(&job));
            while world.runs().is_empty() {
                std::thread::sleep(POLL);
            }
            job.cancel();
            assert!(matches!(ran.join().expect("no panic"), Ok(PostStatus::BrokenOff)));
        });
        assert!(world.has("in/a.stl") && !world.has("bad"));
    }

    #[test]
    fn an_input_whose_result_is_gone_stays() {
        let world = World::new(Code::Malformed);
        assert!(matches!(world.run(&world.job(Duration::ZERO)), Ok(PostStatus::Until(_))));
        fs::rename(world.folder.path().join("out/a.stl"), world.folder.path().join("taken")).expect("moved");
        world.run(&world.job(QUIET)).expect("there is no account any more");
        assert!(world.has("in/a.stl") && !world.has("bad"));
        let without_commands = Settings { on_refused: vec![], ..world.settings.clone() };
        let gone = run(&world.job(QUIET), &world.report, &without_commands, &world.publisher);
        assert!(matches!(gone, Err(PostProcessError::Hook(HookError::NoReport(_)))), "{gone:?}");
        assert!(world.has("in/a.stl") && !world.has("bad"));
    }

    #[test]
    fn inputs_that_ask_for_others_or_were_not_read_stay() {
        for code in [Code::ForeignFile, Code::MissingFile] {
            let world = World::new(code);
            assert!(matches!(world.run(&world.job(QUIET)), Ok(PostStatus::Whole)));
            assert!(world.has("in/a.stl") && !world.runs().is_empty());
        }
        let mut world = World::new(Code::TooLarge);
        world.report.input.blake3 = None;
        assert!(matches!(world.run(&world.job(QUIET)), Ok(PostStatus::Whole)));
        assert!(world.has("in/a.stl") && !world.has("bad"));
        let world = World::new(Code::Malformed);
        let job = world.job(QUIET);
        job.set_beside(vec!["a.bin".to_owned()]);
        assert!(matches!(world.run(&job), Ok(PostStatus::Whole)));
        assert!(world.has("in/a.stl") && !world.has("bad"));
    }
}
