//! Taking inputs up: what is up to date is left, what is large goes to a process of its own, all else is decoded.

use super::apart::stage::Apart;
use super::completion::{Done, End};
use super::in_flight::InFlight;
use super::stage::Stage;
use super::{Chained, Finished, Soup, hand_on, published, unwritten};
use crate::formats::{Content, Notes};
use crate::input::job::Job;
use crate::input::{self, Folder};
use crate::outcome::{Abort, Code, Reason};
use crate::output::begun::MOST_DEATHS;
use crate::output::ledger;
use crate::report::{Facts, Input, Report};
use blake3::Hash;
use crossbeam_channel::Sender;
use std::sync::Arc;

/// Inputs of which more memory than this (bytes) is predicted get a process of their own. A process costs 8 to 14 ms of
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
pub(super) fn read(in_flight: Arc<InFlight>, next: &Next) {
    if !in_flight.job.is_wanted() {
        return in_flight.end(End::Unwanted);
    }
    if !in_flight.job.is_unchanged() {
        return in_flight.end(End::Changed);
    }
    if let Some(hash) = in_flight.job.doubted {
        return doubt(&in_flight, hash);
    }
    if let Some(publisher) = in_flight.shared.sink.publisher()
        && let Err(error) = publisher.admits(&in_flight.job.name)
    {
        let _in_stage = in_flight.in_stage(Stage::Read);
        return unwritten(&in_flight, error);
    }
    if is_apart(&in_flight) { read_apart(in_flight, next) } else { read_here(in_flight, next) }
}

/// Sees whether an input still has the content that was processed.
fn doubt(in_flight: &InFlight, hash: Hash) {
    let _in_stage = in_flight.in_stage(Stage::Read);
    in_flight.end(match input::hash_input(&in_flight.job, &in_flight.settings) {
        Ok((now, _)) if now == hash => End::Same,
        Err(refusal) if refusal.passes => End::Again(refusal.reason),
        _ => {
            tracing::info!("has changed since it was processed, although neither size nor times show it");
            End::Changed
        }
    });
}

/// Whether an input gets a process of its own.
fn is_apart(in_flight: &InFlight) -> bool {
    let is_limited = in_flight.settings.job_memory.is_some() || in_flight.settings.job_time.is_some();
    // The process of a single job does it itself.
    in_flight.shared.sink.publisher().is_some()
        && (is_limited || in_flight.deaths() > 0 || in_flight.predicted() >= APART)
}

fn read_here(in_flight: Arc<InFlight>, next: &Next) {
    in_flight.mark();
    let content = input::read_input(&in_flight.job, &in_flight.settings);
    if !in_flight.job.is_unchanged() {
        return in_flight.end(End::Changed);
    }
    let content = match content {
        Err(reason) if reason.passes => return again(&in_flight, reason.reason),
        content => content.map_err(|refusal| refusal.reason),
    };
    let mut facts = Facts::new(input(&in_flight.job, content.as_deref().ok()));
    let folder = Folder::of_job(&in_flight.job);
    let decoded = in_flight.compute(Stage::Read, |_| decode(&in_flight, &content?, &mut facts, &folder));
    in_flight.job.set_beside(folder.asked());
    facts.input.beside = folder.read();
    match decoded {
        Ok(Decoded::Fresh(content)) => {
            let Content { soup, fields, notes } = *content;
            warn_of_doubts(&in_flight, &notes);
            facts.content = Some(notes);
            facts.fields = Arc::new(fields);
            hand_on(&next.soups, Soup { in_flight, facts, soup });
        }
        Ok(Decoded::UpToDate(older)) => leave(in_flight.clone(), *older, next),
        Err(Abort::For(reason)) if reason.code == Code::MissingFile && in_flight.job.since.is_some() => {
            in_flight.end(End::Waiting(reason));
        }
        Err(why) => hand_on(&next.finished, Finished::Abort(in_flight, Box::new(facts), why)),
    }
}

/// What came of the bytes of an input.
enum Decoded {
    /// A soup, with what else the file holds.
    Fresh(Box<Content>),
    /// The report of an older result: nothing is to be done.
    UpToDate(Box<Report>),
}

/// Decodes the bytes of an input, unless an older result is up to date. What becomes known on the way is a fact even where
/// the input is refused.
fn decode(in_flight: &InFlight, bytes: &[u8], facts: &mut Facts, folder: &Folder) -> Result<Decoded, Abort> {
    facts.input.blake3 = Some(blake3::hash(bytes).to_hex().to_string());
    if let Some(older) = up_to_date(in_flight, &facts.input, folder) {
        return Ok(Decoded::UpToDate(Box::new(older)));
    }
    let mut content = input::decode(&in_flight.job.path, bytes, &in_flight.settings, folder).map_err(|refusal| {
        facts.content = refusal.notes.map(|notes| *notes);
        refusal.reason
    })?;
    input::check_memory(&content.soup, &content.fields, &in_flight.settings)?;
    content.fields = content.fields.by_vertex(&content.soup);
    Ok(Decoded::Fresh(Box::new(content)))
}

/// The older result, where nothing is to be done.
fn up_to_date(in_flight: &InFlight, input: &Input, folder: &Folder) -> Option<Report> {
    let publisher = in_flight.shared.sink.publisher().filter(|_| !in_flight.settings.force)?;
    ledger::up_to_date(&publisher.target(&in_flight.job.name), input, &in_flight.settings, folder)
}

/// An older result is up to date.
fn leave(in_flight: Arc<InFlight>, older: Report, next: &Next) {
    in_flight.job.set_beside(older.input.beside.iter().map(|o| o.file.clone()).collect());
    if older.reason.as_ref().is_none_or(|reason| reason.code != Code::Crashed) {
        // A process that died had done it.
        in_flight.acquit();
    }
    let _in_stage = in_flight.in_stage(Stage::Read);
    tracing::info!(status = %older.status, "is up to date");
    published(in_flight.clone(), Done { report: older, up_to_date: true }, &next.chain);
}

/// An input of which nothing is kept here: neither its bytes nor what becomes of them.
fn read_apart(in_flight: Arc<InFlight>, next: &Next) {
    // Who waits for a disk holds no place to compute.
    let hashed = input::hash_input(&in_flight.job, &in_flight.settings);
    if !in_flight.job.is_unchanged() {
        return in_flight.end(End::Changed);
    }
    let mut facts = Facts::new(input(&in_flight.job, None));
    let hash = match hashed {
        Ok((hash, bytes)) => {
            facts.input.bytes = Some(bytes);
            facts.input.blake3 = Some(hash.to_hex().to_string());
            hash
        }
        Err(refusal) if refusal.passes => return again(&in_flight, refusal.reason),
        Err(refusal) => return stop(in_flight, facts, refusal.reason.into(), next),
    };
    if let Some(older) = up_to_date(&in_flight, &facts.input, &Folder::of_job(&in_flight.job)) {
        return leave(in_flight, older, next);
    }
    if in_flight.deaths() >= MOST_DEATHS && !in_flight.settings.force {
        let reason = crashed(&format!("it was on its way when {} processes ended", in_flight.deaths()));
        return stop(in_flight, facts, reason.into(), next);
    }
    hand_on(&next.apart, Apart { in_flight, facts, hash });
}

fn stop(in_flight: Arc<InFlight>, facts: Facts, why: Abort, next: &Next) {
    hand_on(&next.finished, Finished::Abort(in_flight, Box::new(facts), why));
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
pub(super) fn again(in_flight: &InFlight, reason: Reason) {
    let _in_stage = in_flight.in_stage(Stage::Read);
    tracing::warn!("{}; it is tried again", reason.message);
    in_flight.end(End::Again(reason));
}

/// Tells where a file leaves open what its surface is.
fn warn_of_doubts(in_flight: &InFlight, notes: &Notes) {
    if notes.polygons_doubtful > 0 {
        let _in_stage = in_flight.in_stage(Stage::Read);
        tracing::warn!(
            polygons = notes.polygons_doubtful,
            "polygons cross themselves, or are too intricate: the triangles they were cut into may fold; export the \
             surface as triangles"
        );
    }
    for remark in &notes.remarks {
        let _in_stage = in_flight.in_stage(Stage::Read);
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
