#!/usr/bin/env bash
# Package:  sysinfo 0.40.1 (crates.io), on Linux; beside it rustix 1.1.4
#
# Expected: where the system does not tell its memory, System::new() or refresh_memory() fails,
#           as the former returns a Result; or else the memory is told.
# Happens:  services that systemd starts with ProcSubset=pid see only processes below /proc,
#           and no /proc/meminfo. There, both succeed, total_memory() is 0, and
#           cgroup_limits() none, although the limits lie below /sys, which is there. A
#           program that gives itself a part of the memory gives itself nothing, and one that
#           refuses what does not fit refuses all, without an error. The system call sysinfo,
#           which needs no file, tells the memory all the same.
# Seen:     outside: new: ok, total_memory > 0: true
#           inside:  new: ok, total_memory > 0: false, cgroup_limits: none, sysinfo(2) > 0: true
#
# Needs cargo, and the right to mount (root). Exits non-zero unless both lines are as seen.
set -euo pipefail

work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
mkdir -p "$work/src"
cat > "$work/Cargo.toml" <<'TOML'
[package]
name = "memory"
version = "0.1.0"
edition = "2021"

[dependencies]
sysinfo = { version = "=0.40.1", default-features = false, features = ["system"] }
rustix = { version = "=1.1.4", features = ["system"] }
TOML
cat > "$work/src/main.rs" <<'RUST'
fn main() {
    let system = sysinfo::System::new();
    let made = if system.is_ok() { "ok" } else { "error" };
    let mut system = system.expect("made");
    system.refresh_memory();
    let groups = if system.cgroup_limits().is_some() { "some" } else { "none" };
    println!("new: {made}, total_memory > 0: {}, cgroup_limits: {groups}, sysinfo(2) > 0: {}",
        system.total_memory() > 0, rustix::system::sysinfo().totalram > 0);
}
RUST
cargo build --quiet --release --manifest-path "$work/Cargo.toml" --target-dir "$work/target"
program="$work/target/release/memory"

outside=$("$program")
inside=$(unshare --mount --pid --fork sh -c 'mount -t proc -o subset=pid proc /proc && exec "$0"' "$program")
echo "outside: $outside"
echo "inside:  $inside"
[[ $outside == "new: ok, total_memory > 0: true,"* ]]
[[ $inside == "new: ok, total_memory > 0: false, cgroup_limits: none, sysinfo(2) > 0: true" ]]
