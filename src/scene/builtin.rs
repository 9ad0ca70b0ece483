//! The built-in scenes: ordinary scene files, embedded in the program.

/// An image (JPEG) of each built-in scene, from left to right in the order of [`BUILTIN_SCENES`], all of one width.
pub const SCENES_IMAGE: &[u8] = include_bytes!("../../assets/scenes/thumbnails.jpg");

/// Name, description, and text of the scene file.
pub const BUILTIN_SCENES: &[(&str, &str, &str)] = &[
    (
        "gallery",
        "glass, mirror, metal and diffuse objects on a checkered floor",
        include_str!("../../assets/scenes/gallery.ron"),
    ),
    ("cornell", "the Cornell box", include_str!("../../assets/scenes/cornell.ron")),
    (
        "cornell-balls",
        "the Cornell box with a mirror sphere and a glass sphere",
        include_str!("../../assets/scenes/cornell-balls.ron"),
    ),
    ("dof-balls", "a row of spheres through a wide aperture", include_str!("../../assets/scenes/dof-balls.ron")),
    (
        "veach-mis",
        "Veach's test for multiple importance sampling: four lights over plates from glossy to rough",
        include_str!("../../assets/scenes/veach-mis.ron"),
    ),
    ("ball", "a blue sphere on a checkered floor", include_str!("../../assets/scenes/ball.ron")),
    (
        "kd-tree",
        "a large mesh over fifty spheres on a reflective checkered floor",
        include_str!("../../assets/scenes/kd-tree.ron"),
    ),
    ("models", "six models in a circle", include_str!("../../assets/scenes/models.ron")),
    (
        "simplified",
        "one model with 100 %, 20 % and 1 % of its triangles",
        include_str!("../../assets/scenes/simplified.ron"),
    ),
    ("soft-shadow", "a sphere and its soft shadow", include_str!("../../assets/scenes/soft-shadow.ron")),
    (
        "everything",
        "mirrors, glass, spheres and models in one room",
        include_str!("../../assets/scenes/everything.ron"),
    ),
    ("gi-ball", "a sphere under a large sphere light", include_str!("../../assets/scenes/gi-ball.ron")),
    ("gi-balls", "diffuse and mirror spheres next to a large mesh", include_str!("../../assets/scenes/gi-balls.ron")),
    (
        "glass-balls",
        "glass spheres and a glass torus with caustics",
        include_str!("../../assets/scenes/glass-balls.ron"),
    ),
    (
        "ten-thousand-balls",
        "a mesh of 344,064 triangles above 10,000 spheres",
        include_str!("../../assets/scenes/ten-thousand-balls.ron"),
    ),
    (
        "carousel",
        "an animation: a sphere orbits a turning ring, and the camera moves",
        include_str!("../../assets/scenes/carousel.ron"),
    ),
];

/// The text of a built-in scene; `None` if there is no such scene.
pub fn builtin_text(name: &str) -> Option<&'static str> {
    BUILTIN_SCENES.iter().find(|(known, _, _)| *known == name).map(|(_, _, text)| *text)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::format::scene_file::SceneFile;

    #[test]
    fn every_builtin_scene_reads_and_survives_being_written() {
        for (name, _, text) in BUILTIN_SCENES {
            let scene = SceneFile::parse(text, name).unwrap_or_else(|error| panic!("{error}"));
            let again = SceneFile::parse(&scene.to_ron(), name).unwrap_or_else(|error| panic!("{error}"));
            assert_eq!(scene, again, "{name}");
        }
    }
}
