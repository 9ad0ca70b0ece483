//! What each change costs: every component and resource against its level, and nothing while nothing changed.

use bevy_ecs::component::{Component, Mutable};
use bevy_ecs::prelude::{Entity, World};
use firstlight::frame::{Command, FrameChanges, Level, Paused, Session, SessionOptions, StopAt, Target, Threads};
use firstlight::mesh::procedural;
use firstlight::render::{Environment, Integrator, ToneCurve};
use firstlight::scene::{
    Balls, DirectionalLight, GREY, Lens, Linear, Material, MaterialSlots, Placement, PointLight, Projection, Rendering,
    SceneEnvironment, Shape, SpotLight, SurfaceMaterial, View,
};
use glam::{DVec3, Vec3};
use std::sync::Arc;
use std::time::Duration;

/// A session with one of everything.
struct Stage {
    session: Session,
    frame: u64,
    ball: Entity,
    mesh: Entity,
    cloud: Entity,
    red: Entity,
    blue: Entity,
    unused: Entity,
    light: Entity,
    camera: Entity,
}

impl Stage {
    fn new() -> Self {
        let target = Target { spp: Some(1), ..Target::default() };
        let options = SessionOptions { width: 16, height: 12, threads: Some(1), target, ..SessionOptions::default() };
        let mut session = Session::new(options).unwrap();
        let world = session.world_mut();
        let [red, blue, unused] =
            [Vec3::X, Vec3::Z, Vec3::Y].map(|rgb| world.spawn(SurfaceMaterial(Material::diffuse(rgb))).id());
        let ball = world.spawn((Shape::Sphere { radius: 1.0 }, MaterialSlots(vec![red]))).id();
        let cube = Arc::new(procedural::cuboid(DVec3::ONE));
        let mesh = world.spawn((Shape::Mesh(cube), MaterialSlots(vec![blue]))).id();
        let balls = Arc::new(Balls::new(&[DVec3::ZERO, DVec3::X], [0.1, 0.2]));
        let cloud = world.spawn((Shape::Spheres(balls), MaterialSlots(vec![red]))).id();
        let light = world.spawn((PointLight { intensity: Vec3::ONE, radius: 0.1 }, Placement::at(DVec3::Y))).id();
        let camera = world.spawn((View::default(), Lens::thin(0.1, 4.0))).id();
        let mut stage = Self { session, frame: 0, ball, mesh, cloud, red, blue, unused, light, camera };
        assert!(stage.frame().contains(&Level::Resize), "the first frame starts everything");
        assert_eq!(stage.frame(), [], "the second has nothing to do");
        stage
    }

    fn light_of(&mut self, light: impl Component, placement: Placement) -> Entity {
        let entity = self.session.world_mut().spawn((light, placement)).id();
        self.frame();
        entity
    }

    /// Runs one frame and tells the levels of what it found to be different.
    fn frame(&mut self) -> Vec<Level> {
        self.frame += 1;
        self.session.update(Duration::from_millis(16 * self.frame));
        let found = self.session.world().resource::<FrameChanges>();
        let mut levels: Vec<Level> = found.0.0.iter().map(|change| change.level).collect();
        levels.sort();
        levels.dedup();
        levels
    }

    fn edit(&mut self, change: impl FnOnce(&mut World)) -> Vec<Level> {
        change(self.session.world_mut());
        self.frame()
    }

    /// Replaces a component, and says whether that restarted the picture.
    fn set<T: Component<Mutability = Mutable>>(&mut self, entity: Entity, change: impl FnOnce(&mut T)) -> Vec<Level> {
        self.edit(|world| change(&mut world.get_mut::<T>(entity).unwrap()))
    }

    fn restarts(&self) -> u64 {
        self.session.status().restarts
    }

    fn cause(&self) -> &str {
        &self.session.status().restart_cause
    }
}

#[test]
fn each_component_has_its_level() {
    use Level::{MeshTree, Restart, Shading, TopTree};
    let mut stage = Stage::new();
    let Stage { ball, mesh, cloud, red, blue, light, camera, .. } = stage;

    assert_eq!(stage.set(camera, |view: &mut View| view.eye.x += 1.0), [Restart]);
    assert_eq!(stage.cause(), "camera moved");
    assert_eq!(stage.set(camera, |projection: &mut Projection| projection.vfov_deg = 30.0), [Restart]);
    assert_eq!(stage.cause(), "field of view");
    assert_eq!(stage.set(camera, |lens: &mut Lens| lens.radius = 0.2), [Restart]);
    assert_eq!(stage.cause(), "aperture");
    assert_eq!(stage.set(camera, |lens: &mut Lens| lens.focus_distance = 3.0), [Restart]);
    assert_eq!(stage.cause(), "focus");
    assert_eq!(stage.set(camera, |lens: &mut Lens| lens.blades = 6), [Restart]);

    assert_eq!(stage.set(red, |material: &mut SurfaceMaterial| material.0 = GREY), [Shading]);
    assert!(stage.cause().starts_with("material "), "{}", stage.cause());
    assert_eq!(stage.set(light, |light: &mut PointLight| light.intensity = Vec3::splat(2.0)), [Shading]);
    assert_eq!(
        stage.edit(|world| world.insert_resource(SceneEnvironment {
            light: Environment::Constant(Vec3::ONE),
            ..SceneEnvironment::default()
        })),
        [Shading]
    );
    assert_eq!(stage.cause(), "environment");

    assert_eq!(stage.set(ball, |placement: &mut Placement| placement.translation.y = 2.0), [TopTree]);
    // As the panel calls what has no name, numbered as in its list.
    assert!(stage.cause().starts_with("sphere ") && stage.cause().ends_with(" moved"), "{}", stage.cause());
    assert_eq!(stage.set(light, |placement: &mut Placement| placement.translation.y = 2.0), [TopTree]);
    assert_eq!(stage.cause(), "point light 0 moved");
    assert_eq!(stage.set(light, |light: &mut PointLight| light.radius = 0.2), [TopTree]);
    assert_eq!(stage.set(ball, |shape: &mut Shape| *shape = Shape::Sphere { radius: 0.5 }), [TopTree]);
    assert_eq!(stage.set(ball, |slots: &mut MaterialSlots| slots.0 = vec![blue]), [TopTree]);

    // No ray can hit these: no tree knows them.
    let up = Placement::at(DVec3::Y);
    let point = stage.light_of(PointLight { intensity: Vec3::ONE, radius: 0.0 }, up);
    let cone = SpotLight {
        intensity: Vec3::ONE,
        direction: DVec3::Z,
        inner_angle_deg: 1.0,
        outer_angle_deg: 2.0,
        ..SpotLight::default()
    };
    let spot = stage.light_of(cone, up);
    let sun = stage.light_of(DirectionalLight { irradiance: Vec3::ONE, direction: DVec3::Z }, up);
    for light in [point, spot] {
        assert_eq!(stage.set(light, |placement: &mut Placement| placement.translation.y = 2.0), [Shading]);
        assert!(stage.cause().ends_with(" moved"), "{}", stage.cause());
    }
    assert_eq!(stage.set(sun, |placement: &mut Placement| placement.translation.y = 2.0), [], "it shines everywhere");
    // About its own axis, which turns the image that it projects.
    let rolled = Linear::Turned { rotation_deg: DVec3::new(0.0, 0.0, 90.0), scale: DVec3::ONE };
    assert_eq!(stage.set(spot, |placement: &mut Placement| placement.linear = rolled), [Shading]);
    let turned = Linear::Turned { rotation_deg: DVec3::new(30.0, 0.0, 0.0), scale: DVec3::ONE };
    assert_eq!(stage.set(point, |placement: &mut Placement| placement.linear = turned), []);
    for light in [spot, sun] {
        assert_eq!(stage.set(light, |placement: &mut Placement| placement.linear = turned), [Shading]);
    }
    assert_eq!(stage.set(point, |light: &mut PointLight| light.intensity = Vec3::splat(2.0)), [Shading]);
    assert_eq!(stage.set(spot, |light: &mut SpotLight| light.intensity = Vec3::splat(2.0)), [Shading]);
    assert!(stage.cause().starts_with("power of spot light "), "{}", stage.cause());
    assert_eq!(stage.set(spot, |light: &mut SpotLight| light.outer_angle_deg = 3.0), [Shading]);
    assert_eq!(stage.set(spot, |light: &mut SpotLight| light.image.width_deg = 3.0), [Shading]);
    assert_eq!(stage.set(sun, |light: &mut DirectionalLight| light.irradiance = Vec3::splat(2.0)), [Shading]);
    assert_eq!(stage.set(sun, |light: &mut DirectionalLight| light.direction = DVec3::X), [Shading]);
    assert_eq!(stage.set(sun, |light: &mut DirectionalLight| light.direction = DVec3::ZERO), [Shading, TopTree]);
    let mend = |light: &mut DirectionalLight| light.direction = DVec3::X;
    assert_eq!(stage.set(sun, mend), [Shading, TopTree]);
    let remove = |world: &mut World| {
        world.entity_mut(sun).remove::<DirectionalLight>();
    };
    assert_eq!(stage.edit(remove), [TopTree]);
    assert_eq!(stage.set(point, |light: &mut PointLight| light.radius = 0.2), [TopTree]);

    let torus = Arc::new(procedural::torus(1.0, 0.2, 16, 8));
    assert_eq!(stage.set(mesh, |shape: &mut Shape| *shape = Shape::Mesh(torus)), [MeshTree]);
    let balls = Arc::new(Balls::new(&[DVec3::Z], [0.3]));
    assert_eq!(stage.set(cloud, |shape: &mut Shape| *shape = Shape::Spheres(balls)), [MeshTree]);
}

#[test]
fn each_setting_has_its_level() {
    use Level::{Redraw, Resize, Restart};
    let mut stage = Stage::new();
    let restarts = stage.restarts();
    let kept = |stage: &mut Stage, expected: &[Level]| {
        assert_eq!(stage.frame(), expected);
        assert_eq!(stage.restarts(), restarts, "all samples are kept");
    };
    stage.session.send(Command::SetExposure { stops: 1.0 });
    kept(&mut stage, &[Redraw]);
    stage.session.send(Command::SetToneCurve(ToneCurve::Filmic));
    kept(&mut stage, &[Redraw]);
    stage.session.world_mut().resource_mut::<StopAt>().0.spp = Some(2);
    kept(&mut stage, &[Level::Reschedule]);
    stage.session.world_mut().resource_mut::<Threads>().0 = 2;
    kept(&mut stage, &[Level::Reschedule]);
    stage.session.world_mut().resource_mut::<Paused>().0 = true;
    kept(&mut stage, &[Level::Reschedule]);
    stage.session.send(Command::Resume);
    kept(&mut stage, &[Level::Reschedule]);

    stage.session.send(Command::SetIntegrator(Integrator::Phong));
    assert_eq!(stage.frame(), [Restart]);
    assert_eq!(stage.edit(|world| world.resource_mut::<Rendering>().0.max_depth = 3), [Restart]);
    assert_eq!(stage.edit(|world| world.resource_mut::<Rendering>().0.seed = 3), [Restart]);
    stage.session.send(Command::Restart);
    assert_eq!(stage.frame(), [Restart]);
    stage.session.send(Command::Resize { width: 20, height: 10 });
    assert_eq!(stage.frame(), [Resize]);
    assert_eq!(stage.restarts(), restarts + 5);
}

#[test]
fn coming_and_going_restart_too() {
    let mut stage = Stage::new();
    let Stage { ball, cloud, red, light, .. } = stage;
    assert_eq!(stage.edit(|world| _ = world.spawn(Shape::Plane { normal: DVec3::Y })), [Level::TopTree]);
    assert!(stage.cause().ends_with("added"), "{}", stage.cause());
    assert_eq!(stage.edit(|world| _ = world.despawn(ball)), [Level::TopTree]);
    assert!(stage.cause().ends_with("removed"), "{}", stage.cause());
    assert_eq!(stage.edit(|world| _ = world.entity_mut(cloud).remove::<Shape>()), [Level::Shading, Level::TopTree]);
    assert_eq!(stage.edit(|world| _ = world.despawn(light)), [Level::TopTree]);
    // Nothing uses it any more.
    assert_eq!(stage.edit(|world| _ = world.despawn(red)), []);
}

#[test]
fn a_material_that_is_still_in_use_may_go() {
    let mut stage = Stage::new();
    let red = stage.red;
    assert_eq!(stage.edit(|world| _ = world.despawn(red)), [Level::Shading]);
    assert_eq!(stage.frame(), []);
}

#[test]
fn nothing_restarts_while_nothing_changes() {
    let mut stage = Stage::new();
    let restarts = stage.restarts();
    let Stage { ball, red, unused, camera, .. } = stage;
    // Touched, marked as changed by the ECS, but equal.
    assert_eq!(stage.set(ball, |placement: &mut Placement| *placement = Placement::default()), []);
    assert_eq!(stage.set(red, |material: &mut SurfaceMaterial| *material = material.clone()), []);
    assert_eq!(stage.set(camera, |view: &mut View| view.eye.x += 0.0), []);
    // Not in the picture.
    assert_eq!(stage.set(unused, |material: &mut SurfaceMaterial| material.0 = GREY), []);
    assert_eq!(stage.edit(|world| _ = world.spawn(SurfaceMaterial(GREY))), []);
    assert_eq!(stage.set(camera, |view: &mut View| view.pivot_distance = 4.0), []);
    stage.session.send(Command::ToggleDepthOfField);
    assert_eq!(stage.frame(), [Level::Restart]);
    assert_eq!(stage.set(camera, |lens: &mut Lens| lens.focus_distance = 9.0), [], "the lens is off");
    // Commands that lead nowhere.
    for command in [
        Command::Turn { yaw_deg: 0.0, pitch_deg: 0.0 },
        Command::Fly { right: f64::NAN, up: 0.0, forward: 0.0 },
        Command::Dolly { factor: 0.0 },
        Command::SetExposure { stops: f32::NAN },
        Command::Resize { width: 16, height: 12 },
        Command::Resume,
    ] {
        stage.session.send(command.clone());
        assert_eq!(stage.frame(), [], "{command:?}");
    }
    for _ in 0..10 {
        assert_eq!(stage.frame(), []);
    }
    assert_eq!(stage.restarts(), restarts + 1);
}

#[test]
fn a_window_without_pixels_keeps_the_film() {
    let mut stage = Stage::new();
    let restarts = stage.restarts();
    stage.session.send(Command::Resize { width: 0, height: 0 });
    stage.frame();
    stage.session.send(Command::Resize { width: 16, height: 12 });
    stage.frame();
    assert_eq!(stage.restarts(), restarts);
}
