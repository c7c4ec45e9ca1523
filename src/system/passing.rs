//! Failures that pass: which errors of the system are tried again, and when.
//!
//! A disk that has a moment of weakness, a file server that starts anew, a limit of handles or memory that others have used
//! up: none of these says anything about an input or a result. They are waited out, in steps that grow, so that a failure
//! that lasts costs next to nothing. Errors that tell what stands in the way are lasting: until somebody acts, trying
//! again is noise.

use rustix::io::Errno;
use std::io;
use std::time::Duration;

/// The first step.
const FIRST: Duration = Duration::from_secs(1);

/// No step is longer.
const LONGEST: Duration = Duration::from_secs(600);

/// Errors of a system in trouble: by themselves they come to an end.
const PASSING: [Errno; 20] = [
    Errno::IO,
    Errno::STALE,
    Errno::MFILE,
    Errno::NFILE,
    Errno::NOMEM,
    Errno::TIMEDOUT,
    Errno::AGAIN,
    Errno::INTR,
    Errno::BUSY,
    Errno::NOSPC,
    Errno::DQUOT,
    Errno::NOBUFS,
    Errno::NOLCK,
    Errno::NETDOWN,
    Errno::NETUNREACH,
    Errno::HOSTDOWN,
    Errno::HOSTUNREACH,
    Errno::CONNRESET,
    Errno::NOTCONN,
    Errno::SHUTDOWN,
];

/// Errors that name what stands in the way of a file: a place on another disk, another type, a name that is too long.
const LASTING: [Errno; 7] =
    [Errno::XDEV, Errno::NOTDIR, Errno::ISDIR, Errno::NAMETOOLONG, Errno::LOOP, Errno::FBIG, Errno::OPNOTSUPP];

/// Whether an error says something about the state of the machine only, and not about the file.
///
/// ```
/// use planish::system::passing::{lasts, passes};
/// use std::io::Error;
///
/// let no_space = Error::from(rustix::io::Errno::NOSPC);
/// assert!(passes(&no_space) && !lasts(&no_space));
/// let too_long = Error::from(rustix::io::Errno::NAMETOOLONG);
/// assert!(!passes(&too_long) && lasts(&too_long));
/// // Neither: somebody may mend permissions at any moment, and nothing tells that they did.
/// let denied = Error::from(rustix::io::Errno::ACCESS);
/// assert!(!passes(&denied) && !lasts(&denied));
/// ```
pub fn passes(error: &io::Error) -> bool {
    is_of(error, &PASSING) || error.kind() == io::ErrorKind::OutOfMemory
}

/// Whether an error stays as long as nobody changes what is at the place. Permissions and the like are none of these:
/// nothing tells when somebody has mended them.
pub fn lasts(error: &io::Error) -> bool {
    is_of(error, &LASTING)
}

fn is_of(error: &io::Error, errors: &[Errno]) -> bool {
    Errno::from_io_error(error).is_some_and(|errno| errors.contains(&errno))
}

/// How long to wait after so many failures in a row; 1 is the first.
///
/// ```
/// use planish::system::passing::pause;
///
/// let seconds = [1, 2, 3, 4, 10, 11, 1000].map(|failures| pause(failures).as_secs());
/// assert_eq!(seconds, [1, 2, 4, 8, 512, 600, 600]);
/// ```
pub fn pause(failures: u32) -> Duration {
    FIRST.saturating_mul(1 << failures.saturating_sub(1).min(10)).min(LONGEST)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn trouble_passes_and_obstacles_last() {
        let error = |errno: Errno| io::Error::from(errno);
        for errno in PASSING {
            assert!(passes(&error(errno)) && !lasts(&error(errno)), "{errno}");
        }
        for errno in LASTING {
            assert!(lasts(&error(errno)) && !passes(&error(errno)), "{errno}");
        }
        // Neither: a refusal of an input at once, tried again where a result is to be written.
        for errno in [Errno::ACCESS, Errno::NOENT, Errno::PERM] {
            assert!(!lasts(&error(errno)) && !passes(&error(errno)), "{errno}");
        }
        assert!(!passes(&io::Error::other("no error of the system")));
    }

    #[test]
    fn steps_grow_and_do_not_grow_for_ever() {
        let seconds: Vec<u64> = [1, 2, 3, 10, 11, 12, 1000, u32::MAX].map(|n| pause(n).as_secs()).into();
        assert_eq!(seconds, [1, 2, 4, 512, 600, 600, 600, 600]);
    }
}
