//! `atlas.vtm`: opens the files of a result in ParaView in one go. `vtkio` cannot write multi-block files.

use std::fmt::Write;

/// A block, by its name in ParaView.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Block {
    /// Its name, whatever that is.
    pub name: String,
    /// What is in it.
    pub content: Content,
}

/// What is in a block.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Content {
    /// A file beside this one, whose name has no special characters.
    File(String),
    /// Other blocks.
    Blocks(Vec<Block>),
}

impl Block {
    /// A block of one file.
    pub fn file(name: &str, file: &str) -> Self {
        Self { name: name.to_owned(), content: Content::File(file.to_owned()) }
    }
}

/// The bytes of a multi-block file with these blocks.
pub fn blocks(blocks: &[Block]) -> Vec<u8> {
    let mut text = String::from(
        "<?xml version=\"1.0\"?>\n<VTKFile type=\"vtkMultiBlockDataSet\" version=\"1.0\" \
         byte_order=\"LittleEndian\" header_type=\"UInt64\">\n  <vtkMultiBlockDataSet>\n",
    );
    write_blocks(&mut text, blocks, 4);
    text.push_str("  </vtkMultiBlockDataSet>\n</VTKFile>\n");
    text.into_bytes()
}

/// Appends blocks, which may be nested once: a list of blocks is made of files.
fn write_blocks(text: &mut String, blocks: &[Block], indent: usize) {
    let blank = " ".repeat(indent);
    for (index, Block { name, content }) in blocks.iter().enumerate() {
        let name = escape(name);
        // Writing to a string cannot fail.
        let _ = match content {
            Content::File(file) => {
                writeln!(text, "{blank}<DataSet index=\"{index}\" name=\"{name}\" file=\"{file}\"/>")
            }
            Content::Blocks(inner) => {
                let _ = writeln!(text, "{blank}<Block index=\"{index}\" name=\"{name}\">");
                write_blocks(text, inner, indent + 2);
                writeln!(text, "{blank}</Block>")
            }
        };
    }
}

/// A name as it stands in an attribute of XML, which knows no control characters.
pub(super) fn escape(name: &str) -> String {
    let mut escaped = String::with_capacity(name.len());
    for c in name.chars() {
        match c {
            '&' => escaped.push_str("&amp;"),
            '<' => escaped.push_str("&lt;"),
            '>' => escaped.push_str("&gt;"),
            '"' => escaped.push_str("&quot;"),
            c if c.is_control() => escaped.push('_'),
            c => escaped.push(c),
        }
    }
    escaped
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_block_has_its_number_name_and_file() {
        let inner = vec![Block::file("a <b> & \"c\"", "surface-a.vtu")];
        let text = blocks(&[
            Block { name: "surface".to_owned(), content: Content::Blocks(inner) },
            Block::file("seams", "seams.vtp"),
        ]);
        let text = String::from_utf8(text).expect("UTF-8");
        assert!(text.contains("<DataSet index=\"1\" name=\"seams\" file=\"seams.vtp\"/>"), "{text}");
        let nested = "<Block index=\"0\" name=\"surface\">\n      <DataSet index=\"0\" name=\"a &lt;b&gt; &amp; \
                      &quot;c&quot;\" file=\"surface-a.vtu\"/>\n    </Block>";
        assert!(text.contains(nested), "{text}");
    }
}
