//! Reading of JSON texts in which some members are of another type than the format says.
//!
//! Most texts are read as they are. If that fails, whole numbers may be written `4.0`, and a member that cannot be read
//! is left out of its object: a node without its broken matrix is still a node.

use crate::error::gltf::{GltfProblem, Located, place};
use crate::gltf::json;
use crate::gltf::json::{Root, make_whole};
use serde::Deserialize;
use serde::de::DeserializeOwned;
use serde_json::{Map, Value};

/// A member that was left out, and why.
pub(crate) type Omitted = (String, Located);

/// The text as typed structs, and what was left out of it.
///
/// # Errors
/// If it is not a JSON object, or of glTF 1.
pub(crate) fn parse(text: &[u8]) -> Result<(Root, Vec<Omitted>), GltfProblem> {
    if let Ok(root) = serde_json::from_slice(text) {
        return Ok((root, Vec::new()));
    }
    let wrong = |error: serde_json::Error| GltfProblem::Json(error.to_string());
    // Names in other encodings than UTF-8 are no reason to refuse a file.
    let mut root: Map<String, Value> = serde_json::from_str(&String::from_utf8_lossy(text)).map_err(wrong)?;
    root.values_mut().for_each(make_whole);
    let version = root.get("asset").and_then(|asset| asset.get("version")).map(|version| match version {
        Value::String(text) => text.clone(),
        other => other.to_string(),
    });
    if root.get("meshes").or(root.get("nodes")).is_some_and(Value::is_object) {
        return Err(GltfProblem::Version(version.unwrap_or_else(|| "1.0".to_owned())));
    }
    if let (Some(version), Some(Value::Object(asset))) = (version, root.get_mut("asset")) {
        asset.insert("version".to_owned(), version.into());
    }
    let mut omitted = Vec::new();
    each::<json::Scene>(&mut root, "scenes", &mut omitted);
    each::<json::Node>(&mut root, "nodes", &mut omitted);
    each::<json::Mesh>(&mut root, "meshes", &mut omitted);
    each::<json::Accessor>(&mut root, "accessors", &mut omitted);
    each::<json::BufferView>(&mut root, "bufferViews", &mut omitted);
    each::<json::Buffer>(&mut root, "buffers", &mut omitted);
    each::<json::Material>(&mut root, "materials", &mut omitted);
    each::<json::Texture>(&mut root, "textures", &mut omitted);
    each::<json::Image>(&mut root, "images", &mut omitted);
    each::<json::Sampler>(&mut root, "samplers", &mut omitted);
    each::<json::Camera>(&mut root, "cameras", &mut omitted);
    each::<json::Skin>(&mut root, "skins", &mut omitted);
    each::<json::Animation>(&mut root, "animations", &mut omitted);
    let mut root = Value::Object(root);
    leave_out_broken::<Root>(&mut root, "", &mut omitted);
    Ok((Root::deserialize(root).map_err(wrong)?, omitted))
}

/// Leaves the broken members out of all objects of a list.
fn each<T: DeserializeOwned>(root: &mut Map<String, Value>, list: &str, omitted: &mut Vec<Omitted>) {
    for (i, value) in root.get_mut(list).and_then(Value::as_array_mut).into_iter().flatten().enumerate() {
        leave_out_broken::<T>(value, &place(list, i), omitted);
    }
}

/// Leaves out the members of an object without which it can be read.
fn leave_out_broken<T: DeserializeOwned>(value: &mut Value, place: &str, omitted: &mut Vec<Omitted>) {
    let Err(error) = T::deserialize(&*value) else { return };
    let mut omit = |part: &str, error: serde_json::Error| {
        omitted.push((part.to_owned(), (String::new(), GltfProblem::Json(error.to_string()))));
    };
    let Value::Object(object) = value else {
        omit(place, error);
        *value = Value::Object(Map::new());
        return;
    };
    object.retain(|name, member| {
        let alone = Value::Object(Map::from_iter([(name.clone(), member.clone())]));
        let read = T::deserialize(alone);
        let part = if place.is_empty() { name.clone() } else { format!("{place}.{name}") };
        read.map(|_| ()).map_err(|error| omit(&part, error)).is_ok()
    });
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn whole_numbers_may_have_a_fraction_of_zero() {
        let text = br#"{ "asset": { "version": 2.0 }, "scene": 1.0, "nodes": [{ "mesh": 3.0, "scale": [1, 2.0, 3.5],
            "extensions": { "X": { "light": 1.0 } } }] }"#;
        let (root, omitted) = parse(text).unwrap();
        assert!(omitted.is_empty(), "{omitted:?}");
        assert_eq!((root.asset.version.as_str(), root.scene, root.nodes[0].mesh), ("2", Some(1), Some(3)));
        assert_eq!(root.nodes[0].scale, Some([1.0, 2.0, 3.5]));
        // Also in a text that needs no more.
        let (root, _) = parse(br#"{ "nodes": [{ "extensions": { "X": { "light": 1.0 } } }] }"#).unwrap();
        assert_eq!(root.nodes[0].extensions.get("X").unwrap()["light"].as_u64(), Some(1));
    }

    #[test]
    fn a_broken_member_costs_only_itself() {
        let text = br#"{ "asset": { "version": "2.0" }, "scene": "first", "nodes": [
            { "mesh": 0, "matrix": [1, 2], "name": "a" }, 7, { "mesh": -1, "children": [0] } ], "materials": {} }"#;
        let (root, omitted) = parse(text).unwrap();
        let parts: Vec<&str> = omitted.iter().map(|(part, _)| part.as_str()).collect();
        assert_eq!(parts, ["nodes[0].matrix", "nodes[1]", "nodes[2].mesh", "materials", "scene"]);
        assert_eq!((root.nodes[0].mesh, root.nodes[0].matrix, root.nodes.len()), (Some(0), None, 3));
        assert_eq!((root.nodes[2].mesh, &root.nodes[2].children[..]), (None, &[0][..]));
    }

    #[test]
    fn the_first_version_is_named() {
        for (text, version) in [
            (r#"{ "asset": { "version": "1.1" }, "meshes": { "a": {} } }"#, "1.1"),
            (r#"{ "meshes": { "a": {} } }"#, "1.0"),
        ] {
            assert!(matches!(parse(text.as_bytes()), Err(GltfProblem::Version(found)) if found == version));
        }
        for text in ["", "[1]", "{", "7", "{\"nodes\": [}"] {
            assert!(matches!(parse(text.as_bytes()), Err(GltfProblem::Json(_))), "{text}");
        }
    }
}
