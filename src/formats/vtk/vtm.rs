//! `atlas.vtm`: opens the files of a result in ParaView in one go. `vtkio` cannot write multi-block files.

use std::fmt::Write;

/// The bytes of a multi-block file with these blocks: names without special characters, and files beside it.
pub fn blocks(blocks: &[(&str, &str)]) -> Vec<u8> {
    let mut text = String::from(
        "<?xml version=\"1.0\"?>\n<VTKFile type=\"vtkMultiBlockDataSet\" version=\"1.0\" \
         byte_order=\"LittleEndian\" header_type=\"UInt64\">\n  <vtkMultiBlockDataSet>\n",
    );
    for (index, (name, file)) in blocks.iter().enumerate() {
        // Writing to a string cannot fail.
        let _ = writeln!(text, "    <DataSet index=\"{index}\" name=\"{name}\" file=\"{file}\"/>");
    }
    text.push_str("  </vtkMultiBlockDataSet>\n</VTKFile>\n");
    text.into_bytes()
}

#[cfg(test)]
mod tests {
    #[test]
    fn every_block_has_its_number_name_and_file() {
        let text = String::from_utf8(super::blocks(&[("surface", "surface.vtu"), ("seams", "seams.vtp")]));
        let text = text.expect("UTF-8");
        assert!(text.contains("<DataSet index=\"1\" name=\"seams\" file=\"seams.vtp\"/>"), "{text}");
    }
}
