//! A Bevy scene, path traced: `cargo run` in this folder.
//!
//! Drag with the mouse to orbit, scroll to come closer. Space switches between firstlight and Bevy's own renderer, T
//! turns the torus. All of it is plain Bevy but [`FirstlightPlugin`].

mod firstlight_plugin;

use bevy::core_pipeline::tonemapping::Tonemapping;
use bevy::input::common_conditions::{input_just_pressed, input_toggle_active};
use bevy::input::mouse::{AccumulatedMouseMotion, AccumulatedMouseScroll};
use bevy::pbr::ScreenSpaceTransmission;
use bevy::prelude::*;
use bevy::winit::{UpdateMode, WinitSettings};
use firstlight_plugin::FirstlightPlugin;
use std::f32::consts::FRAC_PI_2;
use std::time::Duration;

const CENTER: Vec3 = Vec3::new(0.0, 0.9, 0.0);

fn main() {
    let frames = UpdateMode::reactive(Duration::from_secs_f64(1.0 / 60.0));
    App::new()
        .add_plugins((DefaultPlugins, FirstlightPlugin))
        .insert_resource(GlobalAmbientLight { brightness: 100.0, ..default() })
        // Sixty frames per second are enough: the rest of the processor is for samples.
        .insert_resource(WinitSettings { focused_mode: frames, unfocused_mode: frames })
        .insert_resource(ClearColor(Color::linear_rgb(0.1, 0.1, 0.1)))
        .add_systems(Startup, setup)
        .add_systems(Update, orbit)
        .add_systems(Update, turn.run_if(input_toggle_active(false, KeyCode::KeyT)))
        .add_systems(Update, other_renderer.run_if(input_just_pressed(KeyCode::Space)))
        .run();
}

#[derive(Component)]
struct Turning;

fn setup(mut commands: Commands, mut meshes: ResMut<Assets<Mesh>>, mut materials: ResMut<Assets<StandardMaterial>>) {
    let mut plain = |color| materials.add(StandardMaterial { perceptual_roughness: 0.9, ..Color::from(color).into() });
    let [white, red, green] =
        [Srgba::rgb(0.8, 0.8, 0.8), Srgba::rgb(0.8, 0.2, 0.15), Srgba::rgb(0.2, 0.6, 0.2)].map(&mut plain);
    let wall = meshes.add(Plane3d::default().mesh().size(4.0, 4.0));
    let lying = Quat::IDENTITY;
    let (back, left, right) =
        (Quat::from_rotation_x(FRAC_PI_2), Quat::from_rotation_z(-FRAC_PI_2), Quat::from_rotation_z(FRAC_PI_2));
    for (material, at, rotation) in [
        (&white, Vec3::ZERO, lying),
        (&white, Vec3::new(0.0, 2.0, -2.0), back),
        (&red, Vec3::new(-2.0, 2.0, 0.0), left),
        (&green, Vec3::new(2.0, 2.0, 0.0), right),
    ] {
        commands.spawn((
            Mesh3d(wall.clone()),
            MeshMaterial3d(material.clone()),
            Transform::from_translation(at).with_rotation(rotation),
        ));
    }

    let gold = materials.add(StandardMaterial {
        base_color: Color::srgb(1.0, 0.77, 0.34),
        metallic: 1.0,
        perceptual_roughness: 0.25,
        ..default()
    });
    let glass = materials.add(StandardMaterial {
        specular_transmission: 1.0,
        perceptual_roughness: 0.0,
        thickness: 1.0,
        ior: 1.5,
        ..default()
    });
    let glowing = materials.add(StandardMaterial { emissive: LinearRgba::rgb(6.0, 3.0, 1.0), ..default() });
    let torus = Torus { minor_radius: 0.2, major_radius: 0.55 }.mesh().minor_resolution(48).major_resolution(96);
    let sphere = meshes.add(Sphere::new(0.55).mesh().ico(20).unwrap());
    commands.spawn((
        Turning,
        Mesh3d(meshes.add(torus)),
        MeshMaterial3d(gold),
        Transform::from_xyz(-0.75, 0.8, -0.5).with_rotation(Quat::from_euler(EulerRot::YXZ, 0.5, FRAC_PI_2, 0.0)),
    ));
    commands.spawn((Mesh3d(sphere.clone()), MeshMaterial3d(glass), Transform::from_xyz(0.8, 0.55, 0.5)));
    commands.spawn((
        Mesh3d(meshes.add(Cuboid::new(0.9, 1.6, 0.9))),
        MeshMaterial3d(white),
        Transform::from_xyz(0.9, 0.8, -0.9).with_rotation(Quat::from_rotation_y(-0.4)),
    ));
    commands.spawn((
        Mesh3d(sphere),
        MeshMaterial3d(glowing),
        Transform::from_xyz(-0.5, 0.2, 0.9).with_scale(Vec3::splat(0.36)),
    ));

    commands.spawn((
        PointLight { intensity: 400_000.0, radius: 0.25, shadow_maps_enabled: true, ..default() },
        Transform::from_xyz(0.3, 4.3, 1.0),
    ));
    commands.spawn((
        Camera3d::default(),
        ScreenSpaceTransmission::default(),
        // That of firstlight.
        Tonemapping::KhronosPbrNeutral,
        Transform::from_xyz(0.0, 1.7, 6.0).looking_at(CENTER, Vec3::Y),
    ));
}

fn orbit(
    buttons: Res<ButtonInput<MouseButton>>,
    motion: Res<AccumulatedMouseMotion>,
    scroll: Res<AccumulatedMouseScroll>,
    mut camera: Single<&mut Transform, With<Camera3d>>,
) {
    let turn = if buttons.pressed(MouseButton::Left) { motion.delta * 0.005 } else { Vec2::ZERO };
    // A camera that is written to has changed, for Bevy and so for firstlight.
    if turn == Vec2::ZERO && scroll.delta.y == 0.0 {
        return;
    }
    let from = camera.translation - CENTER;
    let (yaw, pitch) = (from.x.atan2(from.z) - turn.x, (from.y / from.length()).asin() + turn.y);
    let rotation = Quat::from_euler(EulerRot::YXZ, yaw, -pitch.clamp(0.0, 1.5), 0.0);
    let distance = (from.length() * 0.9_f32.powf(scroll.delta.y)).clamp(1.0, 20.0);
    **camera = Transform::from_translation(CENTER + rotation * Vec3::Z * distance).with_rotation(rotation);
}

fn turn(time: Res<Time>, mut turning: Query<&mut Transform, With<Turning>>) {
    for mut transform in &mut turning {
        transform.rotate_y(time.delta_secs());
    }
}

/// Of the camera in the scene and that in front of firstlight's image, the other one is active.
fn other_renderer(mut cameras: Query<&mut Camera>) {
    for mut camera in &mut cameras {
        camera.is_active = !camera.is_active;
    }
}
