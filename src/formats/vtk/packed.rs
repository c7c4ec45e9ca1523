//! Bytes as XML files pack them: plain or base64, in blocks that may be compressed.
//!
//! Uncompressed data follow their size in bytes. Compressed data follow a header: the number of blocks, the size of a
//! block before compression, that of the last block where it is another (0 where not), and the compressed size of
//! each block. Nothing is unpacked, and no memory taken, before the sizes in a header are compared with the bytes
//! that are there and with what the compressor can do at best.

use super::error::{PackedError, escape};
use super::scalar::Order;
use base64::Engine;
use base64::alphabet::STANDARD;
use base64::engine::{DecodePaddingMode, GeneralPurpose, GeneralPurposeConfig};
use std::borrow::Cow;
use std::io::Read;

/// How often the same bytes of a file may be read: arrays that share their data are few.
const SHARED: u64 = 4;

/// The largest dictionary that xz makes by itself, with its overhead, in KiB.
const DICTIONARY: u32 = (65 << 20) / 1024;

/// Bytes of a large block that are unpacked at a time.
const STEP: usize = 1 << 20;

/// What compresses the blocks of a file.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Compressor {
    Zlib,
    Lz4,
    Lzma,
}

impl Compressor {
    /// Bytes that so many compressed ones become at most. Deflate writes 258 bytes with two bits at best, LZ4 255 with
    /// one byte. LZMA has no such bound: its output is taken as it comes.
    fn most(self, size: usize) -> u64 {
        let size = size as u64;
        match self {
            Self::Zlib => size.saturating_mul(1032),
            Self::Lz4 => size.saturating_mul(255),
            Self::Lzma => u64::MAX,
        }
    }
}

/// How all arrays of a file are packed.
#[derive(Clone, Copy, Debug)]
pub(super) struct Packing {
    pub order: Order,
    /// Whether sizes have 64 bits instead of 32.
    pub wide: bool,
    pub compressor: Option<Compressor>,
}

/// Bytes that may still be read and unpacked.
#[derive(Clone, Copy, Debug)]
pub(super) struct Budget {
    stored: u64,
    unpacked: u64,
}

impl Budget {
    pub fn new(file: usize, unpacked: u64) -> Self {
        Self { stored: (file as u64).saturating_mul(SHARED), unpacked }
    }

    fn store(&mut self, bytes: u64) -> Result<(), PackedError> {
        self.stored = self.stored.checked_sub(bytes).ok_or(PackedError::Overlap)?;
        Ok(())
    }

    fn unpack(&mut self, bytes: u64) -> Result<(), PackedError> {
        let left = self.unpacked;
        self.unpacked = left.checked_sub(bytes).ok_or(PackedError::Expansion { unpacked: bytes, left })?;
        Ok(())
    }
}

/// Bytes of an array, read from the front.
pub(super) enum Stream<'a> {
    Raw(&'a [u8]),
    Base64(Base64<'a>),
}

/// Base64 text: several runs, each with its own padding, may follow each other.
pub(super) struct Base64<'a> {
    text: Cow<'a, [u8]>,
    at: usize,
    /// Decoded, but not read yet: at most two bytes.
    left: Vec<u8>,
}

impl<'a> Stream<'a> {
    /// Base64 text.
    pub fn base64(text: impl Into<Cow<'a, [u8]>>) -> Self {
        Self::Base64(Base64 { text: text.into(), at: 0, left: Vec::new() })
    }

    /// Base64 text in which blanks and ends of lines do not count.
    pub fn base64_with_blanks(text: &'a [u8]) -> Self {
        let text = text.trim_ascii();
        if text.iter().any(u8::is_ascii_whitespace) {
            Self::base64(text.iter().copied().filter(|b| !b.is_ascii_whitespace()).collect::<Vec<u8>>())
        } else {
            Self::base64(text)
        }
    }

    /// How many bytes there are, at most.
    fn len(&self) -> u64 {
        match self {
            Self::Raw(bytes) => bytes.len() as u64,
            Self::Base64(b) => b.left.len() as u64 + ((b.text.len() - b.at) as u64).div_ceil(4) * 3,
        }
    }

    /// The next bytes.
    fn take(&mut self, size: u64) -> Result<Cow<'a, [u8]>, PackedError> {
        let short = PackedError::Short { needed: size, there: self.len() };
        if size > self.len() {
            return Err(short);
        }
        match self {
            Self::Raw(bytes) => {
                let (taken, rest) = bytes.split_at(size as usize);
                *bytes = rest;
                Ok(Cow::Borrowed(taken))
            }
            Self::Base64(base64) => base64.take(size as usize).map(Cow::Owned),
        }
    }

    /// The next sizes.
    fn sizes(&mut self, count: u64, packing: Packing) -> Result<Vec<u64>, PackedError> {
        let word: u64 = if packing.wide { 8 } else { 4 };
        let size = count.saturating_mul(word);
        let bytes = self.take(size)?;
        Ok(bytes.chunks_exact(word as usize).map(|word| packing.order.whole(word)).collect())
    }
}

impl Base64<'_> {
    fn take(&mut self, size: usize) -> Result<Vec<u8>, PackedError> {
        let mut bytes = std::mem::take(&mut self.left);
        bytes.reserve(size + 3);
        while bytes.len() < size {
            let quads = (size - bytes.len()).div_ceil(3);
            let rest = &self.text[self.at..];
            let run = &rest[..(4 * quads).min(rest.len())];
            if run.is_empty() {
                return Err(PackedError::Short { needed: size as u64, there: bytes.len() as u64 });
            }
            // A run ends with its padding, and another one may follow. (`contains` is quick where there is none, as nearly
            // always.)
            let run = match run.contains(&b'=').then(|| run.iter().position(|b| *b == b'=')).flatten() {
                Some(padding) => &run[..((padding / 4 + 1) * 4).min(run.len())],
                None => run,
            };
            ENGINE.decode_vec(run, &mut bytes).map_err(|_| PackedError::Base64(about(run)))?;
            self.at += run.len();
        }
        self.left = bytes.split_off(size);
        Ok(bytes)
    }
}

const ENGINE: GeneralPurpose = GeneralPurpose::new(
    &STANDARD,
    GeneralPurposeConfig::new()
        .with_decode_padding_mode(DecodePaddingMode::Indifferent)
        .with_decode_allow_trailing_bits(true),
);

/// The part of a text that is no base64, to be shown.
fn about(run: &[u8]) -> String {
    let is_base64 = |b: &u8| b.is_ascii_alphanumeric() || b"+/=".contains(b);
    let wrong = run.iter().position(|b| !is_base64(b)).unwrap_or_default();
    format!("\"{}\"", escape(&run[wrong..(wrong + 12).min(run.len())]))
}

/// The bytes of an array.
pub(super) fn unpack<'a>(
    mut stream: Stream<'a>,
    packing: Packing,
    budget: &mut Budget,
) -> Result<Cow<'a, [u8]>, PackedError> {
    let Some(compressor) = packing.compressor else {
        let size = stream.sizes(1, packing)?[0];
        let bytes = stream.take(size)?;
        budget.store(bytes.len() as u64)?;
        return Ok(bytes);
    };
    let header = Header::read(&mut stream, packing)?;
    budget.store(header.packed)?;
    budget.unpack(header.unpacked)?;
    let mut unpacker = Unpacker::new(compressor);
    let mut bytes = Vec::new();
    for (block, packed) in header.sizes.iter().enumerate() {
        let packed = stream.take(*packed)?;
        let before = bytes.len();
        let Err(damaged) = unpacker.block(&packed, header.size_of(block), block, &mut bytes) else { continue };
        bytes.truncate(before);
        let is_empty = header.may_end_with_nothing(block) && unpacker.block(&packed, 0, block, &mut bytes).is_ok();
        if !is_empty {
            return Err(damaged);
        }
    }
    Ok(Cow::Owned(bytes))
}

/// The header of compressed data.
struct Header {
    /// The compressed size of each block.
    sizes: Vec<u64>,
    /// The size of a block, and of the last one, before compression.
    block: u64,
    last: u64,
    /// Whether the size of the last block is not told.
    untold: bool,
    /// The sizes of all blocks.
    packed: u64,
    unpacked: u64,
}

impl Header {
    fn read(stream: &mut Stream, packing: Packing) -> Result<Self, PackedError> {
        let header = stream.sizes(3, packing)?;
        let (blocks, block, told) = (header[0], header[1], header[2]);
        let untold = told == 0;
        let last = if untold { block } else { told };
        let sizes = stream.sizes(blocks, packing)?;
        let packed = sizes.iter().fold(0, |sum: u64, size| sum.saturating_add(*size));
        // Sizes may be any numbers: what does not fit into 64 bits is too much in any case.
        let all_but_last = blocks.saturating_sub(1).saturating_mul(block);
        let unpacked = all_but_last.saturating_add(if blocks > 0 { last } else { 0 });
        if packed > stream.len() {
            return Err(PackedError::Short { needed: packed, there: stream.len() });
        }
        Ok(Self { sizes, block, last, untold, packed, unpacked })
    }

    /// Whether nothing may be in a block: some writers (vtkio 0.7) add such a one where all others are full.
    fn may_end_with_nothing(&self, block: usize) -> bool {
        self.untold && block + 1 == self.sizes.len()
    }

    fn size_of(&self, block: usize) -> u64 {
        if block + 1 == self.sizes.len() { self.last } else { self.block }
    }
}

/// Unpacks one block after the other.
enum Unpacker {
    Zlib(flate2::Decompress),
    Lz4,
    Lzma,
}

impl Unpacker {
    fn new(compressor: Compressor) -> Self {
        match compressor {
            Compressor::Zlib => Self::Zlib(flate2::Decompress::new(true)),
            Compressor::Lz4 => Self::Lz4,
            Compressor::Lzma => Self::Lzma,
        }
    }

    fn compressor(&self) -> Compressor {
        match self {
            Self::Zlib(_) => Compressor::Zlib,
            Self::Lz4 => Compressor::Lz4,
            Self::Lzma => Compressor::Lzma,
        }
    }

    /// Appends what a block holds, which must be so many bytes.
    fn block(&mut self, packed: &[u8], unpacked: u64, block: usize, to: &mut Vec<u8>) -> Result<(), PackedError> {
        let damaged = PackedError::Block { block, size: packed.len(), unpacked };
        if unpacked > self.compressor().most(packed.len()) {
            return Err(damaged);
        }
        let before = to.len();
        let complete = match self {
            Self::Zlib(zlib) => inflate(zlib, packed, unpacked as usize, to),
            Self::Lz4 => {
                to.resize(before + unpacked as usize, 0);
                lz4_flex::block::decompress_into(packed, &mut to[before..]).is_ok_and(|size| size as u64 == unpacked)
            }
            Self::Lzma => {
                // One byte more than expected is too much.
                let reader = lzma_rust2::XzReader::new_mem_limit(packed, false, DICTIONARY);
                reader.take(unpacked.saturating_add(1)).read_to_end(to).is_ok()
            }
        };
        if complete && (to.len() - before) as u64 == unpacked { Ok(()) } else { Err(damaged) }
    }
}

/// Appends exactly so many bytes of a zlib stream; whether it holds these and no more. Memory is taken as they come.
fn inflate(zlib: &mut flate2::Decompress, packed: &[u8], unpacked: usize, to: &mut Vec<u8>) -> bool {
    zlib.reset(true);
    // A small block is done in one call; for a large one the library keeps what it still has to look back at.
    let flush = if unpacked <= STEP { flate2::FlushDecompress::Finish } else { flate2::FlushDecompress::None };
    let before = to.len();
    loop {
        let (consumed, produced) = (zlib.total_in() as usize, zlib.total_out() as usize);
        let Some(left) = unpacked.checked_sub(produced) else { return false };
        // Room for one more byte shows that there is none.
        let room = left.clamp(1, STEP);
        to.resize(before + produced + room, 0);
        let status = zlib.decompress(&packed[consumed..], &mut to[before + produced..], flush);
        let moved = zlib.total_in() as usize > consumed || zlib.total_out() as usize > produced;
        match status {
            Ok(flate2::Status::StreamEnd) => {
                to.truncate(before + zlib.total_out() as usize);
                return true;
            }
            Ok(_) if moved && unpacked > STEP => {}
            _ => return false,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::io::Write;

    /// These blocks, as if each had eight bytes.
    fn packed(compressor: Compressor, blocks: &[&[u8]]) -> Vec<u8> {
        let pack = |block: &&[u8]| match compressor {
            Compressor::Lz4 => lz4_flex::block::compress(block),
            _ => {
                let mut zlib = flate2::write::ZlibEncoder::new(Vec::new(), flate2::Compression::fast());
                zlib.write_all(block).expect("written");
                zlib.finish().expect("written")
            }
        };
        let packed: Vec<Vec<u8>> = blocks.iter().map(pack).collect();
        let sizes = packed.iter().map(Vec::len);
        let header: Vec<usize> = [blocks.len(), 8, 0].into_iter().chain(sizes).collect();
        [header.iter().flat_map(|n| n.to_le_bytes()).collect(), packed.concat()].concat()
    }

    #[test]
    fn nothing_may_follow_full_blocks() {
        let (full, none) = (b"12345678".as_slice(), b"".as_slice());
        for compressor in [Compressor::Zlib, Compressor::Lz4] {
            let packing = Packing { order: Order::Little, wide: true, compressor: Some(compressor) };
            let unpacked = |blocks: &[&[u8]]| {
                let bytes = packed(compressor, blocks);
                unpack(Stream::Raw(&bytes), packing, &mut Budget::new(bytes.len(), 1000)).map(Cow::into_owned)
            };
            assert_eq!(unpacked(&[full, full]).expect("two"), b"1234567812345678");
            assert_eq!(unpacked(&[full, full, none]).expect("two and nothing"), b"1234567812345678");
            for broken in [[full, none, full], [full, full, b"1"], [none, none, none]] {
                assert!(matches!(unpacked(&broken), Err(PackedError::Block { .. })), "{compressor:?}");
            }
        }
    }
}
