//! Which files a command is about.

use crate::formats::{Kind, kind};
use crate::input::job::Job;
use crate::system::escape::escape;
use std::path::{Path, PathBuf};

/// Why inputs are refused as a whole: wrong usage.
#[derive(Debug, thiserror::Error)]
pub enum InputError {
    /// A folder cannot be listed.
    #[error("cannot list {}: {error}", escape(.path))]
    Unreadable {
        /// The path.
        path: PathBuf,
        /// Why.
        error: std::io::Error,
    },
    /// A folder holds no mesh.
    #[error("the folder {} holds no mesh file; name a file or another folder", escape(.0))]
    EmptyFolder(PathBuf),
    /// A path does not end in a name.
    #[error("{} does not name a file", escape(.0))]
    NoName(PathBuf),
    /// An input lies in the output folder itself.
    #[error("{} lies in the output folder, where its result would take its place; use another output folder", escape(.0))]
    InsideOut(PathBuf),
    /// Two inputs have the same name.
    #[error(
        "{} and {} have the same name, so that their results would overwrite each other; rename one, or use two output folders",
        escape(.0), escape(.1)
    )]
    SameName(PathBuf, PathBuf),
}

/// The jobs for files and folders: files as they are named, folders in the order of names. In folders, files that
/// hold no mesh (materials, pictures, hidden and temporary files, unknown extensions) are passed over.
///
/// # Errors
/// [`InputError`].
pub fn collect(inputs: &[PathBuf]) -> Result<Vec<Job>, InputError> {
    let mut jobs = Vec::new();
    for input in inputs {
        // A file that does not exist becomes a job too: it is refused, and the others are done all the same.
        if input.is_dir() {
            jobs.extend(folder(input)?);
        } else if input.file_name().is_some() {
            jobs.push(Job::of_file(input.clone()));
        } else {
            return Err(InputError::NoName(input.clone()));
        }
    }
    Ok(jobs)
}

/// Refuses two inputs of the same name: their results would have the same place.
///
/// # Errors
/// [`InputError::SameName`].
pub fn refuse_same_names(jobs: &[Job]) -> Result<(), InputError> {
    let mut by_name: Vec<&Job> = jobs.iter().collect();
    by_name.sort_by(|a, b| a.name.cmp(&b.name));
    match by_name.windows(2).find(|w| w[0].name == w[1].name) {
        Some(same) => Err(InputError::SameName(same[0].path.clone(), same[1].path.clone())),
        None => Ok(()),
    }
}

/// Refuses inputs that lie in the output folder itself: a result has the name of its input.
///
/// # Errors
/// [`InputError::InsideOut`].
pub fn refuse_inside(jobs: &[Job], out: &Path) -> Result<(), InputError> {
    let Ok(out) = out.canonicalize() else { return Ok(()) };
    let folder = |job: &Job| job.path.canonicalize().ok().and_then(|p| p.parent().map(Path::to_owned));
    match jobs.iter().find(|job| folder(job).is_some_and(|f| f == out)) {
        Some(job) => Err(InputError::InsideOut(job.path.clone())),
        None => Ok(()),
    }
}

fn unreadable(path: &Path) -> impl FnOnce(std::io::Error) -> InputError {
    let path = path.to_owned();
    move |error| InputError::Unreadable { path, error }
}

fn folder(path: &Path) -> Result<Vec<Job>, InputError> {
    let mut files = Vec::new();
    for entry in std::fs::read_dir(path).map_err(unreadable(path))? {
        let file = entry.map_err(unreadable(path))?.path();
        // What is no file, or a link that leads nowhere or out of the folder, becomes a job too: it is refused.
        let mesh = !file.is_dir() && matches!(kind(&file), Kind::Mesh(_) | Kind::OtherMesh(_));
        if mesh {
            files.push(file);
        } else {
            tracing::info!(file = escape(&file), "passed over: no mesh");
        }
    }
    if files.is_empty() {
        return Err(InputError::EmptyFolder(path.to_owned()));
    }
    files.sort();
    Ok(files.into_iter().map(|file| Job::of_folder(path, file)).collect())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn folders_give_their_meshes_in_order() {
        let folder = tempfile::tempdir().expect("a folder");
        for name in ["b.stl", "a.obj", "a.mtl", ".hidden.stl", "notes", "c.ply"] {
            std::fs::write(folder.path().join(name), "x").expect("written");
        }
        let jobs = collect(&[folder.path().to_owned()]).expect("meshes");
        let names: Vec<_> = jobs.iter().map(|j| j.name.display().to_string()).collect();
        assert_eq!(names, ["a.obj", "b.stl", "c.ply"]);
        let twice = [folder.path().to_owned(), folder.path().join("b.stl")];
        let jobs = collect(&twice).expect("meshes");
        assert!(matches!(refuse_same_names(&jobs), Err(InputError::SameName(..))));
        let none = tempfile::tempdir().expect("a folder");
        assert!(matches!(collect(&[none.path().to_owned()]), Err(InputError::EmptyFolder(_))));
        assert_eq!(collect(&[none.path().join("gone.stl")]).expect("a job, to be refused").len(), 1);
    }
}
