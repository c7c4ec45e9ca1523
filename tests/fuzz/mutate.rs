//! Files that are nearly right, for tests of readers: mutations of a valid one, the same in every run.

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

/// Mutations of `seed`, `rounds` of them.
pub fn mutations(seed: &[u8], rounds: u64) -> impl Iterator<Item = Vec<u8>> {
    (0..rounds).map(|round| {
        let mut random = Random(round.wrapping_mul(0x9e37_79b9_7f4a_7c15) ^ 0x2545_f491_4f6c_dd1d);
        let mut bytes = seed.to_vec();
        for _ in 0..=random.below(3) {
            mutate(&mut bytes, &mut random);
        }
        bytes
    })
}

/// Numbers that look random.
struct Random(u64);

impl Random {
    fn next(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mixed = (self.0 ^ (self.0 >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        let mixed = (mixed ^ (mixed >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        mixed ^ (mixed >> 31)
    }

    /// A number below `limit`, or 0.
    fn below(&mut self, limit: usize) -> usize {
        (self.next() >> 33) as usize % limit.max(1)
    }
}

fn mutate(bytes: &mut Vec<u8>, random: &mut Random) {
    let at = random.below(bytes.len());
    match random.below(8) {
        0 => bytes.truncate(at),
        1 => flip(bytes, at, random),
        2 | 3 => overwrite(bytes, at, random),
        4 | 5 => word(bytes, at, random),
        6 => line(bytes, at, random),
        _ => piece(bytes, at, random),
    }
}

fn flip(bytes: &mut [u8], at: usize, random: &mut Random) {
    if let Some(byte) = bytes.get_mut(at) {
        *byte ^= 1 << random.below(8);
    }
}

/// Writes a number in one of two orders.
fn overwrite(bytes: &mut [u8], at: usize, random: &mut Random) {
    let (number, size) = (NUMBERS[random.below(NUMBERS.len())], 1 << random.below(4));
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
        0 => bytes[other].to_vec(),
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

#[test]
fn mutations_differ_and_repeat() {
    let seed = b"one 2 3.0\nfour 5\n";
    let all: Vec<Vec<u8>> = mutations(seed, 1000).collect();
    assert!(all.iter().eq(&mutations(seed, 1000).collect::<Vec<_>>()));
    let mut distinct = all.clone();
    distinct.sort();
    distinct.dedup();
    assert!(distinct.len() > 500, "{}", distinct.len());
    assert!(mutations(b"", 100).all(|m| m.len() < 100));
}
