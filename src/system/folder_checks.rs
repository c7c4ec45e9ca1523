//! Where folders lie to each other.

use crate::system::escape::escape;
use std::io;
use std::path::{Path, PathBuf};

/// A folder with what it is for.
#[derive(Clone, Copy, Debug)]
pub struct FolderRole<'a> {
    role: &'static str,
    path: &'a Path,
}

impl<'a> FolderRole<'a> {
    /// The folder `path`, which need not be there yet.
    pub fn new(role: &'static str, path: &'a Path) -> Self {
        Self { role, path }
    }
}

/// Why folders are refused: wrong usage.
#[derive(Debug, thiserror::Error)]
pub enum FolderError {
    /// One lies in the other.
    #[error(
        "the {} {} and the {} {} lie in each other: what is written to one would be taken for what is dropped into the \
         other; use two separate folders", .0.0, escape(&.0.1), .1.0, escape(&.1.1)
    )]
    Nested((&'static str, PathBuf), (&'static str, PathBuf)),
    /// A path leads nowhere.
    #[error("the {role} {}: {error}", escape(.path))]
    Unknown {
        /// What the folder is for.
        role: &'static str,
        /// The folder.
        path: PathBuf,
        /// Why.
        error: io::Error,
    },
}

/// Refuses folders of which one lies in another, by whatever links or relative paths they are named.
///
/// # Errors
/// [`FolderError`].
pub fn refuse_nested(places: &[FolderRole]) -> Result<(), FolderError> {
    let mut paths = Vec::new();
    for FolderRole { role, path } in places.iter().copied() {
        let real = resolved(path).map_err(|error| FolderError::Unknown { role, path: path.to_owned(), error })?;
        paths.push(real);
    }
    for (i, inner) in paths.iter().enumerate() {
        for (j, outer) in paths.iter().enumerate() {
            if i != j && inner.starts_with(outer) {
                let [inner, outer] = [i, j].map(|k| (places[k].role, places[k].path.to_owned()));
                return Err(FolderError::Nested(inner, outer));
            }
        }
    }
    Ok(())
}

/// The absolute path without links, of a folder that need not be there yet: then that of the first folder above it
/// that is.
fn resolved(path: &Path) -> io::Result<PathBuf> {
    let absolute = std::path::absolute(path)?;
    for there in absolute.ancestors() {
        match there.canonicalize() {
            Ok(real) => return Ok(real.join(absolute.strip_prefix(there).unwrap_or(Path::new("")))),
            Err(e) if e.kind() == io::ErrorKind::NotFound => {}
            Err(e) => return Err(e),
        }
    }
    Ok(absolute)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn nested(a: &Path, b: &Path) -> bool {
        matches!(
            refuse_nested(&[FolderRole::new("inbox", a), FolderRole::new("output folder", b)]),
            Err(FolderError::Nested(..))
        )
    }

    #[test]
    fn folders_in_each_other_are_found_by_any_name() {
        let folder = tempfile::tempdir().expect("a folder");
        let path = |name: &str| folder.path().join(name);
        std::fs::create_dir_all(path("in/sub")).expect("made");
        assert!(
            nested(&path("in"), &path("in"))
                && nested(&path("in"), &path("in/sub"))
                && nested(&path("in/sub"), &path("in"))
        );
        assert!(nested(&path("in"), &path("in/new/deeper")) && nested(&path("in"), &path("in/sub/../out")));
        assert!(!nested(&path("in"), &path("out")) && !nested(&path("in"), &path("in2")));
        #[cfg(unix)]
        {
            std::os::unix::fs::symlink(path("in/sub"), path("link")).expect("linked");
            assert!(nested(&path("in"), &path("link/out")));
        }
    }
}
