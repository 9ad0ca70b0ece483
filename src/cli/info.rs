//! `firstlight info SCENE`: what is in it, what it uses, what is not modelled, memory.

use super::{Failure, SceneArgs};
use clap::Args;
use firstlight::render::{Environment, Material};
use firstlight::scene::{Extraction, FilmSize, Lens, LoadedScene, SceneInputs, Shape};
use std::collections::BTreeMap;
use std::sync::Arc;

#[derive(Args, Clone, Debug)]
pub struct InfoArgs {
    #[command(flatten)]
    scene: SceneArgs,
    /// Build many trees over each mesh instead, and tell what they and their rays cost.
    #[arg(long)]
    tree: bool,
    /// Print one JSON object.
    #[arg(long, requires = "tree")]
    json: bool,
}

pub fn run(args: &InfoArgs) -> Result<(), Failure> {
    let scene = args.scene.load(None, &|_| ())?;
    let mut world = bevy_ecs::world::World::new();
    scene.spawn(&mut world);
    let inputs = SceneInputs::of(&mut world);
    let extraction = Extraction::new(&inputs, &scene.trees);
    for problem in &extraction.problems {
        eprintln!("warning: {problem}");
    }
    if args.tree {
        return super::trees::run(&inputs, &extraction, args.json);
    }
    let film = *world.resource::<FilmSize>();
    println!("{}", scene.source.title());
    let row = |name: &str, text: String| println!("  {name:14}{text}");
    row("objects", counts(inputs.objects.iter().map(|object| kind_of_shape(&object.shape))));
    for object in &inputs.objects {
        let name = object.name.as_deref().unwrap_or("(no name)");
        match &object.shape {
            Shape::Mesh(mesh) => {
                row("", format!("{name}: {} triangles, {} vertices", mesh.triangles.len(), mesh.positions.len()));
            }
            Shape::Spheres(balls) => row("", format!("{name}: {} balls", balls.centers.len())),
            _ => {}
        }
    }
    let shading = &extraction.snapshot.shading;
    row("materials", counts(shading.materials.iter().map(kind_of_material)));
    row("textures", shading.textures.len().to_string());
    let emitters = inputs.objects.iter().filter(|object| glows(object, &inputs)).count();
    row("lights", format!("{emitters} emissive objects, {} point lights", inputs.lights.len()));
    row("environment", environment(&shading.environment));
    let lens = inputs.camera.map_or_else(Lens::default, |camera| camera.lens);
    row("camera", if lens.enabled { format!("lens of radius {} m", lens.radius) } else { "pinhole".to_owned() });
    row("film", format!("{} x {}, box filter", film.width, film.height));
    row("memory", memory(&scene, &inputs, film));
    row("time", format!("{:.3} s to read, {:.3} s to build trees", scene.load_seconds, scene.build_seconds));
    row("uses", list(&used(&extraction, &lens)));
    row("not used", list(&unused(&extraction, &lens)));
    row(
        "not modelled",
        "spectra, polarisation, motion blur, media that scatter, rough glass, light behind a lens".to_owned(),
    );
    Ok(())
}

fn kind_of_shape(shape: &Shape) -> &'static str {
    match shape {
        Shape::Sphere { .. } => "sphere",
        Shape::Plane { .. } => "plane",
        Shape::Quad { .. } => "quad",
        Shape::Triangle { .. } => "triangle",
        Shape::Mesh(_) => "mesh",
        Shape::Spheres(_) => "cloud of balls",
    }
}

fn kind_of_material(material: &Material) -> &'static str {
    match material {
        Material::Diffuse { .. } => "diffuse",
        Material::Mirror { .. } => "mirror",
        Material::Metal { .. } => "metal",
        Material::Glass { .. } => "glass",
        Material::Blend { .. } => "blend",
        Material::Phong { .. } => "phong",
        Material::Emissive { .. } => "emissive",
    }
}

fn glows(object: &firstlight::scene::ObjectInput, inputs: &SceneInputs) -> bool {
    use firstlight::scene::Material::Emissive;
    (inputs.materials.iter())
        .any(|material| matches!(material.material, Emissive { .. }) && object.slots.contains(&material.entity))
}

fn environment(environment: &Environment) -> String {
    match environment {
        Environment::Black => "black".to_owned(),
        Environment::Constant(radiance) => format!("constant {radiance}"),
        Environment::Gradient { .. } => "gradient sky".to_owned(),
        Environment::Image { image, .. } => format!("picture, {} x {}", image.width, image.height),
    }
}

/// Bytes of what was read and built, and of the film.
fn memory(scene: &LoadedScene, inputs: &SceneInputs, film: FilmSize) -> String {
    let mut meshes: BTreeMap<usize, usize> = BTreeMap::new();
    for object in &inputs.objects {
        if let Shape::Mesh(mesh) = &object.shape {
            let bytes = mesh.positions.len() * 12
                + mesh.triangles.len() * 12
                + mesh.normals.len() * 12
                + mesh.uvs.len() * 8
                + mesh.slots.len() * 2;
            meshes.insert(Arc::as_ptr(mesh) as usize, bytes);
        }
    }
    let meshes: usize = meshes.values().sum();
    let film = u64::from(film.width) * u64::from(film.height) * 24;
    let mib = |bytes: f64| format!("{:.1} MiB", bytes / f64::from(1 << 20));
    format!("meshes {}, trees {}, film {}", mib(meshes as f64), mib(scene.trees.bytes() as f64), mib(film as f64))
}

const FEATURES: [&str; 8] =
    ["lens", "textures", "glass", "light sampling", "environment light", "caustics", "blends", "rough metal"];

fn features(extraction: &Extraction, lens: &Lens) -> [bool; 8] {
    let shading = &extraction.snapshot.shading;
    let has = |kind: &str| shading.materials.iter().any(|material| kind_of_material(material) == kind);
    [
        lens.enabled && lens.radius > 0.0,
        !shading.textures.is_empty(),
        shading.features.glass,
        shading.features.light_sampling,
        shading.features.environment,
        shading.features.caustics,
        has("blend"),
        has("metal"),
    ]
}

fn used(extraction: &Extraction, lens: &Lens) -> Vec<&'static str> {
    FEATURES.into_iter().zip(features(extraction, lens)).filter(|(_, used)| *used).map(|(name, _)| name).collect()
}

fn unused(extraction: &Extraction, lens: &Lens) -> Vec<&'static str> {
    FEATURES.into_iter().zip(features(extraction, lens)).filter(|(_, used)| !*used).map(|(name, _)| name).collect()
}

fn list(names: &[&str]) -> String {
    if names.is_empty() { "nothing".to_owned() } else { names.join(", ") }
}

/// `2 × quad, 1 × sphere`.
fn counts<'a>(kinds: impl Iterator<Item = &'a str>) -> String {
    let mut counts: BTreeMap<&str, usize> = BTreeMap::new();
    for kind in kinds {
        *counts.entry(kind).or_default() += 1;
    }
    let parts: Vec<String> = counts.iter().map(|(kind, n)| format!("{n} × {kind}")).collect();
    if parts.is_empty() { "none".to_owned() } else { parts.join(", ") }
}
