//! `planish job`: one input, for another planish that started this process, and puts the result in place.

use super::Exit;
use crate::cli::Apart;
use crate::conveyor::Conveyor;
use crate::conveyor::apart::parent::Parent;
use crate::conveyor::apart::protocol::{Ending, Order, Said, say};
use crate::conveyor::completion::{Completion, End};
use crate::input::job::Job;
use crate::outcome::{Code, Reason};
use crate::output::begun;
use crate::settings::Settings;
use rustix::process::{Resource, Rlimit, getrlimit, setrlimit};
use std::fs::File;
use std::io::{self, BufRead};
use std::sync::Arc;
use std::time::{Duration, Instant};

/// How often it is told how far the input is.
const TELL: Duration = Duration::from_millis(200);

/// Of all processes, this is to be ended first where memory is short; a higher number than that of its parent.
const EXPENDABLE: &str = "500";

/// Does one input, as the parent of this process asks for it.
///
/// # Errors
/// This process was not started by planish.
pub fn job(asked: &Apart, settings: &Settings) -> Result<Exit, Box<dyn std::error::Error>> {
    let mut line = String::new();
    io::stdin().lock().read_line(&mut line)?;
    let order: Order = serde_json::from_str(&line)
        .map_err(|e| format!("{e}: `planish job` is started by planish itself; use `planish run`"))?;
    // Before it is known whether the parent lives: else its death could be overlooked.
    let _until_the_end = begin(asked, &order);
    be_expendable(order.memory);
    let done = start(asked, order.applied_to(settings.clone()));
    asked.mark.iter().for_each(|mark| begun::end_apart(mark));
    if let Err(error) = done {
        // That says nothing about the input.
        let reason = Reason::new(Code::Internal, super::no_threads(&error));
        say(&mut io::stdout(), &Said::Ended(Ending::Again(reason)))?;
    }
    Ok(Exit::Success)
}

/// Starts the stages, and sees the job through.
fn start(asked: &Apart, settings: Settings) -> io::Result<()> {
    let mark = asked.mark.clone();
    let parent = Parent::listen(move || mark.iter().for_each(|mark| begun::end_apart(mark)))?;
    let job = Arc::new(job_of(asked));
    let conveyor = Conveyor::start_apart(&settings, &asked.into, job.bytes, parent.clone())?;
    conveyor.submit(job.clone());
    conveyor.close();
    let ended = follow(&conveyor, &parent);
    parent.say(&Said::Beside { names: job.beside() });
    parent.say(&Said::Ended(ending(ended)));
    Ok(())
}

/// Marks the input as on its way.
fn begin(asked: &Apart, order: &Order) -> Option<File> {
    let marked = begun::begin_apart(asked.mark.as_deref()?, order.mark.as_ref()?);
    marked.inspect_err(|error| tracing::debug!("that it is on its way cannot be noted down: {error}")).ok()
}

/// Where memory is short, nobody else is to suffer: not the parent, and no other process.
fn be_expendable(memory: Option<u64>) {
    // Where the system has no such thing, or forbids it, it chooses by itself.
    let _ = std::fs::write("/proc/self/oom_score_adj", EXPENDABLE);
    if let Some(memory) = memory {
        let limit = Rlimit { current: Some(memory), ..getrlimit(Resource::Data) };
        if let Err(error) = setrlimit(Resource::Data, limit) {
            tracing::warn!("the memory of an input cannot be limited: {error}");
        }
    }
}

fn job_of(asked: &Apart) -> Job {
    let mut job = Job::of_file(asked.input.clone());
    job.name.clone_from(&asked.name);
    job.within.clone_from(&asked.within);
    job.since = asked.waits.then(Instant::now);
    job
}

/// Waits for the end of the job, and tells how far it is.
fn follow(conveyor: &Conveyor, parent: &Parent) -> End {
    let mut told = None;
    loop {
        if let Some(Completion { end, .. }) = conveyor.next(TELL) {
            return end;
        }
        let now = conveyor.running().pop().map(|job| (job.stage, job.charts_done, job.charts, job.trouble));
        if let Some((stage, charts_done, charts, trouble)) = now.clone().filter(|_| now != told) {
            parent.say(&Said::Progress { stage, charts_done, charts, trouble });
            told = now;
        }
    }
}

fn ending(end: End) -> Ending {
    match end {
        End::Done(_) | End::Later(..) | End::Held(..) | End::Outdated(_) | End::Taken(..) | End::Unchained(..) => {
            Ending::Made
        }
        End::Changed | End::Unwanted | End::Same => Ending::Changed,
        End::Waiting(reason) => Ending::Waiting(reason),
        End::Again(reason) => Ending::Again(reason),
        End::Unwritten(error) => Ending::Unwritten { message: error.to_string(), lasts: error.is_lasting() },
        End::Lost => Ending::Lost,
    }
}
