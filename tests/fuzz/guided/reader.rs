//! Coverage-guided fuzzing of the readers: every input goes to the reader that its content asks for, and where that is in
//! doubt to the one that the environment names.
//!
//! ```text
//! cargo install cargo-fuzz
//! PLANISH_FORMAT=stl cargo +nightly fuzz run --fuzz-dir tests/fuzz/guided reader SEEDS -- -max_len=20000 -timeout=10
//! ```
//! SEEDS is a folder of files of that format. What it finds becomes a test of that reader.
#![no_main]

use libfuzzer_sys::fuzz_target;
use planish::formats::{Format, Kind, kind, read_alone};
use std::sync::LazyLock;

static FORMAT: LazyLock<Format> = LazyLock::new(|| {
    let name = std::env::var("PLANISH_FORMAT").expect("PLANISH_FORMAT is an extension, as stl");
    match kind(format!("a.{name}").as_ref()) {
        Kind::Mesh(format) => format,
        other => panic!("PLANISH_FORMAT={name} is no format that is read: {other:?}"),
    }
});

fuzz_target!(|bytes: &[u8]| {
    if let Err(error) = read_alone(*FORMAT, bytes) {
        assert!(!error.reason().message.is_empty());
    }
});
