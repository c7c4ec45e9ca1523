//! Taking inputs up: what is up to date is left, what is large goes to a process of its own, all else is decoded.

use super::apart::stage::Apart;
use super::completion::{Done, End};
use super::in_flight::Travel;
use super::stage::Stage;
use super::{Chained, Finished, Soup, hand_on, published, unwritten};
use crate::formats::{Content, Notes};
use crate::input::job::Job;
use crate::input::{self, Folder};
use crate::outcome::{Code, Reason, Stopped};
use crate::output::begun::MOST_DEATHS;
use crate::output::ledger;
use crate::report::{Facts, Input, Report};
use blake3::Hash;
use crossbeam_channel::Sender;
use std::sync::Arc;

/// Inputs of which more memory than this (bytes) is foretold get a process of their own. A process costs 8 to 14 ms of
/// processor time (measured as the difference that `--job-time` makes, on 100 patches of 32 triangles and on 30 of 3,200).
/// Of 22,000 triangles of binary STL, from which on one is used, that is 2 % of the work; of 3,200 it would be a third.
const APART: u64 = 32 << 20;

/// Where what is read goes next.
pub(super) struct Next {
    pub soups: Sender<Soup>,
    pub apart: Sender<Apart>,
    pub finished: Sender<Finished>,
    pub chain: Sender<Chained>,
}

/// Takes an input up.
pub(super) fn read(travel: Arc<Travel>, next: &Next) {
    if !travel.job.is_wanted() {
        return travel.end(End::Unwanted);
    }
    if !travel.job.is_unchanged() {
        return travel.end(End::Changed);
    }
    if let Some(hash) = travel.job.doubted {
        return doubt(&travel, hash);
    }
    if let Some(publisher) = travel.shared.sink.publisher()
        && let Err(error) = publisher.admits(&travel.job.name)
    {
        let _in_stage = travel.in_stage(Stage::Read);
        return unwritten(&travel, error);
    }
    if is_apart(&travel) { read_apart(travel, next) } else { read_here(travel, next) }
}

/// Sees whether an input still has the content that was processed.
fn doubt(travel: &Travel, hash: Hash) {
    let _in_stage = travel.in_stage(Stage::Read);
    travel.end(match input::hash_input(&travel.job, &travel.settings) {
        Ok((now, _)) if now == hash => End::Same,
        Err(refusal) if refusal.passes => End::Again(refusal.reason),
        _ => {
            tracing::info!("has changed since it was processed, although neither size nor times show it");
            End::Changed
        }
    });
}

/// Whether an input gets a process of its own.
fn is_apart(travel: &Travel) -> bool {
    let is_limited = travel.settings.job_memory.is_some() || travel.settings.job_time.is_some();
    // The process of a single job does it itself.
    travel.shared.sink.publisher().is_some() && (is_limited || travel.deaths() > 0 || travel.foretold() >= APART)
}

fn read_here(travel: Arc<Travel>, next: &Next) {
    travel.mark();
    let content = input::read_input(&travel.job, &travel.settings);
    if !travel.job.is_unchanged() {
        return travel.end(End::Changed);
    }
    let content = match content {
        Err(reason) if reason.passes => return again(&travel, reason.reason),
        content => content.map_err(|refusal| refusal.reason),
    };
    let mut facts = Facts::new(input(&travel.job, content.as_deref().ok()));
    let folder = Folder::of_job(&travel.job);
    let decoded = travel.compute(Stage::Read, |_| {
        let bytes = content?;
        facts.input.blake3 = Some(blake3::hash(&bytes).to_hex().to_string());
        match up_to_date(&travel, &facts.input, &folder) {
            Some(older) => Ok(Err(older)),
            None => {
                let content = input::decode(&travel.job.path, &bytes, &travel.settings, &folder);
                let content = content.map_err(|refusal| {
                    facts.content = refusal.notes.map(|notes| *notes);
                    refusal.reason
                })?;
                input::check_memory(&content.soup, &travel.settings)?;
                Ok(Ok(content))
            }
        }
    });
    travel.job.set_beside(folder.asked());
    facts.input.beside = folder.read();
    match decoded {
        Ok(Ok(Content { soup, notes })) => {
            warn_of_doubts(&travel, &notes);
            facts.content = Some(notes);
            hand_on(&next.soups, Soup { travel, facts, soup });
        }
        Ok(Err(older)) => leave(travel.clone(), older, next),
        Err(Stopped::For(reason)) if reason.code == Code::MissingFile && travel.job.since.is_some() => {
            travel.end(End::Waiting(reason));
        }
        Err(why) => hand_on(&next.finished, Finished::Stopped(travel, Box::new(facts), why)),
    }
}

/// The older result, where nothing is to be done.
fn up_to_date(travel: &Travel, input: &Input, folder: &Folder) -> Option<Report> {
    let publisher = travel.shared.sink.publisher().filter(|_| !travel.settings.force)?;
    ledger::up_to_date(&publisher.target(&travel.job.name), input, &travel.settings, folder)
}

/// An older result is up to date.
fn leave(travel: Arc<Travel>, older: Report, next: &Next) {
    travel.job.set_beside(older.input.beside.iter().map(|o| o.file.clone()).collect());
    if older.reason.as_ref().is_none_or(|reason| reason.code != Code::Crashed) {
        // A process that died had done it.
        travel.acquit();
    }
    let _in_stage = travel.in_stage(Stage::Read);
    tracing::info!(status = %older.status, "is up to date");
    published(travel.clone(), Done { report: older, up_to_date: true }, &next.chain);
}

/// An input of which nothing is kept here: neither its bytes nor what becomes of them.
fn read_apart(travel: Arc<Travel>, next: &Next) {
    // Who waits for a disk holds no place to compute.
    let hashed = input::hash_input(&travel.job, &travel.settings);
    if !travel.job.is_unchanged() {
        return travel.end(End::Changed);
    }
    let mut facts = Facts::new(input(&travel.job, None));
    let hash = match hashed {
        Ok((hash, bytes)) => {
            facts.input.bytes = Some(bytes);
            facts.input.blake3 = Some(hash.to_hex().to_string());
            hash
        }
        Err(refusal) if refusal.passes => return again(&travel, refusal.reason),
        Err(refusal) => return stop(travel, facts, refusal.reason.into(), next),
    };
    if let Some(older) = up_to_date(&travel, &facts.input, &Folder::of_job(&travel.job)) {
        return leave(travel, older, next);
    }
    if travel.deaths() >= MOST_DEATHS && !travel.settings.force {
        let reason = crashed(&format!("it was on its way when {} processes ended", travel.deaths()));
        return stop(travel, facts, reason.into(), next);
    }
    hand_on(&next.apart, Apart { travel, facts, hash });
}

fn stop(travel: Arc<Travel>, facts: Facts, why: Stopped, next: &Next) {
    hand_on(&next.finished, Finished::Stopped(travel, Box::new(facts), why));
}

/// Why an input of which planish has died is put aside.
pub(super) fn crashed(how: &str) -> Reason {
    Reason::new(
        Code::Crashed,
        format!(
            "planish died of it, and of nothing else ({how}), so it is put aside: that is a fault of planish, or the machine \
             has too little memory for it; please report it with the file, and see `planish retry`"
        ),
    )
}

/// The system got in the way: the input itself may be all right.
pub(super) fn again(travel: &Travel, reason: Reason) {
    let _in_stage = travel.in_stage(Stage::Read);
    tracing::warn!("{}; it is tried again", reason.message);
    travel.end(End::Again(reason));
}

/// Tells where a file leaves open what its surface is.
fn warn_of_doubts(travel: &Travel, notes: &Notes) {
    if notes.polygons_doubtful > 0 {
        let _in_stage = travel.in_stage(Stage::Read);
        tracing::warn!(
            polygons = notes.polygons_doubtful,
            "polygons cross themselves, or are too intricate: the triangles they were cut into may fold; export the \
             surface as triangles"
        );
    }
    for remark in &notes.remarks {
        let _in_stage = travel.in_stage(Stage::Read);
        tracing::warn!("{remark}");
    }
}

fn input(job: &Job, content: Option<&[u8]>) -> Input {
    Input {
        name: job.name.to_string_lossy().into_owned(),
        bytes: content.map(|c| c.len() as u64),
        blake3: None,
        beside: vec![],
    }
}
