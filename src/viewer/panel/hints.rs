//! What the labels of the panel mean, shown when the mouse rests on them. Properties of materials, objects and lights
//! have their help in their own tables.

/// Labels and their meanings.
const HINTS: &[(&str, &str)] = &[
    ("integrator", "path tracing follows all light; Phong is the classic model of early ray tracers"),
    ("sampling", "where samples go: where this measure of the error is large, or everywhere alike"),
    ("stop at error", "rendering stops when the noise of the image has fallen to this"),
    ("stop at time", "rendering stops after this time"),
    ("stop at samples", "rendering stops at this many samples per pixel"),
    ("threads", "processor threads that render"),
    ("position", "where the camera is"),
    ("projection", "with perspective, or with parallel rays"),
    ("field of view", "vertical angle that the image shows: smaller is a longer lens"),
    ("focal length", "the field of view as photographers say it, for a sensor 24 mm high"),
    ("fly speed", "factor of the speed of W A S D; the distance to what is under the mouse counts too"),
    ("focus distance", "distance of what is sharp, along the view"),
    ("aperture", "f-number: a smaller one opens the lens and blurs more; its diameter where no lens has such a number"),
    ("blades", "blades of the aperture, which shape blurred highlights; 0 is round"),
    ("blade rotation", "turns the polygon of the blades"),
    ("exposure", "brightness in stops: one more is twice as bright"),
    ("tone curve", "how light becomes a colour of the screen"),
    ("show", "what is shown in place of the image; keys 0 to 9"),
    ("radius", "radius of the sphere"),
    ("material", "what the object is made of; a change concerns all objects that share it"),
    ("kind", "how the surface scatters light; another kind keeps what both have in common"),
    ("of", "the two materials that are mixed"),
    ("faces", "triangles of the mesh"),
    ("normals", "shading: smooth, flat, or by the angles between faces"),
    ("coordinates", "where an image lies on the mesh: as in its file, or projected from the six sides of a box"),
    ("simplify", "share of the faces that is kept"),
    ("original", "faces before they were simplified"),
    ("deviation", "distance between the simplified surface and the original"),
    ("difference", "how much of the image changes by it"),
    ("image", "file of the image that lights the scene"),
    ("strength", "factor of its light"),
    ("time of day", "hour of the sun, which is highest at 12:00; north is −Z"),
    ("date", "day of the year, such as 21 Jun"),
    ("latitude", "degrees north of the equator, from which the sun is seen"),
    ("rotation", "angle by which it is turned"),
    ("colours", "the two colours of the squares"),
    ("wrap", "what is beyond the edge of the image"),
    ("smooth", "colours between those of the image, where it is enlarged"),
    ("samples", "samples per pixel, and the time of rendering since the last restart"),
    ("resolution", "pixels that are rendered; fewer while the view moves"),
    ("rays", "rays per second"),
    ("error estimate", "relative noise of the samples, without denoising"),
    ("denoised", "relative error of the denoised image, and the samples it was made of"),
    ("caustics", "how light through glass and by mirrors is found"),
    ("portals", "openings of a room through which the environment is sampled"),
    ("discarded", "samples that were no finite numbers"),
    ("input latency", "from an input to the first new pixels"),
    ("cancel latency", "until the workers drop what nobody needs any more"),
    ("triangles", "triangles of all objects"),
    ("kd-trees", "memory of what finds the surfaces that rays hit"),
    ("memory", "memory of the whole program"),
    ("undo", "what Ctrl+Z undoes"),
    ("redo", "what Ctrl+Shift+Z redoes"),
    ("last restart", "why the samples were discarded last"),
];

/// The meaning of a label; empty if it has none.
pub fn hint_of(label: &str) -> &'static str {
    HINTS.iter().find(|(known, _)| *known == label).map_or("", |(_, hint)| hint)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_row_of_the_panel_says_what_it_is() {
        let folder = concat!(env!("CARGO_MANIFEST_DIR"), "/src/viewer/panel");
        for file in std::fs::read_dir(folder).expect("the sources") {
            let path = file.expect("the sources").path();
            let text = std::fs::read_to_string(&path).expect("the sources");
            for begin in [" row(ui, \"", "figure(\""] {
                for label in text.split(begin).skip(1).filter_map(|rest| rest.split('"').next()) {
                    assert!(label.is_empty() || !hint_of(label).is_empty(), "{}: {label}", path.display());
                }
            }
        }
    }
}
