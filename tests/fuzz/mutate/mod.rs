//! Files that are nearly right, for tests of readers: mutations of a valid one, the same in every run.
//!
//! Blind changes of a file rarely get past the first look of a reader. So most mutations know what they change: they keep
//! the head of a file, change values of JSON and keep it JSON, and change data inside base64.

pub mod head;
mod packed;
mod plain;
mod tree;

/// Mutations of `seed`, `rounds` of them.
pub fn mutations(seed: &[u8], rounds: u64) -> impl Iterator<Item = Vec<u8>> {
    (0..rounds).map(|round| mutation(seed, round))
}

/// The mutation of this number.
pub fn mutation(seed: &[u8], round: u64) -> Vec<u8> {
    let mut random = Random(round.wrapping_mul(0x9e37_79b9_7f4a_7c15) ^ 0x2545_f491_4f6c_dd1d);
    let mut bytes = seed.to_vec();
    let (knowing, changes) = (random.below(8), 1 + random.below(3));
    for _ in 0..changes {
        match knowing {
            0 => plain::mutate(&mut bytes, 0, &mut random),
            1..=4 => structured(&mut bytes, &mut random),
            _ => behind_the_head(&mut bytes, &mut random),
        }
    }
    bytes
}

/// Changes something that the format gives a structure; where it gives none, something behind the head.
fn structured(bytes: &mut Vec<u8>, random: &mut Random) {
    if !tree::mutate(bytes, random) && !packed::mutate(bytes, random) {
        behind_the_head(bytes, random);
    }
}

fn behind_the_head(bytes: &mut Vec<u8>, random: &mut Random) {
    // All of a document in JSON is its head.
    let head = head::end(bytes);
    if head < bytes.len() || !tree::mutate(bytes, random) {
        plain::mutate(bytes, head, random);
    }
}

/// Numbers that look random.
pub struct Random(u64);

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

#[test]
fn mutations_differ_and_repeat() {
    let json = br#"{"asset": {"version": "2.0"}, "a": [1, 2, {"b": "c"}]}"#;
    let packed = b"<VTKFile><Piece><DataArray>AAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAA</DataArray></Piece></VTKFile>";
    for seed in [&b"one 2 3.0\nfour 5\n"[..], json, packed] {
        let all: Vec<Vec<u8>> = mutations(seed, 1000).collect();
        assert!(all.iter().eq(&mutations(seed, 1000).collect::<Vec<_>>()));
        let mut distinct = all.clone();
        distinct.sort();
        distinct.dedup();
        assert!(distinct.len() > 400, "{}", distinct.len());
    }
    let is_json = |bytes: &Vec<u8>| serde_json::from_slice::<serde_json::Value>(bytes).is_ok();
    assert!(mutations(json, 1000).filter(is_json).count() > 700);
    assert!(mutations(b"", 100).all(|m| m.len() < 100));
}
