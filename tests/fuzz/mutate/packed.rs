//! Mutations of data inside base64.

use super::{Random, plain};
use base64::Engine;
use base64::prelude::BASE64_STANDARD;
use std::ops::Range;

/// Letters that make a run of base64 at least.
const RUN: usize = 24;

/// Changes the data of a run of base64, if there is any. Mostly its length stays.
pub fn mutate(bytes: &mut Vec<u8>, random: &mut Random) -> bool {
    let runs = runs(bytes);
    let Some(run) = runs.get(random.below(runs.len())).cloned() else { return false };
    let Ok(mut data) = BASE64_STANDARD.decode(&bytes[run.clone()]) else { return false };
    change(&mut data, random);
    bytes.splice(run, BASE64_STANDARD.encode(data).into_bytes());
    true
}

/// Changes data.
pub fn change(data: &mut Vec<u8>, random: &mut Random) {
    match random.below(8) {
        0 => plain::mutate(data, 0, random),
        _ => {
            // Numbers mostly begin at multiples of their size.
            let at = 4 * random.below(data.len() / 4);
            plain::overwrite(data, at, random);
        }
    }
}

/// Where there is base64.
fn runs(bytes: &[u8]) -> Vec<Range<usize>> {
    let is_base64 = |b: &u8| b.is_ascii_alphanumeric() || b"+/".contains(b);
    let (mut runs, mut at) = (Vec::new(), 0);
    while let Some(begin) = bytes[at..].iter().position(is_base64).map(|i| at + i) {
        let end = bytes[begin..].iter().position(|b| !is_base64(b)).map_or(bytes.len(), |i| begin + i);
        let padding = bytes[end..].iter().take(2).take_while(|b| **b == b'=').count();
        at = end + padding;
        if end - begin >= RUN && (at - begin) % 4 == 0 {
            runs.push(begin..at);
        }
    }
    runs
}
