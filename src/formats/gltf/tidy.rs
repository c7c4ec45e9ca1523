//! A document as the library is to see it, without what no surface needs.
//!
//! The library is strict about all of a document: one material with a colour of three numbers, one animation of
//! something else than a node (`KHR_animation_pointer`), one scene without nodes, which may be, and it refuses the whole.
//! So what is not read is emptied, and such scenes are completed. Lines keep their numbers, for messages.

use serde::Deserialize;
use serde::de::IgnoredAny;
use serde_json::value::RawValue;
use std::collections::BTreeMap;
use std::ops::Range;

/// The lists of a document that are not read.
const UNREAD: [&str; 7] = ["animations", "cameras", "images", "materials", "samplers", "skins", "textures"];

/// What follows the opening brace of a scene without nodes.
const NO_NODES: &str = "\"nodes\":[]";

/// The parts of a document, as text.
pub(super) struct Document<'a> {
    json: &'a [u8],
    parts: BTreeMap<String, &'a RawValue>,
}

/// A change of the text: another one stands in place of these bytes.
type Change = (Range<usize>, String);

impl<'a> Document<'a> {
    /// The parts of this text.
    pub fn new(json: &'a [u8]) -> Result<Self, serde_json::Error> {
        Ok(Self { json, parts: serde_json::from_slice(json)? })
    }

    /// The version that it says to have. In glTF 1 nearly all is told in another way: the library cannot tell.
    pub fn version(&self) -> Option<String> {
        #[derive(Deserialize)]
        struct Asset {
            version: String,
        }
        let asset = self.parts.get("asset")?;
        serde_json::from_str(asset.get()).ok().map(|asset: Asset| asset.version)
    }

    /// The names of materials, of which nothing else is read.
    pub fn materials(&self) -> Vec<Option<String>> {
        #[derive(Deserialize)]
        struct Material {
            name: Option<String>,
        }
        let list = self.parts.get("materials").map_or("[]", |list| list.get());
        let materials: Vec<&RawValue> = serde_json::from_str(list).unwrap_or_default();
        let name = |text: &RawValue| serde_json::from_str(text.get()).ok().and_then(|m: Material| m.name);
        materials.into_iter().map(name).collect()
    }

    /// The text without what is not read.
    pub fn tidied(&self) -> Vec<u8> {
        let mut changes: Vec<Change> = UNREAD.iter().filter_map(|name| self.emptied(name)).collect();
        changes.extend(self.completed_scenes());
        // They are of different parts of the document: none overlaps another.
        changes.sort_by_key(|(range, _)| range.start);
        let mut tidied = Vec::with_capacity(self.json.len());
        let mut at = 0;
        for (range, text) in changes {
            tidied.extend_from_slice(&self.json[at..range.start]);
            tidied.extend_from_slice(text.as_bytes());
            at = range.end;
        }
        tidied.extend_from_slice(&self.json[at..]);
        tidied
    }

    /// A list with nothing in it but the ends of its lines.
    fn emptied(&self, name: &str) -> Option<Change> {
        let list = self.parts.get(name)?.get();
        if !list.starts_with('[') {
            return None;
        }
        let lines: String = list.chars().filter(|c| *c == '\n').collect();
        Some((self.range(list), format!("[{lines}]")))
    }

    /// Scenes that lack their list of nodes.
    fn completed_scenes(&self) -> Vec<Change> {
        let mut changes = Vec::new();
        let Some(scenes) = self.parts.get("scenes") else { return changes };
        // What is no list is left to the library, which tells what is wrong.
        let scenes: Vec<&RawValue> = serde_json::from_str(scenes.get()).unwrap_or_default();
        for scene in scenes.into_iter().map(RawValue::get) {
            if !lacks_nodes(scene) {
                continue;
            }
            let inside = self.range(scene).start + 1;
            let is_empty = scene[1..].trim_start().starts_with('}');
            changes.push((inside..inside, format!("{NO_NODES}{}", if is_empty { "" } else { "," })));
        }
        changes
    }

    /// Where a part of the text stands in it: the parts are no copies.
    fn range(&self, part: &str) -> Range<usize> {
        let start = part.as_ptr() as usize - self.json.as_ptr() as usize;
        start..start + part.len()
    }
}

/// Whether this is a scene without a list of nodes.
fn lacks_nodes(scene: &str) -> bool {
    #[derive(Deserialize)]
    struct Scene {
        nodes: Option<IgnoredAny>,
    }
    scene.starts_with('{') && serde_json::from_str(scene).is_ok_and(|scene: Scene| scene.nodes.is_none())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn tidied(json: &str) -> String {
        let document = Document::new(json.as_bytes()).expect("JSON");
        String::from_utf8(document.tidied()).expect("text")
    }

    #[test]
    fn what_is_not_read_is_emptied_and_lines_keep_their_numbers() {
        let json = "{\"scene\":0,\n \"materials\" : [{\n\"a\":[1,\n2]}] ,\"nodes\":[{}],\n\"skins\":3}";
        assert_eq!(tidied(json), "{\"scene\":0,\n \"materials\" : [\n\n] ,\"nodes\":[{}],\n\"skins\":3}");
    }

    #[test]
    fn scenes_get_the_list_of_nodes_that_they_lack() {
        let json = r#"{"scenes": [{"nodes":[0]}, { }, {"name":"{x}"}, 3]}"#;
        assert_eq!(tidied(json), r#"{"scenes": [{"nodes":[0]}, {"nodes":[] }, {"nodes":[],"name":"{x}"}, 3]}"#);
        for same in ["{}", r#"{"scenes":{}}"#, r#"{"scenes":[]}"#, r#"{"scenes":[{"nodes":1}]}"#] {
            assert_eq!(tidied(same), same);
        }
    }

    #[test]
    fn the_version_is_told_where_there_is_one() {
        let version = |json: &str| Document::new(json.as_bytes()).expect("JSON").version();
        assert_eq!(version(r#"{"asset":{"version":"1.0"},"meshes":{"a":{}}}"#).as_deref(), Some("1.0"));
        assert_eq!([r#"{"asset":{}}"#, r#"{"asset":{"version":2}}"#, "{}"].map(version), [None, None, None]);
    }
}
