//! Search in the list of keys: by its own words, and by synonyms.

/// Search terms, and the words of the lines that they match.
const SYNONYMS: &[(&str, &[&str])] = &[
    ("animation", &["turntable", "numbered frames"]),
    ("backdrop", &["environment"]),
    ("background", &["environment"]),
    ("blur", &["aperture", "depth of field", "focus"]),
    ("bokeh", &["aperture", "blades"]),
    ("brightness", &["exposure", "strength"]),
    ("bsdf", &["material"]),
    ("camera", &["view", "fly", "orbit"]),
    ("clone", &["duplicate"]),
    ("color", &["colour"]),
    ("copy", &["duplicate"]),
    ("dark", &["exposure"]),
    ("daylight", &["clear sky"]),
    ("denoise", &["error", "samples"]),
    ("dof", &["depth of field", "focus"]),
    ("elevation", &["view from the front", "clear sky"]),
    ("emission", &["light"]),
    ("fabric", &["material"]),
    ("emitter", &["light"]),
    ("surroundings", &["environment", "sky"]),
    ("export", &["save", "png", "exr", "numbered frames"]),
    ("filter", &["find", "samples"]),
    ("floor plan", &["view from above"]),
    ("firefly", &["discarded samples", "paths"]),
    ("first person", &["look around", "capture the mouse"]),
    ("focal", &["field of view", "focus"]),
    ("fov", &["field of view"]),
    ("frames", &["numbered frames"]),
    ("fullscreen", &["full screen"]),
    ("gizmo", &["handles"]),
    ("hdr", &["exr", "environment"]),
    ("hdri", &["environment"]),
    ("heatmap", &["kd-tree", "false colour"]),
    ("history", &["what was saved", "undo"]),
    ("images", &["what was saved", "open"]),
    ("gallery", &["what was saved"]),
    ("previous", &["what was saved", "previous view"]),
    ("renders", &["what was saved", "numbered frames"]),
    ("screenshots", &["what was saved", "screenshot"]),
    ("picture", &["image"]),
    ("import", &["open", "obj", "ply", "stl"]),
    ("iso", &["exposure"]),
    ("keyframe", &["keys"]),
    ("lamp", &["light"]),
    ("load", &["open"]),
    ("lod", &["simplify"]),
    ("lookat", &["target", "pivot"]),
    ("lens", &["aperture", "focal", "focus"]),
    ("magnify", &["nearer", "narrower"]),
    ("manipulator", &["handles"]),
    ("menu", &["panel"]),
    ("model", &["obj", "ply", "stl", "mesh"]),
    ("move", &["handles", "fly", "position"]),
    ("movie", &["turntable", "numbered frames"]),
    ("new", &["add", "new"]),
    ("noise", &["error", "samples"]),
    ("object", &["selection", "objects"]),
    ("options", &["panel", "setting"]),
    ("pan", &["sideways"]),
    ("paste", &["duplicate"]),
    ("paint", &["material"]),
    ("parallel", &["orthographic"]),
    ("photo", &["screenshot"]),
    ("pick", &["select"]),
    ("plan", &["view from above"]),
    ("polygon", &["triangles", "mesh"]),
    ("preferences", &["panel", "setting"]),
    ("quality", &["when to stop", "error"]),
    ("record", &["--record", "numbered frames"]),
    ("reduce", &["simplify"]),
    ("refresh", &["restart"]),
    ("remove", &["delete"]),
    ("reset", &["restart", "initial view"]),
    ("resize", &["scale"]),
    ("resolution", &["any size"]),
    ("revert", &["undo"]),
    ("rotate", &["rotation", "pivot", "rotate"]),
    ("screenshot", &["png", "exr"]),
    ("settings", &["panel", "setting"]),
    ("section", &["view from"]),
    ("shader", &["material"]),
    ("shortcut", &["keys"]),
    ("simplified", &["simplify"]),
    ("speed", &["speed", "threads"]),
    ("stone", &["material"]),
    ("store", &["save", "bookmark"]),
    ("surface", &["material"]),
    ("tilt", &["roll", "level"]),
    ("tonemap", &["tone curve"]),
    ("transform", &["handles", "position"]),
    ("vertical", &["level"]),
    ("video", &["turntable", "numbered frames", "render frames"]),
    ("walk", &["fly"]),
    ("wireframe", &["normals", "triangles"]),
    ("wood", &["material"]),
    ("zoom", &["field of view", "nearer"]),
];

/// Whether a line matches a search: each search term, or a synonym of it, must occur.
pub fn finds(line: &str, search: &str) -> bool {
    let line = line.to_lowercase();
    search.to_lowercase().split_whitespace().all(|word| line.contains(word) || matches_synonym(&line, word))
}

/// Whether a synonym matches; prefixes match from the third letter on.
fn matches_synonym(line: &str, word: &str) -> bool {
    let is_meant = |(said, _): &&(&str, &[&str])| *said == word || word.len() >= 3 && said.starts_with(word);
    SYNONYMS.iter().filter(is_meant).any(|(_, written)| written.iter().any(|written| line.contains(written)))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::viewer::keys::BINDINGS;

    fn lines() -> Vec<String> {
        let line = |title: &str, binding: &crate::viewer::keys::Binding| binding.line(title);
        BINDINGS.iter().flat_map(|group| group.bindings.iter().map(move |one| line(group.title, one))).collect()
    }

    #[test]
    fn every_other_word_leads_somewhere() {
        let lines: Vec<String> = lines().into_iter().map(|line| line.to_lowercase()).collect();
        for (said, written) in SYNONYMS {
            for written in *written {
                assert!(lines.iter().any(|line| line.contains(written)), "{said}: no line has {written:?}");
            }
        }
    }

    #[test]
    fn ordinary_words_find_what_they_mean() {
        for (search, wanted) in [
            ("blur", "switch depth of field on, off"),
            ("bokeh", "make the aperture smaller, larger"),
            ("brightness", "increase, decrease the exposure by a third of a stop"),
            ("video", "--turntable"),
            ("frames", "--frames"),
            ("screenshot", "PNG"),
            ("export", "PNG"),
            ("denoise", "relative error"),
            ("pan", "move sideways"),
            ("simplify mesh", "Panel: Mesh"),
            ("fov", "field of view"),
            ("copy", "duplicate"),
            ("SHADER", "Panel: Materials"),
            ("undo", "undo"),
            ("ortho", "Panel: Camera"),
            ("sun", "Panel: Environment"),
            ("plan", "View from above"),
            ("video", "Render frames"),
            ("wood", "Panel: Materials"),
        ] {
            assert!(lines().iter().any(|line| line.contains(wanted) && finds(line, search)), "{search}: {wanted}");
        }
        assert!(!lines().iter().any(|line| finds(line, "xyzzy")));
    }
}
