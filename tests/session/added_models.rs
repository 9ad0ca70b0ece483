//! Models that join an open scene, with the materials of their files.

use crate::driver::{Drive, Driver};
use firstlight::frame::{Command, Edit, NewThing, Session};
use firstlight::scene::{
    LoadOptions, Material, MaterialSlots, MeshSource, Placement, SceneInputs, SceneSource, Shape, SurfaceMaterial,
};
use glam::DVec3;
use std::path::Path;

/// Two squares, up along +Z, in two materials, one of which has an image.
fn write_model(folder: &Path) -> String {
    let image = image::RgbImage::from_fn(4, 4, |x, _| image::Rgb([40 * x as u8, 200, 90]));
    image.save(folder.join("stripes.png")).unwrap();
    let mtl = "newmtl red\nKd 0.8 0.1 0.1\nnewmtl striped\nKd 1 1 1\nmap_Kd stripes.png\n";
    std::fs::write(folder.join("model.mtl"), mtl).unwrap();
    let obj = "mtllib model.mtl\nv 0 0 0\nv 4 0 0\nv 4 2 0\nv 0 2 0\nv 4 2 1\nv 0 2 1\nvt 0 0\nvt 1 0\nvt 1 1\nvt 0 1\n\
               usemtl red\nf 1/1 2/2 3/3 4/4\nusemtl striped\nf 4/1 3/2 5/3 6/4\n";
    let path = folder.join("chair.obj");
    std::fs::write(&path, obj).unwrap();
    path.to_string_lossy().into_owned()
}

fn add(driver: &mut Driver, file: &str) {
    let n = driver.session.inputs().objects.len();
    driver.edit([Edit::Add(NewThing::Mesh(MeshSource::of_file(file.to_owned())))]);
    driver.run_until(|session| session.is_idle() && session.inputs().objects.len() > n);
}

#[test]
fn a_model_brings_its_materials_and_their_images() {
    let (of_model, of_scene) = (tempfile::tempdir().unwrap(), tempfile::tempdir().unwrap());
    let file = write_model(of_model.path());
    let mut driver = Driver::builtin("cornell");
    let before = driver.session.inputs().clone();
    // A material of the open scene has the name of one of the model.
    let own_red: SurfaceMaterial = driver.get("red");
    add(&mut driver, &file);
    let slots: MaterialSlots = driver.get("chair");
    let names = |driver: &Driver, slots: &MaterialSlots| {
        let materials = &driver.session.inputs().materials;
        let name =
            |id| materials.iter().find(|material| material.entity == id).and_then(|material| material.name.clone());
        slots.0.iter().map(|id| name(*id).expect("materials have names")).collect::<Vec<_>>()
    };
    assert_eq!(names(&driver, &slots), ["red 2", "striped"]);
    assert_eq!(driver.get::<SurfaceMaterial>("red"), own_red);
    assert!(matches!(
        driver.get::<SurfaceMaterial>("striped").0,
        Material::Phong { .. } | Material::Diffuse { .. } | Material::Plastic { .. }
    ));
    assert_eq!(driver.selected().0, [driver.named("chair")]);

    // The second one has materials of its own.
    add(&mut driver, &file);
    assert_eq!(names(&driver, &driver.get("chair 2")), ["red 3", "striped 2"]);

    // Saved elsewhere, it opens with the same materials.
    let path = of_scene.path().join("room.ron");
    driver.session.send(Command::SaveScene { path: path.clone() });
    driver.run_until(|session| session.is_idle() && path.exists());
    let opened = firstlight::scene::load(&SceneSource::of_scene(path), &LoadOptions::default()).unwrap();
    assert!(opened.warnings.is_empty(), "{:?}", opened.warnings);
    let mut world = bevy_ecs::world::World::new();
    opened.spawn(&mut world);
    let again = SceneInputs::of(&mut world);
    let now = driver.session.inputs();
    assert_eq!(again.objects.len(), now.objects.len());
    for (again, now) in again.objects.iter().zip(&now.objects) {
        assert_eq!((&again.name, &again.placement), (&now.name, &now.placement));
        if let (Shape::Mesh(again), Shape::Mesh(now)) = (&again.shape, &now.shape) {
            assert_eq!(again, now);
        }
        assert_eq!(again.slots.len(), now.slots.len());
    }

    // Each was one step.
    driver.edit([Edit::Undo, Edit::Undo]);
    driver.run_until(Session::is_idle);
    let now = driver.session.inputs();
    assert_eq!((now.objects.len(), now.materials.len()), (before.objects.len(), before.materials.len()));
}

/// The model of two nodes that share a mesh, one twice as far up as it is wide.
fn two_nodes() -> String {
    let model = super::living_files::moving_triangle();
    let nodes = r#"{ "mesh": 0, "name": "low" }, { "mesh": 0, "name": "high", "translation": [0, 2, 0] }"#;
    let model = model.replace(r#"{ "mesh": 0, "name": "mover" }"#, nodes);
    model.replace(r#""nodes": [0, 1]"#, r#""nodes": [0, 1, 2]"#).replace(r#""node": 0"#, r#""node": 2"#)
}

/// Green glass, of which a model is made that is 4 m wide.
fn write_glass(folder: &Path) -> String {
    let gltf = super::living_files::moving_triangle();
    let materials = r#""materials": [{ "extensions": {
            "KHR_materials_transmission": { "transmissionFactor": 1 },
            "KHR_materials_volume": { "thicknessFactor": 1, "attenuationDistance": 0.5, "attenuationColor": [0.2, 0.8, 0.4] }
        } }], "meshes""#;
    let gltf =
        gltf.replace(r#""meshes""#, materials).replace(r#""POSITION": 0 }"#, r#""POSITION": 0 }, "material": 0"#);
    let gltf = gltf.replace(r#""name": "mover""#, r#""name": "pane", "scale": [4, 4, 4]"#);
    let path = folder.join("glass.gltf");
    std::fs::write(&path, gltf).unwrap();
    path.to_string_lossy().into_owned()
}

#[test]
fn glass_that_is_added_smaller_keeps_its_colour() {
    let folder = tempfile::tempdir().unwrap();
    let file = write_glass(folder.path());
    let absorption = |driver: &Driver| {
        let slots: MaterialSlots = driver.get("pane");
        match driver.session.world().get::<SurfaceMaterial>(slots.0[0]).map(|surface| &surface.0) {
            Some(Material::Principled { absorption, .. }) => absorption.as_dvec3(),
            other => panic!("{other:?}"),
        }
    };
    let width = |driver: &Driver| driver.get::<Placement>("pane").affine().transform_vector3(DVec3::X).length();
    let mut alone = Driver::builtin("cornell");
    alone.session.send(Command::Open { path: file.clone().into() });
    alone.run_until(|session| {
        session.is_idle() && session.inputs().objects.iter().any(|it| it.name.as_deref() == Some("pane"))
    });
    assert!((width(&alone) - 4.0).abs() < 1e-9 && absorption(&alone).min_element() > 0.1);
    let mut driver = Driver::builtin("cornell");
    add(&mut driver, &file);
    let [here, there] = [&driver, &alone].map(|driver| absorption(driver) * width(driver));
    assert!(width(&driver) < 1.0 && (here - there).length() < 1e-4 * there.length(), "{here} for {there}");
    let told = |text: &str| driver.session.status().messages.iter().any(|message| message.text.contains(text));
    assert!(told("of its size in the file"), "how much smaller it is");
}

#[test]
fn the_parts_of_a_model_keep_their_places_and_are_selected_together() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("two.gltf");
    std::fs::write(&file, two_nodes()).unwrap();
    let mut driver = Driver::builtin("cornell");
    // Where all new things stand.
    driver.edit([Edit::Add(NewThing::Sphere)]);
    driver.run_until(Session::is_idle);
    let (ball, Shape::Sphere { radius }) = (driver.get::<Placement>("ball"), driver.get("ball")) else { panic!() };
    driver.edit([Edit::Undo]);
    driver.run_until(Session::is_idle);
    add(&mut driver, &file.to_string_lossy());
    let [low, high] = ["low", "high"].map(|name| driver.get::<Placement>(name).affine());
    let width = low.transform_vector3(DVec3::X).length();
    assert!((high.translation - low.translation - 2.0 * width * DVec3::Y).length() < 1e-9);
    // Not in the plane of the ground.
    let above = low.translation.y - (ball.translation.y - radius);
    assert!((1e-5..1e-3).contains(&(above / width)), "{above} {width}");
    assert!((0.01..1.0).contains(&width), "as large as other things: {width}");
    assert_eq!(driver.selected().0, [driver.named("low"), driver.named("high")]);
}
