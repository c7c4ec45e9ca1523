//! Every real file at hand, in a format that planish reads, ends as its manifest promises: with a legal atlas whose
//! charts keep the bound of the area ratio, or with a refusal that says why. Linear maps: legality is not a matter of
//! the order, and this is quick. See [`crate::corpus`] for the files themselves.

use crate::corpus::{manifest, shared};
use crate::legality::assert_legal;
use crate::support::Out;
use planish::formats::{Kind, kind};
use planish::outcome::{Code, Status};
use planish::report::Report;
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

/// What a manifest promises of a file.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Promise {
    /// A legal atlas.
    Accept,
    /// A refusal.
    Reject,
    /// One or the other.
    Either,
}

impl Promise {
    /// By the column `kind`; where it speaks of no refusal, there is none.
    fn of(kind: &str) -> Self {
        match kind {
            k if k.contains("accept-or-clear-error") => Self::Either,
            k if k.contains("reject") => Self::Reject,
            _ => Self::Accept,
        }
    }
}

/// The folders of real files, and how many of each planish reads at least.
const FOLDERS: [(&str, usize); 3] = [("meshes", 36), ("anchors/stl", 12), ("malformed", 13)];

/// Larger files, in bytes, run once only: with features.
const LARGE: u64 = 4_000_000;

/// The files that planish reads in a folder of [`FOLDERS`], all that its manifest names among them, and what is promised
/// of each.
fn files(folder: &Path) -> BTreeMap<PathBuf, Promise> {
    let entries = std::fs::read_dir(folder).expect("a folder").map(|e| e.expect("an entry").path());
    let mut files: BTreeMap<PathBuf, Promise> = entries.map(|path| (path, Promise::Accept)).collect();
    if folder.join("MANIFEST.tsv").is_file() {
        files.extend(manifest(folder).iter().map(|row| (folder.join(&row["file"]), Promise::of(&row["kind"]))));
    }
    files.retain(|path, _| matches!(kind(path), Kind::Mesh(_)));
    files
}

/// Runs every file of the folders that has at most so many bytes, and looks at each result.
fn every_file_is_legal_or_refused(most: u64, options: &[&str]) {
    for (folder, least) in FOLDERS {
        let Some(folder) = shared(folder) else { continue };
        let mut files = files(&folder);
        assert!(files.len() >= least, "{}: only {} files are at hand", folder.display(), files.len());
        files.retain(|path, _| {
            let fits = std::fs::metadata(path).expect("it is there").len() <= most;
            if !fits {
                eprintln!("not run with {options:?}: {} is large", path.display());
            }
            fits
        });
        run(&files, options);
    }
}

fn run(files: &BTreeMap<PathBuf, Promise>, options: &[&str]) {
    let out = Out::new();
    let inputs: Vec<&Path> = files.keys().map(PathBuf::as_path).collect();
    let ended = out.run(&inputs, &[&["-q", "--order", "1", "--hand-off", "none"], options].concat());
    assert!(ended.code == Some(0) || ended.code == Some(1), "{options:?}: {:?} {}", ended.code, ended.err);
    for (path, promise) in files {
        let name = path.file_name().expect("a name").to_string_lossy();
        let what = format!("{} with {options:?}, promised: {promise:?}", path.display());
        assert_kept(&what, *promise, &out.report(&name), &out.of(&name));
    }
}

/// The result in `folder` is what was promised.
fn assert_kept(what: &str, promise: Promise, report: &Report, folder: &Path) {
    match (report.status, &report.reason) {
        (Status::Certified, None) => {
            assert_ne!(promise, Promise::Reject, "{what}: was certified");
            assert!(report.refused_components.is_empty(), "{what}: {:?}", report.refused_components);
            assert_legal(folder);
            for chart in &report.charts {
                let within = chart.distortion.area_ratio <= report.settings.max_area_ratio || chart.triangles == 1;
                assert!(within, "{what}: {chart:?}");
            }
        }
        (Status::Refused, Some(reason)) => {
            assert_ne!(promise, Promise::Accept, "{what}: was refused: {reason:?}");
            let at_fault = [Code::NeedsSplit, Code::Internal, Code::UnsupportedFormat, Code::Unreadable];
            assert!(!at_fault.contains(&reason.code) && !reason.message.is_empty(), "{what}: {reason:?}");
        }
        (status, reason) => panic!("{what}: {status}: {reason:?}"),
    }
}

#[test]
fn every_mesh_is_legal_with_seams_along_features() {
    every_file_is_legal_or_refused(u64::MAX, &[]);
}

#[test]
fn every_mesh_is_legal_without_features() {
    every_file_is_legal_or_refused(LARGE, &["--feature-angle", "off"]);
}

/// High genus, many holes, a surface that is not manifold, and one that cannot be oriented.
#[test]
fn strict_disks_are_legal() {
    let Some(meshes) = shared("meshes") else { return };
    let names = ["cad_imu_adis16480.stl", "airplane_27_holes.obj", "truck_nonmanifold.obj", "moebius.obj"];
    let files = names.map(|n| (meshes.join(n), Promise::Accept)).into();
    run(&files, &["--strict-disks", "--feature-angle", "off"]);
}
