//! What the system tells of the work of this process and its children: their processor time, and whether they wait for a
//! disk. Where it does not tell (there is no `/proc`), there is none of either.

use rustix::time::{ClockId, clock_gettime};
use std::fs;
use std::path::Path;
use std::time::Duration;

/// Where the times of a process stand in its `stat`, counted behind its name: its own in user and system mode, and those
/// of its children that have ended.
const TIMES: std::ops::Range<usize> = 11..15;

/// Where its state stands.
const STATE: usize = 0;

/// The processor time of this process and its children since the start, also of those that have ended.
pub fn processor() -> Duration {
    let mut all = 0;
    for child in children() {
        // One that is gone by now is among those that have ended, which are counted below.
        all += ticks(Path::new(&format!("/proc/{child}"))).unwrap_or(0);
    }
    all += ticks(Path::new("/proc/self")).unwrap_or(0);
    let per_second = rustix::param::clock_ticks_per_second().max(1);
    Duration::from_secs_f64(all as f64 / per_second as f64)
}

/// The processor time of the thread that asks.
pub fn processor_of_this_thread() -> Duration {
    let time = clock_gettime(ClockId::ThreadCPUTime);
    Duration::new(time.tv_sec.try_into().unwrap_or(0), time.tv_nsec.try_into().unwrap_or(0))
}

/// Whether a thread of this process or of its children sleeps and cannot be woken, as those do that wait for a disk or
/// for a file server.
pub fn waits_for_disk() -> bool {
    let of_children = children().into_iter().any(|child| has_waiting_thread(&format!("/proc/{child}/task")));
    of_children || has_waiting_thread("/proc/self/task")
}

/// Whether one of these threads, each of which has a folder in `tasks`, waits for a disk.
fn has_waiting_thread(tasks: &str) -> bool {
    // A process may end at any moment, and its folder with it: then nothing waits.
    let Ok(threads) = fs::read_dir(tasks) else { return false };
    for thread in threads.flatten() {
        // D: it sleeps and cannot be woken.
        if fields(&thread.path()).is_some_and(|fields| fields.get(STATE).is_some_and(|state| state == "D")) {
            return true;
        }
    }
    false
}

/// The numbers of the processes that this one has started.
fn children() -> Vec<u32> {
    let mut children = Vec::new();
    let Ok(threads) = fs::read_dir("/proc/self/task") else { return children };
    // Each thread tells of those that it has started itself.
    for thread in threads.flatten() {
        let Ok(list) = fs::read_to_string(thread.path().join("children")) else { continue };
        children.extend(list.split_whitespace().filter_map(|id| id.parse::<u32>().ok()));
    }
    children
}

/// The processor time of a process and of its children that have ended, in ticks of the clock.
fn ticks(process: &Path) -> Option<u64> {
    let fields = fields(process)?;
    let mut sum = 0;
    for ticks in fields.get(TIMES)? {
        sum += ticks.parse::<u64>().ok()?;
    }
    Some(sum)
}

/// What the system tells of a process or thread, behind its name, in which there may be anything.
fn fields(of: &Path) -> Option<Vec<String>> {
    let stat = fs::read(of.join("stat")).ok()?;
    let stat = String::from_utf8_lossy(&stat);
    let (_, fields) = stat.rsplit_once(')')?;
    Some(fields.split_whitespace().map(str::to_owned).collect())
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::process::{Command, Stdio};
    use std::time::Instant;

    /// Computes until the processor time has grown.
    fn grows(work: impl Fn()) -> bool {
        let (before, since) = (processor(), Instant::now());
        while processor() <= before {
            work();
            if since.elapsed() > Duration::from_secs(60) {
                return false;
            }
        }
        true
    }

    #[test]
    fn processor_time_is_that_of_this_process_and_of_its_children_that_run() {
        let own = processor_of_this_thread();
        assert!(grows(|| assert!((0..100_000_u64).map(std::hint::black_box).sum::<u64>() > 0)));
        assert!(processor_of_this_thread() > own);
        let mut child = Command::new("sh").args(["-c", "while :; do :; done"]).stdin(Stdio::null()).spawn();
        let child = child.as_mut().expect("a shell");
        let pid = child.id();
        assert!(children().contains(&pid));
        let (before, since) = (ticks(format!("/proc/{pid}").as_ref()), Instant::now());
        while ticks(format!("/proc/{pid}").as_ref()) <= before && since.elapsed() < Duration::from_secs(60) {
            std::thread::sleep(Duration::from_millis(10));
        }
        assert!(ticks(format!("/proc/{pid}").as_ref()) > before);
        child.kill().and_then(|()| child.wait()).expect("ended");
    }
}
