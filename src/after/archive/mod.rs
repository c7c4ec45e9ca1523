//! What becomes of an input that is done with: it is moved to another folder, or deleted.
//!
//! The file is kept at its new place first, and then moved into a hidden folder beside it ([`crate::after::holding`]), and
//! looked at and read there once more: so what is removed is what was processed, even where something else takes its
//! name at the same moment, or somebody writes to it without a trace (through shared memory, neither size nor time
//! change). What is not is given back, and what somebody has open to write to it stays, where the system can tell. Nothing is followed on the way, and what was kept goes again where it fails.
//!
//! Guarantee: an input that is removed has the content that was processed, and where it is to be moved, a file with
//! this content is at its new place. Not covered: what somebody writes through shared memory after that last reading.

use crate::after::holding::{HOLDING, Holding};
use crate::system::disk::{self, Disk, File, Folder, Stat};
use crate::system::escape::escape;
use crate::system::fingerprint::Fingerprint;
use crate::system::safe_open::OpenError;
use blake3::{Hash, Hasher};
use rustix::process::geteuid;
use std::ffi::{OsStr, OsString};
use std::io::{self, ErrorKind, Read};
use std::path::{Path, PathBuf};

/// Numbers that are tried to find a free name.
const MOST_COPIES: u32 = 10_000;

/// Stems longer than this (bytes) are cut where a number is added; a character has at most four.
const LONGEST_STEM: usize = 200;

/// An input, as it was processed.
#[derive(Clone, Copy, Debug)]
pub struct Processed<'a> {
    /// The inbox.
    pub inbox: &'a Path,
    /// Its path below the inbox.
    pub name: &'a Path,
    /// What the file looked like.
    pub look: &'a Fingerprint,
    /// The hash of its content.
    pub hash: Hash,
}

/// What is to become of the file.
#[derive(Clone, Copy, Debug)]
pub enum Way<'a> {
    /// Moved to this path, or, where something else is there already, to one like it with a number.
    To(&'a Path),
    /// Deleted.
    Nowhere,
}

/// What became of the file.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Fate {
    /// It is away.
    Away,
    /// There is nothing to put away: it is gone, or a link. Links stay, as what they point to is not ours.
    Nothing,
    /// It stays: it is not what was processed.
    Changed,
    /// It stays: somebody has it open to write to it.
    Busy,
}

/// Why an input is not put away.
#[derive(Debug, thiserror::Error)]
#[error("cannot put the input {} away: {error}; check the permissions of its folder and of the one it goes to", escape(.path))]
pub struct ArchiveError {
    /// The file.
    path: PathBuf,
    /// Why.
    error: io::Error,
}

/// Where a file with the content of the input is now.
enum Kept<F> {
    /// It was put into this folder, under this name; and what it looked like then.
    Made(F, OsString, Stat),
    /// It was there before.
    Found,
}

/// Puts an input away, if it still is what was processed, and nobody has it open to write to it.
///
/// # Errors
/// [`ArchiveError`]; then the file is where it was, untouched where its folder cannot be written or it has no place to
/// go to; and nothing is left of the attempt.
pub fn archive(disk: &impl Disk, input: &Processed, way: Way) -> Result<Fate, ArchiveError> {
    try_to_put_away(disk, input, way).map_err(|error| ArchiveError { path: input.inbox.join(input.name), error })
}

fn try_to_put_away<D: Disk>(disk: &D, input: &Processed, way: Way) -> io::Result<Fate> {
    let (Some(above), Some(name)) = (input.name.parent(), input.name.file_name()) else { return Ok(Fate::Nothing) };
    let top = disk.open(input.inbox).map_err(OpenError::Io);
    let folder = match top.and_then(|top| disk::below(top, above)) {
        Err(error) if error.is_missing() => return Ok(Fate::Nothing),
        opened => opened.map_err(OpenError::into_io)?,
    };
    let file = match folder.open_file(name) {
        Err(OpenError::NotRegular) => return Ok(Fate::Nothing),
        Err(error) if error.is_missing() => return Ok(Fate::Nothing),
        opened => opened.map_err(OpenError::into_io)?,
    };
    if Fingerprint::of_stat(&file.stat()?) != *input.look {
        return Ok(Fate::Changed);
    }
    if file.has_writer()? == Some(true) {
        return Ok(Fate::Busy);
    }
    // Made before anything is kept: where it cannot be, the file is not touched.
    let holding = Holding::make(&folder)?;
    let fate = keep_and_remove(disk, input, way, &Source { folder: &folder, name, file }, &holding);
    holding.remove();
    fate
}

/// The file in its inbox, opened.
struct Source<'a, F: Folder> {
    folder: &'a F,
    name: &'a OsStr,
    file: F::File,
}

fn keep_and_remove<D: Disk>(
    disk: &D,
    input: &Processed,
    way: Way,
    source: &Source<D::Folder>,
    holding: &Holding<D::Folder>,
) -> io::Result<Fate> {
    let kept = match way {
        Way::Nowhere => Kept::Found,
        Way::To(place) => match keep_at(disk, input, source, place)? {
            Some(kept) => kept,
            None => return Ok(Fate::Changed),
        },
    };
    let fate = remove(input, source.name, holding);
    let stays = match fate {
        Ok(Fate::Away) => false,
        Ok(Fate::Changed | Fate::Nothing | Fate::Busy) => true,
        // Where nobody knows where it is, what was kept may be all there is of it.
        Err(_) => holding.is_there(source.name),
    };
    match kept {
        Kept::Made(folder, name, made) if stays => remove_made(&folder, &name, &made).and(fate),
        Kept::Made(..) | Kept::Found => fate,
    }
}

/// Removes what was put there, unless somebody has put something else in its place.
fn remove_made<F: Folder>(folder: &F, name: &OsStr, made: &Stat) -> io::Result<()> {
    match folder.stat_of(name) {
        Ok(found) if found.identity == made.identity => folder.unlink(name),
        Err(error) if error.kind() != ErrorKind::NotFound => Err(error),
        Ok(_) | Err(_) => Ok(()),
    }
}

/// Removes the file, if it is what was processed. It is away only where its removal has succeeded.
fn remove<F: Folder>(input: &Processed, name: &OsStr, holding: &Holding<F>) -> io::Result<Fate> {
    holding.take(name)?;
    let removed = match looked_at(input, holding.open_held(name)) {
        Ok(Fate::Away) => holding.delete(name).map(|()| Fate::Away),
        looked_at => looked_at,
    };
    if matches!(removed, Ok(Fate::Away)) {
        return removed;
    }
    holding.give_back(name).and(removed)
}

/// What is to become of a file that is held: away, if it is the one that was processed, with the same content.
fn looked_at<F: File>(input: &Processed, opened: Result<F, OpenError>) -> io::Result<Fate> {
    let file = match opened {
        Err(OpenError::NotRegular) => return Ok(Fate::Changed),
        opened => opened.map_err(OpenError::into_io)?,
    };
    let before = Fingerprint::of_stat(&file.stat()?);
    if !before.is_renamed(input.look) || hash_of(&file, input)? != input.hash {
        return Ok(Fate::Changed);
    }
    if Fingerprint::of_stat(&file.stat()?) != before {
        return Ok(Fate::Changed);
    }
    // Whoever opened it before it was held may still write to it.
    Ok(if file.has_writer()? == Some(true) { Fate::Busy } else { Fate::Away })
}

fn hash_of(file: &impl File, input: &Processed) -> io::Result<Hash> {
    copy(file, input, |_| Ok(()))
}

/// Copies a file, a little more than the input has at most; the hash of what was copied.
fn copy(file: &impl File, input: &Processed, mut to: impl FnMut(&[u8]) -> io::Result<()>) -> io::Result<Hash> {
    let (mut hasher, mut rest) = (Hasher::new(), file.content()?.take(input.look.bytes.saturating_add(1)));
    let mut buffer = vec![0; 1 << 16];
    loop {
        match rest.read(&mut buffer) {
            Ok(0) => return Ok(hasher.finalize()),
            Ok(read) => {
                hasher.update(&buffer[..read]);
                to(&buffer[..read])?;
            }
            Err(error) if error.kind() == ErrorKind::Interrupted => {}
            Err(error) => return Err(error),
        }
    }
}

/// Keeps a file at `place`, or at the first place like it that is free or has the same content already. None: it is not
/// what was processed.
fn keep_at<D: Disk>(
    disk: &D,
    input: &Processed,
    source: &Source<D::Folder>,
    place: &Path,
) -> io::Result<Option<Kept<D::Folder>>> {
    let above = place.parent().unwrap_or(place);
    let folder = disk::make_all(disk, above)?;
    for number in 1..MOST_COPIES {
        let place = if number == 1 { place.to_owned() } else { numbered(place, number) };
        let name = place.file_name().unwrap_or_default();
        let kept = match put_in_free_place(input, source, &folder, name) {
            Err(error) if error.kind() == ErrorKind::AlreadyExists => {
                if !has_content(input, source, &folder, name)? {
                    continue;
                }
                Kept::Found
            }
            Err(error) => return Err(error),
            Ok(None) => return Ok(None),
            Ok(Some(made)) => Kept::Made(folder, name.to_owned(), made),
        };
        // The original is removed next. What was found may be of an attempt that was killed before it came to this.
        if let Err(error) = sync_up(disk, above, input) {
            return match kept {
                Kept::Made(folder, name, made) => remove_made(&folder, &name, &made).and(Err(error)),
                Kept::Found => Err(error),
            };
        }
        return Ok(Some(kept));
    }
    Err(io::Error::new(ErrorKind::AlreadyExists, format!("{} and {MOST_COPIES} numbered names exist", escape(place))))
}

/// Brings to disk the names in a folder, and its own, and those of the folders above it that inputs have made.
fn sync_up<D: Disk>(disk: &D, folder: &Path, input: &Processed) -> io::Result<()> {
    let (mut top, mut below) = (folder, PathBuf::new());
    for _ in input.name.parent().into_iter().flat_map(Path::components) {
        let (Some(above), Some(name)) = (top.parent(), top.file_name()) else { break };
        below = Path::new(name).join(below);
        top = above;
    }
    disk::sync_down(disk, top, &below).map_err(|(_, error)| error)?;
    disk::sync_name(disk, top)
}

/// Puts a second name of the file, or where that cannot be a copy, into a folder, if nothing has that name. None: it is
/// not what was processed, and nothing is left there.
fn put_in_free_place<F: Folder>(
    input: &Processed,
    source: &Source<F>,
    folder: &F,
    name: &OsStr,
) -> io::Result<Option<Stat>> {
    match source.folder.link(source.name, folder, name) {
        Ok(()) => {}
        Err(error) if error.kind() == ErrorKind::AlreadyExists => return Err(error),
        Err(_) => return copy_to_free_place(input, &source.file, folder, name),
    }
    match folder.stat_of(name) {
        Ok(made) if made.is_file() && Fingerprint::of_stat(&made).is_renamed(input.look) => Ok(Some(made)),
        // The name is not looked at again: what it was given to a moment ago is known by it only.
        not_it => folder.unlink(name).and(not_it.map(|_| None)),
    }
}

/// Copies what was opened, wherever its name leads by now.
fn copy_to_free_place<F: Folder>(
    input: &Processed,
    from: &F::File,
    folder: &F,
    name: &OsStr,
) -> io::Result<Option<Stat>> {
    let (hidden, copy) = disk::make_unique(HOLDING, |hidden| folder.make_file(hidden, 0o600))?;
    let put = match fill(input, from, &copy) {
        Ok(true) => disk::rename_to_free(folder, &hidden, folder, name).map(|()| true),
        not_it => not_it,
    };
    if !matches!(put, Ok(true)) {
        let _ = folder.unlink(&hidden);
        return put.map(|_| None);
    }
    let set = open_up(folder, &copy, from);
    let made = copy.stat()?;
    match set {
        Ok(()) => Ok(Some(made)),
        Err(error) => remove_made(folder, name, &made).and(Err(error)),
    }
}

/// Gives a copy its permissions. Its name comes to disk before: under the hidden one that it had until now, it is known by
/// the permissions that it has (see `holding::clear`).
fn open_up<F: Folder>(folder: &F, copy: &F::File, from: &F::File) -> io::Result<()> {
    folder.sync()?;
    copy.set_mode(from.stat()?.mode_of_copy())?;
    copy.sync()
}

/// Fills a copy; whether it is what was processed.
fn fill<F: File>(input: &Processed, from: &F, to: &F) -> io::Result<bool> {
    let original = from.stat()?;
    if !Fingerprint::of_stat(&original).is_renamed(input.look)
        || copy(from, input, |bytes| to.append(bytes))? != input.hash
    {
        return Ok(false);
    }
    to.set_time(original.modified)?;
    to.sync()?;
    Ok(true)
}

/// Whether a regular file with the content of the input has this name, perhaps from an earlier attempt; then it is on
/// disk. One of another user does not count, who could change it later.
fn has_content<F: Folder>(input: &Processed, source: &Source<F>, folder: &F, name: &OsStr) -> io::Result<bool> {
    let file = match folder.open_file(name) {
        // It is gone again, or may not be read.
        Err(OpenError::Io(error)) if [ErrorKind::NotFound, ErrorKind::PermissionDenied].contains(&error.kind()) => {
            return Ok(false);
        }
        Err(OpenError::Io(error)) => return Err(error),
        Err(_) => return Ok(false),
        Ok(file) => file,
    };
    let (found, owner) = (file.stat()?, source.file.stat()?.owner);
    let is_alike = found.bytes == input.look.bytes && [owner, geteuid().as_raw()].contains(&found.owner);
    if !is_alike || hash_of(&file, input)? != input.hash {
        return Ok(false);
    }
    file.sync().map(|()| true)
}

/// `part.stl` becomes `part.2.stl`; a name too long for that is cut.
fn numbered(place: &Path, number: u32) -> PathBuf {
    let mut name = place.file_stem().unwrap_or_default().to_owned();
    if name.len() > LONGEST_STEM {
        name = name.to_string_lossy().chars().take(LONGEST_STEM / 4).collect::<String>().into();
    }
    name.push(format!(".{number}"));
    if let Some(extension) = place.extension() {
        name.push(".");
        name.push(extension);
    }
    place.with_file_name(name)
}

#[cfg(test)]
mod tests;
