//! A disk in memory that keeps apart what is seen and what would survive a loss of power.
//!
//! The content, permissions and time of a file are durable when it is synced; names are when their folder is. What is not
//! synced may have come to the disk or not when the power goes: of the changes of names any part that keeps their order
//! in each folder (a rename between two folders is one change of both, as journals have it), of the content of a file
//! any beginning. Processes are killed before any of their changes, and any single operation can fail.
//!
//! Deliberately absent: links that are followed, and users other than this one and one other.

use super::{Disk, File, Folder, Kind, Rename, Stat, Time};
use crate::system::fingerprint::Identity;
use crate::system::safe_open::OpenError;
use parking_lot::{Mutex, MutexGuard};
use rustix::io::Errno;
use rustix::process::geteuid;
use std::collections::{BTreeMap, BTreeSet};
use std::ffi::{OsStr, OsString};
use std::fmt;
use std::io::{self, Cursor, Read};
use std::path::{Component, Path};
use std::sync::Arc;

type Names = BTreeMap<OsString, usize>;

/// The folder at the top.
const TOP: usize = 0;

/// What may be wanting on a file system.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Abilities {
    pub exchange: bool,
    pub to_free: bool,
    pub links: bool,
}

impl Abilities {
    pub const ALL: Self = Self { exchange: true, to_free: true, links: true };
}

/// Which syncs do nothing, though they tell that they have.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Lies {
    #[default]
    None,
    OfFiles,
    OfFolders,
}

/// What is done to a process.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Plan {
    /// It is killed before this change.
    pub kill: Option<usize>,
    /// This operation fails.
    pub fail: Option<(usize, Errno)>,
}

/// What is left of what was not synced when the power goes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Left {
    Nothing,
    Everything,
    /// What these random numbers say.
    Some(u64),
}

/// What somebody else does, once.
type Meanwhile = Box<dyn FnOnce(&Simulated) + Send>;

/// What can be lost of a node.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
struct State {
    content: Vec<u8>,
    mode: u32,
    modified: Time,
    changed: Time,
}

#[derive(Clone, Debug)]
struct Node {
    kind: Kind,
    device: u64,
    owner: u32,
    is_removed: bool,
    live: State,
    durable: State,
}

/// A change of names, in one folder or two.
#[derive(Clone, Debug)]
struct Change {
    sets: Vec<(usize, OsString, Option<usize>)>,
}

impl Change {
    fn touches(&self, folders: &BTreeSet<usize>) -> bool {
        self.sets.iter().any(|(folder, ..)| folders.contains(folder))
    }

    fn apply(&self, names: &mut BTreeMap<usize, Names>) {
        for (folder, name, node) in &self.sets {
            let names = names.entry(*folder).or_default();
            match node {
                Some(node) => names.insert(name.clone(), *node),
                None => names.remove(name),
            };
        }
    }
}

#[derive(Clone)]
struct World {
    nodes: Vec<Node>,
    live: BTreeMap<usize, Names>,
    durable: BTreeMap<usize, Names>,
    pending: Vec<Change>,
    able: Abilities,
    lies: Lies,
    clock: i64,
}

/// What is about processes.
#[derive(Default)]
struct Processes {
    plans: BTreeMap<u32, Plan>,
    /// How many operations and changes each has made.
    counts: BTreeMap<u32, (usize, usize)>,
    dead: BTreeSet<u32>,
    /// Locked nodes, by handle and process.
    locks: BTreeMap<usize, (u64, u32)>,
    handles: u64,
    meanwhile: Option<(usize, Meanwhile)>,
}

struct Machine {
    world: World,
    processes: Processes,
}

/// The disk, as one process sees it.
#[derive(Clone)]
pub struct Simulated {
    machine: Arc<Mutex<Machine>>,
    process: u32,
}

impl fmt::Debug for Simulated {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        write!(f, "process {}", self.process)
    }
}

fn failed<T>(errno: Errno) -> io::Result<T> {
    Err(errno.into())
}

/// Numbers without pattern, the same in every run (Steele, Lea and Flood 2014, doi 10.1145/2660193.2660195).
fn random(state: &mut u64) -> u64 {
    *state = state.wrapping_add(0x9e37_79b9_7f4a_7c15);
    let mut z = *state;
    z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    z ^ (z >> 31)
}

impl World {
    fn new(able: Abilities) -> Self {
        let (names, nodes) = (BTreeMap::from([(TOP, Names::new())]), Vec::new());
        let (live, durable) = (names.clone(), names);
        let mut world = Self { nodes, live, durable, pending: vec![], able, lies: Lies::None, clock: 1_000_000_000 };
        world.node(Kind::Folder, 1, 0o755, &[]);
        world
    }

    fn now(&mut self) -> Time {
        self.clock += 1;
        (self.clock, 0)
    }

    /// A new node. Its permissions are there from the beginning.
    fn node(&mut self, kind: Kind, device: u64, mode: u32, content: &[u8]) -> usize {
        let now = self.now();
        let durable = State { content: content.to_vec(), mode, modified: now, changed: now };
        let owner = geteuid().as_raw();
        self.nodes.push(Node { kind, device, owner, is_removed: false, live: durable.clone(), durable });
        self.nodes.len() - 1
    }

    fn find(&self, folder: usize, name: &OsStr) -> io::Result<usize> {
        self.live.get(&folder).and_then(|names| names.get(name)).copied().ok_or_else(|| Errno::NOENT.into())
    }

    fn is_folder(&self, node: usize) -> bool {
        self.nodes[node].kind == Kind::Folder
    }

    /// What a path leads to.
    fn walk(&self, path: &Path) -> io::Result<usize> {
        let mut at = TOP;
        for part in path.components() {
            let Component::Normal(part) = part else { continue };
            if !self.is_folder(at) {
                return failed(Errno::NOTDIR);
            }
            at = self.find(at, part)?;
        }
        Ok(at)
    }

    fn change(&mut self, sets: Vec<(usize, OsString, Option<usize>)>) {
        let now = self.now();
        for (folder, _, node) in &sets {
            self.nodes[*folder].live.modified = now;
            self.nodes[*folder].live.changed = now;
            if let Some(node) = node {
                self.nodes[*node].live.changed = now;
            }
        }
        let change = Change { sets };
        change.apply(&mut self.live);
        self.pending.push(change);
    }

    fn set(&mut self, folder: usize, name: &OsStr, node: Option<usize>) -> io::Result<()> {
        if node.is_some() && self.nodes[folder].is_removed {
            return failed(Errno::NOENT);
        }
        if node.is_some() && self.find(folder, name).is_ok() {
            return failed(Errno::EXIST);
        }
        if node.is_none() {
            self.find(folder, name)?;
        }
        self.change(vec![(folder, name.to_owned(), node)]);
        Ok(())
    }

    fn make(&mut self, folder: usize, name: &OsStr, kind: Kind, mode: u32, content: &[u8]) -> io::Result<usize> {
        let made = self.node(kind, self.nodes[folder].device, mode, content);
        if kind == Kind::Folder {
            self.live.insert(made, Names::new());
            self.durable.insert(made, Names::new());
        }
        self.set(folder, name, Some(made))?;
        Ok(made)
    }

    fn is_empty(&self, folder: usize) -> bool {
        self.live.get(&folder).is_none_or(BTreeMap::is_empty)
    }

    fn rename(&mut self, from: (usize, &OsStr), to: (usize, &OsStr), how: Rename) -> io::Result<()> {
        if (how == Rename::Exchange && !self.able.exchange) || (how == Rename::ToFree && !self.able.to_free) {
            return failed(Errno::INVAL);
        }
        let (node, device) = (self.find(from.0, from.1)?, self.nodes[from.0].device);
        let there = self.find(to.0, to.1).ok();
        if device != self.nodes[to.0].device {
            return failed(Errno::XDEV);
        }
        if self.nodes[to.0].is_removed {
            return failed(Errno::NOENT);
        }
        if [Some(node), there].into_iter().flatten().any(|moved| self.nodes[moved].device != device) {
            return failed(Errno::BUSY);
        }
        match (how, there) {
            (Rename::Exchange, None) => return failed(Errno::NOENT),
            (Rename::ToFree, Some(_)) => return failed(Errno::EXIST),
            (Rename::Over, Some(there)) if there == node => return Ok(()),
            (Rename::Over, Some(there)) => match (self.is_folder(node), self.is_folder(there)) {
                (true, false) => return failed(Errno::NOTDIR),
                (false, true) => return failed(Errno::ISDIR),
                (true, true) if !self.is_empty(there) => return failed(Errno::NOTEMPTY),
                (true, true) => self.nodes[there].is_removed = true,
                (false, false) => {}
            },
            (Rename::Exchange, Some(_)) | (Rename::Over | Rename::ToFree, None) => {}
        }
        let left = there.filter(|_| how == Rename::Exchange);
        self.change(vec![(from.0, from.1.to_owned(), left), (to.0, to.1.to_owned(), Some(node))]);
        Ok(())
    }

    /// Brings the names in a folder to disk, and with them, in other folders, what came before them.
    fn sync_names(&mut self, folder: usize) {
        let mut folders = BTreeSet::from([folder]);
        self.keep(&mut folders, |_| false);
    }

    /// Brings the changes to disk that touch these folders, or that are chosen, and those before them in their folders.
    fn keep(&mut self, folders: &mut BTreeSet<usize>, mut chosen: impl FnMut(&Change) -> bool) {
        let (mut kept, mut rest) = (Vec::new(), Vec::new());
        for change in std::mem::take(&mut self.pending).into_iter().rev() {
            if change.touches(folders) || chosen(&change) {
                folders.extend(change.sets.iter().map(|(folder, ..)| *folder));
                kept.push(change);
            } else {
                rest.push(change);
            }
        }
        kept.iter().rev().for_each(|change| change.apply(&mut self.durable));
        rest.reverse();
        self.pending = rest;
    }

    /// What there is when the power is back.
    fn after_power_loss(&self, left: Left) -> Self {
        let mut world = self.clone();
        let mut state = if let Left::Some(seed) = left { seed } else { 0 };
        let mut is_left = |_: &Change| match left {
            Left::Nothing => false,
            Left::Everything => true,
            Left::Some(_) => random(&mut state).is_multiple_of(2),
        };
        world.keep(&mut BTreeSet::new(), &mut is_left);
        world.pending.clear();
        world.live = world.durable.clone();
        for node in &mut world.nodes {
            let written = node.live.content.len();
            let survived = match left {
                Left::Nothing => None,
                Left::Everything => Some(written),
                Left::Some(_) => [None, Some(0), Some(written / 2), Some(written)][random(&mut state) as usize % 4],
            };
            if let Some(survived) = survived
                && node.live != node.durable
            {
                let is_torn = node.live.content != node.durable.content;
                node.durable = node.live.clone();
                node.durable.content.truncate(if is_torn { survived } else { written });
            }
            node.live = node.durable.clone();
            // What had been removed may be there again.
            node.is_removed = false;
        }
        world
    }

    fn stat(&self, node: usize) -> Stat {
        let Node { kind, device, owner, live, .. } = &self.nodes[node];
        Stat {
            kind: *kind,
            bytes: live.content.len() as u64,
            identity: Identity::new(*device, node as u64),
            modified: live.modified,
            changed: live.changed,
            owner: *owner,
            mode: live.mode,
        }
    }

    fn add_all(&self, folder: usize, path: &str, all: &mut BTreeMap<String, Seen>) {
        for (name, node) in &self.live[&folder] {
            let path = format!("{path}/{}", name.to_string_lossy());
            let found = &self.nodes[*node];
            let seen = if found.kind == Kind::File { Seen::File(found.live.content.clone()) } else { Seen::Other };
            all.insert(path.clone(), if found.kind == Kind::Folder { Seen::Folder } else { seen });
            if found.kind == Kind::Folder {
                self.add_all(*node, &path, all);
            }
        }
    }
}

/// What lies under a path.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Seen {
    File(Vec<u8>),
    Folder,
    Other,
}

/// How the machine is used by the tests.
impl Simulated {
    /// An empty disk.
    pub fn new(able: Abilities) -> Self {
        Self::with(World::new(able))
    }

    fn with(world: World) -> Self {
        let machine = Machine { world, processes: Processes::default() };
        Self { machine: Arc::new(Mutex::new(machine)), process: 0 }
    }

    /// The same disk, as another process sees it.
    pub fn process(&self, process: u32, plan: Plan) -> Self {
        self.machine.lock().processes.plans.insert(process, plan);
        Self { machine: self.machine.clone(), process }
    }

    /// The disk on another machine, where nothing runs yet: after a loss of power, or, where none is told, as it is.
    pub fn restarted(&self, left: Option<Left>) -> Self {
        let world = &self.machine.lock().world;
        Self::with(left.map_or_else(|| world.clone(), |left| world.after_power_loss(left)))
    }

    /// Before this operation of the first process, somebody does something.
    pub fn meanwhile(&self, operation: usize, then: impl FnOnce(&Self) + Send + 'static) {
        self.machine.lock().processes.meanwhile = Some((operation, Box::new(then)));
    }

    pub fn lie(&self, lies: Lies) {
        self.machine.lock().world.lies = lies;
    }

    /// How many operations, and how many changes, this process has made.
    pub fn counts(&self) -> (usize, usize) {
        self.machine.lock().processes.counts.get(&self.process).copied().unwrap_or_default()
    }

    pub fn is_locked(&self, path: &str) -> bool {
        let machine = self.machine.lock();
        machine.world.walk(path.as_ref()).is_ok_and(|node| machine.processes.locks.contains_key(&node))
    }

    /// All that is there.
    pub fn all(&self) -> BTreeMap<String, Seen> {
        let mut all = BTreeMap::new();
        self.machine.lock().world.add_all(TOP, "", &mut all);
        all
    }

    pub fn file(&self, path: &str) -> Option<Vec<u8>> {
        match self.all().remove(path) {
            Some(Seen::File(content)) => Some(content),
            _ => None,
        }
    }

    pub fn look(&self, path: &str) -> Option<Stat> {
        let world = &self.machine.lock().world;
        world.walk(path.as_ref()).ok().map(|node| world.stat(node))
    }

    /// What somebody else does is on disk at once, with all names on the way there.
    fn theirs<T>(&self, path: &str, act: impl FnOnce(&mut World, usize, &OsStr) -> T) -> T {
        let path = Path::new(path);
        let (above, name) = (path.parent().expect("not the top"), path.file_name().expect("a name"));
        if self.machine.lock().world.walk(above).is_err() {
            self.put_folder(above.to_str().expect("plain"), 0o755);
        }
        let world = &mut self.machine.lock().world;
        let folder = world.walk(above).expect("made");
        let done = act(world, folder, name);
        for path in above.ancestors() {
            let folder = world.walk(path).expect("on the way");
            world.sync_names(folder);
        }
        done
    }

    /// Somebody makes a folder.
    pub fn put_folder(&self, path: &str, mode: u32) {
        self.theirs(path, |world, folder, name| drop(world.make(folder, name, Kind::Folder, mode, &[])));
    }

    /// Somebody mounts another disk.
    pub fn mount(&self, path: &str) {
        self.put_folder(path, 0o755);
        let world = &mut self.machine.lock().world;
        let node = world.walk(path.as_ref()).expect("made");
        world.nodes[node].device = 2;
    }

    /// Somebody makes a link, or a pipe.
    pub fn put_other(&self, path: &str, kind: Kind) {
        self.theirs(path, |world, folder, name| drop(world.make(folder, name, kind, 0o777, b"/etc")));
    }

    /// Somebody saves a file under another name, and gives it this one.
    pub fn put(&self, path: &str, content: &[u8]) {
        self.theirs(path, |world, folder, name| {
            let _ = world.set(folder, name, None);
            drop(world.make(folder, name, Kind::File, 0o644, content));
        });
    }

    /// Somebody removes something.
    pub fn remove(&self, path: &str) {
        let inside: Vec<String> = self.all().into_keys().filter(|p| p.starts_with(&format!("{path}/"))).collect();
        for path in inside.iter().rev().map(String::as_str).chain([path]) {
            self.theirs(path, |world, folder, name| {
                let Ok(node) = world.find(folder, name) else { return };
                let _ = world.set(folder, name, None);
                world.nodes[node].is_removed = true;
            });
        }
    }

    /// Begins an operation.
    fn operate(&self, is_change: bool) -> io::Result<MutexGuard<'_, Machine>> {
        let mut machine = self.machine.lock();
        let processes = &mut machine.processes;
        let counts = processes.counts.entry(self.process).or_default();
        let (operation, change) = *counts;
        let plan = processes.plans.get(&self.process).copied().unwrap_or_default();
        if is_change && plan.kill == Some(change) {
            processes.dead.insert(self.process);
            processes.locks.retain(|_, (_, process)| *process != self.process);
        }
        if processes.dead.contains(&self.process) {
            return Err(io::Error::other("the process is dead"));
        }
        *counts = (operation + 1, change + usize::from(is_change));
        if let Some((_, then)) = processes.meanwhile.take_if(|(at, _)| self.process == 1 && *at == operation) {
            drop(machine);
            then(self);
            machine = self.machine.lock();
        }
        match plan.fail {
            Some((at, errno)) if at == operation => failed(errno),
            _ => Ok(machine),
        }
    }

    fn folder(&self, node: usize) -> SimulatedFolder {
        SimulatedFolder { disk: self.clone(), node }
    }

    fn open_node(&self, machine: &mut Machine, node: usize) -> SimulatedFile {
        machine.processes.handles += 1;
        SimulatedFile { disk: self.clone(), node, handle: machine.processes.handles }
    }
}

impl Disk for Simulated {
    type Folder = SimulatedFolder;

    fn open(&self, path: &Path) -> io::Result<SimulatedFolder> {
        let machine = self.operate(false)?;
        let node = machine.world.walk(path)?;
        if machine.world.is_folder(node) { Ok(self.folder(node)) } else { failed(Errno::NOTDIR) }
    }
}

/// An open folder.
#[derive(Debug)]
pub struct SimulatedFolder {
    disk: Simulated,
    node: usize,
}

impl Folder for SimulatedFolder {
    type File = SimulatedFile;

    fn stat(&self) -> io::Result<Stat> {
        Ok(self.disk.operate(false)?.world.stat(self.node))
    }

    fn stat_of(&self, name: impl AsRef<OsStr>) -> io::Result<Stat> {
        let world = &self.disk.operate(false)?.world;
        Ok(world.stat(world.find(self.node, name.as_ref())?))
    }

    fn list(&self) -> io::Result<Vec<OsString>> {
        Ok(self.disk.operate(false)?.world.live[&self.node].keys().cloned().collect())
    }

    fn open_folder(&self, name: impl AsRef<OsStr>) -> io::Result<Self> {
        let world = &self.disk.operate(false)?.world;
        let node = world.find(self.node, name.as_ref())?;
        if world.is_folder(node) { Ok(self.disk.folder(node)) } else { failed(Errno::NOTDIR) }
    }

    fn open_file(&self, name: impl AsRef<OsStr>) -> Result<SimulatedFile, OpenError> {
        let mut machine = self.disk.operate(false)?;
        let node = machine.world.find(self.node, name.as_ref())?;
        if machine.world.nodes[node].kind != Kind::File {
            return Err(OpenError::NotRegular);
        }
        Ok(self.disk.open_node(&mut machine, node))
    }

    fn follow_file(&self, name: impl AsRef<OsStr>) -> Result<SimulatedFile, OpenError> {
        self.open_file(name)
    }

    fn open_private(&self, name: impl AsRef<OsStr>, make: bool) -> io::Result<SimulatedFile> {
        let mut machine = self.disk.operate(make)?;
        let node = match machine.world.find(self.node, name.as_ref()) {
            Err(_) if make => machine.world.make(self.node, name.as_ref(), Kind::File, 0o600, &[])?,
            found => found?,
        };
        match machine.world.nodes[node].kind {
            Kind::Link => failed(Errno::LOOP),
            Kind::Folder => failed(Errno::ISDIR),
            Kind::File | Kind::Other => Ok(self.disk.open_node(&mut machine, node)),
        }
    }

    fn read_link(&self, name: impl AsRef<OsStr>) -> io::Result<OsString> {
        let world = &self.disk.operate(false)?.world;
        let node = &world.nodes[world.find(self.node, name.as_ref())?];
        if node.kind != Kind::Link {
            return failed(Errno::INVAL);
        }
        Ok(String::from_utf8(node.live.content.clone()).expect("plain").into())
    }

    fn make_folder(&self, name: impl AsRef<OsStr>, mode: u32) -> io::Result<()> {
        let world = &mut self.disk.operate(true)?.world;
        world.make(self.node, name.as_ref(), Kind::Folder, mode & 0o755, &[]).map(|_| ())
    }

    fn make_file(&self, name: impl AsRef<OsStr>, mode: u32) -> io::Result<SimulatedFile> {
        let mut machine = self.disk.operate(true)?;
        let node = machine.world.make(self.node, name.as_ref(), Kind::File, mode & 0o644, &[])?;
        Ok(self.disk.open_node(&mut machine, node))
    }

    fn make_link(&self, target: &OsStr, name: impl AsRef<OsStr>) -> io::Result<()> {
        let world = &mut self.disk.operate(true)?.world;
        let target = target.as_encoded_bytes();
        world.make(self.node, name.as_ref(), Kind::Link, 0o777, target).map(|_| ())
    }

    fn link(&self, name: impl AsRef<OsStr>, to: &Self, to_name: impl AsRef<OsStr>) -> io::Result<()> {
        let world = &mut self.disk.operate(true)?.world;
        let node = world.find(self.node, name.as_ref())?;
        if !world.able.links || world.is_folder(node) {
            return failed(Errno::PERM);
        }
        if world.nodes[self.node].device != world.nodes[to.node].device {
            return failed(Errno::XDEV);
        }
        world.set(to.node, to_name.as_ref(), Some(node))
    }

    fn rename(&self, name: impl AsRef<OsStr>, to: &Self, to_name: impl AsRef<OsStr>, how: Rename) -> io::Result<()> {
        let world = &mut self.disk.operate(true)?.world;
        world.rename((self.node, name.as_ref()), (to.node, to_name.as_ref()), how)
    }

    fn unlink(&self, name: impl AsRef<OsStr>) -> io::Result<()> {
        let world = &mut self.disk.operate(true)?.world;
        if world.is_folder(world.find(self.node, name.as_ref())?) {
            return failed(Errno::ISDIR);
        }
        world.set(self.node, name.as_ref(), None)
    }

    fn remove_folder(&self, name: impl AsRef<OsStr>) -> io::Result<()> {
        let world = &mut self.disk.operate(true)?.world;
        let node = world.find(self.node, name.as_ref())?;
        if !world.is_folder(node) {
            return failed(Errno::NOTDIR);
        }
        if !world.is_empty(node) {
            return failed(Errno::NOTEMPTY);
        }
        world.set(self.node, name.as_ref(), None)?;
        world.nodes[node].is_removed = true;
        Ok(())
    }

    fn set_mode(&self, mode: u32) -> io::Result<()> {
        self.disk.operate(true)?.world.nodes[self.node].live.mode = mode;
        Ok(())
    }

    fn sync(&self) -> io::Result<()> {
        let world = &mut self.disk.operate(true)?.world;
        if world.lies != Lies::OfFolders {
            world.sync_names(self.node);
            world.nodes[self.node].durable = world.nodes[self.node].live.clone();
        }
        Ok(())
    }
}

/// An open file.
#[derive(Debug)]
pub struct SimulatedFile {
    disk: Simulated,
    node: usize,
    handle: u64,
}

impl SimulatedFile {
    fn change(&self, change: impl FnOnce(&mut State)) -> io::Result<()> {
        let world = &mut self.disk.operate(true)?.world;
        let now = world.now();
        let state = &mut world.nodes[self.node].live;
        (state.modified, state.changed) = (now, now);
        change(state);
        Ok(())
    }
}

impl File for SimulatedFile {
    fn stat(&self) -> io::Result<Stat> {
        Ok(self.disk.operate(false)?.world.stat(self.node))
    }

    fn content(&self) -> io::Result<impl Read + '_> {
        Ok(Cursor::new(self.disk.operate(false)?.world.nodes[self.node].live.content.clone()))
    }

    /// In two steps, between which it may be killed.
    fn append(&self, bytes: &[u8]) -> io::Result<()> {
        let (first, second) = bytes.split_at(bytes.len() / 2);
        self.change(|state| state.content.extend(first))?;
        self.change(|state| state.content.extend(second))
    }

    fn set_mode(&self, mode: u32) -> io::Result<()> {
        let modified = self.stat()?.modified;
        self.change(|state| (state.mode, state.modified) = (mode, modified))
    }

    fn set_time(&self, time: Time) -> io::Result<()> {
        self.change(|state| state.modified = time)
    }

    fn sync(&self) -> io::Result<()> {
        let world = &mut self.disk.operate(true)?.world;
        if world.lies != Lies::OfFiles {
            world.nodes[self.node].durable = world.nodes[self.node].live.clone();
        }
        Ok(())
    }

    fn lock_now(&self) -> io::Result<bool> {
        let locks = &mut self.disk.operate(false)?.processes.locks;
        let (holder, _) = *locks.entry(self.node).or_insert((self.handle, self.disk.process));
        Ok(holder == self.handle)
    }

    fn has_writer(&self) -> io::Result<Option<bool>> {
        self.disk.operate(false).map(|_| Some(false))
    }
}

impl Drop for SimulatedFile {
    fn drop(&mut self) {
        let locks = &mut self.disk.machine.lock().processes.locks;
        locks.retain(|_, (handle, _)| *handle != self.handle);
    }
}
