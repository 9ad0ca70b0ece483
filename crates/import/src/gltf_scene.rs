//! The scene of a glTF file that is opened by itself: its meshes, materials, lights and cameras as a scene file.
//!
//! A camera that the file lacks is added as for other models ([`crate::framing`]); light and ground are added by the
//! world (`scene/model_light.rs`).

use crate::documents::{Documents, Opened};
use crate::error::gltf::{GltfProblem, Located};
use crate::framing::{AWAY, Framing};
use crate::gltf::assembly::PlacedLight;
use crate::gltf::facts::GltfFacts;
use crate::gltf::mesh::BuiltMesh;
use crate::gltf_motion::{Animated, GltfMotion, LastMoment};
use crate::gltf_parts::{camera_of, extend, light_of};
use crate::model::placing::corners_of;
use crate::model::placing::{is_placement, transform};
use firstlight_files::warnings::Warnings;
use firstlight_format::bounds::number;
use firstlight_format::camera::CameraPart;
use firstlight_format::choice::ModelChoice;
use firstlight_format::error::{SceneError, suggestion};
use firstlight_format::material_textures::texture_names;
use firstlight_format::parts::{LightPart, MaterialPart, ObjectPart};
use firstlight_format::scene_file::SceneFile;
use firstlight_format::sources::{MeshSource, Seconds, TextureSource};
use firstlight_format::value::Named;
use glam::{DVec3, Vec3};
use std::collections::hash_map::Entry;
use std::collections::{BTreeMap, BTreeSet, HashMap, HashSet};
use std::path::Path;
use std::sync::Arc;

/// A scene file made from a glTF file.
pub struct Generated {
    /// The scene.
    pub file: SceneFile,
    /// What `info` says of the file.
    pub facts: GltfFacts,
    /// What is not modelled or left out.
    pub warnings: Warnings,
    /// Where a moment was asked for.
    pub motion: Option<GltfMotion>,
    /// Of all objects.
    pub framing: Framing,
    /// Whether a material emits light.
    pub emits: bool,
    /// Whether the camera is one of the file.
    pub has_camera: bool,
}

/// Options of the scene.
pub struct Wish<'a> {
    /// Path of the model in the scene file.
    pub file: &'a str,
    /// Camera, variant and time.
    pub choice: &'a ModelChoice,
    /// Width over height of the image.
    pub aspect: f64,
}

/// Makes the scene of the file at `path`.
pub fn generate(documents: &Documents, path: &Path, wish: &Wish) -> Result<Generated, SceneError> {
    let opened = documents.open(path).map_err(|error| SceneError::new(error.to_string()))?;
    Maker { documents, opened: &opened, wish, path }.scene()
}

struct Maker<'a> {
    documents: &'a Documents,
    opened: &'a Arc<Opened>,
    wish: &'a Wish<'a>,
    path: &'a Path,
}

impl Maker<'_> {
    fn wrong(&self, located: Located) -> SceneError {
        SceneError::new(self.opened.document.error(located).to_string())
    }

    fn scene(&self) -> Result<Generated, SceneError> {
        let (choice, document) = (self.wish.choice, &self.opened.document);
        let posed = self.opened.posed(choice.at);
        let assembly = document.assembly(&posed).map_err(|located| self.wrong(located))?;
        let surfaces = self.opened.surfaces(self.wish.file);
        let facts = document.facts(&assembly, &surfaces);
        let variant = self.variant(&facts)?;
        let mut warnings = Warnings::default();
        if let Some(ignored) = choice.at.and_then(|at| beyond_animation(at, facts.animation_length)) {
            warnings.push(self.told(&ignored));
        }

        let mut distinct = HashSet::new();
        let wanted: Vec<_> = (assembly.meshes.iter())
            .filter(|placed| distinct.insert(placed.key))
            .map(|placed| (self.opened.clone(), placed.key, placed.key.node.and(choice.at)))
            .collect();
        self.documents.make(&wanted);

        let (mut objects, mut used) = (Vec::new(), BTreeSet::new());
        let mut shown = Vec::new();
        // As for the moments of `GltfMotion`.
        let mut bounds = (DVec3::INFINITY, DVec3::NEG_INFINITY);
        // Avatars look along -Z until version 1 of their format.
        let side = if facts.extensions.iter().any(|name| name == "VRM") { AWAY } else { DVec3::ONE };
        let mut framing = Framing::new(side, self.wish.aspect);
        let mut of_invisible = framing.clone();
        let mut built: HashMap<_, Option<(Arc<BuiltMesh>, _)>> = HashMap::new();
        for (i, placed) in assembly.meshes.iter().enumerate() {
            let at = placed.key.node.and(choice.at);
            if let Entry::Vacant(entry) = built.entry(placed.key) {
                let mesh = match self.documents.mesh(self.opened, placed.key, at) {
                    Err(located @ (_, GltfProblem::TooLarge { .. })) => return Err(self.wrong(located)),
                    // Its warnings are told when the object is loaded.
                    mesh => document.omissions.kept(&format!("meshes[{}]", placed.key.mesh), mesh),
                };
                entry.insert(mesh.map(|mesh| {
                    let corners = corners_of(&mesh.mesh);
                    (mesh, corners)
                }));
            }
            let Some(Some((mesh, corners))) = built.get(&placed.key) else { continue };
            let name = placed.name.clone().unwrap_or_else(|| format!("mesh {}", i + 1));
            if !is_placement(&placed.world) {
                let name = firstlight_files::printable::name(&name);
                let sentence = format!("`{name}` is flattened or too far away, and is left out");
                document.omissions.tell(&format!("meshes {i}"), sentence);
                continue;
            }
            shown.push((i, *corners));
            extend(&mut bounds, *corners, &placed.world);
            let indices = mesh.keys.iter().map(|key| {
                let material = variant.and_then(|variant| key.variants.get(&variant).copied()).or(key.material);
                surfaces.index(material)
            });
            let indices: Vec<usize> = indices.collect();
            used.extend(indices.iter().copied());
            let is_invisible = indices.iter().all(|&index| is_hole(&surfaces.materials[index].part));
            if !placed.is_hidden {
                let framing = if is_invisible { &mut of_invisible } else { &mut framing };
                framing.add(&mesh.mesh, *corners, &placed.world);
            }
            let names: Vec<String> = indices.iter().map(|&index| surfaces.materials[index].name.clone()).collect();
            let is_one = names.iter().all(|name| *name == names[0]);
            let source = MeshSource::Gltf {
                file: self.wish.file.to_owned(),
                mesh: Some(placed.key.mesh),
                node: placed.key.node,
                at: at.map(Seconds),
            };
            let (material, materials) = if is_one { (Some(names[0].clone()), None) } else { (None, Some(names)) };
            let mut object = ObjectPart::mesh(Some(name), source, material, materials, transform(&placed.world));
            if let ObjectPart::Mesh { hidden, .. } = &mut object {
                *hidden = placed.is_hidden;
            }
            objects.push(object);
        }
        if objects.is_empty() {
            return Err(self.wrong(document.omissions.nothing_left()));
        }
        if framing.is_empty() {
            framing = of_invisible;
        }
        let materials: Vec<_> = used.iter().map(|&index| &surfaces.materials[index]).collect();
        let emits = materials.iter().any(|surface| surface.emits);
        let named: Named<_> = materials.iter().map(|surface| (surface.name.clone(), surface.part.clone())).collect();
        let textures = textures_of(&named, &surfaces.textures);
        warnings.extend(self.notes(&materials.iter().map(|s| (&*s.name, &*s.notes)).collect::<Vec<_>>()));
        let optional = facts.unknown_extensions.iter().filter(|name| !document.requires(name));
        let unknown: Vec<_> = optional.map(|name| format!("`{name}`")).collect();
        if !unknown.is_empty() {
            warnings.push(self.told(&format!("extensions that are not modelled: {}", unknown.join(", "))));
        }

        let center = 0.5 * (bounds.0 + bounds.1);
        let of_file = assembly.cameras.iter();
        let cameras: Vec<_> = of_file.map(|camera| (camera.name.clone(), camera_of(camera, center))).collect();
        let chosen = self.chosen(&cameras)?;
        let file = SceneFile {
            cameras: if cameras.len() > 1 { cameras.iter().cloned().collect() } else { Named::default() },
            textures,
            materials: named,
            objects,
            lights: self.lights(&assembly.lights, &mut warnings),
            ..SceneFile::new(chosen.cloned().unwrap_or_else(|| framing.camera()))
        };
        let mut all: Warnings = document.omissions.sentences().iter().map(|sentence| self.told(sentence)).collect();
        all.append(&warnings);
        file.check().map_err(|error| SceneError::in_file(self.path, error.to_string()))?;
        let motion = match facts.animation_length.filter(|_| choice.at.is_some()) {
            None => None,
            Some(length) => {
                let (objects, boxes): (Vec<usize>, _) = shown.into_iter().unzip();
                let is_seen = |(i, light): (usize, &PlacedLight)| (light.light.intensity != Vec3::ZERO).then_some(i);
                let lights: Vec<usize> = assembly.lights.iter().enumerate().filter_map(is_seen).collect();
                let camera = chosen.and_then(|chosen| cameras.iter().position(|(_, part)| std::ptr::eq(part, chosen)));
                let moved = document.moved_nodes();
                let camera = camera.filter(|&camera| moved[assembly.cameras[camera].node as usize]);
                let animated = Animated::of(document, &assembly, &objects, &lights);
                let (file, opened) = (self.wish.file.to_owned(), self.opened.clone());
                let last = LastMoment::default();
                Some(GltfMotion { file, opened, objects, boxes, lights, camera, animated, length, last })
            }
        };
        let has_camera = chosen.is_some();
        Ok(Generated { file, facts, warnings: all, motion, framing, emits, has_camera })
    }

    fn told(&self, what: &str) -> String {
        format!("{}: {what}", self.path.display())
    }

    /// Unsupported features, each one once with the materials that use it.
    fn notes(&self, materials: &[(&str, &[String])]) -> Vec<String> {
        const TOLD: usize = 6;
        let mut by_note: BTreeMap<&str, Vec<&str>> = BTreeMap::new();
        for (name, notes) in materials {
            for note in *notes {
                by_note.entry(note).or_default().push(name);
            }
        }
        let sentence = |(note, names): (&str, Vec<&str>)| {
            let list: Vec<String> =
                names.iter().take(TOLD).map(|name| format!("`{}`", firstlight_files::printable::name(name))).collect();
            let more = if names.len() > TOLD { format!(" and {} more", names.len() - TOLD) } else { String::new() };
            self.told(&format!("{}{more}: {note}", list.join(", ")))
        };
        by_note.into_iter().map(sentence).collect()
    }

    fn variant(&self, facts: &GltfFacts) -> Result<Option<u32>, SceneError> {
        let Some(wanted) = &self.wish.choice.variant else { return Ok(None) };
        match facts.variants.iter().position(|name| name == wanted) {
            Some(number) => Ok(Some(number as u32)),
            None => Err(self.missing("variant", wanted, &facts.variants)),
        }
    }

    fn missing(&self, what: &str, wanted: &str, names: &[String]) -> SceneError {
        let hint = match names {
            [] => ": the file has none".to_owned(),
            _ => suggestion(wanted, names.iter().map(String::as_str)),
        };
        let wanted = firstlight_files::printable::name(wanted);
        SceneError::in_file(self.path, format!("there is no {what} `{wanted}`{hint}"))
    }

    fn chosen<'c>(&self, cameras: &'c [(String, CameraPart)]) -> Result<Option<&'c CameraPart>, SceneError> {
        let Some(wanted) = &self.wish.choice.camera else { return Ok(cameras.first().map(|(_, part)| part)) };
        match cameras.iter().find(|(name, _)| name == wanted) {
            Some((_, part)) => Ok(Some(part)),
            None => {
                let names: Vec<String> = cameras.iter().map(|(name, _)| name.clone()).collect();
                Err(self.missing("camera", wanted, &names))
            }
        }
    }

    fn lights(&self, lights: &[PlacedLight], warnings: &mut Warnings) -> Vec<LightPart> {
        let mut parts = Vec::new();
        for (i, placed) in lights.iter().enumerate() {
            let name = Some(placed.name.clone().unwrap_or_else(|| format!("light {}", i + 1)));
            if placed.light.intensity == Vec3::ZERO {
                continue;
            }
            if placed.light.has_range {
                let name = firstlight_files::printable::name(name.as_deref().unwrap_or_default()).into_owned();
                warnings
                    .push(self.told(&format!("`range` of light `{name}` is ignored: lights have no cutoff distance")));
            }
            parts.push(light_of(placed, name));
        }
        parts
    }
}

/// Returns a warning for a time, in seconds, outside of the animations of a scene.
pub fn beyond_animation(at: f64, length: Option<f64>) -> Option<String> {
    let shown = number(at);
    match length {
        None => Some(format!("has no animation: {shown} s shows the stored pose")),
        Some(end) if at > end => Some(format!("the animation ends at {} s: {shown} s shows its end", number(end))),
        Some(_) if at < 0.0 => Some(format!("the animation begins at 0 s: {shown} s shows its start")),
        Some(_) => None,
    }
}

/// The textures that the materials name, in order.
fn textures_of(
    materials: &Named<firstlight_format::parts::MaterialPart>,
    all: &[(String, TextureSource)],
) -> Named<TextureSource> {
    let names: HashSet<String> = materials.iter().flat_map(|(_, part)| texture_names(part)).collect();
    all.iter().filter(|(name, _)| names.contains(name)).cloned().collect()
}

/// Whether nothing of a surface is seen, as of boxes that bound or trigger something.
fn is_hole(part: &MaterialPart) -> bool {
    matches!(part, MaterialPart::Principled { opacity, .. } if *opacity == 0.0.into())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn moments_are_told_with_few_digits() {
        for (at, length, told) in [
            (1e300, None, "has no animation: 1e300 s shows the stored pose"),
            (1e300, Some(2.5), "the animation ends at 2.5 s: 1e300 s shows its end"),
            (-1e300, Some(2.5), "the animation begins at 0 s: -1e300 s shows its start"),
        ] {
            assert_eq!(beyond_animation(at, length).as_deref(), Some(told));
        }
    }
}
