//! `planish watch`: the real program, fed, disturbed, stopped and killed.

mod chaining;
mod commanding;
mod dropping;
mod enduring;
mod isolating;
pub mod killing;
pub mod many;
mod operating;
mod putting_away;
mod reaching_out;
mod refusing;
mod stopping;

use crate::support::Out;
use planish::outcome::Status;
use planish::report::Output;
use rustix::process::{Pid, Resource, Rlimit, Signal, kill_process, prlimit};
use serde_json::Value;
use std::collections::BTreeSet;
use std::ffi::{OsStr, OsString};
use std::fs::{self, File};
use std::io::Write;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, ExitStatus};
use std::time::{Duration, Instant};

/// Nothing here takes a tenth of this; a test that waits longer has failed.
const PATIENCE: Duration = Duration::from_secs(300);

/// An inbox, an output folder, and perhaps a daemon between them. All goes when the test ends.
pub struct Watched {
    folder: tempfile::TempDir,
    pub out: Out,
    args: Vec<String>,
    daemon: Option<Child>,
}

impl Watched {
    /// With these arguments for every start.
    pub fn new(args: &[&str]) -> Self {
        let folder = tempfile::tempdir().expect("a folder");
        fs::create_dir(folder.path().join("in")).expect("made");
        let args = args.iter().map(ToString::to_string).collect();
        Self { folder, out: Out::new(), args, daemon: None }
    }

    /// With this settings file.
    pub fn configured(toml: &str, args: &[&str]) -> Self {
        let mut watched = Self::new(args);
        let config = watched.beside("planish.toml");
        fs::write(&config, toml).expect("written");
        watched.args.extend(["--config".to_owned(), config.display().to_string()]);
        watched
    }

    /// One more argument for every start.
    pub fn add_argument(&mut self, argument: &str) {
        self.args.push(argument.to_owned());
    }

    pub fn inbox(&self) -> PathBuf {
        self.folder.path().join("in")
    }

    /// A path beside the inbox.
    pub fn beside(&self, name: &str) -> PathBuf {
        self.folder.path().join(name)
    }

    /// Puts a file into the inbox at once, by a rename.
    pub fn drop_in(&self, name: &str, bytes: &[u8]) {
        let path = self.beside("on-its-way");
        fs::write(&path, bytes).expect("written");
        fs::rename(path, self.inbox().join(name)).expect("moved in");
    }

    /// `planish watch` with its log in a file.
    fn command(&self) -> Command {
        let mut command = Command::new(env!("CARGO_BIN_EXE_planish"));
        command.args(self.arguments()).stderr(self.log_file());
        command
    }

    /// The arguments of `planish`.
    pub fn arguments(&self) -> Vec<OsString> {
        let (inbox, out) = (self.inbox(), self.out.path());
        let head: [&OsStr; 6] =
            ["watch".as_ref(), inbox.as_ref(), "--out".as_ref(), out.as_ref(), "--log".as_ref(), "json".as_ref()];
        head.into_iter().map(OsStr::to_owned).chain(self.args.iter().map(OsString::from)).collect()
    }

    /// Where the daemon says what it does.
    pub fn log_file(&self) -> File {
        File::options().create(true).append(true).open(self.beside("log")).expect("a log")
    }

    pub fn start(&mut self) {
        self.start_with(|command| command);
    }

    pub fn start_with(&mut self, change: impl Fn(&mut Command) -> &mut Command) {
        assert!(self.daemon.is_none(), "one at a time");
        let mut command = self.command();
        change(&mut command);
        self.daemon = Some(command.spawn().expect("starts"));
    }

    /// Starts the daemon in another way.
    pub fn start_as(&mut self, command: &mut Command) {
        assert!(self.daemon.is_none(), "one at a time");
        self.daemon = Some(command.spawn().expect("starts"));
    }

    pub fn pid(&self) -> u32 {
        self.daemon.as_ref().expect("it runs").id()
    }

    pub fn signal(&self, signal: Signal) {
        send(self.daemon.as_ref().expect("it runs"), signal);
    }

    /// Waits until the daemon has ended.
    pub fn wait(&mut self) -> ExitStatus {
        let daemon = self.daemon.as_mut().expect("it runs");
        let since = Instant::now();
        loop {
            if let Some(status) = daemon.try_wait().expect("a child") {
                self.daemon = None;
                return status;
            }
            if since.elapsed() > PATIENCE {
                panic!("the daemon does not end\n{}", self.log());
            }
            std::thread::sleep(Duration::from_millis(5));
        }
    }

    /// Asks the daemon to stop that runs below another program, which ends with it.
    pub fn end_traced(&mut self) {
        let traced = self.status()["pid"].as_u64().and_then(|pid| i32::try_from(pid).ok()).and_then(Pid::from_raw);
        kill_process(traced.expect("it tells its number"), Signal::TERM).expect("sent");
        assert_eq!(self.wait().code(), Some(0), "{}", self.log());
    }

    /// Kills the daemon as the system does when memory is short.
    pub fn kill(&mut self) {
        let mut daemon = self.daemon.take().expect("it runs");
        daemon.kill().expect("killed");
        daemon.wait().expect("a child");
    }

    /// Asks the daemon to stop, and sees that it ends well.
    pub fn stop(&mut self) {
        // Where all was done before, it may have been started only now, and a signal that it does not yet hear ends it.
        self.wait_until("it hears signals", |w| hears(w.pid(), Signal::TERM));
        self.signal(Signal::TERM);
        let status = self.wait();
        assert_eq!(status.code(), Some(0), "{}", self.log());
    }

    pub fn log(&self) -> String {
        fs::read_to_string(self.beside("log")).unwrap_or_default()
    }

    /// How often a message was logged about an input.
    pub fn logged(&self, input: &str, message: &str) -> usize {
        let log = self.log();
        let lines = log.lines().filter_map(|l| serde_json::from_str::<Value>(l).ok());
        let about = |l: &Value| l["spans"].as_array().is_some_and(|all| all.iter().any(|s| s["input"] == input));
        let says = |l: &Value| l["fields"]["message"].as_str().is_some_and(|m| m.starts_with(message));
        lines.filter(|l| about(l) && says(l)).count()
    }

    /// Waits until something is so.
    pub fn wait_until(&self, what: &str, mut is_so: impl FnMut(&Self) -> bool) {
        let since = Instant::now();
        while !is_so(self) {
            assert!(since.elapsed() < PATIENCE, "waited in vain until {what}\n{}", self.log());
            std::thread::sleep(Duration::from_millis(20));
        }
    }

    /// Waits until every input has a result from exactly these bytes.
    pub fn wait_for(&self, inputs: &[(&str, &[u8])]) {
        for (name, bytes) in inputs {
            self.wait_until(&format!("{name} is done"), |w| w.is_done(name, bytes));
        }
    }

    pub fn is_done(&self, name: &str, bytes: &[u8]) -> bool {
        let Ok(text) = fs::read(self.out.of(name).join("report.json")) else { return false };
        let report: Value = serde_json::from_slice(&text).expect("reports are whole");
        report["input"]["blake3"] == blake3::hash(bytes).to_hex().as_str()
    }

    /// What the daemon tells, as `planish status` reads it.
    pub fn status(&self) -> Value {
        fs::read(self.out.path().join(".planish/status.json"))
            .ok()
            .and_then(|text| serde_json::from_slice(&text).ok())
            .unwrap_or_default()
    }

    /// Whether an input is on its way, and has reached a stage behind reading.
    pub fn is_running(&self, name: &str) -> bool {
        let status = self.status();
        let running = status["running"].as_array().cloned().unwrap_or_default();
        running.iter().any(|job| job["name"] == name && job["stage"] != "read")
    }

    /// Whether the result of an input is complete: every file of it there with its size and hash, and no other.
    pub fn assert_complete(&self, name: &str, status: Status) {
        let report = self.out.report(name);
        assert_eq!(report.status, status, "{name}: {:?}", report.reason);
        let mut expected: BTreeSet<String> = report.outputs.iter().map(|o| o.file.clone()).collect();
        assert_eq!(expected.is_empty(), status != Status::Certified, "{name}");
        for output in &report.outputs {
            assert_eq!(Output::of(&output.file, &self.out.read(name, &output.file)), *output, "{name}");
        }
        expected.insert("report.json".to_owned());
        assert_eq!(names(&self.out.of(name)), expected, "{name}: nothing stray");
    }

    /// Whether the output folder holds the results of these inputs and nothing else; and, when no daemon runs, no
    /// staging folder is left.
    pub fn assert_tidy(&self, inputs: &[&str]) {
        let mut expected: BTreeSet<String> = inputs.iter().map(ToString::to_string).collect();
        expected.insert(".planish".to_owned());
        assert_eq!(names(self.out.path()), expected);
        if self.daemon.is_none() {
            let staging = names(&self.out.path().join(".planish"));
            assert_eq!(staging.iter().collect::<Vec<_>>(), ["opening", "watch.lock"]);
        }
    }
}

impl Drop for Watched {
    fn drop(&mut self) {
        if let Some(mut daemon) = self.daemon.take() {
            let _ = daemon.kill();
            let _ = daemon.wait();
        }
    }
}

/// The names in a folder.
pub fn names(folder: &Path) -> BTreeSet<String> {
    let name = |e: fs::DirEntry| e.file_name().to_string_lossy().into_owned();
    fs::read_dir(folder).expect("a folder").flatten().map(name).collect()
}

/// A disk with bumps, as a binary STL: about 6 n^2 triangles. Different `twist`s are different surfaces.
pub fn disk(n: u32, twist: f64) -> Vec<u8> {
    let soup = planish_core::shapes::disk(n);
    let point = |i: u32| soup.points()[i as usize].map(|x| (x * (1.0 + 1e-3 * twist)) as f32);
    let mut bytes = vec![0_u8; 80];
    bytes.extend((soup.triangles().len() as u32).to_le_bytes());
    for t in soup.triangles() {
        bytes.extend([0; 12]);
        t.iter().flat_map(|v| point(*v)).for_each(|x| bytes.extend(x.to_le_bytes()));
        bytes.extend([0; 2]);
    }
    bytes
}

/// A triangle in glTF, whose data are in the file that is named.
pub fn gltf_naming(uri: &str) -> String {
    format!(
        r#"{{"asset": {{"version": "2.0"}}, "buffers": [{{"uri": "{uri}", "byteLength": 36}}],
        "bufferViews": [{{"buffer": 0, "byteLength": 36}}],
        "accessors": [{{"bufferView": 0, "componentType": 5126, "count": 3, "type": "VEC3",
                        "min": [0, 0, 0], "max": [1, 1, 0]}}],
        "meshes": [{{"primitives": [{{"attributes": {{"POSITION": 0}}}}]}}]}}"#
    )
}

/// Whether a process runs: one that is dead, and of which nobody has asked, does not.
pub fn runs(id: impl std::fmt::Display) -> bool {
    let stat = fs::read_to_string(format!("/proc/{id}/stat")).unwrap_or_default();
    !stat.is_empty() && !stat.contains(") Z ")
}

/// Gives a process this many handles at most; it keeps those that it has.
pub fn limit_handles(process: u32, handles: u64) {
    let process = i32::try_from(process).ok().and_then(Pid::from_raw).expect("a process");
    let limit = Rlimit { current: Some(handles), maximum: Some(1 << 10) };
    prlimit(Some(process), Resource::Nofile, limit).expect("set");
}

/// Writes a file in pieces, with pauses.
pub fn write_slowly(path: &Path, bytes: &[u8], pieces: usize, pause: Duration) {
    let mut file = File::create(path).expect("made");
    for piece in bytes.chunks(bytes.len().div_ceil(pieces)) {
        file.write_all(piece).expect("written");
        file.flush().expect("written");
        std::thread::sleep(pause);
    }
}

/// Sends a process a signal.
/// Whether a process handles a signal, or has ended; where the system does not tell, it is taken to.
fn hears(id: u32, signal: Signal) -> bool {
    let status = fs::read_to_string(format!("/proc/{id}/status")).unwrap_or_default();
    let of = |key| status.lines().find_map(|line| line.strip_prefix(key)).map(str::trim);
    let caught = of("SigCgt:").and_then(|mask| u64::from_str_radix(mask, 16).ok());
    of("State:").is_some_and(|state| state.starts_with('Z'))
        || caught.is_none_or(|mask| mask >> (signal.as_raw() - 1) & 1 == 1)
}

pub fn send(process: &Child, signal: Signal) {
    kill_process(Pid::from_child(process), signal).expect("sent");
}
