//! How much room the disk of the results has, and whether that is enough to take inputs up.
//!
//! What is on its way goes on, whatever the room: its result is kept in memory or in staging where it cannot be written.

use bytesize::ByteSize;
use std::path::Path;

/// The room on the file system of `path`, in bytes, for who has no privileges; none where the system does not tell.
pub fn free(path: &Path) -> Option<u64> {
    let told = rustix::fs::statvfs(path).ok()?;
    Some(told.f_bavail.saturating_mul(told.f_frsize))
}

/// Why no input is taken up, where at least `least` bytes are to be `free`; none: there is room, or nobody knows.
pub fn too_little(free: Option<u64>, least: u64) -> Option<String> {
    let free = free.filter(|free| *free < least)?;
    let [free, least] = [free, least].map(ByteSize::b);
    Some(format!(
        "the disk of the results has {free} left, less than {least}: no input is taken up before it has more; make room, or \
         lower min-free"
    ))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn there_is_room_or_too_little_or_nobody_knows() {
        assert!(free(std::env::temp_dir().as_path()).is_some() && free("/no/such/folder".as_ref()).is_none());
        let told = too_little(Some(1 << 20), 1 << 30).expect("too little");
        assert!(told.contains("1.0 MiB left, less than 1.0 GiB"), "{told}");
        let enough = [(Some(1 << 30), 1 << 30), (Some(0), 0), (None, u64::MAX)];
        assert!(enough.into_iter().all(|(free, least)| too_little(free, least).is_none()));
    }
}
