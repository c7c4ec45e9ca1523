//! What takes too long for every change: `cargo test --release -- --ignored full --nocapture`.
//!
//! Each of these says what it has seen on standard error.

mod load;

use crate::daemon::killing;

#[test]
#[ignore = "takes ten minutes"]
fn full_three_hundred_kills_leave_every_result_whole_and_nothing_else() {
    killing::kill_and_look(300);
}
