//! The scenes inside the program: plain scene files, embedded.

/// Name, what it shows, and the text of the scene file.
pub const BUILTIN_SCENES: &[(&str, &str, &str)] = &[
    (
        "gallery",
        "glass, mirror, metal and matte things on a checkered floor",
        include_str!("../../assets/scenes/gallery.ron"),
    ),
    ("cornell", "the box that every renderer is tried on", include_str!("../../assets/scenes/cornell.ron")),
    (
        "cornell-balls",
        "a mirror ball, and a glass ball with its caustic, in the box",
        include_str!("../../assets/scenes/cornell-balls.ron"),
    ),
    ("dof-balls", "a row of balls through a wide lens", include_str!("../../assets/scenes/dof-balls.ron")),
    (
        "veach-mis",
        "four lights of equal power over four plates, from polished to dull",
        include_str!("../../assets/scenes/veach-mis.ron"),
    ),
    ("ball", "one blue ball on a checkered floor", include_str!("../../assets/scenes/ball.ron")),
    (
        "kd-tree",
        "a large mesh over fifty balls on a reflecting checkered floor",
        include_str!("../../assets/scenes/kd-tree.ron"),
    ),
    ("models", "six models around a point", include_str!("../../assets/scenes/models.ron")),
    (
        "simplified",
        "one model with all of its triangles, a fifth, a hundredth",
        include_str!("../../assets/scenes/simplified.ron"),
    ),
    ("soft-shadow", "a ball and its soft shadow", include_str!("../../assets/scenes/soft-shadow.ron")),
    (
        "everything",
        "two mirrors, glass, balls and models in one room",
        include_str!("../../assets/scenes/everything.ron"),
    ),
    ("gi-ball", "one ball under a large ball of light", include_str!("../../assets/scenes/gi-ball.ron")),
    ("gi-balls", "matte and mirror balls beside a large mesh", include_str!("../../assets/scenes/gi-balls.ron")),
    (
        "glass-balls",
        "glass balls and a glass torus with their caustics",
        include_str!("../../assets/scenes/glass-balls.ron"),
    ),
    (
        "ten-thousand-balls",
        "a mesh of 344,064 triangles above 10,000 balls",
        include_str!("../../assets/scenes/ten-thousand-balls.ron"),
    ),
];

/// The scene file of a built-in scene.
pub fn builtin_text(name: &str) -> Option<&'static str> {
    BUILTIN_SCENES.iter().find(|(known, _, _)| *known == name).map(|(_, _, text)| *text)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::file::SceneFile;

    #[test]
    fn every_builtin_scene_reads_and_survives_being_written() {
        for (name, _, text) in BUILTIN_SCENES {
            let scene = SceneFile::parse(text, name).unwrap_or_else(|error| panic!("{error}"));
            let again = SceneFile::parse(&scene.to_ron(), name).unwrap_or_else(|error| panic!("{error}"));
            assert_eq!(scene, again, "{name}");
        }
    }
}
