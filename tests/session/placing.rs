//! Where things go that are added, and where the camera stops.

use crate::driver::{Drive, Driver};
use bevy_ecs::entity::Entity;
use firstlight::format::property::SkyProperty;
use firstlight::frame::{
    Command, Edit, Focus, FocusTarget, NewThing, OpenReel, Projector, Property, Reel, SessionOptions, Target,
    has_left_camera,
};
use firstlight::render::Environment;
use firstlight::scene::animation::ObjectProperty;
use firstlight::scene::{
    ColorParam, DirectionalLight, EnvironmentSource, GRADIENT, Material, MaterialSlots, Placement, PointLight, Rgb,
    SceneEnvironment, SceneSource, Shape, SpotLight, SurfaceMaterial, View,
};
use glam::{DVec2, DVec3};
use std::path::Path;

const PYRAMID: &str =
    "v -0.5 0 -0.5\nv 0.5 0 -0.5\nv 0.5 0 0.5\nv -0.5 0 0.5\nv 0 1 0\nf 1 2 5\nf 2 3 5\nf 3 4 5\nf 4 1 5\nf 1 4 3 2\n";

/// A model of this many metres, opened by itself.
fn model(folder: &Path, size: f64) -> Driver {
    let scaled = |word: &str| word.parse().map_or(word.to_owned(), |x: f64| (size * x).to_string());
    let lines = PYRAMID.lines().map(|line| match line.strip_prefix("v ") {
        Some(numbers) => format!("v {}\n", numbers.split(' ').map(scaled).collect::<Vec<_>>().join(" ")),
        None => format!("{line}\n"),
    });
    let path = folder.join("pyramid.obj");
    std::fs::write(&path, lines.collect::<String>()).unwrap();
    Driver::opened(SceneSource::Model(path))
}

/// Where a point is in an image of 480 × 320.
fn place(driver: &Driver, point: DVec3) -> Option<DVec2> {
    Projector::new(&driver.session.status().rig, DVec2::new(480.0, 320.0)).place(point)
}

#[test]
fn an_orbit_about_a_model_stops_above_the_ground_it_stands_on() {
    let folder = tempfile::tempdir().unwrap();
    for size in [0.01, 1.0, 300.0] {
        let mut driver = model(folder.path(), size);
        let ground = driver.get::<Placement>("ground").translation.y;
        let below = |driver: &Driver| driver.session.status().rig.view.eye.y < ground;
        let orbit = |driver: &mut Driver| {
            for _ in 0..20 {
                driver.session.send(Command::Orbit { yaw_deg: 1.0, pitch_deg: -8.0 });
                driver.frame();
            }
        };
        orbit(&mut driver);
        let View { eye, pivot_distance, .. } = driver.session.status().rig.view;
        assert!(eye.y > ground && eye.y - ground < 0.02 * pivot_distance, "{eye} above {ground}");
        // Who wants to see the model from below takes the ground away.
        driver.select("ground");
        driver.edit([Edit::Delete]);
        orbit(&mut driver);
        assert!(below(&driver));
        // Below a ground, for whatever reason, one may go on, and go home.
        driver.edit([Edit::Undo]);
        driver.session.send(Command::Orbit { yaw_deg: 10.0, pitch_deg: -1.0 });
        driver.frame();
        assert!(below(&driver));
        driver.session.send(Command::Home);
        driver.frame();
        assert!(!below(&driver));
    }
}

/// White would have this irradiance by the light alone, W/m², if it faced it.
fn irradiance(driver: &Driver, thing: &NewThing, subject: DVec3) -> f64 {
    let fall = |position: DVec3| (subject - position).length_squared();
    match thing {
        NewThing::PointLight => {
            let at: Placement = driver.get("point light");
            f64::from(driver.get::<PointLight>("point light").intensity.x) / fall(at.translation)
        }
        NewThing::SpotLight => {
            let (light, at): (SpotLight, Placement) = (driver.get("spot light"), driver.get("spot light"));
            let way = (subject - at.translation).normalize();
            assert!(way.dot(light.direction) > 1.0 - 1e-6, "it points to it");
            f64::from(light.intensity.x) / fall(at.translation)
        }
        NewThing::DirectionalLight => f64::from(driver.get::<DirectionalLight>("directional light").irradiance.x),
        _ => {
            let (shape, at): (Shape, Placement) = (driver.get("area light"), driver.get("area light"));
            let Shape::Quad { edge_u, edge_v } = shape else { panic!("{shape:?}") };
            let center = at.translation + 0.5 * (edge_u + edge_v);
            let normal = edge_u.cross(edge_v);
            assert!(normal.normalize().dot((subject - center).normalize()) > 1.0 - 1e-6, "it faces it");
            let material = driver.get::<MaterialSlots>("area light").0[0];
            let material = driver.session.world().get::<SurfaceMaterial>(material).expect("a material");
            let Material::Emissive { radiance: ColorParam::Rgb(radiance) } = &material.0 else {
                panic!("{material:?}")
            };
            f64::from(radiance.max_element()) * normal.length() / fall(center)
        }
    }
}

#[test]
fn a_new_light_lights_what_is_selected_or_seen_as_much_at_any_size() {
    let folder = tempfile::tempdir().unwrap();
    for size in [0.01, 1.0, 300.0] {
        for thing in [NewThing::AreaLight, NewThing::PointLight, NewThing::SpotLight, NewThing::DirectionalLight] {
            for chosen in [false, true] {
                let mut driver = model(folder.path(), size);
                // The model is in the middle of the image, too.
                let object = driver.named("model");
                let subject = driver.session.box_of(object).expect("its box").middle();
                if chosen {
                    driver.select("model");
                }
                driver.edit([Edit::Add(thing.clone())]);
                let entity = driver.selected().active().expect("what is new is selected");
                let at = driver.session.world().get::<Placement>(entity).expect("a place").translation;
                let View { eye, .. } = driver.session.status().rig.view;
                assert!(at.y > subject.y && at.y < 4.0 * size, "{thing:?} of {size}: {at}");
                assert!((at - subject).length() < (eye - subject).length(), "{thing:?} of {size}: {at}");
                let middle = driver.session.box_of(entity).expect("its box").middle();
                let seen = place(&driver, middle).expect("in front of the camera");
                let is_above = thing == NewThing::AreaLight && seen.y < 0.0;
                assert!(
                    is_above || seen.cmpge(DVec2::ZERO).all() && seen.cmple(DVec2::new(480.0, 320.0)).all(),
                    "{seen}"
                );
                let irradiance = irradiance(&driver, &thing, subject);
                assert!((4.0..8.0).contains(&irradiance), "{thing:?} of {size}, chosen {chosen}: {irradiance}");
            }
        }
    }
}

#[test]
fn a_light_after_an_area_light_lights_what_is_seen_too() {
    let folder = tempfile::tempdir().unwrap();
    let mut driver = model(folder.path(), 1.0);
    let subject = driver.session.box_of(driver.named("model")).expect("its box").middle();
    driver.edit([Edit::Add(NewThing::AreaLight)]);
    driver.settle();
    driver.edit([Edit::Add(NewThing::SpotLight)]);
    let irradiance = irradiance(&driver, &NewThing::SpotLight, subject);
    assert!((4.0..8.0).contains(&irradiance), "{irradiance}");
}

#[test]
fn what_is_added_at_a_place_of_the_image_stands_there() {
    let folder = tempfile::tempdir().unwrap();
    for size in [0.01, 1.0, 300.0] {
        for (x, y) in [(0.15, 0.8), (0.85, 0.75), (0.5, 0.5)] {
            let mut driver = model(folder.path(), size);
            driver.edit([Edit::AddAt { thing: NewThing::Sphere, x, y }]);
            let (shape, at): (Shape, Placement) = (driver.get("ball"), driver.get("ball"));
            let Shape::Sphere { radius } = shape else { panic!("{shape:?}") };
            let foot = place(&driver, at.translation - radius * DVec3::Y).expect("in front of the camera");
            let wanted = DVec2::new(480.0 * x, 320.0 * y);
            // In the middle is the model, before which it stands; beside it may be little room.
            let is_there = if x == 0.5 { (foot - wanted).x.abs() < 24.0 } else { foot.distance(wanted) < 16.0 };
            assert!(is_there, "{size}: {foot} for {wanted}");
        }
    }
}

/// Its dark back would be a board before the scene.
#[test]
fn a_new_area_light_shows_its_front_however_far_the_camera_is_and_hides_nothing() {
    let folder = tempfile::tempdir().unwrap();
    for (factor, pitch_deg) in [(1.0, 0.0), (1.0, -70.0), (4.0, -30.0), (8.0, 20.0)] {
        let mut driver = model(folder.path(), 1.0);
        let object = driver.named("model");
        let subject = driver.session.box_of(object).expect("its box").middle();
        driver.select("model");
        driver.session.send(Command::Dolly { factor });
        driver.session.send(Command::Orbit { yaw_deg: 0.0, pitch_deg: -pitch_deg });
        driver.settle();
        driver.edit([Edit::Add(NewThing::AreaLight)]);
        let (shape, at): (Shape, Placement) = (driver.get("area light"), driver.get("area light"));
        let Shape::Quad { edge_u, edge_v } = shape else { panic!("{shape:?}") };
        let center = at.translation + 0.5 * (edge_u + edge_v);
        let eye = driver.session.status().rig.view.eye;
        assert!(edge_u.cross(edge_v).dot(eye - center) > 0.0, "{factor} {pitch_deg}: its back, from {eye}");
        // The way from the camera to what is lit is free.
        let seen = place(&driver, subject).expect("in view");
        assert_eq!(driver.session.entity_at(seen.x / 480.0, seen.y / 320.0), Some(object), "{factor} {pitch_deg}");
    }
}

#[test]
fn focus_tracks_the_selected_object_where_it_is_seen_or_else_the_last_point() {
    let folder = tempfile::tempdir().unwrap();
    let mut driver = model(folder.path(), 1.0);
    let (object, ground) = (driver.named("model"), driver.named("ground"));
    let target = |driver: &mut Driver| {
        driver.session.send(Command::ToggleFocusLock);
        driver.frame();
        let target = driver.session.world().resource::<Focus>().target;
        driver.session.send(Command::ToggleFocusLock);
        driver.frame();
        target
    };
    driver.session.send(Command::FocusAt { x: 0.5, y: 0.95 });
    driver.frame();
    assert!(matches!(target(&mut driver), FocusTarget::Object(entity, _) if entity == ground));
    driver.select("model");
    let at: Placement = driver.get("model");
    let FocusTarget::Object(entity, local) = target(&mut driver) else { panic!("no object") };
    assert_eq!(entity, object);
    let (point, eye) = (at.affine().transform_point3(local), driver.session.status().rig.view.eye);
    let middle = driver.session.box_of(object).expect("its box").middle();
    assert!((point - eye).length() < (middle - eye).length(), "its surface: {point}, {middle}");
    // Where it was clicked is better known than its middle.
    driver.session.send(Command::FocusAt { x: 0.52, y: 0.55 });
    driver.frame();
    let last = driver.session.world().resource::<Focus>().last.expect("it was focused on");
    let FocusTarget::Object(entity, local) = target(&mut driver) else { panic!("no object") };
    assert!((last.0, entity) == (object, object) && at.affine().transform_point3(local).distance(last.1) < 1e-9);
}

#[test]
fn a_copy_stands_beside_its_original() {
    let folder = tempfile::tempdir().unwrap();
    for size in [0.01, 1.0, 300.0] {
        let mut driver = model(folder.path(), size);
        driver.select("model");
        let before: Placement = driver.get("model");
        driver.edit([Edit::Duplicate]);
        driver.settle();
        let step = driver.get::<Placement>("model 2").translation - before.translation;
        let wide = step.abs().max_element();
        assert!(wide > size && wide < 1.5 * size && step.length() == wide, "{step} at {size}");
        let at = |point: DVec3| place(&driver, point).expect("in front of the camera").x;
        assert!(at(before.translation + step) > at(before.translation), "to the right, as it is seen");
    }
}

#[test]
fn a_copy_that_the_right_hides_stands_where_it_is_seen() {
    let folder = tempfile::tempdir().unwrap();
    let mut driver = model(folder.path(), 1.0);
    driver.select("model");
    let before: Placement = driver.get("model");
    // Near the right edge of the image.
    let View { eye, .. } = driver.session.status().rig.view;
    let right = driver.session.status().rig.view.right();
    let view = driver.session.status().rig.view;
    driver.session.send(Command::SetView(View { eye: eye - 1.1 * right, ..view }));
    driver.frame();
    driver.edit([Edit::Duplicate]);
    driver.settle();
    let step = driver.get::<Placement>("model 2").translation - before.translation;
    assert!(step.dot(right) < 0.0, "{step}");
}

#[test]
fn numbers_turn_an_object_about_its_middle_as_handles_do() {
    let folder = tempfile::tempdir().unwrap();
    let mut driver = model(folder.path(), 1.0);
    let id = driver.select("model");
    let middle = |driver: &mut Driver| driver.session.box_of(Entity::from_bits(id)).unwrap().middle();
    let before = middle(&mut driver);
    let set = |property, value| Edit::Set { id, property: Property::Object(property), value };
    driver.edit([set(ObjectProperty::Rotate, DVec3::new(0.0, 0.0, 90.0))]);
    driver.edit([Edit::Begin, Edit::Turn { axis: DVec3::X, angle_deg: 50.0 }]);
    assert!(middle(&mut driver).abs_diff_eq(before, 1e-12));
    // So the position is what it was, and a saved scene opens with the same placement.
    let turned: Placement = driver.get("model");
    assert!(
        turned.translation.abs_diff_eq(DVec3::ZERO, 1e-12) && turned.pivot == DVec3::new(0.0, 0.5, 0.0),
        "{turned:?}"
    );
    let path = folder.path().join("turned.ron");
    driver.session.send(Command::SaveScene { path: path.clone() });
    driver.run_until(|session| session.is_idle() && path.exists());
    let target = Target { spp: Some(1), ..Target::default() };
    let options = SessionOptions { width: 16, height: 16, target, ..SessionOptions::default() };
    let mut again = Driver::new(options, SceneSource::Scene(path));
    again.settle();
    assert_eq!(again.get::<Placement>("model"), turned);
}

/// Height of the lowest point of the model.
fn lowest(driver: &Driver) -> f64 {
    let Shape::Mesh(mesh) = driver.get::<Shape>("model") else { panic!("a mesh") };
    let world = driver.get::<Placement>("model").affine();
    let points = mesh.positions.iter().map(|point| world.transform_point3(mesh.center + point.as_dvec3()).y);
    points.fold(f64::INFINITY, f64::min)
}

#[test]
fn what_is_scaled_stays_standing() {
    let folder = tempfile::tempdir().unwrap();
    let mut driver = model(folder.path(), 1.0);
    let id = driver.select("model");
    let set = |property, value| Edit::Set { id, property: Property::Object(property), value };
    // Leaning, where neither its box nor its origin is on the ground.
    driver.edit([set(ObjectProperty::Rotate, DVec3::new(20.0, 30.0, 40.0))]);
    let before = lowest(&driver);
    for edit in [
        set(ObjectProperty::Scale, DVec3::splat(3.0)),
        set(ObjectProperty::Scale, DVec3::new(0.5, 2.0, 1.0)),
        Edit::Scale { factors: DVec3::splat(0.3) },
        Edit::Scale { factors: DVec3::new(1.0, 4.0, 1.0) },
    ] {
        let middle = driver.session.box_of(Entity::from_bits(id)).unwrap().middle();
        driver.edit([Edit::Begin, edit, Edit::End]);
        let moved = driver.session.box_of(Entity::from_bits(id)).unwrap().middle() - middle;
        assert!((lowest(&driver) - before).abs() < 1e-9, "{} was {before}", lowest(&driver));
        assert!(moved.with_y(0.0).length() < 1e-9 && moved.y.abs() > 0.01, "{moved}");
    }
}

/// As an added model of another unit: its origin is far from its middle.
#[test]
fn the_position_of_a_scaled_model_does_not_jump_when_it_gets_a_pivot() {
    let folder = tempfile::tempdir().unwrap();
    let mut driver = model(folder.path(), 100.0);
    let id = driver.select("model");
    let set = |property, value| Edit::Set { id, property: Property::Object(property), value };
    driver.edit([set(ObjectProperty::Translate, DVec3::new(3.0, 0.0, 2.0))]);
    driver.edit([set(ObjectProperty::Scale, DVec3::splat(0.01))]);
    let scaled: Placement = driver.get("model");
    // What is set to the value that it has is no edit.
    driver.edit([set(ObjectProperty::Scale, DVec3::splat(0.01)), set(ObjectProperty::Rotate, DVec3::ZERO)]);
    assert_eq!(driver.get::<Placement>("model"), scaled);
    let bare = scaled.with_pivot(DVec3::ZERO);
    assert!((bare.translation - scaled.translation).length() > 10.0);
    assert!(bare.position().abs_diff_eq(scaled.position(), 1e-9) && bare.position() == bare.translation);
    driver.edit([set(ObjectProperty::Rotate, DVec3::new(0.0, 40.0, 20.0))]);
    assert!(driver.get::<Placement>("model").position().abs_diff_eq(scaled.position(), 1e-9));
}

#[test]
fn between_its_keys_an_object_turns_about_its_middle() {
    let folder = tempfile::tempdir().unwrap();
    let mut driver = model(folder.path(), 1.0);
    let id = driver.select("model");
    let [rotate, scale] = [ObjectProperty::Rotate, ObjectProperty::Scale].map(Property::Object);
    driver.edit([Edit::Set { id, property: scale, value: DVec3::splat(0.5) }]);
    let before = driver.session.box_of(Entity::from_bits(id)).unwrap().middle();
    let key = Edit::SetKeys { camera: false };
    driver.edit([key.clone()]);
    driver.session.send(Command::SetMoment { seconds: Some(2.0) });
    driver.settle();
    driver.edit([Edit::Set { id, property: rotate, value: DVec3::new(0.0, 0.0, 360.0) }, key]);
    driver.session.send(Command::SetMoment { seconds: Some(1.0) });
    driver.settle();
    let half: Placement = driver.get("model");
    assert!(half.affine().transform_vector3(DVec3::Y).abs_diff_eq(-0.5 * DVec3::Y, 1e-9), "half a turn: {half:?}");
    let middle = driver.session.box_of(Entity::from_bits(id)).unwrap().middle();
    assert!(middle.abs_diff_eq(before, 1e-9), "{middle} was {before}");
}

#[test]
fn what_lies_is_turned_upright_and_stands_on_the_ground() {
    let folder = tempfile::tempdir().unwrap();
    let mut driver = model(folder.path(), 1.0);
    let id = driver.select("model");
    let ground = driver.get::<Placement>("ground").translation.y;
    let lowest = |driver: &Driver| lowest(driver) - ground;
    let before: Placement = driver.get("model");
    driver.edit([Edit::Move { by: DVec3::new(0.5, 3.0, 0.0) }, Edit::StandOnGround]);
    assert!(lowest(&driver) > 0.0 && lowest(&driver) < 1e-3, "{}", lowest(&driver));
    driver.edit([Edit::TurnUpright]);
    assert!(lowest(&driver) > 0.0 && lowest(&driver) < 1e-3, "{}", lowest(&driver));
    let turned = driver.get::<Placement>("model").affine();
    assert!(turned.transform_vector3(DVec3::Z).abs_diff_eq(DVec3::Y, 1e-12), "Z is up now");
    // Not the corner of its box, where it leans.
    let rotate = Property::Object(ObjectProperty::Rotate);
    driver.edit([Edit::Set { id, property: rotate, value: DVec3::new(20.0, 30.0, 40.0) }, Edit::StandOnGround]);
    assert!(lowest(&driver) > 0.0 && lowest(&driver) < 1e-3, "{}", lowest(&driver));
    driver.edit([Edit::Undo, Edit::Undo, Edit::Undo, Edit::Undo, Edit::Undo]);
    assert_eq!(driver.get::<Placement>("model"), before);
    // What has no end, and what is no object, stays.
    let plane: Placement = driver.get("ground");
    driver.select("ground");
    driver.edit([Edit::StandOnGround]);
    assert_eq!(driver.get::<Placement>("ground"), plane);
}

#[test]
fn things_stand_on_a_table_and_the_parts_of_a_thing_stay_together() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("table.ron");
    let text = r#"(
        camera: (eye: (0, 4, 20), look_at: (0, 3, 0)),
        environment: constant(1),
        materials: { "grey": diffuse(albedo: 0.5) },
        objects: [
            plane(name: "floor", material: "grey"),
            quad(name: "table", corner: (-2, 2, -2), edge_u: (0, 0, 4), edge_v: (4, 0, 0), material: "grey"),
            sphere(name: "cup", center: (0.5, 6, 0), radius: 0.5, material: "grey"),
            sphere(name: "cherry", center: (0.5, 7, 0), radius: 0.25, material: "grey"),
            sphere(name: "sunk", center: (-1, 2.1, 0), radius: 0.5, material: "grey"),
            sphere(name: "beside", center: (8, 6, 0), radius: 0.5, material: "grey"),
        ],
    )"#;
    std::fs::write(&path, text).unwrap();
    let mut driver = Driver::opened(SceneSource::Scene(path));
    let height = |driver: &Driver, name: &str| driver.get::<Placement>(name).translation.y;
    for (name, expected) in [("cup", 2.5), ("sunk", 2.5), ("beside", 0.5)] {
        driver.select(name);
        driver.edit([Edit::StandOnGround]);
        let found = height(&driver, name);
        assert!(found > expected && found < expected + 1e-3, "{name}: {found} is not {expected}");
    }
    driver.edit([Edit::Undo, Edit::Undo, Edit::Undo]);
    let ids = ["cup", "cherry"].map(|name| driver.named(name).to_bits());
    driver.edit([Edit::Select { id: ids[0], add: false }, Edit::Select { id: ids[1], add: true }, Edit::StandOnGround]);
    let [cup, cherry] = ["cup", "cherry"].map(|name| height(&driver, name));
    assert!((cup - 2.5).abs() < 1e-3 && (cherry - cup - 1.0).abs() < 1e-9, "{cup} {cherry}");
}

#[test]
fn the_camera_is_in_front_of_things_or_in_a_room() {
    let folder = tempfile::tempdir().unwrap();
    let mut driver = model(folder.path(), 1.0);
    assert_eq!(driver.session.is_in_room(), Some(false));
    // Between things, but under the sky.
    let view = driver.session.status().rig.view;
    driver.session.send(Command::SetView(View { eye: DVec3::new(0.0, 1.5, 0.0), ..view }));
    driver.frame();
    assert_eq!(driver.session.is_in_room(), Some(false));
    // Before a box that is open, and inside of it.
    let mut driver = Driver::builtin("cornell");
    assert_eq!(driver.session.is_in_room(), Some(false));
    let view = driver.session.status().rig.view;
    driver.session.send(Command::SetView(View { eye: DVec3::new(0.0, 1.5, -0.5), ..view }));
    driver.frame();
    assert_eq!(driver.session.is_in_room(), Some(true));
    // The wheel does not throw it through the wall behind it, where there is one.
    let view = View::look_at(DVec3::new(-0.3, 1.5, -0.5), DVec3::new(-0.9, 1.5, -0.5), DVec3::Y).unwrap();
    for (factor, between) in [(1.5, -0.1..0.5), (1e3, 0.9..1.0)] {
        driver.session.send(Command::SetView(view));
        driver.session.send(Command::Dolly { factor });
        driver.frame();
        let x = driver.session.status().rig.view.eye.x;
        assert!(between.contains(&x), "{factor}: {x}");
    }
    // Nor does an orbit about what is near the other wall, which comes back as far out as it was.
    let view = View::look_at(DVec3::new(0.5, 1.5, -0.5), DVec3::new(-0.5, 1.5, -0.5), DVec3::Y).unwrap();
    driver.session.send(Command::SetView(view));
    driver.frame();
    let mut leftmost = f64::INFINITY;
    for i in 0..36 {
        driver.session.send(Command::Orbit { yaw_deg: if i < 18 { -10.0 } else { 10.0 }, pitch_deg: 0.0 });
        driver.frame();
        leftmost = leftmost.min(driver.session.status().rig.view.eye.x);
    }
    let around = driver.session.status().rig.view;
    assert!(leftmost > -1.0 && leftmost < -0.9, "{leftmost}");
    assert!((around.eye - view.eye).length() < 1e-6, "{}", around.eye);
}

#[test]
fn a_framed_ball_is_in_the_middle() {
    let mut driver = Driver::builtin("gi-ball");
    driver.select("ball");
    for (yaw_deg, pitch_deg) in [(0.0, 0.0), (40.0, -25.0), (100.0, -50.0)] {
        driver.session.send(Command::Orbit { yaw_deg, pitch_deg });
        driver.session.send(Command::FrameAll);
        driver.frame();
        let middle = driver.get::<Placement>("ball").translation;
        let at = place(&driver, middle).expect("it is in front") - DVec2::new(240.0, 160.0);
        // A sphere off the axis is seen as an ellipse, whose middle is not that of the sphere.
        assert!(at.length() < 2.0, "{at}");
    }
}

#[test]
fn any_environment_becomes_a_gradient_again() {
    let mut driver = Driver::builtin("gallery");
    let sky = |driver: &Driver| driver.session.world().resource::<SceneEnvironment>().clone();
    let [zenith, horizon, ground] = GRADIENT;
    for other in [Property::Sky, Property::ClearSky(SkyProperty::Elevation)] {
        driver.edit([Edit::Set { id: 0, property: other, value: DVec3::splat(0.5) }]);
        assert!(!matches!(sky(&driver).light, Environment::Gradient { .. }), "{other:?}");
        driver.edit([Edit::Set { id: 0, property: Property::Zenith, value: zenith.as_dvec3() }]);
        let part = EnvironmentSource::Gradient { zenith: Rgb(zenith), horizon: Rgb(horizon), ground: Rgb(ground) };
        assert_eq!(sky(&driver).part, part);
    }
}

#[test]
fn what_turns_by_itself_turns_about_what_is_shown() {
    let folder = tempfile::tempdir().unwrap();
    let mut driver = model(folder.path(), 1.0);
    let middle = driver.session.box_of(driver.named("model")).expect("its box").middle();
    let depth = |driver: &Driver| {
        let view = driver.session.status().rig.view;
        (view.pivot_distance, (middle - view.eye).dot(view.forward))
    };
    let near = View { pivot_distance: 0.1, ..driver.session.status().rig.view };
    driver.session.send(Command::SetView(near));
    driver.session.send(Command::PivotOnMiddle);
    driver.frame();
    let (pivot, expected) = depth(&driver);
    assert!((pivot / expected - 1.0).abs() < 1e-6, "{pivot} is not {expected}");
    // Within a room only what is selected counts.
    let inside = View { eye: middle, pivot_distance: 0.1, ..near };
    driver.session.send(Command::SetView(inside));
    driver.session.send(Command::PivotOnMiddle);
    driver.frame();
    assert_eq!(depth(&driver).0, 0.1);
}

#[test]
fn moves_of_the_camera_are_undone_one_by_one() {
    let mut driver = Driver::builtin("gi-ball");
    let (start, mut now) = (driver.session.status().rig.view, driver.start.elapsed());
    let mut turn = |driver: &mut Driver, pause_ms: u64| {
        now += std::time::Duration::from_millis(pause_ms);
        driver.session.send(Command::Orbit { yaw_deg: 10.0, pitch_deg: 0.0 });
        driver.session.update(now);
        driver.session.status().rig.view
    };
    // One drag, of three events; then another.
    turn(&mut driver, 3000);
    turn(&mut driver, 100);
    let turned = turn(&mut driver, 100);
    turn(&mut driver, 3000);
    let mut undo = || {
        driver.session.send(Command::Edit(Edit::Undo));
        now += std::time::Duration::from_millis(100);
        driver.session.update(now);
        driver.session.status().rig.view
    };
    assert_eq!([undo(), undo()], [turned, start]);
}

#[test]
fn a_scene_in_which_nothing_moves_is_turned_around() {
    let mut driver = Driver::builtin("studio");
    assert!(Reel::of(&mut driver.session).is_none());
    let start = driver.session.status().rig.view;
    let mut reel = Reel::turntable_of(&mut driver.session, 8).unwrap().open().unwrap();
    let eye = |seconds: f64, reel: &mut OpenReel| {
        let scene = reel.at(seconds).0;
        scene.origin + scene.prepared.camera.eye.as_dvec3()
    };
    let (first, half) = (eye(0.0, &mut reel), eye(0.5, &mut reel));
    assert!(first.abs_diff_eq(start.eye, 1e-5), "{first}");
    let across = 0.5 * (first + half) - start.pivot();
    assert!(across.with_y(0.0).length() < 1e-5 && (half.y - first.y).abs() < 1e-5, "{half} across {first}");
}

#[test]
fn a_turntable_of_an_animation_stands_at_its_moment_and_leaves_the_tracks_of_the_camera() {
    let mut driver = Driver::builtin("carousel");
    driver.session.send(Command::SetMoment { seconds: Some(1.0) });
    driver.settle();
    let placed = |driver: &Driver| driver.session.inputs().objects.iter().map(|it| it.placement).collect::<Vec<_>>();
    let (rig, before) = (driver.session.status().rig, placed(&driver));
    let at_moment = Reel::of(&mut driver.session).unwrap().open().unwrap().at(1.0).0;
    let mut reel = Reel::turntable_of(&mut driver.session, 4).unwrap().open().unwrap();
    for (frame, expected) in firstlight::frame::turntable(&rig, 4).iter().enumerate() {
        let scene = reel.at(frame as f64 / 4.0).0;
        let eye = scene.origin + scene.prepared.camera.eye.as_dvec3();
        assert!(eye.abs_diff_eq(expected.view.eye, 1e-5), "frame {frame}: {eye}");
        assert_eq!(scene.entities.len(), at_moment.entities.len());
    }
    assert_eq!(placed(&driver), before, "the session goes on");
}

#[test]
fn whoever_flies_away_from_the_camera_of_an_animation_stays_there_until_it_goes_back() {
    let mut driver = Driver::builtin("carousel");
    let go = |driver: &mut Driver, seconds: f64| {
        driver.session.send(Command::SetMoment { seconds: Some(seconds) });
        driver.settle();
        driver.session.status().rig
    };
    let on_track = [1.0, 1.5, 2.0, 2.5].map(|seconds| go(&mut driver, seconds));
    assert!(on_track.windows(2).all(|two| two[0].view != two[1].view));
    // Another aperture is no other place.
    go(&mut driver, 1.0);
    driver.session.send(Command::SetAperture { radius: 0.0123 });
    driver.frame();
    let followed = go(&mut driver, 1.5);
    assert_eq!((followed.view.eye, followed.lens.radius), (on_track[1].view.eye, 0.0123));
    driver.session.send(Command::Orbit { yaw_deg: 25.0, pitch_deg: 5.0 });
    driver.frame();
    let flown = driver.session.status().rig;
    let placed = |driver: &Driver| driver.session.inputs().objects.iter().map(|it| it.placement).collect::<Vec<_>>();
    let before = placed(&driver);
    assert_eq!(go(&mut driver, 2.0), flown);
    assert!(placed(&driver) != before && !driver.session.has_unsaved_edits());
    // Frames show what is seen: that view, or the camera of the animation.
    let frame = |driver: &mut Driver| {
        let scene = Reel::of(&mut driver.session).unwrap().open().unwrap().at(2.5).0;
        scene.origin + scene.prepared.camera.eye.as_dvec3()
    };
    assert_eq!(has_left_camera(&driver.session), Some(true));
    let eye = frame(&mut driver);
    assert!(eye.abs_diff_eq(flown.view.eye, 1e-5), "{eye}");
    driver.session.send(Command::SetView(on_track[2].view));
    driver.frame();
    assert_eq!(has_left_camera(&driver.session), Some(false));
    let eye = frame(&mut driver);
    assert!(eye.abs_diff_eq(on_track[3].view.eye, 1e-5), "{eye}");
    assert_eq!(go(&mut driver, 2.5).view.eye, on_track[3].view.eye);
}

#[test]
fn orbits_stay_above_the_floor_that_the_camera_stands_on() {
    let mut driver = Driver::builtin("cornell");
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("floor.ron");
    let text = r#"(
        camera: (eye: (0, 1, 3), look_at: (0, 0.5, 0)),
        environment: constant(1),
        materials: { "grey": diffuse(albedo: 0.5) },
        objects: [
            quad(corner: (-5, 0, 5), edge_u: (10, 0, 0), edge_v: (0, 0, -10), material: "grey"),
            sphere(center: (0, 0.5, 0), radius: 0.5, material: "grey"),
        ],
    )"#;
    std::fs::write(&path, text).unwrap();
    driver.session.open(SceneSource::Scene(path));
    driver.run_until(|session| session.inputs().objects.len() == 2);
    driver.settle();
    for pitch_deg in [15.0; 8].into_iter().chain([-15.0; 16]) {
        driver.session.send(Command::Orbit { yaw_deg: 10.0, pitch_deg });
        driver.frame();
        assert!(driver.session.status().rig.view.eye.y > 0.0);
    }
}
