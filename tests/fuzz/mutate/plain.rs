//! Mutations of bytes, words and lines.

use super::Random;

/// Numbers that tempt readers of text.
const WORDS: [&str; 14] = [
    "-1",
    "0",
    "1",
    "3",
    "255",
    "65536",
    "2147483647",
    "4294967295",
    "9223372036854775807",
    "18446744073709551615",
    "1e999",
    "nan",
    "-1e-320",
    "x",
];

/// Numbers that tempt readers of binary data; of each, the low 1, 2, 4 or 8 bytes are written.
const NUMBERS: [u64; 9] =
    [0, 1, 0x7f, 0x80, 0x7fff_ffff, 0x8000_0000, u64::MAX, 0x7ff0_0000_0000_0000, 0x7fc0_0000_7f80_0000];

/// Changes something behind the first `keep` bytes.
pub fn mutate(bytes: &mut Vec<u8>, keep: usize, random: &mut Random) {
    let at = keep + random.below(bytes.len().saturating_sub(keep));
    if at >= bytes.len() {
        return;
    }
    match random.below(12) {
        0 => bytes.truncate(at),
        1 | 2 => flip(bytes, at, random),
        3..=5 => overwrite(bytes, at, random),
        6..=8 => word(bytes, at, random),
        9 => line(bytes, at, random),
        10 => swap(bytes, keep, random),
        _ => piece(bytes, at, random),
    }
}

fn flip(bytes: &mut [u8], at: usize, random: &mut Random) {
    if let Some(byte) = bytes.get_mut(at) {
        *byte ^= 1 << random.below(8);
    }
}

/// Writes a number in one of two orders: a tempting one, or one that is small enough for an id.
pub fn overwrite(bytes: &mut [u8], at: usize, random: &mut Random) {
    let tempting = NUMBERS[random.below(NUMBERS.len())];
    let (number, size) = (if random.below(2) == 0 { tempting } else { random.below(40) as u64 }, 1 << random.below(4));
    let mut number = number.to_le_bytes()[..size].to_vec();
    if random.below(2) == 0 {
        number.reverse();
    }
    bytes[at..].iter_mut().zip(number).for_each(|(byte, new)| *byte = new);
}

/// The first word from a byte on, in a text.
fn word_at(bytes: &[u8], at: usize) -> std::ops::Range<usize> {
    let blank = |b: &u8| b.is_ascii_whitespace();
    let before = bytes[..at].iter().rposition(blank).map_or(0, |i| i + 1);
    let end = bytes[at..].iter().position(blank).map_or(bytes.len(), |i| at + i);
    before..end
}

/// Puts another word in the place of one, or another one of the file.
fn word(bytes: &mut Vec<u8>, at: usize, random: &mut Random) {
    let old = word_at(bytes, at);
    let other = word_at(bytes, random.below(bytes.len()));
    let new = match random.below(4) {
        0 | 1 => bytes[other].to_vec(),
        2 => random.below(40).to_string().into_bytes(),
        _ => WORDS[random.below(WORDS.len())].as_bytes().to_vec(),
    };
    bytes.splice(old, new);
}

/// Removes a line, or repeats it.
fn line(bytes: &mut Vec<u8>, at: usize, random: &mut Random) {
    let begin = bytes[..at].iter().rposition(|b| *b == b'\n').map_or(0, |i| i + 1);
    let end = bytes[at..].iter().position(|b| *b == b'\n').map_or(bytes.len(), |i| at + i + 1);
    let line = bytes[begin..end].to_vec();
    let times = [0, 2, 3][random.below(3)];
    bytes.splice(begin..end, line.repeat(times));
}

/// Exchanges two runs of the same length.
fn swap(bytes: &mut [u8], keep: usize, random: &mut Random) {
    let size = [1, 4, 8, 12, 50][random.below(5)];
    let places = (bytes.len() - keep) / size;
    let [a, b] = [(); 2].map(|()| keep + size * random.below(places));
    if a != b && places > 0 {
        let (low, high) = bytes.split_at_mut(a.max(b));
        low[a.min(b)..][..size].swap_with_slice(&mut high[..size]);
    }
}

/// Removes some bytes, or repeats them elsewhere.
fn piece(bytes: &mut Vec<u8>, at: usize, random: &mut Random) {
    let end = (at + 1 + random.below(40)).min(bytes.len());
    let piece = bytes[at.min(end)..end].to_vec();
    if random.below(2) == 0 {
        bytes.drain(at.min(end)..end);
    } else {
        let to = random.below(bytes.len());
        bytes.splice(to..to, piece);
    }
}
