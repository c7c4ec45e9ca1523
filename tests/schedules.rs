//! The locks of the conveyor under many orders of threads: see `tests/bench/schedules`.

use std::path::Path;
use std::process::Command;

#[test]
fn no_order_of_threads_makes_the_semaphore_or_the_budget_stand_still() {
    // `cargo test` has built it.
    let program = Path::new(env!("CARGO_BIN_EXE_planish")).with_file_name("examples").join("schedules");
    let ran = Command::new(program).arg("1000").output().expect("built");
    let told = String::from_utf8_lossy(&ran.stdout);
    assert!(ran.status.success() && told.starts_with("4000 orders of threads, none wrong"), "{ran:?}");
}
