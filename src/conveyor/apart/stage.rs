//! The stage that has inputs done by processes of their own.

use super::protocol::Ending;
use super::{Death, Outcome, run};
use crate::conveyor::completion::End;
use crate::conveyor::in_flight::InFlight;
use crate::conveyor::stage::Stage;
use crate::conveyor::writing::{self, After, Made, Ready};
use crate::conveyor::{Finished, hand_on, reading, unwritten};
use crate::input;
use crate::outcome::{Code, Reason};
use crate::output::begun::MOST_DEATHS;
use crate::output::publish::{PublishError, Staged};
use crate::report::{Facts, Report};
use crate::result_files;
use crate::system::passing;
use blake3::Hash;
use bytesize::ByteSize;
use crossbeam_channel::Sender;
use std::sync::Arc;

/// What gets a process of its own.
pub(in crate::conveyor) struct Apart {
    pub in_flight: Arc<InFlight>,
    pub facts: Facts,
    /// The hash of its content.
    pub hash: Hash,
}

/// How an attempt ended that brought no result.
enum Tried {
    Died(Death),
    Refused(Reason),
}

/// Has an input done by a process of its own: once more, where that dies.
pub(in crate::conveyor) fn do_apart(
    Apart { in_flight, facts, hash }: Apart,
    finished: &Sender<Finished>,
    after: &After,
) {
    let ended = loop {
        match try_apart(&in_flight, hash, after) {
            // Ends: deaths are counted.
            Some(Tried::Died(death)) if in_flight.count_death() < MOST_DEATHS && in_flight.job.is_wanted() => {
                let _in_stage = in_flight.in_stage(Stage::Read);
                tracing::warn!("its process died ({death}): it is tried once more");
                // Where the machine was short of something, it may have it then.
                std::thread::sleep(passing::pause(1));
            }
            tried => break tried,
        }
    };
    let why = match ended {
        None => return,
        Some(Tried::Died(death)) => reading::crashed(&death.to_string()),
        Some(Tried::Refused(reason)) => reason,
    };
    hand_on(finished, Finished::Abort(in_flight, Box::new(facts), why.into()));
}

/// Has an input done by a process of its own; none: its end is told, or its result on its way.
fn try_apart(in_flight: &Arc<InFlight>, hash: Hash, after: &After) -> Option<Tried> {
    let publisher = in_flight.shared.sink.publisher()?;
    let staged = match publisher.room() {
        Ok(staged) => staged,
        Err(error) => {
            unwritten(in_flight, error);
            return None;
        }
    };
    match run(in_flight, &staged.folder()) {
        Ok(Outcome::Ended(ending)) => end(in_flight, ending, staged, hash, after),
        Ok(Outcome::Died(death)) => return Some(of_death(in_flight, death)),
        Ok(Outcome::OutOfTime) => return Some(Tried::Refused(out_of_time(in_flight))),
        Ok(Outcome::Unwanted) => in_flight.end(End::Unwanted),
        Err(error) => {
            let message = format!("no process can be started for it: {error}");
            reading::again(in_flight, Reason::new(Code::Unreadable, message));
        }
    }
    None
}

fn end(in_flight: &Arc<InFlight>, ending: Ending, staged: Staged, hash: Hash, after: &After) {
    in_flight.acquit();
    match ending {
        Ending::Made => put(in_flight, staged, hash, after),
        Ending::Changed => in_flight.end(End::Changed),
        Ending::Waiting(reason) => in_flight.end(End::Waiting(reason)),
        Ending::Again(reason) => reading::again(in_flight, reason),
        Ending::Unwritten { message, lasts } => unwritten(in_flight, PublishError::Told { message, lasts }),
        Ending::Lost => in_flight.end(End::Lost),
    }
}

/// Puts in place what the process of an input has made, if it is of the content that was hashed.
fn put(in_flight: &Arc<InFlight>, staged: Staged, hash: Hash, after: &After) {
    let text = input::read_file(&staged.folder().join(result_files::REPORT)).ok();
    let report: Option<Report> = text.and_then(|text| serde_json::from_slice(&text).ok());
    match report {
        Some(report) if report.input.blake3.as_deref() == Some(hash.to_hex().as_str()) => {
            writing::put(Ready { in_flight: in_flight.clone(), report, content: Made::Staged(staged) }, after);
        }
        Some(_) => in_flight.end(End::Changed),
        None => in_flight.end(End::Lost),
    }
}

fn out_of_time(in_flight: &InFlight) -> Reason {
    let limit = in_flight.settings.job_time.unwrap_or_default();
    let message = format!("it takes longer than {limit} s: split or decimate it, or raise job-time");
    Reason::new(Code::JobTime, message)
}

/// What a death says: where memory was limited, and it died for that, it is no accident.
fn of_death(in_flight: &InFlight, death: Death) -> Tried {
    match in_flight.settings.job_memory.map(ByteSize::b) {
        Some(limit) if death.is_for_memory() => {
            let message = format!("it takes more memory than {limit}: split or decimate it, or raise job-memory");
            Tried::Refused(Reason::new(Code::JobMemory, message))
        }
        _ => Tried::Died(death),
    }
}
