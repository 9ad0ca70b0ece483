//! What a session shows opens again as what it shows: random edits, flights and times, undone and redone; the scene is
//! saved, and an image of it; both are loaded into a world of their own and rendered with the same seed and samples.
//!
//! `FIRSTLIGHT_EDIT_ROUNDS`: how many rounds, instead of 50.

use crate::driver::{Drive, Driver, of_material};
use crate::random::Random;
use firstlight::frame::{
    Command, CurrentScene, Edit, MessageKind, NewThing, Print, Property, Session, SessionOptions, Target,
    render_offline,
};
use firstlight::render::{Film, MaterialKind, SampleAllocation};
use firstlight::scene::animation::{Interpolation, LightProperty};
use firstlight::scene::file::SceneFile;
use firstlight::scene::whole_file::Replace;
use firstlight::scene::{
    Description, Extraction, ImageSamples, LoadOptions, LoadedScene, Rendering, Rgb, SceneInputs, SceneSource,
    TextureSource, load,
};
use glam::{DVec2, DVec3, Vec3};
use std::error::Error;
use std::path::Path;

const SIZE: (u32, u32) = (24, 16);
const SPP: u32 = 2;
const SEED: u32 = 7;

/// Tracks of all kinds, motion blur, a mesh file, an image, names that are used twice.
const ROOM: &str = r#"(
    camera: (eye: (0, 1, 6), look_at: (0, 0.5, 0), vfov: 40, lens_radius: 0.02),
    cameras: { "side": (eye: (5, 1, 0), forward: (-1, 0, 0), pivot_distance: 4) },
    environment: gradient(zenith: 0.6, horizon: 0.4, ground: 0.1),
    textures: { "tiles": image(file: "tiles.png") },
    materials: {
        "red": diffuse(albedo: (0.8, 0.1, 0.1)), "satin": metal(alpha: 0.2, reflectance: 0.9),
        "floor": diffuse(albedo: "tiles"), "glass": glass(ior: 1.5), "mixed": blend(weight: 0.5, a: "red", b: "satin"),
    },
    objects: [
        plane(material: "floor"),
        sphere(name: "ball", center: (-2, 0.5, 0), radius: 0.5, material: "red"),
        sphere(name: "ball", center: (0, 0.5, 1), radius: 0.4, material: "glass"),
        mesh(name: "ring", source: builtin("cube"), material: "mixed", transform: (translate: (1, 1, -2), scale: 0.5)),
        mesh(name: "tent", source: obj("tent.obj"), material: "satin"),
        spheres(centers: [(2, 0.2, 1), (2.5, 0.2, 1)], radii: all(0.2), material: "red"),
    ],
    lights: [
        point(name: "bulb", position: (2, 3, 2), intensity: 20, radius: 0.1),
        spot(name: "spot", position: (0, 3, 0), direction: (0, -1, 0), intensity: 5, outer_angle: 30),
    ],
    animation: (
        fps: 10,
        shutter: 0.5,
        tracks: [
            camera(property: eye, interpolation: smooth, keys: [(0, (0, 1, 6)), (1, (2, 1, 5)), (4, (4, 2, 4))]),
            camera(property: vfov, interpolation: held, keys: [(0, 40), (2, 30), (4, 20)]),
            object(name: "ring", property: rotate, keys: [(0, (0, 0, 0)), (4, (0, 720, 0))]),
            object(name: "tent", property: translate, keys: [(1, (-2, 0.5, 0)), (3, (2, 0.5, 1))]),
            light(name: "bulb", property: intensity, interpolation: held, keys: [(0, 20), (2, (30, 20, 10))]),
            material(name: "red", property: albedo, keys: [(0, (0.8, 0.1, 0.1)), (2, 0.4)]),
        ],
    ),
)"#;

fn write_room(folder: &Path) -> SceneSource {
    let tent = "v 0 0 0\nv 1 0 0\nv 0 0 -1\nv 0 1 0\nf 1 2 4\nf 2 3 4\nf 3 1 4\n";
    std::fs::write(folder.join("tent.obj"), tent).unwrap();
    std::fs::write(folder.join("room.ron"), ROOM).unwrap();
    let image = image::RgbImage::from_fn(4, 4, |x, y| image::Rgb([60 + 40 * x as u8, 200 - 40 * y as u8, 90]));
    image.save(folder.join("tiles.png")).unwrap();
    SceneSource::Scene(folder.join("room.ron"))
}

impl Driver {
    fn small(source: SceneSource) -> Self {
        let options = SessionOptions {
            width: SIZE.0,
            height: SIZE.1,
            threads: Some(2),
            seed: SEED,
            target: Target { spp: Some(SPP), ..Target::default() },
            ..SessionOptions::default()
        };
        let mut driver = Self::new(options, source);
        driver.settle();
        driver
    }

    fn send(&mut self, commands: impl IntoIterator<Item = Command>) {
        for command in commands {
            self.session.send(command);
            self.frame();
        }
    }

    fn errors(&self) -> Vec<String> {
        let messages = self.session.status().messages.iter();
        messages.filter(|message| message.kind == MessageKind::Error).map(|message| message.text.clone()).collect()
    }

    /// One thing that somebody may do to the scene, sensible or not.
    fn whim(&mut self, random: &mut Random) -> Vec<Command> {
        let inputs = self.session.inputs();
        let things: Vec<u64> = (inputs.objects.iter().map(|object| object.entity))
            .chain(inputs.lights.iter().map(|light| light.entity))
            .map(|entity| entity.to_bits())
            .collect();
        let materials: Vec<u64> = inputs.materials.iter().map(|material| material.entity.to_bits()).collect();
        let mut one = |ids: &[u64]| ids.get(random.below(ids.len())).copied().unwrap_or_default();
        let (id, material) = (one(&things), one(&materials));
        let mut number = || f64::from(random.signed());
        let three = DVec3::new(number(), number(), number());
        let (a, b) = (number(), number());
        let select = Command::Edit(Edit::Select { id, add: false });
        let edit = |edit: Edit| vec![select.clone(), Command::Edit(edit)];
        let set = |id, property, value| vec![Command::Edit(Edit::Set { id, property, value })];
        let things =
            [NewThing::Sphere, NewThing::Plane, NewThing::AreaLight, NewThing::PointLight, NewThing::SpotLight];
        let kinds = [MaterialKind::Diffuse, MaterialKind::Metal, MaterialKind::Glass, MaterialKind::Mirror];
        let names = ["", "ball", "a \"quoted\" \\ name", "käse 球", "sphere 2", "\n"];
        let hows = [Interpolation::Linear, Interpolation::Smooth, Interpolation::Held];
        let properties = ["albedo", "reflectance", "alpha", "ior", "weight", "absorption"].map(of_material);
        let of_sky = [Property::Zenith, Property::Horizon, Property::Ground, Property::SkyStrength];
        let share = 0.5 + 0.5 * three;
        match random.below(39) {
            0 => vec![Command::Turn { yaw_deg: 60.0 * a, pitch_deg: 40.0 * b }],
            1 => vec![Command::Orbit { yaw_deg: 90.0 * a, pitch_deg: 60.0 * b }],
            2 => vec![Command::Fly { right: a, up: 0.3 * b, forward: a * b }],
            3 => vec![Command::Dolly { factor: a.exp() }, Command::Zoom { factor: (0.5 * b).exp() }],
            4 => vec![Command::Roll { angle_deg: 90.0 * a }],
            5 => vec![
                Command::SetAperture { radius: 0.1 * a.abs() },
                Command::SetFocus { distance: 1.0 + 5.0 * b.abs() },
            ],
            6 => vec![Command::NextCamera],
            7 => vec![Command::Home],
            8 | 9 => vec![Command::SetMoment { seconds: Some(2.0 + 2.5 * a) }],
            10 => vec![Command::AdvanceMoment { seconds: a }],
            11 => vec![Command::AdjustExposure { stops: a as f32 }],
            12..15 => edit(Edit::Move { by: three }),
            15 => edit(Edit::Turn { axis: three, angle_deg: 180.0 * a }),
            16 => edit(Edit::Scale { factors: DVec3::splat(a.exp()) }),
            17 => edit(Edit::Delete),
            18 => edit(Edit::Duplicate),
            19 => vec![Command::Edit(Edit::Add(things[random.below(things.len())].clone()))],
            20..22 => set(material, properties[random.below(properties.len())], share),
            22 => vec![Command::Edit(Edit::SetKind { id: material, kind: kinds[random.below(kinds.len())] })],
            23 => vec![Command::Edit(Edit::Assign { id, material })],
            24 => vec![Command::Edit(Edit::OwnMaterial { id })],
            25 => vec![Command::Edit(Edit::Rename { id, name: names[random.below(names.len())].to_owned() })],
            26 => set(id, Property::Light(LightProperty::Intensity), 20.0 * share),
            27 => set(0, of_sky[random.below(of_sky.len())], share),
            28 => vec![Command::Edit(Edit::SetKeys { camera: a > 0.0 })],
            29 => edit(Edit::SetKeys { camera: false }),
            30 => edit(Edit::DeleteKeys),
            31 => edit(Edit::Interpolate { how: hows[random.below(hows.len())] }),
            32 => set(0, Property::Shutter, DVec3::splat(share.x)),
            33 => {
                let (a, b) = (Rgb(Vec3::splat(share.x as f32)), Rgb(Vec3::splat(share.y as f32)));
                let part =
                    TextureSource::Checker { a, b, squares: DVec2::splat(4.0), offset: DVec2::ZERO, rotate: 0.0 };
                vec![Command::Edit(Edit::Paint { id: material, part })]
            }
            34 => vec![Command::Edit(Edit::Undo); 1 + random.below(4)],
            35 | 36 => edit(Edit::Hide { others: a > 0.8 }),
            37 => vec![Command::Edit(Edit::ShowAll)],
            _ => vec![Command::Edit(Edit::Undo), Command::Edit(Edit::Undo), Command::Edit(Edit::Redo)],
        }
    }
}

fn opened(source: &SceneSource) -> Result<LoadedScene, String> {
    load(source, &LoadOptions::default()).map_err(|error| error.to_string())
}

/// Of a scene in a world of its own.
fn rendered(scene: &LoadedScene) -> (SceneFile, Film) {
    let mut world = bevy_ecs::world::World::new();
    let settings =
        firstlight::render::RenderSettings { seed: SEED, allocation: SampleAllocation::Uniform, ..Default::default() };
    world.insert_resource(Rendering(settings));
    scene.spawn(&mut world);
    let file = Description::of(&mut world, Some(scene)).file;
    let inputs = SceneInputs::of(&mut world);
    let extraction = Extraction::of_world(&mut world, &inputs, &scene.trees);
    let settings = world.resource::<Rendering>().0;
    let mut film = Film::new(SIZE.0, SIZE.1);
    let target = Target { spp: Some(SPP), ..Target::default() };
    render_offline(&extraction.prepared, &settings, &mut film, target, |_| true);
    (file, film)
}

/// The lines of two scene files that differ.
fn difference(a: &SceneFile, b: &SceneFile) -> String {
    let (a, b) = (a.to_ron(), b.to_ron());
    let lines = a.lines().zip(b.lines()).filter(|(a, b)| a != b).take(6);
    lines.map(|(a, b)| format!("\n- {a}\n+ {b}")).collect()
}

/// The session as a scene file and as an image, opened again, shows what the session shows.
fn check(driver: &mut Driver, folder: &Path, round: usize) -> Result<(), Box<dyn Error>> {
    driver.settle();
    let scene = folder.join("saved.ron");
    driver.session.send(Command::SaveScene { path: scene.clone() });
    driver.run_until(|session| !session.is_saving());
    let errors = driver.errors();
    if !errors.is_empty() {
        return Err(errors.join("; ").into());
    }
    driver.settle();
    let live = driver.session.describe().file;
    let film = driver.session.film_snapshot().ok_or("there is no film")?;
    let picture = folder.join("picture.exr");
    save_image(driver, &film, &picture)?;
    for source in [SceneSource::Scene(scene), SceneSource::Picture(picture.clone())] {
        let title = source.title();
        let scene = opened(&source)?;
        let (file, fresh) = rendered(&scene);
        let is_picture = matches!(source, SceneSource::Picture(_));
        // An image has the size of its film, a scene file that of its scene.
        let file = SceneFile { film: live.film, ..file };
        if !is_picture && file != live {
            return Err(format!("{title} describes another scene:{}", difference(&live, &file)).into());
        }
        if is_picture && !scene.warnings.is_empty() {
            return Err(format!("{title}: {:?}", scene.warnings).into());
        }
        if fresh.means() != film.means() {
            let n = fresh.means().iter().zip(&film.means()).filter(|(a, b)| a != b).count();
            return Err(format!("{title} shows another scene: {n} pixels differ{}", difference(&live, &file)).into());
        }
    }
    // In a process of its own, now and then.
    if round % 10 == 3 {
        let program = env!("CARGO_BIN_EXE_firstlight");
        let done = std::process::Command::new(program)
            .args(["render", "picture.exr", "-o", "again.exr", "-q"])
            .current_dir(folder)
            .output()?;
        if !done.status.success() || std::fs::read(&picture)? != std::fs::read(folder.join("again.exr"))? {
            return Err(
                format!("another process renders another image: {}", String::from_utf8_lossy(&done.stderr)).into()
            );
        }
    }
    Ok(())
}

/// The image that the session shows, with its scene.
fn save_image(driver: &mut Driver, film: &Film, path: &Path) -> Result<(), Box<dyn Error>> {
    let display = driver.session.status().display;
    let samples = ImageSamples { first: 0, spp: film.spp(), uneven: film.is_uneven() };
    let note = driver.session.shot_draft().note(path, SIZE, samples, display);
    let print = Print { film, display: &display, size: SIZE, note: Some(&note), denoised: None };
    Ok(print.write(path, Replace::Anything)?)
}

fn rounds() -> usize {
    std::env::var("FIRSTLIGHT_EDIT_ROUNDS").ok().and_then(|rounds| rounds.parse().ok()).unwrap_or(50)
}

#[test]
fn edits_equal_reloads() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path();
    let room = write_room(path);
    let builtin = |name: &str| SceneSource::Builtin(name.to_owned());
    let sources = [room.clone(), builtin("carousel"), room, builtin("glass-balls")];
    let mut failures = Vec::new();
    let mut driver = Driver::small(sources[0].clone());
    let mut done = Vec::new();
    for round in 0..rounds() {
        if round % 10 == 0 {
            let source = sources[round / 10 % sources.len()].clone();
            driver = Driver::small(source.clone());
            done = vec![source.title()];
        }
        let mut random = Random(round as u64);
        for _ in 0..1 + random.below(6) {
            let whim = driver.whim(&mut random);
            done.push(format!("{whim:?}"));
            driver.send(whim);
        }
        if let Err(problem) = check(&mut driver, path, round) {
            failures.push(format!("round {round}: {problem}\nafter {}", done.join("\n  ")));
            // What is wrong stays wrong.
            driver = Driver::small(sources[0].clone());
            done = vec![sources[0].title()];
        }
    }
    assert!(failures.is_empty(), "{} rounds failed:\n{}", failures.len(), failures.join("\n\n"));
}

/// A file that was edited elsewhere: the session that reads it again shows what a new one does.
#[test]
fn a_scene_that_is_read_again_equals_one_that_is_opened() {
    let [ours, theirs] = [(); 2].map(|()| tempfile::tempdir().unwrap());
    let source = write_room(ours.path());
    let mut editor = Driver::small(write_room(theirs.path()));
    let mut driver = Driver::small(source.clone());
    let SceneSource::Scene(path) = &source else { unreachable!() };
    for round in 0..rounds().div_ceil(2) {
        let mut random = Random(0xF11E + round as u64);
        for _ in 0..1 + random.below(6) {
            let whim = editor.whim(&mut random);
            editor.send(whim);
        }
        let edited = theirs.path().join("edited.ron");
        editor.session.send(Command::SaveScene { path: edited.clone() });
        editor.run_until(|session| !session.is_saving());
        // As an editor of text does.
        std::fs::write(path, std::fs::read(&edited).unwrap()).unwrap();
        let (file, film) = rendered(&opened(&source).unwrap());
        let is_read =
            |session: &Session| session.world().resource::<CurrentScene>().0.file == opened(&source).unwrap().file;
        driver.run_until(|session| is_read(session) && session.status().done && session.is_idle());
        let live = driver.session.describe().file;
        assert!(live == file, "round {round}:{}", difference(&file, &live));
        assert!(driver.session.film_snapshot().unwrap().means() == film.means(), "round {round}: another image");
    }
}

/// An image of strangers may name any scene file as its own.
#[test]
fn what_an_image_names_as_its_scene_is_not_where_it_is_saved() {
    let folder = tempfile::tempdir().unwrap();
    let mut driver = Driver::small(write_room(folder.path()));
    driver.settle();
    assert_eq!(driver.session.scene_file(), Some(folder.path().join("room.ron")));
    let film = driver.session.film_snapshot().unwrap();
    let picture = folder.path().join("picture.exr");
    save_image(&mut driver, &film, &picture).unwrap();
    let mut driver = Driver::small(SceneSource::Picture(picture));
    driver.settle();
    assert_eq!(driver.session.scene_file(), None);
    let new = folder.path().join("new.ron");
    driver.session.send(Command::SaveScene { path: new.clone() });
    driver.run_until(|session| !session.is_saving());
    assert_eq!(driver.session.scene_file(), Some(new));
}

/// Where the disk with the images is away for a day, the scene that names them is left as it is.
#[test]
fn a_scene_without_its_images_is_saved_to_another_file_and_says_so() {
    let folder = tempfile::tempdir().unwrap();
    let source = write_room(folder.path());
    let path = folder.path().join("room.ron");
    let (text, tiles) = (std::fs::read_to_string(&path).unwrap(), folder.path().join("tiles.png"));
    std::fs::remove_file(&tiles).unwrap();
    let mut driver = Driver::small(source);
    driver.settle();
    assert_eq!(driver.session.scene_file(), None);
    let new = folder.path().join("new.ron");
    driver.session.send(Command::SaveScene { path: new.clone() });
    driver.run_until(|session| !session.is_saving());
    driver.frame();
    let said = |driver: &Driver| {
        let warnings = driver.session.status().messages.iter().filter(|said| said.kind == MessageKind::Warning);
        warnings
            .filter(|said| said.text.contains("`tiles.png` is missing, and the saved scene does not name it"))
            .count()
    };
    assert_eq!((said(&driver), driver.session.scene_file()), (1, Some(new.clone())));
    assert!(text.contains("tiles.png") && !std::fs::read_to_string(&new).unwrap().contains("tiles.png"));
    assert_eq!(std::fs::read_to_string(&path).unwrap(), text);
    driver.session.send(Command::SaveScene { path: new });
    driver.run_until(|session| !session.is_saving());
    driver.frame();
    assert_eq!(said(&driver), 1, "once is enough");
}
