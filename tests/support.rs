//! Running the real program.

use planish::report::Report;
use serde_json::Value;
use std::path::{Path, PathBuf};
use std::process::{Command, Output};

/// The folder of the sources.
pub fn root() -> &'static Path {
    Path::new(env!("CARGO_MANIFEST_DIR"))
}

/// A fixture by its name.
pub fn fixture(name: &str) -> PathBuf {
    root().join("fixtures").join(name)
}

/// How a call of the program ended.
#[derive(Debug)]
pub struct Ended {
    pub code: Option<i32>,
    pub out: String,
    pub err: String,
}

/// Runs the program with these arguments.
pub fn planish<A: AsRef<std::ffi::OsStr>>(args: impl IntoIterator<Item = A>) -> Ended {
    let Output { status, stdout, stderr } =
        Command::new(env!("CARGO_BIN_EXE_planish")).args(args).output().expect("the program starts");
    let text = |bytes: Vec<u8>| String::from_utf8_lossy(&bytes).into_owned();
    Ended { code: status.code(), out: text(stdout), err: text(stderr) }
}

/// An output folder that goes when the test ends.
pub struct Out {
    folder: tempfile::TempDir,
}

impl Out {
    pub fn new() -> Self {
        Self { folder: tempfile::tempdir().expect("a folder") }
    }

    pub fn path(&self) -> &Path {
        self.folder.path()
    }

    /// The result folder of an input.
    pub fn of(&self, name: &str) -> PathBuf {
        self.folder.path().join(name)
    }

    /// `planish run INPUTS --out THIS EXTRA`.
    pub fn run(&self, inputs: &[&Path], extra: &[&str]) -> Ended {
        let mut args: Vec<&std::ffi::OsStr> = vec!["run".as_ref()];
        args.extend(inputs.iter().map(|p| p.as_os_str()));
        args.extend(["--out".as_ref(), self.path().as_os_str()]);
        args.extend(extra.iter().map(|a| std::ffi::OsStr::new(*a)));
        planish(args)
    }

    /// Writes an input file beside the results and runs it.
    pub fn run_bytes(&self, name: &str, bytes: &[u8]) -> (Ended, Report) {
        self.run_bytes_with(name, bytes, &[])
    }

    /// As [`Self::run_bytes`], with more arguments.
    pub fn run_bytes_with(&self, name: &str, bytes: &[u8], extra: &[&str]) -> (Ended, Report) {
        (self.try_bytes(name, bytes, extra), self.report(name))
    }

    /// As [`Self::run_bytes_with`], where there may be no report.
    pub fn try_bytes(&self, name: &str, bytes: &[u8], extra: &[&str]) -> Ended {
        let inputs = tempfile::tempdir().expect("a folder");
        let path = inputs.path().join(name);
        std::fs::write(&path, bytes).expect("written");
        self.run(&[&path], extra)
    }

    /// The report of an input.
    pub fn report(&self, name: &str) -> Report {
        serde_json::from_slice(&self.read(name, "report.json")).expect("a report")
    }

    /// The report of an input without what may differ from run to run.
    pub fn timeless(&self, name: &str) -> Value {
        let mut value: Value = serde_json::from_slice(&self.read(name, "report.json")).expect("a report");
        value.as_object_mut().expect("an object").remove("timing");
        value
    }

    /// A file of a result.
    pub fn read(&self, name: &str, file: &str) -> Vec<u8> {
        std::fs::read(self.of(name).join(file)).expect("the file is there")
    }
}
