//! ModelLight for a model that is opened by itself: that of its file where it is enough to see the model by, and generated
//! light where it is not.
//!
//! What the file brings is measured, not guessed: a small image is rendered in its light alone, and divided by the albedo
//! of what it shows. That is how bright a white surface would be there, so dark models are not taken for unlit ones. The
//! result is a function of the model, and of the camera of its file if it has one: not of the size of an image.

use crate::files::warnings::Warning;
use crate::format::bounds::MOST_STOPS;
use crate::format::camera::CameraPart;
use crate::format::material_textures::emits;
use crate::format::parts::{LightPart, MaterialPart, ObjectPart};
use crate::format::placement::Placement;
use crate::format::sources::EnvironmentSource;
use crate::import::framing::Framing;
use crate::import::meshes::LoadedMesh;
use crate::import::model::placing::corners_of;
use crate::render::{Display, Film, RenderSettings, Techniques, advance, gather_features};
use crate::scene::default_scene;
use crate::scene::default_scene::{is_inner, is_key_light};
use crate::scene::extract::Extraction;
use crate::scene::inner_light::{middle_of_room, sees_anything};
use crate::scene::loaded::LoadedScene;
use crate::scene::source::SceneSource;
use crate::scene::world::components::Shape;
use crate::scene::world::inputs::SceneInputs;
use bevy_ecs::world::World;
use glam::{DVec3, UVec2, Vec3};

/// What the model brings.
pub(super) struct Model {
    /// Corners of its box, metres.
    pub bounds: (DVec3, DVec3),
    /// Signs of the direction of its front.
    pub side: DVec3,
    /// Whether it has emissive materials; unlit ones, which show a colour without light, do not count.
    pub emits: bool,
    /// Whether the camera is that of the file: then the file is a scene, which stands on a ground of its own.
    pub has_camera: bool,
}

/// Width over height of the image in which light is measured, whatever the size of the image that is rendered: an image
/// opens again at another size, and must have the same light.
const ASPECT: f64 = 16.0 / 9.0;

/// The light on the surfaces that the camera sees: radiance of a white surface in their place, W·m⁻²·sr⁻¹, 1 being the
/// white of the display; ascending, not empty.
#[derive(Clone, Debug)]
struct ModelLight(Vec<f32>);

impl ModelLight {
    /// Medians outside of this range call for another exposure.
    const USUAL: std::ops::RangeInclusive<f64> = 0.2..=1.5;
    /// The median after it.
    const EXPOSED: f64 = 1.0;
    /// Lights that would need a longer exposure, in stops, do not matter.
    const LONGEST: f64 = 6.0;
    /// Share of the surfaces below which light does not reach the model.
    const REACHED: f64 = 0.05;
    /// Share below which the user is told why the rest is black.
    const MOSTLY_REACHED: f64 = 0.6;
    /// Mean brightness of a model that can be seen by emitters alone, and by lights, of which shadows are expected.
    const BRIGHT: f64 = 0.35;
    const SHADED: f64 = 0.15;

    /// Level that is black beside a lit surface, and share of such surfaces that is a room without light.
    const DARK: f32 = 0.02;
    const MOST_DARK: f64 = 0.25;

    /// Those that get any light.
    fn lit(&self) -> &[f32] {
        &self.0[self.0.partition_point(|level| *level == 0.0)..]
    }

    /// Share of the surfaces that get any light.
    fn reached(&self) -> f64 {
        self.lit().len() as f64 / self.0.len() as f64
    }

    fn reaches(&self) -> bool {
        self.reached() >= Self::REACHED
    }

    /// Share of the surfaces that are shown black or nearly.
    fn dark(&self) -> f64 {
        self.0.partition_point(|level| *level < Self::DARK) as f64 / self.0.len() as f64
    }

    /// Whether a part of what the camera sees lies in the dark.
    fn is_lacking(&self) -> bool {
        self.mean(0.0) < Self::SHADED || self.dark() >= Self::MOST_DARK
    }

    /// Mean of what the display shows of a white surface, at an exposure in stops.
    fn mean(&self, stops: f64) -> f64 {
        let shown = |level: &f32| (f64::from(*level) * stops.exp2()).min(1.0);
        self.0.iter().map(shown).sum::<f64>() / self.0.len() as f64
    }

    /// Exposure that shows this light, in half stops; 0 where the usual one does.
    fn exposure(&self) -> f64 {
        let lit = self.lit();
        let median = lit.get(lit.len() / 2).map_or(0.0, |level| f64::from(*level));
        if !self.reaches() || Self::USUAL.contains(&median) {
            return 0.0;
        }
        let stops = (2.0 * (Self::EXPOSED / median).log2()).round() / 2.0;
        stops.clamp(-f64::from(MOST_STOPS), Self::LONGEST)
    }

    /// Whether the model can be seen by it: by lights at their exposure, by emitters as they are.
    fn is_enough(&self, has_lights: bool) -> bool {
        (has_lights && self.mean(self.exposure()) >= Self::SHADED) || self.mean(0.0) >= Self::BRIGHT
    }

    /// Share of the generated light beside emitters of this light, so that they still glow.
    fn dimming(&self) -> f32 {
        /// In this light and more, it is a third.
        const BRIGHT: f64 = 0.1;
        (1.0 - 2.0 / 3.0 * (self.mean(0.0) / BRIGHT).min(1.0)) as f32
    }
}

impl Model {
    fn brings_light(&self, scene: &LoadedScene) -> bool {
        self.emits || !scene.file.lights.is_empty()
    }

    /// Whether its light depends on where things are. Generated light reaches what stands free; a room that is seen
    /// through the backs of its walls is closed for light.
    pub(super) fn is_measured(&self, scene: &LoadedScene) -> bool {
        let is_one_sided = |part: &MaterialPart| matches!(part, MaterialPart::Principled { two_sided: false, .. });
        self.brings_light(scene) || self.has_camera || scene.file.materials.iter().any(|(_, part)| is_one_sided(part))
    }

    /// The camera by which light is measured: that of the file, or one that frames the model for [`ASPECT`].
    fn measuring_camera(&self, scene: &LoadedScene) -> CameraPart {
        if self.has_camera || !self.is_measured(scene) {
            return scene.file.camera.clone();
        }
        let mut framing = Framing::new(self.side, ASPECT);
        for (object, mesh) in scene.file.objects.iter().zip(&scene.meshes) {
            if let Some(LoadedMesh { mesh, .. }) = mesh {
                framing.add(mesh, corners_of(mesh), &Placement::from_part(object.transform()).affine());
            }
        }
        framing.camera()
    }
}

/// Adds to a scene what was added to the same model in its stored pose.
pub(super) fn light_as_in(scene: &mut LoadedScene, stored: &LoadedScene) {
    let added = stored.file.objects.iter().filter(|object| !matches!(object, ObjectPart::Mesh { .. }));
    for object in added {
        let of_object = stored.file.materials.iter().filter(|(name, _)| object.material() == Some(*name));
        scene.file.materials.0.extend(of_object.map(|(name, part)| (name.to_owned(), part.clone())));
        scene.file.objects.push(object.clone());
    }
    (scene.file.environment, scene.file.display) = (stored.file.environment.clone(), stored.file.display);
    let has = |light: &LightPart| scene.file.lights.iter().any(|own| own.name() == light.name());
    let added: Vec<_> = stored.file.lights.iter().filter(|light| is_inner(light) && !has(light)).cloned().collect();
    scene.file.lights.extend(added);
    scene.warnings.append(&stored.warnings);
    scene.meshes.resize(scene.file.objects.len(), None);
    scene.balls.resize(scene.file.objects.len(), None);
}

/// Adds what the scene of a model lacks: environment, key light and ground, and sets the exposure of physical lights.
/// An environment that was chosen stays as it is.
pub(super) fn light_model(scene: &mut LoadedScene, model: &Model) {
    let camera = model.measuring_camera(scene);
    let camera = std::mem::replace(&mut scene.file.camera, camera);
    light_as_measured(scene, model);
    scene.file.camera = camera;
}

fn light_as_measured(scene: &mut LoadedScene, model: &Model) {
    let has_lights = !scene.file.lights.is_empty();
    let brings_light = model.brings_light(scene);
    let own = if brings_light {
        let chosen = std::mem::replace(&mut scene.file.environment, EnvironmentSource::Black);
        let own = measure(scene);
        scene.file.environment = chosen;
        own
    } else {
        None
    };
    let title = scene.source.title();
    let is_enough = own.as_ref().is_some_and(|own| own.is_enough(has_lights));
    if !is_enough {
        if !model.has_camera {
            default_scene::stand_on_ground(&mut scene.file, model.bounds);
        }
        if scene.environment.is_none() {
            let reason = if brings_light { "its own light is too weak or does not reach it" } else { "has no light" };
            // A format without lights needs no words for that.
            let may_have_light = scene.facts.is_some() || matches!(scene.source, SceneSource::Foreign(_));
            if brings_light || may_have_light {
                let text = format!("{title}: {reason}: an environment and a key light are added");
                scene.warnings.push(Warning::notice(text));
            }
            let share = own.as_ref().filter(|_| model.emits).map_or(1.0, ModelLight::dimming);
            default_scene::light(&mut scene.file, model.bounds, model.side, share);
        }
        scene.meshes.resize(scene.file.objects.len(), None);
        scene.balls.resize(scene.file.objects.len(), None);
    }
    if !model.is_measured(scene) {
        return;
    }
    let Some(mut light) = own.filter(|_| is_enough && scene.environment.is_none()).or_else(|| measure(scene)) else {
        if model.has_camera && !sees_anything(&extraction(scene)) {
            scene.warnings.push(format!("{title}: the camera of the file sees nothing of it: choose another view"));
        }
        return;
    };
    // Only what is added may be too little here, for all of it or for the inside of a room that is seen through its walls.
    if !is_enough && light.is_lacking() {
        let place = middle_of_room(&extraction(scene));
        let added = place.map(|place| default_scene::light_inside(&mut scene.file, &place));
        match added.and_then(|()| measure(scene)).filter(|inside| inside.dark() < light.dark()) {
            Some(inside) => {
                light = inside;
                let text = format!("{title}: hardly any light gets into it: a light is added inside");
                scene.warnings.push(Warning::notice(text));
            }
            None => scene.file.lights.retain(|light| !is_inner(light)),
        }
    }
    if !light.reaches() {
        scene.warnings.push(format!(
            "{title}: hardly any light reaches what the camera sees, which is enclosed or faces away: choose another view, \
             or add a light"
        ));
    } else if is_enough && light.reached() < ModelLight::MOSTLY_REACHED {
        let share = 100.0 * light.reached();
        scene.warnings.push(Warning::notice(format!(
            "{title}: its lights reach {share:.0} % of what the camera sees: --env FILE adds light from all around"
        )));
    }
    // Generated light has the usual level outside.
    let is_usual = scene.file.lights.is_empty() && !model.emits && !model.has_camera;
    let exposure = if is_usual { 0.0 } else { light.exposure() };
    if exposure != 0.0 {
        let text = format!("{title}: the exposure is set to {exposure:+} stops, for the level of its light");
        scene.warnings.push(Warning::notice(text));
        scene.file.display = Display { exposure_stops: exposure as f32, ..scene.file.display };
    }
}

/// The scene without its ground, which is none of the model, and always lit.
fn extraction(scene: &LoadedScene) -> Extraction {
    let mut world = World::new();
    scene.spawn(&mut world);
    let mut inputs = SceneInputs::of(&mut world);
    inputs.objects.retain(|object| !matches!(object.shape, Shape::Plane { .. }));
    Extraction::new(&inputs, &scene.trees)
}

/// Measures the light of a scene, of which nothing has been drawn yet; `None` if its camera sees no surface that reflects
/// enough to tell.
fn measure(scene: &LoadedScene) -> Option<ModelLight> {
    /// Pixels of the image.
    const PIXELS: f64 = 1024.0;
    const SAMPLES: u32 = 4;
    /// Segments of paths: light that was reflected three times.
    const DEPTH: u32 = 5;
    /// Black surfaces look the same in any light.
    const LEAST_ALBEDO: f32 = 0.02;

    let of_meshes =
        scene.meshes.iter().flatten().flat_map(|mesh| mesh.slots.iter().map(|(name, part)| (&**name, part)));
    let mut materials = scene.file.materials.iter().chain(of_meshes);
    // Unlit materials too. The key light is behind the camera.
    let has_emission = materials.any(|(name, part)| emits(part) && !is_key_light(name));
    let scene = extraction(scene).prepared;
    let width = (PIXELS * ASPECT).sqrt().clamp(8.0, PIXELS / 8.0).round();
    let size = UVec2::new(width as u32, (PIXELS / width).round() as u32);
    let settings = |max_depth| {
        let techniques = Techniques { caustics: false, ..Techniques::ALL };
        RenderSettings { max_depth, techniques, ..RenderSettings::default() }
    };
    let image = |max_depth| {
        let mut film = Film::new(size.x, size.y);
        advance(&scene, &settings(max_depth), &mut film, SAMPLES, &|| false);
        film.means()
    };
    let all = image(DEPTH);
    let emitted = if has_emission { image(1) } else { vec![Vec3::ZERO; all.len()] };
    let surfaces = gather_features(&scene, &settings(DEPTH), size, SAMPLES, &|| false)?;
    let level = |color: Vec3| color.element_sum() / 3.0;
    let is_told_by = |&i: &usize| {
        surfaces.coverage[i] == 1.0 && level(emitted[i]) == 0.0 && level(surfaces.albedo[i]) >= LEAST_ALBEDO
    };
    let told = (0..all.len()).filter(is_told_by);
    let mut levels: Vec<f32> = told.map(|i| level(all[i] - emitted[i]).max(0.0) / level(surfaces.albedo[i])).collect();
    levels.sort_by(f32::total_cmp);
    (!levels.is_empty()).then_some(ModelLight(levels))
}
