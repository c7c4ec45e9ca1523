//! What a look at a file shows: enough to tell whether it changed since.

use crate::system::disk::Stat;
use serde::{Deserialize, Serialize};
use std::fs::Metadata;
use std::io;
use std::path::Path;

/// What a look at a regular file shows. Two looks differ where the file was written to, or another one took its name.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Fingerprint {
    /// Its size in bytes.
    pub bytes: u64,
    identity: Identity,
    times: [(i64, i64); 2],
}

/// Which file or folder it is, whatever its name.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Identity([u64; 2]);

impl Identity {
    /// By the numbers of its device and of itself on that.
    pub fn new(device: u64, number: u64) -> Self {
        Self([device, number])
    }

    /// The number of the device that it is on.
    pub fn device(self) -> u64 {
        self.0[0]
    }

    /// Its number on its device.
    pub fn number(self) -> u64 {
        self.0[1]
    }

    /// By what the system says of it.
    #[cfg(unix)]
    pub fn of(metadata: &Metadata) -> Self {
        use std::os::unix::fs::MetadataExt;
        Self([metadata.dev(), metadata.ino()])
    }

    /// By what the system says of it: here, when it was made.
    #[cfg(not(unix))]
    pub fn of(metadata: &Metadata) -> Self {
        let since = metadata.created().ok().and_then(|t| t.duration_since(std::time::UNIX_EPOCH).ok());
        Self(since.map_or([0; 2], |d| [d.as_secs(), u64::from(d.subsec_nanos())]))
    }
}

impl Fingerprint {
    /// Looks at a file.
    ///
    /// # Errors
    /// Where it cannot be looked at. None in the result: it is no regular file.
    pub fn at(path: &Path) -> io::Result<Option<Self>> {
        let metadata = std::fs::metadata(path)?;
        Ok(metadata.is_file().then(|| Self::of(&metadata)))
    }

    /// What the system says of a file. The time of its last change of state counts, too: copying tools set the other
    /// one back.
    #[cfg(unix)]
    pub fn of(metadata: &Metadata) -> Self {
        use std::os::unix::fs::MetadataExt;
        let times = [(metadata.mtime(), metadata.mtime_nsec()), (metadata.ctime(), metadata.ctime_nsec())];
        Self { bytes: metadata.len(), identity: Identity::of(metadata), times }
    }

    /// What the system says of a file.
    #[cfg(not(unix))]
    pub fn of(metadata: &Metadata) -> Self {
        let since = metadata.modified().ok().and_then(|t| t.duration_since(std::time::UNIX_EPOCH).ok());
        let modified = since.map_or((0, 0), |d| (d.as_secs() as i64, i64::from(d.subsec_nanos())));
        Self { bytes: metadata.len(), identity: Identity::of(metadata), times: [modified; 2] }
    }

    /// What a look through [`crate::system::disk`] shows.
    pub fn of_stat(stat: &Stat) -> Self {
        Self { bytes: stat.bytes, identity: stat.identity, times: [stat.modified, stat.changed] }
    }

    /// Whether this is the same file with the same content, perhaps under another name: a rename changes nothing else.
    ///
    /// ```
    /// use planish::system::fingerprint::Fingerprint;
    ///
    /// # fn main() -> std::io::Result<()> {
    /// let folder = tempfile::tempdir()?;
    /// let (old, new) = (folder.path().join("a.stl"), folder.path().join("b.stl"));
    /// std::fs::write(&old, "solid")?;
    /// let before = Fingerprint::at(&old)?.expect("a regular file");
    /// std::fs::rename(&old, &new)?;
    /// assert!(before.is_renamed(&Fingerprint::at(&new)?.expect("a regular file")));
    /// std::fs::write(&new, "solid cube")?;
    /// assert!(!before.is_renamed(&Fingerprint::at(&new)?.expect("a regular file")));
    /// # Ok(())
    /// # }
    /// ```
    pub fn is_renamed(&self, other: &Self) -> bool {
        (self.bytes, self.identity, self.times[0]) == (other.bytes, other.identity, other.times[0])
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn writing_and_replacing_show() {
        let folder = tempfile::tempdir().expect("a folder");
        let [path, other] = ["a.stl", "b.stl"].map(|n| folder.path().join(n));
        std::fs::write(&path, "one").expect("written");
        let first = Fingerprint::at(&path).expect("there").expect("a file");
        assert_eq!(Fingerprint::at(&path).expect("there"), Some(first));
        std::fs::write(&path, "three").expect("written");
        let second = Fingerprint::at(&path).expect("there").expect("a file");
        assert_ne!(first, second);
        std::fs::write(&other, "three").expect("written");
        std::fs::rename(&other, &path).expect("renamed");
        let third = Fingerprint::at(&path).expect("there").expect("a file");
        assert!(!second.is_renamed(&third) && third.bytes == 5);
        std::fs::rename(&path, &other).expect("renamed");
        assert!(third.is_renamed(&Fingerprint::at(&other).expect("there").expect("a file")));
        assert_eq!(Fingerprint::at(folder.path()).expect("there"), None);
        assert!(Fingerprint::at(&path).is_err());
    }
}
