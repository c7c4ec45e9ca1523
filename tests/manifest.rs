//! Every real file at hand holds what its manifest says: points and triangles as the file has them, and the surface that
//! they make when bit-equal points are one. Blank columns promise nothing.

use crate::corpus::{manifest, shared};
use planish::formats::{Format, Kind, kind};
use planish::input::{Folder, decode};
use planish::settings::{RawSettings, Settings};
use planish_core::topology::TopologySummary;
use std::collections::BTreeMap;
use std::path::Path;

type Row = BTreeMap<String, String>;

/// What a file holds, under the names of the manifest's columns; none: it is refused.
fn found(path: &Path, settings: &Settings) -> Option<Vec<(&'static str, String)>> {
    let bytes = std::fs::read(path).expect("it is there");
    let content = decode(path, &bytes, settings, &Folder::of(path)).ok()?;
    // Readers of MSH leave nodes in the middle of edges out; they are points of the file all the same.
    let left_out = if kind(path) == Kind::Mesh(Format::Msh) { content.notes.mid_nodes } else { 0 };
    let [points, triangles] = [content.soup.points().len() + left_out, content.soup.triangles().len()];
    let repaired = planish_core::repair(&content.soup, &planish_core::repair::Settings { weld: 0.0 }).ok()?;
    let raw: TopologySummary = repaired.raw;
    let found = [
        ("vertices_file", points as i64),
        ("triangles_file", triangles as i64),
        ("vertices_welded", raw.vertices as i64),
        ("triangles_used", raw.triangles as i64),
        ("components", raw.components as i64),
        ("boundary_loops", raw.boundary_loops as i64),
        ("nonmanifold_edges", raw.nonmanifold_edges as i64),
        ("nonmanifold_vertices", raw.nonmanifold_vertices as i64),
        ("inconsistent_edges", raw.inconsistent_edges as i64),
    ];
    let mut found: Vec<_> = found.map(|(name, count)| (name, count.to_string())).into();
    found.push(("orientable", if raw.orientable { "True" } else { "False" }.to_owned()));
    found.extend(raw.genus.map(|genus| ("genus_total", genus.to_string())));
    Some(found)
}

/// Where file and manifest differ.
fn differences(row: &Row, found: &[(&'static str, String)]) -> Vec<String> {
    let differs = |(name, count): &&(&str, String)| {
        let told = row.get(*name).map_or("", |t| t.trim());
        !told.is_empty() && told != count
    };
    found.iter().filter(differs).map(|(name, count)| format!("{name}: {} told, {count} found", row[*name])).collect()
}

#[test]
fn every_file_holds_what_its_manifest_says() {
    let settings = RawSettings::default().check().expect("in range");
    let mut wrong = Vec::new();
    for (folder, least) in [("meshes", 28), ("malformed", 11)] {
        let Some(folder) = shared(folder) else { continue };
        let rows: Vec<Row> = manifest(&folder);
        let read: Vec<&Row> = rows.iter().filter(|row| matches!(kind(row["file"].as_ref()), Kind::Mesh(_))).collect();
        assert!(read.len() >= least, "{}: {} files", folder.display(), read.len());
        for row in read {
            let differences = match found(&folder.join(&row["file"]), &settings) {
                Some(_) if row["kind"].contains("expected reject") => vec!["read, but to be refused".to_owned()],
                Some(found) => differences(row, &found),
                None if row["kind"].contains("reject") || row["kind"].contains("clear-error") => vec![],
                None => vec!["refused, but to be read".to_owned()],
            };
            wrong.extend(differences.iter().map(|d| format!("{}: {d}", row["file"])));
        }
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}
