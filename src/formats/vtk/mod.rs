//! Files of VTK: legacy `.vtk`, and XML `.vtu` and `.vtp`.
//!
//! What a file is its first bytes tell, not its name. Everything that makes a surface is read, as triangles;
//! vertices, lines and volumes are counted. One array of cells, of whole numbers or words, labels the triangles;
//! one of points tells sizes, if it is asked for. Quadratic
//! triangles and quadrilaterals give their corners: edges are
//! taken to be straight. [`vtu`], [`vtp`] and [`vtm`] are what planish writes for ParaView.

mod appended;
mod attributes;
mod carried;
mod cell;
mod cell_fields;
mod cell_labels;
mod error;
mod legacy;
mod legacy_arrays;
mod legacy_fields;
mod legacy_sizes;
mod made;
mod packed;
mod read_back;
mod scalar;
mod surface;
mod text;
pub mod vtm;
pub mod vtp;
pub mod vtu;
pub mod welded;
mod xml;
mod xml_fields;
mod xml_labels;
mod xml_outline;
mod xml_parts;
mod xml_sizes;
#[cfg(test)]
mod xml_tests;

use super::{Content, ReadError, Source};
use error::Location;
pub use error::VtkError;
pub use made::made;

/// Reads a file of VTK.
pub(super) fn read(source: &Source) -> Result<Content, ReadError> {
    let bytes = source.bytes;
    if bytes.get(..legacy::HEAD.len()).is_some_and(|head| head.eq_ignore_ascii_case(legacy::HEAD)) {
        return legacy::read(source);
    }
    // What stands before an XML file is no part of it.
    let text = bytes.strip_prefix(b"\xef\xbb\xbf").unwrap_or(bytes).trim_ascii_start();
    if text.starts_with(b"<?xml") || text.starts_with(b"<VTKFile") || text.starts_with(b"<!--") {
        return xml::read(&Source { bytes: text, ..*source });
    }
    let found = error::escape(&bytes[..bytes.len().min(24)]);
    Err(VtkError::NoVtk { found }.into())
}

/// The refusal of a data set that is no surface.
fn unsupported(location: Location, dataset: &str) -> VtkError {
    let plain = dataset.trim_start_matches("vtk").replace('_', "").to_ascii_lowercase();
    let (what, remedy) = match plain.as_str() {
        "structuredgrid" | "structuredpoints" | "rectilineargrid" | "imagedata" | "hypertreegrid" => (
            "a grid and no surface of triangles",
            "in ParaView apply the filter Extract Surface (or Contour) and save the result as .vtp",
        ),
        p if ["multiblock", "partitioned", "hierarchical", "overlapping", "nonoverlapping", "collection"]
            .iter()
            .any(|kind| p.starts_with(kind)) =>
        {
            ("which names other files", "open its pieces: the .vtu and .vtp files that it names")
        }
        "punstructuredgrid" | "ppolydata" | "pimagedata" | "pstructuredgrid" | "prectilineargrid" => {
            ("which names other files", "open its pieces: the .vtu and .vtp files that it names")
        }
        _ => ("which is no surface", "save a surface as POLYDATA or UNSTRUCTURED_GRID: .vtp, .vtu or .vtk"),
    };
    VtkError::Dataset { location, dataset: dataset.to_owned(), what, remedy }
}
