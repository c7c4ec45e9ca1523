//! Whether somebody has a file open for writing.
//!
//! Linux grants a lease for reading only on a file that nobody has open for writing, and tells so at once; a mapping that
//! is shared and writable counts as long as it is there, even where its file was closed. It asks for no more rights than
//! that the file is one's own, or the capability `CAP_LEASE`. No crate that is kept up offers this call: it is the only
//! one in planish that the compiler does not check.

use std::fs::File;
use std::io;

/// Chooses the signal that tells of what becomes of a lease (`include/uapi/asm-generic/fcntl.h`).
#[cfg(target_os = "linux")]
const F_SETSIG: i32 = 10;

/// Whether somebody has `file`, which is open for reading only, open for writing, here or in another process. None: the
/// system cannot tell, as for the files of other users, and on file systems in a network.
///
/// # Errors
/// Those of the system that say nothing about leases.
#[cfg(target_os = "linux")]
pub fn has_writer(file: &File) -> io::Result<Option<bool>> {
    use rustix::io::Errno;
    // Somebody may open the file while the lease is held: the signal that tells so must not end the program, as the one
    // that is sent by default does. This one is ignored where nobody listens.
    control(file, F_SETSIG, libc::SIGURG)?;
    match control(file, libc::F_SETLEASE, libc::F_RDLCK) {
        // Given back at once: who opens the file to write to it must not be kept waiting.
        Ok(()) => control(file, libc::F_SETLEASE, libc::F_UNLCK).map(|()| Some(false)),
        Err(error) => match Errno::from_io_error(&error) {
            Some(Errno::AGAIN) if is_in_network(file)? => Ok(None),
            Some(Errno::AGAIN) => Ok(Some(true)),
            Some(Errno::ACCESS | Errno::PERM | Errno::INVAL | Errno::NOSYS | Errno::OPNOTSUPP | Errno::NOLCK) => {
                Ok(None)
            }
            _ => Err(error),
        },
    }
}

/// Whether a file is on a file system that refuses leases in the same way where nobody has the file open: its server did
/// not lend the file to this machine.
#[cfg(target_os = "linux")]
fn is_in_network(file: &File) -> io::Result<bool> {
    // NFS, SMB and CIFS, Ceph, AFS, Lustre, OCFS2, 9P and whatever is behind FUSE (linux/magic.h).
    const NETWORKS: [i128; 10] = [
        0x6969,
        0x517b,
        0xff53_4d42,
        0xfe53_4d42,
        0x00c3_6400,
        0x5346_414f,
        0x0bd0_0bd0,
        0x7461_636f,
        0x0102_1997,
        0x6573_5546,
    ];
    let kind = i128::from(rustix::fs::fstatfs(file)?.f_type) & 0xffff_ffff;
    Ok(NETWORKS.contains(&kind))
}

/// Whether somebody has `file` open for writing: this system cannot tell.
///
/// # Errors
/// None.
#[cfg(not(target_os = "linux"))]
pub fn has_writer(_file: &File) -> io::Result<Option<bool>> {
    Ok(None)
}

#[cfg(target_os = "linux")]
#[expect(unsafe_code, reason = "no safe crate offers leases")]
fn control(file: &File, command: i32, argument: i32) -> io::Result<()> {
    use std::os::fd::AsRawFd;
    // SAFETY: the descriptor is open as long as `file` is borrowed; `F_SETLEASE` and `F_SETSIG`, the only commands given
    // here, take an integer, and neither read nor write memory of this process.
    let done = unsafe { libc::fcntl(file.as_raw_fd(), command, argument) };
    if done == -1 { Err(io::Error::last_os_error()) } else { Ok(()) }
}

#[cfg(all(test, target_os = "linux"))]
mod tests {
    use super::*;

    #[test]
    fn a_file_has_a_writer_as_long_as_somebody_has_it_open_for_writing() {
        let folder = tempfile::tempdir().expect("a folder");
        let path = folder.path().join("a.stl");
        std::fs::write(&path, "content").expect("written");
        let reader = File::open(&path).expect("there");
        if has_writer(&reader).expect("asked").is_none() {
            eprintln!("skipped: this file system knows no leases");
            return;
        }
        assert_eq!(has_writer(&reader).expect("asked"), Some(false));
        let another_reader = File::open(&path).expect("there");
        assert_eq!(has_writer(&reader).expect("asked"), Some(false), "readers are none");
        let writer = File::options().append(true).open(&path).expect("there");
        assert_eq!(has_writer(&reader).expect("asked"), Some(true));
        assert_eq!(has_writer(&another_reader).expect("asked"), Some(true));
        drop(writer);
        assert_eq!(has_writer(&reader).expect("asked"), Some(false));
        // The lease is given back: it keeps nobody waiting.
        File::options().append(true).open(&path).expect("at once");
    }
}
