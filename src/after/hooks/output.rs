//! What a command prints: read as it comes, and never waited for.
//!
//! Of each output the last 64 KiB are kept and the rest is counted only: however much a command prints, it takes no
//! disk, and no more memory than that. The pipes are read whenever there is something in them, so that no command waits
//! for planish; and they are closed when the command is over, whoever still has the other end. So a child that it left
//! behind keeps nobody waiting, and what that prints from then on goes nowhere: it is sent SIGPIPE.

use rustix::event::{PollFd, PollFlags, Timespec, poll};
use rustix::fd::OwnedFd;
use rustix::io::{Errno, ioctl_fionbio, ioctl_fionread};
use std::fs::File;
use std::io::{self, ErrorKind, Read};
use std::process::Child;
use std::time::Duration;

/// This much of the end of an output is kept, in bytes.
pub const TAIL: usize = 64 << 10;

/// This much is read at once, in bytes: what a pipe holds.
const CHUNK: usize = 64 << 10;

/// The end of an output.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Tail {
    /// The text; what is no UTF-8 is replaced.
    pub text: String,
    /// Whether something before it is missing.
    pub truncated: bool,
}

/// Standard output and standard error of a command.
#[derive(Default)]
pub struct Outputs {
    stdout: Output,
    stderr: Output,
}

impl Outputs {
    /// Takes the pipes of a process that was started with them.
    pub fn take(&mut self, child: &mut Child) -> io::Result<()> {
        self.stdout = Output::of(child.stdout.take().map(OwnedFd::from))?;
        self.stderr = Output::of(child.stderr.take().map(OwnedFd::from))?;
        Ok(())
    }

    /// Waits until something is printed, but no longer than `time`, and reads some of it.
    pub fn wait(&mut self, time: Duration) -> io::Result<()> {
        let time = Timespec { tv_sec: time.as_secs() as i64, tv_nsec: time.subsec_nanos().into() };
        let open = [&self.stdout, &self.stderr].into_iter().filter_map(|output| output.pipe.as_ref());
        let mut open: Vec<PollFd> = open.map(|pipe| PollFd::new(pipe, PollFlags::IN)).collect();
        match poll(&mut open, Some(&time)) {
            Err(error) if error != Errno::INTR => return Err(error.into()),
            _ => {}
        }
        self.stdout.read()?;
        self.stderr.read()
    }

    /// Reads what is in the pipes at this moment, and nothing that comes later: that may be without end.
    pub fn read_rest(&mut self) -> io::Result<()> {
        self.stdout.read_rest()?;
        self.stderr.read_rest()
    }

    /// How much was printed on the one on which more was, in bytes.
    pub fn longest(&self) -> u64 {
        self.stdout.bytes.max(self.stderr.bytes)
    }

    /// Closes the pipes; the ends of standard output and standard error.
    pub fn close(self) -> (Tail, Tail) {
        (self.stdout.tail(), self.stderr.tail())
    }
}

/// An output of a command.
#[derive(Default)]
struct Output {
    /// Our end of the pipe; none once the other ends are closed.
    pipe: Option<File>,
    kept: Vec<u8>,
    bytes: u64,
}

impl Output {
    fn of(pipe: Option<OwnedFd>) -> io::Result<Self> {
        if let Some(pipe) = &pipe {
            // For our end only: who writes to the other one is not concerned.
            ioctl_fionbio(pipe, true)?;
        }
        Ok(Self { pipe: pipe.map(File::from), ..Self::default() })
    }

    /// Reads some of what there is, without waiting.
    fn read(&mut self) -> io::Result<()> {
        let Some(pipe) = &mut self.pipe else { return Ok(()) };
        let mut chunk = [0; CHUNK];
        match pipe.read(&mut chunk) {
            Ok(0) => self.pipe = None,
            Ok(read) => self.keep(&chunk[..read]),
            Err(error) if matches!(error.kind(), ErrorKind::WouldBlock | ErrorKind::Interrupted) => {}
            Err(error) => return Err(error),
        }
        Ok(())
    }

    fn read_rest(&mut self) -> io::Result<()> {
        let Some(pipe) = &self.pipe else { return Ok(()) };
        let all = self.bytes + ioctl_fionread(pipe)?;
        while self.pipe.is_some() && self.bytes < all {
            self.read()?;
        }
        Ok(())
    }

    fn keep(&mut self, chunk: &[u8]) {
        self.bytes += chunk.len() as u64;
        self.kept.extend_from_slice(chunk);
        self.kept.drain(..self.kept.len().saturating_sub(TAIL));
    }

    /// The end of the output, cut between characters where it is text.
    fn tail(self) -> Tail {
        let truncated = self.bytes > self.kept.len() as u64;
        let mut cut = 0;
        if truncated {
            // The bytes of a character behind its first one, of which there are three at most, begin with the bits 10.
            cut = self.kept.iter().take(3).take_while(|byte| **byte & 0xC0 == 0x80).count();
        }
        Tail { text: String::from_utf8_lossy(&self.kept[cut..]).into_owned(), truncated }
    }
}
