//! Which files in a result are planish's: those that its report names, some of them in folders of their own.

use crate::report::Output;
use crate::result_files;
use crate::system::disk::{self, File, Folder};
use crate::system::safe_open::OpenError;
use std::collections::{BTreeMap, BTreeSet};
use std::ffi::{OsStr, OsString};
use std::io::{self, ErrorKind};
use std::path::{Component, Path};

/// The files of planish in a result, by name; those in folders that it made, by folder.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Listed {
    files: BTreeSet<OsString>,
    folders: BTreeMap<OsString, BTreeSet<OsString>>,
}

impl Listed {
    /// Those that a report names, and those beside it. A report may say anything: only names are taken from it, and ways to
    /// folders of the result, no ways to others.
    pub fn of(outputs: Vec<Output>) -> Self {
        let mut listed = Self { files: result_files::BESIDE_OUTPUTS.map(OsString::from).into(), ..Self::default() };
        for output in outputs {
            match place(&output.file) {
                Some((None, name)) => {
                    listed.files.insert(name.to_owned());
                }
                Some((Some(folder), name)) => {
                    listed.folders.entry(folder.to_owned()).or_default().insert(name.to_owned());
                }
                None => {}
            }
        }
        listed
    }

    /// The files in the result folder itself, in their order.
    pub fn files(&self) -> impl Iterator<Item = &OsString> {
        self.files.iter()
    }

    /// The folders that planish made, with its files in each.
    pub fn folders(&self) -> impl Iterator<Item = (&OsString, Self)> {
        self.folders.iter().map(|(name, files)| (name, Self::inside(files)))
    }

    /// Whether the file of this name, in the result folder itself, is planish's.
    pub fn has(&self, name: &OsStr) -> bool {
        self.files.contains(name)
    }

    /// The files of planish in the folder of this name; none where that is not its own.
    pub fn folder(&self, name: &OsStr) -> Option<Self> {
        self.folders.get(name).map(Self::inside)
    }

    /// Whether a folder holds nothing else.
    ///
    /// # Errors
    /// The folder cannot be read.
    pub fn is_all_of<F: Folder>(&self, folder: &F) -> io::Result<bool> {
        for name in folder.list()? {
            let is_known = match self.folder(&name) {
                Some(inside) if folder.stat_of(&name)?.is_folder() => inside.is_all_of(&folder.open_folder(&name)?)?,
                _ => self.has(&name),
            };
            if !is_known {
                return Ok(false);
            }
        }
        Ok(true)
    }

    /// Removes what planish wrote, but for this file. What has been replaced by a folder stays.
    ///
    /// # Errors
    /// The system refuses; some of it may be gone then.
    pub fn remove<F: Folder>(&self, folder: &F, but: &str) -> io::Result<()> {
        for (name, inside) in self.folders() {
            let opened = match folder.open_folder(name) {
                Err(error) if error.kind() == ErrorKind::NotFound || disk::is_no_folder(&error) => continue,
                opened => opened?,
            };
            inside.remove(&opened, but)?;
            match folder.remove_folder(name) {
                Err(error) if error.kind() != ErrorKind::NotFound && !disk::is_full(&error) => return Err(error),
                // What is not planish's keeps the folder.
                Ok(()) | Err(_) => {}
            }
        }
        for file in self.files().filter(|file| *file != but) {
            match folder.stat_of(file) {
                Err(error) if error.kind() == ErrorKind::NotFound => {}
                // A folder of that name is somebody else's.
                Ok(found) if found.is_folder() => {}
                found => found.and_then(|_| folder.unlink(file))?,
            }
        }
        Ok(())
    }

    fn inside(files: &BTreeSet<OsString>) -> Self {
        Self { files: files.clone(), folders: BTreeMap::new() }
    }
}

/// The folder, if any, and the name that a report gives to a file; none where that leads elsewhere than into the result.
pub fn place(file: &str) -> Option<(Option<&OsStr>, &OsStr)> {
    let mut parts = Path::new(file).components();
    match (parts.next(), parts.next(), parts.next()) {
        (Some(Component::Normal(name)), None, None) => Some((None, name)),
        (Some(Component::Normal(folder)), Some(Component::Normal(name)), None) => Some((Some(folder), name)),
        _ => None,
    }
}

/// Opens a file of a result, which may lie in a folder there.
///
/// # Errors
/// [`OpenError`]; a name that leads elsewhere is no regular file.
pub fn open_file<F: Folder>(result: &F, file: &str) -> Result<F::File, OpenError> {
    match place(file) {
        Some((None, name)) => result.follow_file(name),
        Some((Some(folder), name)) => result.open_folder(folder)?.follow_file(name),
        None => Err(OpenError::NotRegular),
    }
}

/// Writes the files of a result, and brings them to disk.
///
/// # Errors
/// Those of the system.
pub fn write_all<F: Folder>(result: &F, files: &[(String, Vec<u8>)]) -> io::Result<()> {
    let mut folders: BTreeMap<&OsStr, F> = BTreeMap::new();
    for (file, bytes) in files {
        let (folder, name) = place(file).ok_or_else(|| io::Error::other(format!("{file} is no name in a result")))?;
        let to = match folder {
            None => result,
            Some(folder) => {
                if !folders.contains_key(folder) {
                    result.make_folder(folder, disk::OPEN_FOLDER)?;
                    folders.insert(folder, result.open_folder(folder)?);
                }
                &folders[folder]
            }
        };
        let file = to.make_file(name, disk::OPEN_FILE)?;
        file.append(bytes)?;
        file.sync()?;
    }
    folders.values().try_for_each(Folder::sync)?;
    result.sync()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::system::disk::{Disk, System};
    use std::fs;

    fn listed(files: &[&str]) -> Listed {
        Listed::of(files.iter().map(|file| Output::of(file, b"x")).collect())
    }

    #[test]
    fn names_lead_into_the_result_and_nowhere_else() {
        let all = listed(&["a.vtu", "mmg/b.mesh", "../c", "/d", "mmg/../e", "f/g/h", ""]);
        assert!(all.has("a.vtu".as_ref()) && all.has("report.json".as_ref()) && !all.has("c".as_ref()));
        let folders: Vec<_> = all.folders().map(|(name, inside)| (name.clone(), inside.files().count())).collect();
        assert_eq!(folders, [("mmg".into(), 1)]);
        assert_eq!([place("a/.."), place("."), place("a/b/c")], [None; 3]);
    }

    #[test]
    fn what_is_written_is_found_and_removed_and_what_is_foreign_stays() {
        let place = tempfile::tempdir().expect("a folder");
        let folder = System.open(place.path()).expect("there");
        let content = |name: &str| (name.to_owned(), name.as_bytes().to_vec());
        write_all(&folder, &[content("a.vtu"), content("mmg/b.mesh"), content("mmg/c.sol")]).expect("written");
        assert!(open_file(&folder, "mmg/c.sol").is_ok() && open_file(&folder, "mmg/../a.vtu").is_err());
        let own = listed(&["a.vtu", "mmg/b.mesh", "mmg/c.sol"]);
        assert!(
            own.is_all_of(&folder).expect("read")
                && !listed(&["a.vtu", "mmg/b.mesh"]).is_all_of(&folder).expect("read")
        );
        fs::write(place.path().join("mmg/mine.mesh"), "mine").expect("written");
        assert!(!own.is_all_of(&folder).expect("read"));
        own.remove(&folder, "report.json").expect("removed");
        let left: Vec<_> =
            fs::read_dir(place.path().join("mmg")).expect("stays").flatten().map(|e| e.file_name()).collect();
        assert_eq!((left, place.path().join("a.vtu").exists()), (vec![OsString::from("mine.mesh")], false));
        assert!(write_all(&folder, &[content("../out")]).is_err());
    }
}
