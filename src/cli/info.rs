//! `firstlight info SCENE`: contents of a scene, features in use, unsupported features, memory.

use crate::cli::args::{SceneArgs, ScenesArgs, check_scenes};
use crate::cli::console;
use crate::cli::console::print;
use crate::cli::failure::Failure;
use crate::cli::info_materials;
use crate::cli::info_objects::ObjectList;
use crate::cli::number::{counted, two_digits};
use clap::Args;
use firstlight::frame::{Aperture, DenoiseFilter, PictureLayer, f_number};
use firstlight::printable;
use firstlight::render::{CausticChoice, Emission, Environment, Film, caustic_choice, portal_count};
use firstlight::scene::animation::Shutter;
use firstlight::scene::file::{AnimationPart, TrackPart};
use firstlight::scene::gltf::GltfFacts;
use firstlight::scene::{
    Animation, EnvironmentSource, Extraction, FilmSize, Lens, LightKind, LoadedScene, Projection, Rendering,
    SceneEnvironment, SceneInputs, SceneSource, Severity, Shape, Warning, Warnings,
};
use std::collections::BTreeMap;
use std::sync::Arc;

#[derive(Args, Clone, Debug)]
pub struct InfoArgs {
    #[command(flatten)]
    scenes: ScenesArgs,
    /// Compare kd-trees over each mesh: build time, size, and cost per ray.
    #[arg(long)]
    tree: bool,
    /// List the materials with what differs from their defaults.
    #[arg(long)]
    materials: bool,
    /// Print the result as one line of JSON.
    #[arg(long)]
    json: bool,
}

pub fn run(args: &InfoArgs) -> Result<(), Failure> {
    let scenes: Vec<SceneArgs> = args.scenes.each().collect();
    check_scenes(scenes.iter())?;
    scenes.iter().try_for_each(|scene| tell(args, scene))
}

fn tell(args: &InfoArgs, scene: &SceneArgs) -> Result<(), Failure> {
    let layers = match scene.source()? {
        SceneSource::Picture(path) => PictureLayer::in_file(&path).into_iter().map(PictureLayer::name).collect(),
        _ => Vec::new(),
    };
    let scene = scene.load(None, &mut firstlight::scene::Files::default(), &|_| ())?;
    let mut world = bevy_ecs::world::World::new();
    scene.spawn(&mut world);
    let inputs = SceneInputs::of(&mut world);
    let extraction = Extraction::new(&inputs, &scene.trees);
    console::tell(&extraction.problems.iter().cloned().collect());
    if args.tree {
        return crate::cli::trees::run(&inputs, &extraction, args.json);
    }
    let film = *world.resource::<FilmSize>();
    let prepared = &extraction.prepared;
    let settings = world.resource::<Rendering>().0;
    let can_be_seen = prepared.camera.check().is_ok() && settings.check().is_ok();
    let caustics = (prepared.features().caustics && can_be_seen)
        .then(|| caustic_choice(prepared, &settings, (film.width, film.height)));
    let n_portals = if can_be_seen { portal_count(prepared, &settings) } else { 0 };
    let animation = world.get_resource::<Animation>().cloned();
    let list = ObjectList::of(&inputs);
    let told = SceneReport {
        scene: &scene,
        inputs: &inputs,
        list,
        extraction: &extraction,
        film,
        layers,
        caustics,
        n_portals,
        animation,
    };
    match (args.json, args.materials) {
        (true, false) => print(told.json()),
        (true, true) => {
            let mut json = told.json();
            json["material_list"] = info_materials::json(&inputs);
            print(json)
        }
        (false, _) => {
            let mut text = told.text();
            let materials = args.materials.then(|| info_materials::lines(&inputs)).into_iter().flatten();
            text.extend(materials.map(|line| format!("  material      {line}")));
            print(text)
        }
    }
}

/// The data for the report on a scene.
struct SceneReport<'a> {
    scene: &'a LoadedScene,
    inputs: &'a SceneInputs,
    list: ObjectList<'a>,
    extraction: &'a Extraction,
    film: FilmSize,
    /// Of the image that the scene is read from; empty for other sources.
    layers: Vec<&'static str>,
    /// How caustics are sampled, if there can be any.
    caustics: Option<CausticChoice>,
    /// Number of openings through which the environment is sampled.
    n_portals: usize,
    /// The animation of the scene file, if it has one.
    animation: Option<Animation>,
}

impl SceneReport<'_> {
    fn n_hidden(&self) -> usize {
        self.inputs.hidden.entities().count()
    }

    /// As text.
    fn text(&self) -> Vec<String> {
        let Self { scene, extraction, film, .. } = self;
        let mut out = vec![scene.source.title()];
        let mut row = |name: &str, text: String| out.push(format!("  {name:14}{text}"));
        let counts = |counts: BTreeMap<&str, usize>| {
            let parts: Vec<String> = counts.iter().map(|(kind, n)| format!("{n} × {kind}")).collect();
            if parts.is_empty() { "none".to_owned() } else { parts.join(", ") }
        };
        row("objects", counts(self.objects()));
        row("size", self.list.size());
        let shading = &extraction.prepared.shading;
        row("materials", counts(self.materials()));
        let pictures = scene.picture_bytes() as f64 / f64::from(1 << 20);
        let pictures = if pictures > 0.0 { format!(", images {pictures:.1} MiB") } else { String::new() };
        row("textures", format!("{}{pictures}", shading.textures.len()));
        let mut lights = counted(self.emitters(), "emissive object");
        for (i, (n, kind)) in self.lights().into_iter().enumerate() {
            if n > 0 || i == 0 {
                lights += &format!(", {}", counted(n, kind));
            }
        }
        row("lights", lights);
        let hidden = self.n_hidden();
        if hidden > 0 {
            row("hidden", format!("{hidden} more, which the image leaves out"));
        }
        row("environment", environment(&self.inputs.environment));
        let lens = if self.lens().enabled { self.aperture() } else { "pinhole".to_owned() };
        row("camera", format!("{lens}, {}", self.projection()));
        row("film", format!("{} x {}, {} filter", film.width, film.height, self.filter()));
        if !self.layers.is_empty() {
            row("layers", self.layers.join(", "));
        }
        if let Some(filter) = self.denoised_by() {
            row("denoised", format!("by {filter}; the raw image is in its film, if that was saved"));
        }
        if let Some(how) = scene.shot.as_ref().and_then(|shot| shot.ended_early.clone()) {
            row("ended early", how);
        }
        if let Some(caustics) = self.caustics {
            row("caustics", caustics.to_string());
        }
        if self.n_portals > 0 {
            row("portals", format!("the environment is sampled through {}", counted(self.n_portals, "opening")));
        }
        if let Some(animation) = &self.animation {
            animation_rows(&scene.file.animation, animation, &mut row);
        }
        if let Some(facts) = &scene.facts {
            facts_rows(facts, &mut row);
        }
        let mib = |bytes: usize| format!("{:.1} MiB", bytes as f64 / f64::from(1 << 20));
        let [meshes, trees, film] = self.bytes().map(mib);
        row("memory", format!("meshes {meshes}, kd-trees {trees}, film {film}"));
        row("time", format!("{:.3} s to load, {:.3} s to build kd-trees", scene.load_seconds, scene.build_seconds));
        row("uses", list(&self.features(true)));
        row("not used", list(&self.features(false)));
        let not_modelled = self.not_modelled();
        if not_modelled.is_empty() {
            row("not modelled", "nothing that this scene contains".to_owned());
        }
        for (i, what) in not_modelled.into_iter().enumerate() {
            row(if i == 0 { "not modelled" } else { "" }, what);
        }
        // Last, since they may be long.
        if self.animation.is_some() {
            track_rows(&scene.file.animation, &mut row);
        }
        for (i, line) in self.list.lines().into_iter().enumerate() {
            row(if i == 0 { "parts" } else { "" }, line);
        }
        out
    }

    /// What denoised the pixels of the image that the scene is read from.
    fn denoised_by(&self) -> Option<&str> {
        let name = self.scene.shot.as_ref()?.denoised.as_deref()?;
        let filter = DenoiseFilter::ALL.into_iter().find(|filter| filter.name() == name);
        Some(filter.map_or(name, |filter| filter.label()))
    }

    /// As one line of JSON.
    fn json(&self) -> serde_json::Value {
        let Self { scene, extraction, film, .. } = self;
        let shading = &extraction.prepared.shading;
        let lens = self.lens();
        let [meshes, trees, film_bytes] = self.bytes();
        let mut json = serde_json::json!({
            "scene": scene.source.title(),
            "denoised": scene.shot.as_ref().and_then(|shot| shot.denoised.as_deref()),
            "fingerprint": scene.fingerprint().to_string(),
            "objects": self.objects(),
            "parts": self.list.json(),
            "bounds": self.list.bounds_json(),
            "materials": self.materials(),
            "textures": shading.textures.len(),
            "emissive_objects": self.emitters(),
            "hidden": self.n_hidden(),
            "environment": environment(&self.inputs.environment),
            "lens_radius": if lens.enabled { lens.radius } else { 0.0 },
            "width": film.width,
            "height": film.height,
            "filter": self.filter(),
            "layers": self.layers,
            "bytes": { "meshes": meshes, "trees": trees, "textures": scene.picture_bytes(), "film": film_bytes },
            "load_s": scene.load_seconds,
            "build_s": scene.build_seconds,
            "uses": self.features(true),
            "not_used": self.features(false),
            "not_modelled": self.not_modelled(),
            "caustics": self.caustics.map(caustics_json),
            "portals": self.n_portals,
            "animation": self.animation.as_ref().map(|animation| animation_json(&scene.file.animation, animation)),
            "model": scene.facts.as_ref().map(facts_json),
            "warnings": texts_of(&scene.warnings, Severity::Warning),
            "notices": texts_of(&scene.warnings, Severity::Notice),
            "problems": extraction.problems,
        });
        for (n, kind) in self.lights() {
            json[kind.replace(' ', "_") + "s"] = n.into();
        }
        json
    }

    /// Unsupported features of the scene's files, one text each.
    fn not_modelled(&self) -> Vec<String> {
        let Some(facts) = &self.scene.facts else {
            // For other formats they are in the warnings.
            let says = |warning: &&Warning| ["not modelled", "left out"].iter().any(|words| warning.contains(words));
            return self.scene.warnings.iter().filter(says).map(Warning::to_string).collect();
        };
        let extensions = facts.unknown_extensions.iter().map(|name| format!("extension {}", printable::name(name)));
        let notes = facts.notes.iter().map(|(material, note)| format!("{}: {note}", printable::name(material)));
        extensions.chain(notes).collect()
    }

    fn objects(&self) -> BTreeMap<&'static str, usize> {
        counts(self.inputs.objects.iter().map(|object| kind_of_shape(&object.shape)))
    }

    fn materials(&self) -> BTreeMap<&'static str, usize> {
        counts(self.extraction.prepared.shading.materials.iter().map(|material| material.kind().name()))
    }

    fn emitters(&self) -> usize {
        let prepared = &self.extraction.prepared;
        let emits = |&id: &u32| Emission::of(&prepared.shading.materials, id).is_some();
        let objects = prepared.geometry.objects.iter().filter(|object| !object.is_point_light);
        objects.filter(|object| object.materials.iter().any(emits)).count()
    }

    /// The number of lights of each kind.
    fn lights(&self) -> [(usize, &'static str); LightKind::NAMES.len()] {
        LightKind::NAMES
            .map(|kind| (self.inputs.lights.iter().filter(|light| light.light.name() == kind).count(), kind))
    }

    fn lens(&self) -> Lens {
        self.inputs.camera.map_or_else(Lens::default, |camera| camera.lens)
    }

    /// Its size, also as an f-number if there are such lenses.
    fn aperture(&self) -> String {
        let aperture = self.inputs.camera.map(|camera| Aperture::of(camera.lens.radius, &camera.projection));
        let radius = format!("lens radius {} m", two_digits(self.lens().radius));
        match aperture {
            Some(Aperture::FNumber(stop)) => format!("{}, {radius}", f_number(stop)),
            _ => radius,
        }
    }

    fn projection(&self) -> String {
        let projection = self.inputs.camera.map_or_else(Projection::default, |camera| camera.projection);
        match projection.orthographic_height {
            Some(height) => format!("orthographic, {} m high", two_digits(height)),
            None => format!("{}° high", two_digits(projection.vfov_deg)),
        }
    }

    fn filter(&self) -> String {
        // As spelled in scene files.
        let words = format!("{:?}", self.scene.file.film.filter);
        let spaced =
            words.char_indices().flat_map(|(i, c)| (i > 0 && c.is_uppercase()).then_some(' ').into_iter().chain([c]));
        spaced.collect::<String>().to_lowercase()
    }

    /// Memory of meshes, trees and the film, bytes.
    fn bytes(&self) -> [usize; 3] {
        let mut meshes: BTreeMap<usize, usize> = BTreeMap::new();
        for object in &self.inputs.objects {
            if let Shape::Mesh(mesh) = &object.shape {
                let bytes = mesh.positions.len() * 12
                    + mesh.triangles.len() * 12
                    + mesh.normals.len() * 12
                    + (mesh.uvs.len() + mesh.uvs2.len()) * 8
                    + (mesh.colors.len() + mesh.tangents.len()) * 16
                    + mesh.slots.len() * 2;
                meshes.insert(Arc::as_ptr(mesh) as usize, bytes);
            }
        }
        let film = self.film.width as usize * self.film.height as usize * Film::BYTES_A_PIXEL;
        [meshes.values().sum(), self.scene.trees.bytes(), film]
    }

    /// The names in [`FEATURES`] that the scene uses, or those that it does not use.
    fn features(&self, used: bool) -> Vec<&'static str> {
        let has = features(self.extraction, &self.lens());
        FEATURES.into_iter().zip(has).filter(|(_, has)| *has == used).map(|(name, _)| name).collect()
    }
}

/// The sampling of caustics as JSON.
fn caustics_json(choice: CausticChoice) -> serde_json::Value {
    let CausticChoice { plan, cost, gain } = choice;
    serde_json::json!({
        "light_path_stride": plan.light_path_stride, "guided": plan.guided, "cost": cost, "variance_saved": gain,
        "text": choice.to_string(),
    })
}

/// The animation as text.
fn animation_rows(part: &AnimationPart, animation: &Animation, row: &mut impl FnMut(&str, String)) {
    let (length, fps) = (number(animation.length()), number(animation.fps));
    let n_frames = animation.n_frames();
    let frames = counted(n_frames as usize, "frame");
    row("animation", format!("{length} s, {frames} at {fps} per second, shown at {} s", number(part.at)));
    let exposure = match animation.shutter {
        Shutter::Share(0.0) | Shutter::Seconds(0.0) => "closed: no motion blur".to_owned(),
        Shutter::Share(share) => {
            format!("open for {} of a frame, {} ms: motion blur", number(share), number(1e3 * share / animation.fps))
        }
        Shutter::Seconds(seconds) => format!("open for {} ms: motion blur", number(1e3 * seconds)),
    };
    row("shutter", exposure);
}

/// The tracks of an animation as text.
fn track_rows(part: &AnimationPart, row: &mut impl FnMut(&str, String)) {
    /// Further ones are counted; `--json` has all.
    const MOST: usize = 60;
    for (i, track) in part.tracks.iter().take(MOST).enumerate() {
        let what = moved(track);
        let keys = counted(track.keys().len(), "key");
        let span = match track.keys() {
            [(start, _), .., (end, _)] => format!(", {} to {} s", number(*start), number(*end)),
            _ => String::new(),
        };
        row(if i == 0 { "tracks" } else { "" }, format!("{what}: {keys}, {}{span}", track.interpolation().name()));
    }
    if part.tracks.len() > MOST {
        row("", format!("… and {} more (--json lists all)", part.tracks.len() - MOST));
    }
}

/// Such as `translate of ball`.
fn moved(track: &TrackPart) -> String {
    let (property, name) = match track {
        TrackPart::Camera { property, .. } => (property.name(), "camera"),
        TrackPart::Object { property, name, .. } => (property.name(), name.as_str()),
        TrackPart::Light { property, name, .. } => (property.name(), name.as_str()),
        TrackPart::Material { property, name, .. } => (property.name(), name.as_str()),
    };
    format!("{property} of {}", printable::name(name))
}

/// The animation as JSON.
fn animation_json(part: &AnimationPart, animation: &Animation) -> serde_json::Value {
    let tracks: Vec<_> = (part.tracks.iter())
        .map(|track| {
            let times: Vec<f64> = track.keys().iter().map(|(time, _)| *time).collect();
            serde_json::json!({ "of": moved(track), "interpolation": track.interpolation().name(), "keys_s": times })
        })
        .collect();
    serde_json::json!({
        "length_s": animation.length(), "fps": animation.fps, "frames": animation.n_frames(), "at_s": part.at,
        "shutter": part.shutter, "shutter_s": part.shutter_seconds, "tracks": tracks,
    })
}

/// A number of a scene file, with at most three decimal places.
fn number(value: f64) -> String {
    ((value * 1e3).round() / 1e3).to_string()
}

/// The contents of a glTF file as text.
fn facts_rows(facts: &GltfFacts, row: &mut impl FnMut(&str, String)) {
    let names = |names: &[String]| {
        let shown: Vec<_> = names.iter().map(|name| printable::name(name)).collect();
        if shown.is_empty() { "none".to_owned() } else { shown.join(", ") }
    };
    let meshes = if facts.meshes == 1 { "1 mesh".to_owned() } else { format!("{} meshes", facts.meshes) };
    row("model", format!("{meshes} in the file, {}", counted(facts.instances, "instance")));
    row("cameras", names(&facts.cameras));
    row("model lights", names(&facts.lights));
    row("variants", names(&facts.variants));
    let animations = match facts.animation_length {
        Some(seconds) => format!("{}, {} s", names(&facts.animations), two_digits(seconds)),
        None => "none".to_owned(),
    };
    row("animations", animations);
    row("extensions", names(&facts.extensions));
}

/// The contents of a glTF file as JSON.
fn facts_json(facts: &GltfFacts) -> serde_json::Value {
    let notes: Vec<_> = facts.notes.iter().map(|(material, note)| serde_json::json!([material, note])).collect();
    serde_json::json!({
        "meshes": facts.meshes, "instances": facts.instances, "cameras": facts.cameras, "lights": facts.lights,
        "variants": facts.variants, "animations": facts.animations, "animation_s": facts.animation_length,
        "extensions": facts.extensions, "unknown_extensions": facts.unknown_extensions, "not_modelled": notes,
    })
}

fn kind_of_shape(shape: &Shape) -> &'static str {
    match shape {
        Shape::Sphere { .. } => "sphere",
        Shape::Plane { .. } => "plane",
        Shape::Quad { .. } => "quad",
        Shape::Triangle { .. } => "triangle",
        Shape::Mesh(_) => "mesh",
        Shape::Spheres(_) => "sphere cloud",
    }
}

fn environment(environment: &SceneEnvironment) -> String {
    if let EnvironmentSource::Sky { elevation, azimuth, turbidity, .. } = &environment.part {
        return format!("clear sky, sun at {elevation:.1}°, azimuth {azimuth:.1}°, turbidity {turbidity}");
    }
    match &environment.light {
        Environment::Black => "black".to_owned(),
        Environment::Constant(radiance) => format!("constant {radiance}"),
        Environment::Gradient { .. } => "gradient sky".to_owned(),
        Environment::Image { image, .. } => format!("image, {} x {}", image.width, image.height),
    }
}

const FEATURES: [&str; 9] = [
    "lens",
    "textures",
    "glass",
    "light sampling",
    "environment light",
    "caustics",
    "blends",
    "rough metal",
    "rough glass",
];

fn features(extraction: &Extraction, lens: &Lens) -> [bool; 9] {
    let (shading, features) = (&extraction.prepared.shading, extraction.prepared.features());
    let has = |kind: &str| shading.materials.iter().any(|material| material.kind().name() == kind);
    [
        lens.enabled && lens.radius > 0.0,
        !shading.textures.is_empty(),
        features.glass,
        features.light_sampling,
        features.environment,
        features.caustics,
        has("blend"),
        has("metal"),
        has("rough_glass"),
    ]
}

fn list(names: &[&str]) -> String {
    if names.is_empty() { "nothing".to_owned() } else { names.join(", ") }
}

fn texts_of(warnings: &Warnings, severity: Severity) -> Vec<&str> {
    warnings.iter().filter(|warning| warning.severity == severity).map(|warning| &**warning).collect()
}

fn counts<'a>(kinds: impl Iterator<Item = &'a str>) -> BTreeMap<&'a str, usize> {
    let mut counts: BTreeMap<&str, usize> = BTreeMap::new();
    for kind in kinds {
        *counts.entry(kind).or_default() += 1;
    }
    counts
}
