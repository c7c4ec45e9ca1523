//! `planish run`: process files, once.

use super::{Exit, shown};
use crate::inputs;
use crate::job::{Done, Job, Stage};
use crate::outcome::Status;
use crate::publish::Publisher;
use crate::report::Report;
use crate::settings::Settings;
use comfy_table::{CellAlignment, Table, presets};
use indicatif::{ProgressBar, ProgressStyle};
use std::io::IsTerminal;
use std::path::PathBuf;
use std::time::Duration;

/// Processes all inputs; prints a table of what became of them.
///
/// # Errors
/// What makes the call as a whole impossible: wrong usage.
pub fn run(paths: &[PathBuf], settings: &Settings) -> Result<Exit, Box<dyn std::error::Error>> {
    let out = settings.out.as_deref().ok_or("no output folder: give --out DIR (or out = \"DIR\" in planish.toml)")?;
    let jobs = inputs::collect(paths)?;
    inputs::refuse_same_names(&jobs)?;
    inputs::refuse_inside(&jobs, out)?;
    let publisher = Publisher::open(out)?;
    let progress = progress(jobs.len(), settings.quiet);
    let mut rows = Vec::new();
    for job in &jobs {
        let tell = |stage: Stage| progress.set_message(format!("{}: {}", job.name.display(), stage.name()));
        rows.push((job, job.run(settings, &publisher, &tell)));
        progress.inc(1);
    }
    progress.finish_and_clear();
    if !settings.quiet {
        super::say(&table(&rows).to_string());
    }
    for (job, result) in &rows {
        tell_trouble(job, result);
    }
    let good = rows.iter().all(|(_, r)| r.as_ref().is_ok_and(|d| d.report.status == Status::Certified));
    Ok(if good { Exit::Success } else { Exit::Refused })
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

type Row<'a, E> = (&'a Job, Result<Done, E>);

/// One line per input.
fn table<E>(rows: &[Row<E>]) -> Table {
    let mut table = Table::new();
    table.load_style(presets::NOTHING);
    table.set_header(["input", "status", "triangles", "charts", "invalid", "untangled by", "area ratio", "cpu s"]);
    for column in [2, 3, 4, 6, 7] {
        if let Some(column) = table.column_mut(column) {
            column.set_cell_alignment(CellAlignment::Right);
        }
    }
    for (job, result) in rows {
        let name = shown(job.name.as_ref());
        match result {
            Ok(done) => table.add_row(cells(name, done)),
            Err(_) => table.add_row(vec![name, "not written".to_owned()]),
        };
    }
    table
}

fn cells(name: String, done: &Done) -> Vec<String> {
    let report = &done.report;
    let status = if done.up_to_date { format!("{} (up to date)", report.status) } else { report.status.to_string() };
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

/// Says on standard error what was wrong with an input.
fn tell_trouble<E: std::fmt::Display>(job: &Job, result: &Result<Done, E>) {
    let input = shown(&job.path);
    match result {
        Err(error) => eprintln!("planish: {input}: {error}"),
        Ok(Done { report: Report { reason: Some(reason), status, .. }, .. }) => {
            let place = reason.place.as_ref().map_or(String::new(), |p| format!(" ({p})"));
            eprintln!("planish: {input}: {status}: {}{place} [{}]", reason.message, reason.code.name());
        }
        Ok(_) => {}
    }
}
