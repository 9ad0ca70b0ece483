//! Lists of materials and lights, and what is done to all that share one, without a window.

use crate::driver::{Drive, of_material};
use bevy_ecs::entity::Entity;
use firstlight::format::property::SkyProperty;
use firstlight::frame::{Command, Edit, History, Property, Selection, Session, SessionOptions, Target, sky_strength};
use firstlight::render::Environment;
use firstlight::scene::{
    ColorParam, EnvironmentSource, Inventory, Material, SceneEnvironment, SceneSource, SurfaceMaterial,
};
use glam::{DVec3, Vec3};
use std::sync::Arc;
use std::time::Instant;

const SCENE: &str = r#"(
    camera: (eye: (0, 1, 6), look_at: (0, 0.5, 0)),
    environment: gradient(zenith: (0.2, 0.4, 0.8), horizon: (0.5, 0.5, 0.5), ground: (0.1, 0.1, 0.1)),
    materials: {
        "clay": diffuse(albedo: (0.6, 0.3, 0.2)),
        "steel": metal(alpha: 0.04, reflectance: (0.6, 0.6, 0.6)),
        "worn": blend(weight: 0.5, a: "clay", b: "steel"),
        "lamp": emissive(radiance: (8, 6, 4)),
        "glow": blend(weight: 0.25, a: "steel", b: "lamp"),
        "spare": mirror(reflectance: (0.9, 0.9, 0.9)),
    },
    objects: [
        sphere(name: "one", center: (-1, 0.5, 0), radius: 0.5, material: "clay"),
        sphere(name: "two", center: (0, 0.5, 0), radius: 0.5, material: "worn"),
        sphere(name: "three", center: (1, 0.5, 0), radius: 0.5, material: "clay"),
        quad(name: "panel", corner: (-1, 3, -1), edge_u: (2, 0, 0), edge_v: (0, 0, 2), material: "lamp"),
        sphere(center: (2, 0.5, 0), radius: 0.5, material: "glow"),
    ],
    lights: [point(name: "bulb", position: (0, 2, 2), intensity: 3, radius: 0.05), directional(direction: (0, -1, 0), irradiance: 1)],
)"#;

struct Driver {
    session: Session,
    start: Instant,
    _folder: tempfile::TempDir,
}

impl Drive for Driver {
    fn session(&mut self) -> (&mut Session, Instant) {
        (&mut self.session, self.start)
    }
}

impl Driver {
    fn open() -> Self {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("scene.ron");
        std::fs::write(&path, SCENE).unwrap();
        let target = Target { spp: Some(1), ..Target::default() };
        let options = SessionOptions { width: 32, height: 32, threads: Some(1), target, ..SessionOptions::default() };
        let mut driver = Self { session: Session::new(options).unwrap(), start: Instant::now(), _folder: folder };
        driver.session.open(SceneSource::Scene(path));
        driver.run_until(|session| !session.inputs().objects.is_empty());
        driver
    }

    fn material(&self, inventory: &Inventory, name: &str) -> Entity {
        inventory.materials.iter().find(|entry| entry.label == name).unwrap_or_else(|| panic!("no {name}")).entity
    }

    /// Names, as the list of objects has them.
    fn labels(&self, inventory: &Inventory, entities: &[Entity]) -> Vec<String> {
        let label =
            |entity: &Entity| inventory.objects.iter().find(|entry| entry.entity == *entity).unwrap().label.clone();
        entities.iter().map(label).collect()
    }
}

#[test]
fn materials_are_listed_with_all_that_use_them() {
    let driver = Driver::open();
    let inventory = driver.session.inventory();
    let listed: Vec<(&str, usize, usize)> = (inventory.materials.iter())
        .map(|entry| (entry.label.as_str(), entry.users.len(), entry.blends.len()))
        .collect();
    // Parts of a blend are used by what the blend is on.
    let mut expected =
        [("clay", 3, 1), ("steel", 2, 2), ("worn", 1, 0), ("lamp", 2, 1), ("glow", 1, 0), ("spare", 0, 0)];
    expected.sort_unstable();
    let mut sorted = listed.clone();
    sorted.sort_unstable();
    assert_eq!(sorted, expected, "{listed:?}");
    let lights: Vec<(&str, &str, bool)> =
        (inventory.lights.iter()).map(|entry| (entry.label.as_str(), entry.kind, entry.material.is_some())).collect();
    assert_eq!(
        lights,
        [
            ("panel", "area light", true),
            ("sphere 4", "sphere light", true),
            ("bulb", "point light", false),
            ("directional light 1", "directional light", false)
        ]
    );
}

#[test]
fn a_shared_material_changes_on_all_that_share_it_and_they_can_be_selected() {
    let mut driver = Driver::open();
    let inventory = driver.session.inventory();
    let clay = driver.material(&inventory, "clay");
    let selected = |driver: &Driver| driver.session.world().resource::<Selection>().0.clone();
    driver.edit([Edit::SelectUsers { material: clay.to_bits() }]);
    assert_eq!(driver.labels(&inventory, &selected(&driver)), ["one", "two", "three"]);
    let before = selected(&driver);
    driver.edit([Edit::SelectUsers { material: driver.material(&inventory, "spare").to_bits() }]);
    assert_eq!(selected(&driver), before, "what no object uses selects nothing, and says so");
    assert!(driver.session.status().messages.back().is_some_and(|message| message.text.contains("no object uses")));
    // One edit and one undo for all three.
    let restarts = driver.session.status().restarts;
    let value = DVec3::new(0.1, 0.8, 0.1);
    driver.edit([Edit::Set { id: clay.to_bits(), property: of_material("albedo"), value }]);
    let color = |driver: &Driver| match SurfaceMaterial::of(driver.session.world(), clay) {
        Some(Material::Diffuse { albedo: ColorParam::Rgb(rgb) }) => *rgb,
        other => panic!("{other:?}"),
    };
    assert_eq!(color(&driver), value.as_vec3());
    assert_eq!(driver.session.status().restarts, restarts + 1);
    assert_eq!(driver.session.status().restart_cause, "material `clay`");
    driver.edit([Edit::Undo]);
    assert_eq!(color(&driver), Vec3::new(0.6, 0.3, 0.2));
    // With a copy of its own, one leaves the others.
    let one = before[0].to_bits();
    driver.edit([Edit::OwnMaterial { id: one }]);
    let inventory = driver.session.inventory();
    let users = |name: &str| inventory.material(driver.material(&inventory, name)).unwrap().users.len();
    assert_eq!((users("clay"), users("clay 2")), (2, 1));
}

#[test]
fn lists_are_as_old_as_the_scene_and_not_as_the_camera() {
    let mut driver = Driver::open();
    driver.frame();
    let revision = driver.session.revision();
    driver.session.send(Command::Orbit { yaw_deg: 5.0, pitch_deg: 0.0 });
    driver.frame();
    assert_eq!(driver.session.revision(), revision, "a camera that moves makes no list wrong");
    let inventory = driver.session.inventory();
    let spare = driver.material(&inventory, "spare");
    driver.edit([Edit::Rename { id: spare.to_bits(), name: "silver".to_owned() }]);
    assert_ne!(driver.session.revision(), revision, "no object uses it, and it is in the list all the same");
    driver.material(&driver.session.inventory(), "silver");
}

#[test]
fn the_sky_is_made_stronger_in_proportion() {
    let mut driver = Driver::open();
    let sky = |driver: &Driver| driver.session.inputs().environment.light.clone();
    assert_eq!(sky_strength(&sky(&driver)), 0.8);
    driver.edit([Edit::Set { id: 0, property: Property::SkyStrength, value: DVec3::splat(1.6) }]);
    let Environment::Gradient { zenith, horizon, ground } = sky(&driver) else { panic!("it was a gradient") };
    for (new, old) in [(zenith, Vec3::new(0.2, 0.4, 0.8)), (horizon, Vec3::splat(0.5)), (ground, Vec3::splat(0.1))] {
        assert!(new.abs_diff_eq(2.0 * old, 1e-6), "{new} {old}");
    }
    assert_eq!(driver.session.world().resource::<History>().undo_label(), Some("environment"));
    driver.edit([Edit::Set { id: 0, property: Property::SkyRotation, value: DVec3::splat(30.0) }]);
    let refused = &driver.session.status().messages.back().expect("it is told").text;
    assert!(refused.contains("SkyRotation"), "{refused}");
    driver.edit([Edit::Undo]);
    assert_eq!(sky_strength(&sky(&driver)), 0.8);
}

#[test]
fn undo_names_what_has_changed_of_the_camera() {
    let mut driver = Driver::open();
    let mut label_of = |command: Command| {
        driver.session.send(command);
        driver.frame();
        driver.session.world().resource::<History>().undo_label().map(str::to_owned)
    };
    assert_eq!(label_of(Command::ScaleFocus { factor: 1.5 }).as_deref(), Some("lens"));
    assert_eq!(label_of(Command::Orbit { yaw_deg: 5.0, pitch_deg: 0.0 }).as_deref(), Some("camera"));
    assert_eq!(label_of(Command::ToggleDepthOfField).as_deref(), Some("lens"));
}

#[test]
fn any_environment_becomes_a_clear_sky() {
    let mut driver = Driver::open();
    let sky = |driver: &Driver| driver.session.inputs().environment.clone();
    let set = |driver: &mut Driver, property, value| {
        let property = Property::ClearSky(property);
        driver.edit([Edit::Set { id: 0, property, value: DVec3::splat(value) }]);
        sky(driver)
    };
    let image = |sky: &SceneEnvironment| match &sky.light {
        Environment::Image { image, rotation, .. } => (image.clone(), *rotation),
        other => panic!("{other:?}"),
    };
    let first = set(&mut driver, SkyProperty::Elevation, 20.0);
    assert_eq!(SkyProperty::Elevation.get(&first.part), Some(20.0));
    let turned = set(&mut driver, SkyProperty::Azimuth, 90.0);
    assert!(Arc::ptr_eq(&image(&first).0, &image(&turned).0), "it is the same image");
    assert_eq!(image(&turned).1, -std::f32::consts::FRAC_PI_2);
    // Within what it may be.
    let hazy = set(&mut driver, SkyProperty::Turbidity, 99.0);
    assert_eq!(SkyProperty::Turbidity.get(&hazy.part), Some(10.0));
    assert!(!Arc::ptr_eq(&image(&turned).0, &image(&hazy).0));
    driver.edit([Edit::Set { id: 0, property: Property::SkyStrength, value: DVec3::splat(2.0) }]);
    let EnvironmentSource::Sky { scale, azimuth: 90.0, .. } = sky(&driver).part else { panic!() };
    assert_eq!(scale.0, Vec3::splat(2.0));
    // And any becomes one of a single colour.
    driver.edit([Edit::Set { id: 0, property: Property::Sky, value: DVec3::splat(0.5) }]);
    assert!(matches!(sky(&driver).light, Environment::Constant(radiance) if radiance == Vec3::splat(0.5)));
    assert!(matches!(sky(&driver).part, EnvironmentSource::Constant(_)));
    for _ in 0..5 {
        driver.edit([Edit::Undo]);
    }
    assert!(matches!(sky(&driver).light, Environment::Gradient { .. }));
}
