//! Changing a scene through a session, without a window: selecting, editing, undoing, looking at it in other ways.

use crate::driver::{Drive, Driver, of_material};
use bevy_ecs::component::Component;
use bevy_ecs::entity::Entity;
use bevy_ecs::name::Name;
use firstlight::frame::navigation::Rig;
use firstlight::frame::{
    Bookmarks, Command, Edit, Focus, FocusTarget, MeshMeasure, NewThing, Projector, Property, Selection, Session,
    SessionOptions, Target, wanted_mesh,
};
use firstlight::render::{Environment, Inspection, Integrator, MaterialKind};
use firstlight::scene::animation::LightProperty;
use firstlight::scene::{
    ColorParam, DirectionalLight, Inventory, LoadOptions, Material, MaterialSlots, MeshOptions, MeshOrigin,
    MeshShading, MeshSource, Placement, PointLight, Rgb, SceneInputs, SceneSource, Shape, SpotLight, SurfaceMaterial,
    TextureSource,
};
use glam::{DVec2, DVec3, Vec3};

impl Driver {
    /// A small picture of a scene, with two samples a pixel.
    pub fn builtin(name: &str) -> Self {
        Self::opened(SceneSource::Builtin(name.to_owned()))
    }

    /// The same of any scene.
    pub fn opened(source: SceneSource) -> Self {
        let target = Target { spp: Some(2), ..Target::default() };
        let options = SessionOptions { width: 48, height: 32, threads: Some(2), target, ..SessionOptions::default() };
        let mut driver = Self::new(options, source);
        driver.settle();
        driver
    }

    pub fn named(&self, name: &str) -> Entity {
        let inputs = self.session.inputs();
        let objects = inputs.objects.iter().map(|object| (object.entity, &object.name));
        let lights = inputs.lights.iter().map(|light| (light.entity, &light.name));
        let materials = inputs.materials.iter().map(|material| (material.entity, &material.name));
        let mut all = objects.chain(lights).chain(materials);
        all.find(|(_, other)| other.as_deref() == Some(name)).unwrap_or_else(|| panic!("no {name}")).0
    }

    pub fn select(&mut self, name: &str) -> u64 {
        let id = self.named(name).to_bits();
        self.edit([Edit::Select { id, add: false }]);
        id
    }

    fn has(&self, name: &str) -> bool {
        self.session.inputs().objects.iter().any(|object| object.name.as_deref() == Some(name))
    }

    pub fn selected(&self) -> &Selection {
        self.session.world().resource()
    }

    pub fn get<T: Component + Clone>(&self, name: &str) -> T {
        self.session.world().get::<T>(self.named(name)).unwrap_or_else(|| panic!("{name} has none")).clone()
    }
}

#[test]
fn clicking_selects_what_is_seen_there() {
    let mut driver = Driver::builtin("gallery");
    driver.edit([Edit::PickAt { x: 0.8, y: 0.95, add: false }]);
    assert_eq!(driver.selected().active(), Some(driver.named("floor")));
    driver.edit([Edit::PickAt { x: 0.2, y: 0.42, add: true }]);
    assert_eq!(driver.selected().0, [driver.named("floor"), driver.named("mirror ball")]);
    driver.edit([Edit::PickAt { x: 0.5, y: 0.02, add: false }]);
    assert_eq!(driver.selected().0, [], "the sky is nothing");
    driver.edit([Edit::SelectAll]);
    assert_eq!(driver.selected().0.len(), 12);
}

/// How the scene is rendered is no edit: an undo after it undoes the edit before it. How bright it is shown is one.
#[test]
fn an_undo_leaves_the_integrator_alone_and_takes_the_exposure_back() {
    let mut driver = Driver::builtin("gallery");
    let (before, display) = (driver.session.inputs().clone(), driver.session.status().display);
    driver.select("gold ball");
    driver.edit([Edit::Move { by: DVec3::new(0.5, 0.25, -1.0) }]);
    let moved = driver.session.inputs().clone();
    let send = |driver: &mut Driver, command: Command| {
        driver.session.send(command);
        driver.frame();
    };
    for stops in [0.5, 1.0] {
        send(&mut driver, Command::SetExposure { stops });
    }
    send(&mut driver, Command::NextToneCurve);
    send(&mut driver, Command::SetIntegrator(Integrator::Phong));
    let shown = |driver: &Driver| driver.session.status().display;
    driver.edit([Edit::Undo]);
    driver.frame();
    assert_eq!((shown(&driver).exposure_stops, shown(&driver).tone_curve), (1.0, display.tone_curve));
    driver.edit([Edit::Undo]);
    driver.frame();
    assert_eq!(shown(&driver), display, "both changes of the exposure are one step");
    assert_eq!(driver.session.inputs(), &moved);
    driver.edit([Edit::Undo]);
    driver.frame();
    assert_eq!(driver.session.inputs(), &before);
    assert_eq!(driver.session.status().integrator, Integrator::Phong);
    // A change of settings between two steps does not end what can be redone.
    driver.session.send(Command::SetIntegrator(Integrator::Path));
    driver.frame();
    driver.edit([Edit::Redo]);
    assert_ne!(driver.session.inputs(), &before);
}

#[test]
fn a_material_stays_when_the_object_that_uses_it_is_deleted() {
    let mut driver = Driver::builtin("gallery");
    driver.edit([Edit::Add(NewThing::Sphere)]);
    let material = driver.get::<MaterialSlots>("ball").0[0];
    driver.edit([
        Edit::Set { id: material.to_bits(), property: of_material("albedo"), value: DVec3::new(0.1, 0.8, 0.2) },
        Edit::Rename { id: material.to_bits(), name: "leaf green".to_owned() },
        Edit::Delete,
    ]);
    let inventory = driver.session.inventory();
    let entry = inventory.material(material).expect("it is in the list");
    assert_eq!((entry.label.as_str(), entry.users.len()), ("leaf green", 0));
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("saved.ron");
    driver.session.send(Command::SaveScene { path: path.clone() });
    driver.run_until(|session| !session.is_saving());
    assert!(std::fs::read_to_string(path).unwrap().contains("leaf green"));
}

#[test]
fn every_edit_can_be_undone_and_done_again_to_the_bit() {
    let mut driver = Driver::builtin("gallery");
    let mut states = vec![driver.session.inputs().clone()];
    let red = driver.named("red").to_bits();
    let ball = driver.select("gold ball");
    let edits = [
        Edit::Move { by: DVec3::new(0.5, 0.25, -1.0) },
        Edit::Turn { axis: DVec3::Y, angle_deg: 30.0 },
        Edit::Scale { factors: DVec3::splat(1.5) },
        Edit::Set { id: ball, property: Property::SphereRadius, value: DVec3::splat(0.4) },
        Edit::Set { id: red, property: of_material("albedo"), value: DVec3::new(0.1, 0.8, 0.2) },
        Edit::SetKind { id: red, kind: MaterialKind::Glass },
        Edit::Assign { id: ball, material: red },
        Edit::OwnMaterial { id: ball },
        Edit::Rename { id: ball, name: "brass ball".to_owned() },
        Edit::Set { id: 0, property: Property::Zenith, value: DVec3::new(0.0, 0.5, 1.0) },
        Edit::Duplicate,
        Edit::Delete,
        Edit::Add(NewThing::Sphere),
        Edit::Add(NewThing::Plane),
        Edit::Add(NewThing::Cube),
        Edit::Add(NewThing::AreaLight),
        Edit::Add(NewThing::PointLight),
    ];
    for edit in edits {
        driver.edit([edit.clone()]);
        let now = driver.session.inputs().clone();
        assert_ne!(states.last(), Some(&now), "{edit:?} did nothing: {:?}", driver.session.status().messages);
        states.push(now);
    }
    for expected in states.iter().rev().skip(1) {
        driver.edit([Edit::Undo]);
        assert_eq!(driver.session.inputs(), expected);
    }
    driver.edit([Edit::Undo]);
    assert!(driver.session.status().messages.back().unwrap().text.contains("nothing to undo"));
    for expected in &states[1..] {
        driver.edit([Edit::Redo]);
        assert_eq!(driver.session.inputs(), expected);
    }
}

#[test]
fn a_drag_is_one_step_and_counts_from_where_it_began() {
    let mut driver = Driver::builtin("gallery");
    driver.select("red ball");
    let before: Placement = driver.get("red ball");
    driver.edit([Edit::Begin]);
    for i in 1..=20 {
        driver.edit([Edit::Move { by: DVec3::X * 0.125 * f64::from(i) }]);
    }
    driver.edit([Edit::End]);
    let after: Placement = driver.get("red ball");
    assert_eq!(after.translation, before.translation + 2.5 * DVec3::X);
    driver.edit([Edit::Undo]);
    assert_eq!(driver.get::<Placement>("red ball"), before);
    // A sphere that is scaled along one axis stays one, or it could not be drawn.
    driver.edit([Edit::Scale { factors: DVec3::new(1.5, 1.0, 1.0) }]);
    assert_eq!(driver.get::<Placement>("red ball").even_scale(), Some(1.5));
    driver.edit([Edit::Undo]);
    // A walk of the camera between two edits is one step too.
    let home = driver.session.status().rig;
    for _ in 0..10 {
        driver.session.send(Command::Turn { yaw_deg: 1.0, pitch_deg: 0.0 });
        driver.frame();
    }
    driver.edit([Edit::Delete, Edit::Undo]);
    assert_ne!(driver.session.status().rig, home);
    driver.edit([Edit::Undo]);
    assert_eq!(driver.session.status().rig, home);
    assert_eq!(driver.get::<Placement>("red ball"), before);
}

#[test]
fn new_things_stand_in_sight_and_copies_share_until_they_get_their_own() {
    let mut driver = Driver::builtin("gallery");
    driver.edit([Edit::Add(NewThing::Sphere)]);
    assert_eq!(driver.selected().active(), Some(driver.named("ball")));
    let (shape, place): (Shape, Placement) = (driver.get("ball"), driver.get("ball"));
    let Shape::Sphere { radius } = shape else { panic!("{shape:?}") };
    assert!(radius > 0.0 && place.translation.length() < 10.0, "{place:?}");
    driver.edit([Edit::Duplicate]);
    let copy: Placement = driver.get("ball 2");
    assert!(copy.translation.x > place.translation.x);
    // A copy that is moved next begins where its original is; what is cancelled was never there.
    let by = DVec3::new(0.0, 2.0, 0.0);
    let copying = [Edit::Begin, Edit::DuplicateInPlace, Edit::Move { by: 3.0 * by }];
    driver.edit(copying.clone());
    assert_eq!(driver.get::<Placement>("ball 3").translation, copy.translation + 3.0 * by);
    driver.edit([Edit::Move { by }]);
    assert_eq!(driver.get::<Placement>("ball 3").translation, copy.translation + by, "from where it began");
    driver.edit([Edit::Cancel]);
    assert_eq!((driver.has("ball 3"), driver.selected().active()), (false, Some(driver.named("ball 2"))));
    driver.edit(copying.into_iter().chain([Edit::End, Edit::Undo]));
    assert_eq!((driver.has("ball 3"), driver.selected().active()), (false, Some(driver.named("ball 2"))), "one step");
    driver.edit([Edit::Begin, Edit::Move { by }, Edit::Cancel]);
    assert_eq!(driver.get::<Placement>("ball 2"), copy);
    driver.edit([Edit::Redo]);
    assert_eq!(driver.get::<Placement>("ball 2"), copy, "nothing to do again");
    assert_eq!(driver.get::<MaterialSlots>("ball"), driver.get::<MaterialSlots>("ball 2"), "they share a material");
    let id = driver.named("ball 2").to_bits();
    driver.edit([Edit::OwnMaterial { id }]);
    assert_ne!(driver.session.world().get::<MaterialSlots>(Entity::from_bits(id)), Some(&driver.get("ball")));
    driver.edit([Edit::Add(NewThing::PointLight)]);
    let id = driver.named("point light").to_bits();
    driver.edit([Edit::Set {
        id,
        property: Property::Light(LightProperty::Intensity),
        value: DVec3::new(3.0, 2.0, 1.0),
    }]);
    assert_eq!(driver.get::<PointLight>("point light").intensity, Vec3::new(3.0, 2.0, 1.0));
    driver.edit([Edit::Set { id, property: Property::Light(LightProperty::Radius), value: DVec3::ZERO }]);
    assert_eq!(driver.get::<PointLight>("point light").radius, 0.0, "a point");
    driver.edit([Edit::Add(NewThing::SpotLight)]);
    let id = driver.named("spot light").to_bits();
    for (property, x) in [
        (Property::Light(LightProperty::InnerAngle), 28.0),
        (Property::Light(LightProperty::OuterAngle), 25.0),
        (Property::Light(LightProperty::Intensity), 7.0),
    ] {
        driver.edit([Edit::Set { id, property, value: DVec3::splat(x) }]);
    }
    driver.edit([Edit::Set { id, property: Property::Light(LightProperty::Direction), value: DVec3::X }]);
    let spot: SpotLight = driver.get("spot light");
    assert_eq!((spot.inner_angle_deg, spot.outer_angle_deg), (25.0, 25.0), "the inner cone stays within the outer");
    assert_eq!((spot.intensity, spot.direction), (Vec3::splat(7.0), DVec3::X));
    driver.edit([Edit::Duplicate, Edit::Delete, Edit::Undo]);
    assert_eq!(driver.get::<SpotLight>("spot light 2"), spot);
    driver.edit([Edit::Add(NewThing::DirectionalLight)]);
    let id = driver.named("directional light").to_bits();
    driver.edit([Edit::Set { id, property: Property::Light(LightProperty::Irradiance), value: DVec3::splat(2.0) }]);
    driver.edit([Edit::Set { id, property: Property::Light(LightProperty::Direction), value: DVec3::ZERO }]);
    let sun: DirectionalLight = driver.get("directional light");
    assert!(sun.irradiance == Vec3::splat(2.0) && sun.direction != DVec3::ZERO, "{sun:?}");
    driver.edit([Edit::Delete, Edit::Undo]);
    assert_eq!(driver.get::<DirectionalLight>("directional light"), sun);
    // Nonsense is refused, and nothing changes.
    let (material, id): (SurfaceMaterial, u64) = (driver.get("red"), driver.named("red").to_bits());
    for (property, value) in
        [(of_material("albedo"), DVec3::NAN), (of_material("ior"), DVec3::ONE), (Property::SphereRadius, DVec3::ONE)]
    {
        driver.edit([Edit::Set { id, property, value }]);
    }
    assert_eq!(driver.get::<SurfaceMaterial>("red"), material);
}

/// Each stands on something, in sight, and within nothing that was there before, not even when many were added.
#[test]
fn new_things_find_room() {
    let mut driver = Driver::builtin("cornell-balls");
    for round in 0..6 {
        driver.edit([Edit::Add(NewThing::Sphere)]);
        let new = driver.selected().active().expect("what is new is selected");
        let spheres: Vec<(Entity, DVec3, f64)> = (driver.session.inputs().objects.iter())
            .filter_map(|object| match object.shape {
                Shape::Sphere { radius } => Some((object.entity, object.placement.translation, radius)),
                _ => None,
            })
            .collect();
        let &(_, place, radius) = spheres.iter().find(|(entity, ..)| *entity == new).expect("it is a ball");
        for (other, center, other_radius) in spheres.iter().filter(|(entity, ..)| *entity != new) {
            let gap = (place - *center).length() - radius - other_radius;
            assert!(gap > -0.05 * radius, "round {round}: {gap} to {other} at {center}, new at {place}, {radius}");
        }
        let rig = driver.session.status().rig;
        let seen = Projector::new(&rig, DVec2::new(480.0, 320.0)).place(place).expect("in front of the eye");
        assert!(seen.cmpge(DVec2::ZERO).all() && seen.cmple(DVec2::new(480.0, 320.0)).all(), "{seen}");
        let depth = (place - rig.view.eye).dot(rig.view.forward);
        assert!((0.01..0.2).contains(&(radius / depth)), "{radius} at {depth}");
        driver.session.send(Command::Orbit { yaw_deg: 4.0, pitch_deg: 1.0 });
        driver.frame();
    }
}

#[test]
fn what_comes_back_is_selected_as_it_was_when_it_came() {
    let mut driver = Driver::builtin("gallery");
    driver.select("gold ball");
    let original = driver.selected().0.clone();
    driver.edit([Edit::Duplicate]);
    let copy = driver.selected().0.clone();
    assert_ne!(copy, original);
    driver.edit([Edit::Undo]);
    assert_eq!(driver.selected().0, original, "the copy is gone: what it was made of is selected again");
    driver.edit([Edit::SelectNone, Edit::Redo]);
    assert_eq!(driver.selected().0, copy);
    driver.edit([Edit::Delete, Edit::Undo]);
    assert_eq!(driver.selected().0, copy, "what was deleted is back, and selected");
    // Nothing came or went: the selection is nobody's business.
    let red = driver.named("red").to_bits();
    driver.edit([
        Edit::Set { id: red, property: of_material("albedo"), value: DVec3::ONE },
        Edit::SelectNone,
        Edit::Undo,
    ]);
    assert_eq!(driver.selected().0, []);
}

#[test]
fn a_mesh_is_simplified_beside_the_picture() {
    let mut driver = Driver::builtin("gallery");
    let id = driver.named("serpent").to_bits();
    let whole: Shape = driver.get("serpent");
    let restarts = driver.session.status().restarts;
    driver.edit([Edit::Remesh { id, options: simplified(0.05) }]);
    assert!(!driver.session.is_idle() && driver.get::<Shape>("serpent") == whole, "the frame did not wait for it");
    driver.run_until(|session| session.status().restarts > restarts && session.is_idle());
    let (shape, measure): (Shape, MeshMeasure) = (driver.get("serpent"), driver.get("serpent"));
    let Shape::Mesh(coarse) = shape else { panic!() };
    assert_eq!(measure.faces, coarse.triangles.len());
    assert!(measure.faces <= measure.whole_faces / 20 && measure.faces > measure.whole_faces / 25);
    let deviation = measure.deviation.unwrap();
    assert!(deviation.mean() > 0.0 && deviation.max() < 0.2, "{deviation:?}");
    assert_eq!(driver.get::<MeshOrigin>("serpent").options.simplify, Some(0.05));
    driver.edit([Edit::Undo]);
    driver.run_until(Session::is_idle);
    assert_eq!(driver.get::<Shape>("serpent"), whole);
    driver.edit([Edit::Add(NewThing::Mesh(MeshSource::Builtin("torus".to_owned())))]);
    driver.run_until(|session| session.inputs().objects.iter().any(|object| object.name.as_deref() == Some("torus")));
    driver.edit([Edit::Add(NewThing::Mesh(MeshSource::Obj("/no/such.obj".to_owned())))]);
    driver.run_until(|session| session.status().messages.iter().any(|message| message.text.contains("no such file")));
}

fn simplified(ratio: f64) -> MeshOptions {
    MeshOptions { simplify: Some(ratio), ..MeshOptions::default() }
}

#[test]
fn what_is_asked_of_a_mesh_adds_up_and_is_taken_back_before_it_is_there() {
    let flat = MeshOptions { shading: MeshShading::Flat, ..simplified(0.05) };
    let mut driver = Driver::builtin("gallery");
    let entity = driver.named("serpent");
    let id = entity.to_bits();
    let wanted = |driver: &Driver| wanted_mesh(driver.session.world(), entity);
    let count = |driver: &Driver| driver.session.inputs().objects.len();
    let (whole, before): (Shape, _) = (driver.get("serpent"), wanted(&driver));
    driver.edit([Edit::Add(NewThing::Sphere)]);
    let n_objects = count(&driver);
    // A slider that is dragged, and another control.
    for ratio in [0.9, 0.5, 0.2, 0.05] {
        driver.edit([Edit::Remesh { id, options: simplified(ratio) }]);
        assert_eq!(wanted(&driver), Some(simplified(ratio)));
    }
    driver.edit([Edit::Remesh { id, options: flat }]);
    assert_eq!(wanted(&driver), Some(flat));
    driver.edit([Edit::Undo]);
    driver.run_until(Session::is_idle);
    assert_eq!((wanted(&driver), count(&driver)), (before, n_objects), "the mesh was what came last, not the sphere");
    assert_eq!(driver.get::<Shape>("serpent"), whole);
    // What was done after it was asked for goes first.
    driver.edit([Edit::Remesh { id, options: flat }]);
    driver.edit([Edit::Add(NewThing::Sphere), Edit::Undo]);
    assert_eq!(count(&driver), n_objects);
    driver.run_until(Session::is_idle);
    assert_eq!(wanted(&driver), Some(flat));
    assert!(driver.get::<MeshMeasure>("serpent").faces <= driver.get::<MeshMeasure>("serpent").whole_faces / 20);
    // Nor does it begin again for what is so already.
    driver.edit([Edit::Remesh { id, options: flat }]);
    assert!(driver.session.status().loading.is_none());
    driver.edit([Edit::Undo]);
    driver.run_until(Session::is_idle);
    assert_eq!((driver.get::<Shape>("serpent"), count(&driver)), (whole, n_objects));
}

#[test]
fn looking_in_other_ways_keeps_all_samples() {
    let mut driver = Driver::builtin("gallery");
    let (picture, restarts) = (driver.session.picture().rgba.clone(), driver.session.status().restarts);
    let mut seen = vec![picture.clone()];
    for inspection in Inspection::ALL.into_iter().filter(|inspection| *inspection != Inspection::Picture) {
        let number = driver.session.picture().number;
        driver.session.send(Command::SetInspection(inspection));
        driver.run_until(|session| session.picture().number > number && session.is_idle());
        let rgba = driver.session.picture().rgba.clone();
        assert!(!seen.contains(&rgba), "{inspection:?} looks like another one");
        seen.push(rgba);
    }
    driver.session.send(Command::SetInspection(Inspection::Picture));
    driver.run_until(|session| session.is_idle() && session.picture().rgba == picture);
    driver.session.send(Command::SetSharpZone { shown: true });
    driver.run_until(|session| session.is_idle() && session.picture().rgba != picture);
    driver.session.send(Command::SetSharpZone { shown: false });
    driver.run_until(|session| session.is_idle() && session.picture().rgba == picture);
    assert_eq!((driver.session.status().restarts, driver.session.status().spp), (restarts, 2));
}

#[test]
fn focus_stays_with_a_thing_and_views_can_be_come_back_to() {
    let mut driver = Driver::builtin("gallery");
    driver.session.send(Command::FocusAt { x: 0.2, y: 0.42 });
    driver.session.send(Command::ToggleFocusLock);
    driver.frame();
    assert!(matches!(driver.session.world().resource::<Focus>().target, FocusTarget::Object(..)));
    let near = driver.session.status().rig;
    driver.session.send(Command::SetBookmark { slot: 4 });
    driver.session.send(Command::Dolly { factor: 2.0 });
    driver.frame();
    let far = driver.session.status().rig;
    let stepped_back = (near.view.eye - far.view.eye).dot(near.view.forward);
    assert!((far.lens.focus_distance - near.lens.focus_distance - stepped_back).abs() < 1e-5, "{far:?}");
    // The object takes the focus along.
    driver.select("mirror ball");
    driver.edit([Edit::Move { by: far.view.forward }]);
    assert!((driver.session.status().rig.lens.focus_distance - far.lens.focus_distance - 1.0).abs() < 1e-5);
    driver.session.send(Command::SetFocus { distance: 3.0 });
    driver.frame();
    assert_eq!(driver.session.world().resource::<Focus>().target, FocusTarget::Camera, "a hand takes over");
    driver.session.send(Command::GoToBookmark { slot: 4 });
    driver.frame();
    assert_eq!(driver.session.status().rig, near);
    assert_eq!(driver.session.world().resource::<Bookmarks>().get(4), Some(near));
    // What is selected is framed.
    driver.select("red ball");
    driver.session.send(Command::FrameAll);
    driver.frame();
    let rig = driver.session.status().rig;
    let ball: Placement = driver.get("red ball");
    assert!((rig.view.pivot() - ball.translation).length() < 0.1, "{rig:?}");
    assert!(rig.view.pivot_distance < 3.0);
}

#[test]
fn focus_follows_a_place_of_the_picture_wherever_the_camera_goes() {
    let mut driver = Driver::builtin("gallery");
    let follow = |driver: &mut Driver, x: f64, y: f64| {
        driver.session.send(Command::FocusFollows { x, y });
        driver.frame();
        driver.session.status().rig.lens.focus_distance
    };
    let ball = follow(&mut driver, 0.2, 0.42);
    driver.session.send(Command::FocusAt { x: 0.2, y: 0.42 });
    driver.frame();
    assert!((driver.session.status().rig.lens.focus_distance / ball - 1.0).abs() < 1e-5, "as a click would");
    let floor = follow(&mut driver, 0.5, 0.95);
    assert!(floor < ball, "{floor} {ball}");
    assert_eq!(follow(&mut driver, 0.5, 0.02), floor, "the sky has no distance");
    follow(&mut driver, 0.5, 0.95);
    let before = driver.session.status().rig;
    driver.session.send(Command::Turn { yaw_deg: 0.0, pitch_deg: -10.0 });
    driver.frame();
    let lower = driver.session.status().rig.lens.focus_distance;
    assert!(lower < floor, "the same place of the picture is nearer now: {lower} {floor}");
    driver.session.send(Command::ToggleFocusLock);
    driver.session.send(Command::SetView(before.view));
    driver.frame();
    assert_eq!(driver.session.status().rig.lens.focus_distance, lower, "let go, it stays");
    assert_eq!(driver.session.world().resource::<Focus>().target, FocusTarget::Camera);
}

#[test]
fn a_new_plane_lies_below_everything_and_what_emits_is_a_light() {
    let mut driver = Driver::builtin("gallery");
    driver.select("gold ball");
    driver.edit([Edit::Move { by: DVec3::new(0.0, -3.0, 0.0) }]);
    let (Shape::Sphere { radius }, place) = (driver.get("gold ball"), driver.get::<Placement>("gold ball")) else {
        panic!()
    };
    driver.edit([Edit::Add(NewThing::Plane)]);
    let plane = driver.selected().active().unwrap();
    let height = driver.session.world().get::<Placement>(plane).unwrap().translation.y;
    assert!((height - (place.translation.y - radius)).abs() < 1e-6, "{height}");
    let id = driver.named("red").to_bits();
    let n_lights = |driver: &Driver| Inventory::of(driver.session.world(), driver.session.inputs()).lights.len();
    let before = n_lights(&driver);
    driver.edit([Edit::SetKind { id, kind: MaterialKind::Principled }]);
    assert_eq!(n_lights(&driver), before);
    driver.edit([Edit::Set { id, property: of_material("emission"), value: DVec3::ONE }]);
    assert!(n_lights(&driver) > before);
}

#[test]
fn colours_become_textures_and_textures_change() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("stripes.png");
    image::RgbImage::from_fn(4, 4, |x, _| image::Rgb([if x % 2 == 0 { 200 } else { 20 }; 3])).save(&file).unwrap();
    let mut driver = Driver::builtin("gallery");
    let id = driver.named("red").to_bits();
    let checker = |squares: f64| TextureSource::Checker {
        a: Rgb(Vec3::splat(0.7)),
        b: Rgb(Vec3::splat(0.1)),
        squares: DVec2::splat(squares),
        offset: DVec2::ZERO,
        rotate: 0.0,
    };
    let texture = |driver: &Driver| match driver.get::<SurfaceMaterial>("red").0 {
        Material::Diffuse { albedo: ColorParam::Texture(texture) }
        | Material::Phong { diffuse: ColorParam::Texture(texture), .. } => {
            Some((texture.name.clone(), texture.part.clone()))
        }
        _ => None,
    };
    let plain: SurfaceMaterial = driver.get("red");
    driver.edit([Edit::Paint { id, part: checker(8.0) }]);
    assert_eq!(texture(&driver), Some(("checker".to_owned(), checker(8.0))));
    let restarts = driver.session.status().restarts;
    driver.edit([Edit::Paint { id, part: checker(3.0) }]);
    assert_eq!(texture(&driver), Some(("checker".to_owned(), checker(3.0))), "it keeps its name");
    assert_eq!(driver.session.status().restarts, restarts + 1, "and the picture shows it");
    // A picture is read beside.
    let picture = TextureSource::image(file.to_string_lossy().into_owned());
    driver.edit([Edit::Paint { id, part: picture.clone() }]);
    driver.run_until(Session::is_idle);
    assert_eq!(texture(&driver), Some(("stripes".to_owned(), picture)));
    // It is saved, and all of it can be taken back.
    driver.session.send(Command::SaveScene { path: folder.path().join("painted.ron") });
    driver.run_until(|session| session.is_idle() && folder.path().join("painted.ron").exists());
    let text = std::fs::read_to_string(folder.path().join("painted.ron")).unwrap();
    assert!(text.contains("\"stripes.png\""), "{text}");
    driver.edit([Edit::Undo, Edit::Undo, Edit::Undo]);
    assert_eq!(driver.get::<SurfaceMaterial>("red"), plain);
    // A mesh without texture coordinates gets some, which is told; the cube has some.
    let told = |driver: &Driver| {
        let messages = driver.session.status().messages.iter();
        messages.filter(|message| message.text.contains("no texture coordinates")).count()
    };
    let mesh = |driver: &Driver, name: &str| match driver.get::<Shape>(name) {
        Shape::Mesh(mesh) => mesh,
        _ => panic!("{name}"),
    };
    for (name, expected) in [("cube", 0), ("icosphere", 1)] {
        driver.edit([Edit::Add(NewThing::Mesh(MeshSource::Builtin(name.to_owned())))]);
        driver.run_until(|session| {
            session.is_idle() && session.inputs().objects.iter().any(|object| object.name.as_deref() == Some(name))
        });
        let (slots, bare): (MaterialSlots, Shape) = (driver.get(name), driver.get(name));
        driver.edit([Edit::Paint { id: slots.0[0].to_bits(), part: checker(8.0) }]);
        driver.edit([Edit::Paint { id: slots.0[0].to_bits(), part: checker(4.0) }]);
        assert_eq!(told(&driver), expected, "{name}, once");
        // A scene that is saved opens with the same mesh.
        let projected = mesh(&driver, name);
        assert_eq!(projected.uvs.len(), projected.positions.len());
        let path = folder.path().join(format!("{name}.ron"));
        driver.session.send(Command::SaveScene { path: path.clone() });
        driver.run_until(|session| session.is_idle() && path.exists());
        let opened = firstlight::scene::load(&SceneSource::of_scene(path), &LoadOptions::default()).unwrap();
        let mut world = bevy_ecs::world::World::new();
        opened.spawn(&mut world);
        let again = world.query::<(&Name, &Shape)>().iter(&world).find(|(of, _)| of.as_str() == name);
        let Some((_, Shape::Mesh(again))) = again else { panic!("{name}") };
        assert_eq!(**again, *projected, "{name}");
        driver.edit([Edit::Undo, Edit::Undo]);
        assert_eq!(driver.get::<Shape>(name), bare, "{name}: one step of undo for both");
        driver.edit([Edit::Undo]);
    }
    // It can light the scene from all around, too.
    let light = |driver: &mut Driver| SceneInputs::of(driver.session.world_mut()).environment;
    let before = light(&mut driver);
    driver.edit([Edit::LightFrom { file: file.to_string_lossy().into_owned() }]);
    driver.run_until(Session::is_idle);
    let Environment::Image { image, .. } = light(&mut driver).light else { panic!("{:?}", light(&mut driver)) };
    assert_eq!((image.width, image.height), (4, 4));
    driver.edit([Edit::Undo]);
    assert_eq!(light(&mut driver), before);
    // What cannot be read is told, and changes nothing.
    let missing = TextureSource::image("nowhere.png".to_owned());
    driver.edit([Edit::Paint { id, part: missing }]);
    driver.run_until(|session| session.status().messages.iter().any(|message| message.text.contains("nowhere.png")));
    assert_eq!(driver.get::<SurfaceMaterial>("red"), plain);
}

#[test]
fn a_material_is_for_the_part_that_was_clicked() {
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("two.mtl"), "newmtl left\nKd 1 0 0\nnewmtl right\nKd 0 0 1\n").unwrap();
    let corners = "v -1 -1 0\nv 0 -1 0\nv 1 -1 0\nv -1 1 0\nv 0 1 0\nv 1 1 0\n";
    let faces = "usemtl left\nf 1 2 5 4\nusemtl right\nf 2 3 6 5\n";
    std::fs::write(folder.path().join("two.obj"), format!("mtllib two.mtl\n{corners}{faces}")).unwrap();
    let scene = "(camera: (eye: (0, 0, 4), look_at: (0, 0, 0)), environment: constant(1), \
                 objects: [mesh(name: \"wall\", source: obj(\"two.obj\"))])";
    let path = folder.path().join("scene.ron");
    std::fs::write(&path, scene).unwrap();
    let target = Target { spp: Some(2), ..Target::default() };
    let options = SessionOptions { width: 48, height: 32, threads: Some(2), target, ..SessionOptions::default() };
    let mut driver = Driver::new(options, SceneSource::Scene(path));
    driver.settle();
    let names = |driver: &Driver| {
        let slots: MaterialSlots = driver.get("wall");
        let name = |slot: &Entity| driver.session.world().get::<Name>(*slot).unwrap().as_str().to_owned();
        slots.0.iter().map(name).collect::<Vec<_>>()
    };
    let dress = |name: &str| Edit::Dress { name: name.to_owned() };
    assert_eq!(names(&driver), ["left", "right"]);
    let id = driver.named("wall").to_bits();
    let left = driver.get::<MaterialSlots>("wall").0[0].to_bits();
    let click = |x| Edit::PickAt { x, y: 0.5, add: false };
    driver.edit([click(0.6), dress("gold")]);
    assert_eq!(names(&driver), ["left", "gold"]);
    driver.edit([click(0.4), dress("clay")]);
    assert_eq!(names(&driver), ["clay", "gold"]);
    driver.edit([Edit::Assign { id, material: left }, Edit::OwnMaterial { id }]);
    assert_eq!(names(&driver), ["left 2", "gold"]);
    driver.edit([Edit::Undo, Edit::Undo, Edit::Undo]);
    assert_eq!(names(&driver), ["left", "gold"]);
    // What is saved has the same parts.
    let saved = folder.path().join("saved.ron");
    driver.session.send(Command::SaveScene { path: saved.clone() });
    driver.run_until(|session| saved.exists() && session.is_idle());
    assert!(std::fs::read_to_string(&saved).unwrap().contains("materials: [\"left\", \"gold\"]"));
    // From a list, it is the whole object, or the part that was chosen there.
    driver.edit([Edit::ChoosePart { id, part: Some(0) }, dress("glass")]);
    assert_eq!(names(&driver), ["glass", "gold"]);
    driver.select("wall");
    driver.edit([dress("glass")]);
    assert_eq!(names(&driver), ["glass"]);
}

#[test]
fn a_spot_light_is_picked_at_its_mark_and_aimed_at_what_is_seen() {
    let mut driver = Driver::builtin("gallery");
    driver.edit([Edit::Add(NewThing::SpotLight)]);
    let light = driver.named("spot light");
    let inputs = driver.session.inputs();
    let camera = inputs.camera.unwrap();
    let rig = Rig { view: camera.view, projection: camera.projection, lens: camera.lens };
    let position = driver.get::<Placement>("spot light").translation;
    let place = Projector::new(&rig, DVec2::new(1.5, 1.0)).place(position).unwrap() / DVec2::new(1.5, 1.0);
    driver.edit([Edit::SelectNone]);
    assert_eq!(driver.session.entity_at(place.x, place.y), Some(light));
    driver.edit([Edit::PickAt { x: place.x, y: place.y, add: false }]);
    assert_eq!(driver.selected().0, [light]);
    assert_ne!(driver.session.entity_at(place.x, place.y + 0.1), Some(light), "beside its mark");

    for at in [[0.4, 0.7], [0.6, 0.8]] {
        let before = driver.get::<SpotLight>("spot light");
        driver.edit([Edit::AimAt { id: light.to_bits(), x: at[0], y: at[1] }]);
        let [from, to] = driver.session.axis_of(light).unwrap();
        assert_eq!(from, position);
        // Something else may be in the way.
        let along = |i: u32| from + (to - from) * (f64::from(i) / 100.0);
        let seen = |point| Projector::new(&rig, DVec2::new(1.5, 1.0)).place(point).map(|at| at / DVec2::new(1.5, 1.0));
        let off = (1..400).filter_map(|i| seen(along(i))).map(|place| place.distance(at.into()));
        let least = off.min_by(f64::total_cmp).unwrap();
        assert!(least < 0.01, "{least} from {at:?}");
        driver.edit([Edit::Undo]);
        assert_eq!(driver.get::<SpotLight>("spot light"), before);
    }
    let object = driver.named("serpent").to_bits();
    driver.edit([Edit::AimAt { id: object, x: 0.5, y: 0.5 }]);
    assert!(driver.session.status().messages.iter().any(|message| message.text.contains("only spot lights")));
}
