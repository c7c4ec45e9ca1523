#!/usr/bin/env bash
# Package:  etagere 0.3.0 (crates.io)
#
# Expected: AtlasAllocator::allocate returns None where a rectangle finds no room, so that who
#           tries again in a larger atlas succeeds in the end.
# Happens:  it returns None for the 65,536th rectangle of any atlas, however much room is left and
#           however small the rectangles are: items are numbered in 16 bits, one number means
#           none, and nothing in the signature or the documentation of the call says so. A loop
#           that grows the atlas until all fit never ends, or gives up on sizes that would do.
# Seen:     side 2048: 65535 of 70000
#           side 8192: 65535 of 70000
#           (rectangles of 4 x 4, of which 262,144 have room in the smaller one)
#
# Needs cargo. Exits non-zero unless both lines are as seen.
set -euo pipefail

work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
mkdir -p "$work/src"
cat > "$work/Cargo.toml" <<'TOML'
[package]
name = "packing"
version = "0.1.0"
edition = "2021"

[dependencies]
etagere = "=0.3.0"
TOML
cat > "$work/src/main.rs" <<'RUST'
use etagere::{size2, AtlasAllocator};

fn main() {
    for side in [2048, 8192] {
        let mut atlas = AtlasAllocator::new(size2(side, side));
        let placed = (0..70_000).take_while(|_| atlas.allocate(size2(4, 4)).is_some()).count();
        println!("side {side}: {placed} of 70000");
    }
}
RUST
printed=$(cargo run --quiet --release --manifest-path "$work/Cargo.toml" --target-dir "$work/target")
echo "$printed"
[[ $printed == $'side 2048: 65535 of 70000\nside 8192: 65535 of 70000' ]]
