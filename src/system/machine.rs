//! What the machine, or the container in which this process runs, has.

use std::fs;
use std::path::{Path, PathBuf};

/// Where the system does not tell: that of a small machine. More than there is would end processes, less makes inputs wait.
const UNKNOWN: u64 = 2 << 30;

/// Where the system shows control groups.
const GROUPS: &str = "/sys/fs/cgroup";

/// The memory that there is for this process, in bytes: that of the machine, or less where a control group that it is in has
/// a limit.
pub fn memory() -> u64 {
    // A call, and no file: where only processes are shown below /proc, as in hardened services, files tell nothing.
    let told = rustix::system::sysinfo();
    let of_the_machine = (told.totalram as u64).saturating_mul(u64::from(told.mem_unit));
    let of_the_machine = if of_the_machine == 0 { UNKNOWN } else { of_the_machine };
    let groups = fs::read_to_string("/proc/self/cgroup").unwrap_or_default();
    limit_of_groups(&groups, Path::new(GROUPS)).map_or(of_the_machine, |limit| limit.min(of_the_machine))
}

/// The least limit of the control groups that a process is in, as `/proc/self/cgroup` tells them, and of those above them.
fn limit_of_groups(groups: &str, top: &Path) -> Option<u64> {
    let limits = groups.lines().filter_map(|line| file_of_group(line, top)).filter_map(|(folder, file)| {
        let above = folder.ancestors().take_while(|folder| folder.starts_with(top));
        above.filter_map(|folder| limit(&folder.join(file))).min()
    });
    limits.min()
}

/// The folder of a group that limits memory, and the file in it that tells the limit: `0::/path` is a group of the second
/// version of control groups, `7:memory:/path` one of the first.
fn file_of_group(line: &str, top: &Path) -> Option<(PathBuf, &'static str)> {
    let mut parts = line.splitn(3, ':').skip(1);
    let (kinds, path) = (parts.next()?, parts.next()?.trim_start_matches('/'));
    match kinds {
        "" => Some((top.join(path), "memory.max")),
        kinds if kinds.split(',').any(|kind| kind == "memory") => {
            Some((top.join("memory").join(path), "memory.limit_in_bytes"))
        }
        _ => None,
    }
}

/// A limit in bytes; none where there is no such file, or no number in it ("max").
fn limit(file: &Path) -> Option<u64> {
    fs::read_to_string(file).ok()?.trim().parse().ok()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn there_is_memory() {
        assert!(memory() > 64 << 20, "{}", memory());
    }

    #[test]
    fn the_least_limit_on_the_way_counts() {
        let top = tempfile::tempdir().expect("a folder");
        let write = |path: &str, text: &str| {
            let path = top.path().join(path);
            fs::create_dir_all(path.parent().expect("a folder")).expect("made");
            fs::write(path, text).expect("written");
        };
        write("system.slice/memory.max", "4000000\n");
        write("system.slice/planish.service/memory.max", "max\n");
        write("memory/docker/1/memory.limit_in_bytes", "3000000\n");
        let limit = |groups: &str| limit_of_groups(groups, top.path());
        assert_eq!(limit("0::/system.slice/planish.service\n"), Some(4_000_000));
        assert_eq!(limit("0::/system.slice\n7:cpu,memory:/docker/1\n"), Some(3_000_000));
        assert_eq!(limit("0::/\n"), None);
        assert_eq!(limit("nonsense\n1:name=systemd:/x\n"), None);
    }
}
