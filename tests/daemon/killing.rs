//! Killed at any moment, and started again.

use super::{Watched, disk, names};
use planish::outcome::Status;
use std::time::Duration;

/// Numbers without pattern, the same in every run (Steele, Lea and Flood 2014, doi 10.1145/2660193.2660195).
fn random(state: &mut u64) -> u64 {
    *state = state.wrapping_add(0x9e37_79b9_7f4a_7c15);
    let mut z = *state;
    z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    z ^ (z >> 31)
}

#[test]
fn sixty_kills_and_one_clean_run_leave_every_result_whole_and_nothing_else() {
    kill_and_look(60);
}

/// Kills the daemon so often, and sees what is there after one clean run.
pub fn kill_and_look(kills: u64) {
    let mut w = Watched::new(&["--jobs", "2"]);
    let mut state = 1;
    let mut inputs: Vec<(String, Vec<u8>)> = Vec::new();
    for kill in 0..kills {
        // A new file each time, and every third time newer content for an old one: there is always something to do.
        let name = if kill % 3 == 2 { random(&mut state) % inputs.len() as u64 } else { inputs.len() as u64 };
        let size = if kill % 7 == 0 { 70 } else { 4 + random(&mut state) % 30 };
        let bytes = disk(size as u32, kill as f64);
        let name = format!("{name}.stl");
        w.drop_in(&name, &bytes);
        inputs.retain(|(n, _)| *n != name);
        inputs.push((name, bytes));
        w.start();
        // A file settles within a second; what follows is what is to be hit.
        std::thread::sleep(Duration::from_millis(950 + random(&mut state) % 700));
        w.kill();
        let staging = names(&w.out.path().join(".planish")).iter().filter(|n| n.starts_with("run-")).count();
        assert!(staging <= 1, "each start clears what the one before it left behind");
    }
    w.start();
    let all: Vec<(&str, &[u8])> = inputs.iter().map(|(name, bytes)| (name.as_str(), &bytes[..])).collect();
    w.wait_for(&all);
    w.stop();
    let names: Vec<&str> = all.iter().map(|(name, _)| *name).collect();
    names.iter().for_each(|name| w.assert_complete(name, Status::Certified));
    w.assert_tidy(&names);
    let in_vain: usize = names.iter().map(|name| w.logged(name, "begins") - w.logged(name, "ends")).sum();
    eprintln!("{kills} kills hit {in_vain} jobs; {} inputs, all whole", names.len());
    assert!(in_vain > kills as usize / 4, "only {in_vain} jobs were hit: the test has lost its sense");
}
