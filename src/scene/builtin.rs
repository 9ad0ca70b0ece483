//! The built-in scenes: ordinary scene files, embedded in the program.

/// An image (JPEG) of each built-in scene, from left to right in the order of [`BUILTIN_SCENES`], all of one width.
pub const SCENES_IMAGE: &[u8] = include_bytes!("../../assets/scenes/thumbnails.jpg");

/// Makes the list of scenes from their names, which are those of their files, and descriptions.
macro_rules! scenes {
    ($($name:literal: $about:literal,)*) => {
        &[$(($name, $about, include_str!(concat!("../../assets/scenes/", $name, ".ron"))),)*]
    };
}

/// Name, description, and text of the scene file.
pub const BUILTIN_SCENES: &[(&str, &str, &str)] = scenes! {
    "gallery": "glass, mirror, metal and diffuse objects on a checkered floor",
    "cornell": "the Cornell box",
    "cornell-balls": "the Cornell box with a mirror sphere and a glass sphere",
    "dof-balls": "a row of spheres through a wide aperture",
    "veach-mis": "Veach's test for multiple importance sampling: four lights over plates from glossy to rough",
    "ball": "a blue sphere on a checkered floor",
    "kd-tree": "a large mesh over fifty spheres on a reflective checkered floor",
    "models": "six models in a circle",
    "simplified": "one model with 100 %, 20 % and 1 % of its triangles",
    "soft-shadow": "a sphere and its soft shadow",
    "everything": "mirrors, glass, spheres and models in one room",
    "gi-ball": "a sphere under a large sphere light",
    "gi-balls": "diffuse and mirror spheres next to a large mesh",
    "glass-balls": "glass spheres and a glass torus with caustics",
    "ten-thousand-balls": "a mesh of 344,064 triangles above 10,000 spheres",
    "studio": "a ground and a light: an empty scene to put things in",
    "carousel": "an animation: a sphere orbits a turning ring, and the camera moves",
};

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
