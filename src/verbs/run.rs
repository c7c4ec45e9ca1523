//! `planish run`: process files, once.

use super::{Exit, eprint_line, escape};
use crate::conveyor::Conveyor;
use crate::conveyor::completion::{Done, End};
use crate::input;
use crate::input::job::Job;
use crate::output::publish::Publisher;
use crate::report::{RefusedComponent, Report};
use crate::settings::Settings;
use crate::system::orphans;
use crate::watch::signals::{self, Hangup};
use crate::watch::stop::Stop;
use comfy_table::{CellAlignment, Table, presets};
use indicatif::{ProgressBar, ProgressStyle};
use std::io::IsTerminal;
use std::path::PathBuf;
use std::sync::Arc;
use std::time::{Duration, Instant};

/// How long the jobs have to reach a safe point when the program is interrupted.
const PATIENCE: Duration = Duration::from_secs(3);

/// Processes all inputs; prints a table of what became of them.
///
/// # Errors
/// What makes the call as a whole impossible: wrong usage.
pub fn run(paths: &[PathBuf], settings: &Settings) -> Result<Exit, Box<dyn std::error::Error>> {
    let out = settings.out.as_deref().ok_or(super::NO_OUT)?;
    let jobs = input::collect(paths)?;
    input::refuse_same_names(&jobs)?;
    input::refuse_inside(&jobs, out)?;
    let stop = signals::listen(Hangup::Stop, false)?;
    let publisher = Arc::new(Publisher::open(out)?);
    let conveyor = Conveyor::start(settings, publisher.clone(), false).map_err(|e| super::no_threads(&e))?;
    let jobs: Vec<Arc<Job>> = jobs.into_iter().map(Arc::new).collect();
    jobs.iter().for_each(|job| conveyor.submit(job.clone()));
    conveyor.close();
    let ends = follow(&jobs, &conveyor, &stop, settings.quiet);
    // Where it was told twice to stop.
    let has_commands = !settings.on_certified.is_empty() || !settings.on_refused.is_empty();
    if has_commands && let Ok(staging) = publisher.staging() {
        orphans::end_those_of(&staging);
    }
    publisher.close();
    let rows: Vec<Row> = jobs.iter().map(AsRef::as_ref).zip(&ends).collect();
    if !settings.quiet {
        super::say(&table(&rows).to_string());
        rows.iter().for_each(|(job, end)| tell_doubts(job, end));
        rows.iter().for_each(|(job, end)| tell_remarks(job, end));
    }
    rows.iter().for_each(|(job, end)| tell_refused(job, end));
    rows.iter().for_each(|(job, end)| tell_trouble(job, end));
    let is_good = |end: &End| matches!(end, End::Done(done) if done.report.is_whole());
    Ok(if ends.iter().all(is_good) { Exit::Success } else { Exit::Refused })
}

/// Waits until all jobs have ended, and shows how far they are. When it is asked to stop, it cancels the others and
/// waits for them a little.
fn follow(jobs: &[Arc<Job>], conveyor: &Conveyor, stop: &Stop, quiet: bool) -> Vec<End> {
    let bar = progress(jobs.len(), quiet);
    let mut ends: Vec<Option<End>> = jobs.iter().map(|_| None).collect();
    let (mut missing, mut latest) = (jobs.len(), None);
    while missing > 0 && latest.is_none_or(|latest| Instant::now() < latest) {
        if let Some(ended) = conveyor.next(Duration::from_millis(50)) {
            if let Some(i) = jobs.iter().position(|job| Arc::ptr_eq(job, &ended.job)) {
                ends[i] = Some(ended.end);
            }
            missing -= 1;
            bar.inc(1);
        } else if !bar.is_hidden() {
            bar.set_message(message(conveyor));
        }
        if stop.is_asked() {
            jobs.iter().for_each(|job| job.cancel());
            latest = Some(Instant::now() + if latest.is_none() { PATIENCE } else { Duration::ZERO });
        }
    }
    bar.finish_and_clear();
    ends.into_iter().map(|end| end.unwrap_or(End::Unwanted)).collect()
}

/// What is on its way.
fn message(conveyor: &Conveyor) -> String {
    let one = |job: crate::conveyor::progress::Running| {
        let charts = if job.charts > 1 { format!(" {}/{}", job.charts_done, job.charts) } else { String::new() };
        format!("{}: {}{charts}", escape(&job.name), job.stage.name())
    };
    conveyor.running().into_iter().take(4).map(one).collect::<Vec<_>>().join(", ")
}

/// A bar on the terminal; invisible where standard error is none.
fn progress(jobs: usize, quiet: bool) -> ProgressBar {
    if quiet || !std::io::stderr().is_terminal() {
        return ProgressBar::hidden();
    }
    let style = ProgressStyle::with_template("{spinner} [{pos}/{len}] {msg} {elapsed:.dim}");
    let bar = ProgressBar::new(jobs as u64).with_style(style.unwrap_or_else(|_| ProgressStyle::default_bar()));
    bar.enable_steady_tick(Duration::from_millis(120));
    bar
}

type Row<'a> = (&'a Job, &'a End);

/// One line per input.
fn table(rows: &[Row]) -> Table {
    let mut table = Table::new();
    table.load_style(presets::NOTHING);
    table.set_header(["input", "status", "triangles", "charts", "invalid", "untangled by", "area ratio", "cpu s"]);
    for column in [2, 3, 4, 6, 7] {
        if let Some(column) = table.column_mut(column) {
            column.set_cell_alignment(CellAlignment::Right);
        }
    }
    for (job, end) in rows {
        let name = escape(&job.name);
        table.add_row(match (end.standing(), end) {
            (Some(done), _) => cells(name, done),
            (None, End::Unwanted) => vec![name, "interrupted".to_owned()],
            (None, _) => vec![name, "not written".to_owned()],
        });
    }
    table
}

fn cells(name: String, done: &Done) -> Vec<String> {
    let report = &done.report;
    let mut status = report.status.to_string();
    match report.refused_components.len() {
        0 => {}
        1 => status += ", 1 component refused",
        several => status += &format!(", {several} components refused"),
    }
    if done.up_to_date {
        status += " (up to date)";
    }
    let some = |count: usize| if report.charts.is_empty() { String::new() } else { count.to_string() };
    let invalid = report.charts.iter().filter_map(|c| c.quadratic.as_ref()).map(|q| q.invalid).sum();
    let mut methods: Vec<&str> =
        report.charts.iter().filter_map(|c| c.untangle.as_ref()).map(|u| &u.method[..]).collect();
    methods.sort_unstable();
    methods.dedup();
    let ratio = report.charts.iter().map(|c| c.distortion.area_ratio).reduce(f64::max);
    vec![
        name,
        status,
        report.surface.as_ref().map_or(String::new(), |s| s.repaired.counts.triangles.to_string()),
        some(report.charts.len()),
        some(invalid),
        methods.join(", "),
        ratio.map_or(String::new(), |r| if r < 1e4 { format!("{r:.1}") } else { format!("{r:.1e}") }),
        format!("{:.2}", report.timing.values().sum::<f64>()),
    ]
}

/// Says on standard error what of an input was not as it should be, but was read all the same.
fn tell_remarks(job: &Job, end: &End) {
    let End::Done(Done { report: Report { content: Some(content), .. }, .. }) = end else { return };
    content.remarks.iter().for_each(|remark| eprint_line(&format!("{}: {remark}", escape(&job.path))));
}

/// Says on standard error what was wrong with an input.
fn tell_trouble(job: &Job, end: &End) {
    let input = escape(&job.path);
    match end {
        End::Unwritten(error) => eprint_line(&format!("{input}: {error}")),
        End::Taken(done, error) | End::Unchained(done, error) => {
            eprint_line(&format!("{input}: {}, but {error}", done.report.status));
        }
        End::Changed => eprint_line(&format!("{input}: it changed while it was read; try again")),
        End::Waiting(reason) | End::Again(reason) => eprint_line(&format!("{input}: {}", reason.message)),
        End::Lost => eprint_line(&format!("{input}: planish broke down; that is a fault of planish: please report it")),
        End::Done(Done { report: Report { reason: Some(reason), status, .. }, .. }) => {
            let untold = reason.location.as_ref().filter(|location| !reason.message.contains(location.as_str()));
            let location = untold.map_or(String::new(), |location| format!(" ({location})"));
            eprint_line(&format!("{input}: {status}: {}{location} [{}]", reason.message, reason.code.name()));
        }
        End::Done(_) | End::Later(..) | End::Held(..) | End::Outdated(_) | End::Unwanted | End::Same => {}
    }
}

/// Says on standard error which components of an input are not in its result.
fn tell_refused(job: &Job, end: &End) {
    let refused = end.standing().map_or(&[][..], |done| &done.report.refused_components);
    for refused in refused {
        let RefusedComponent { component, reason, .. } = refused;
        eprint_line(&format!(
            "{}: component {component} is refused, of {}: {} [{}]",
            escape(&job.path),
            refused.extent(),
            reason.message,
            reason.code.name()
        ));
    }
}

/// Says on standard error what is doubtful about the surface of an input.
fn tell_doubts(job: &Job, end: &End) {
    if let Some(done) = end.standing() {
        let warnings = done.report.warnings.iter();
        warnings.for_each(|w| eprint_line(&format!("{}: warning: {}", escape(&job.path), w.message)));
    }
}
