//! A plugin that mirrors the 3D scene of an app into a firstlight session, and shows its image in place of Bevy's.
//!
//! Mirrored are meshes, factors of `StandardMaterial`, point, spot and directional lights, the ambient light as an
//! environment, camera and exposure; textures, skins and morph targets are not. Bevy's change detection tells what to
//! write, and firstlight's what to compute again: a moved object keeps every tree, and while nothing changes, the image
//! gets more samples.
//!
//! Bevy's light is photometric, and multiplied by the exposure of the camera before it is shown: that product is the
//! radiance here. Start reading at [`FirstlightPlugin`].

use bevy::asset::RenderAssetUsages;
use bevy::camera::Exposure;
use bevy::ecs::entity::EntityHashMap;
use bevy::platform::collections::HashMap;
use bevy::prelude::*;
use bevy::render::render_resource::{Extent3d, TextureDimension, TextureFormat};
use firstlight::prelude as fl;
use firstlight::render::Environment;
use std::f32::consts::PI;
use std::sync::Arc;

pub struct FirstlightPlugin;

impl Plugin for FirstlightPlugin {
    fn build(&self, app: &mut App) {
        // The workers give way to the threads of Bevy. The size of the image follows from the window.
        let options = fl::SessionOptions { yielding: true, ..default() };
        let mut session = fl::Session::new(options).expect("the threads of firstlight start");
        session.send(fl::Command::SetDenoising(fl::Denoising::Denoised));
        app.insert_resource(Traced::new(session))
            .add_systems(Startup, open_screen)
            .add_systems(PostStartup, rest_own_camera)
            // After transforms have been propagated and changes of assets noted, which `PostUpdate` does.
            .add_systems(Last, (mirror_materials, mirror_objects, mirror_lights, mirror_camera, show).chain())
            .add_observer(forget::<Mesh3d>)
            .add_observer(forget::<Camera3d>)
            .add_observer(forget::<PointLight>)
            .add_observer(forget::<SpotLight>)
            .add_observer(forget::<DirectionalLight>);
    }
}

/// The session, and what in its world stands for what in Bevy's.
#[derive(Resource)]
struct Traced {
    session: fl::Session,
    twins: EntityHashMap<Entity>,
    materials: HashMap<AssetId<StandardMaterial>, Entity>,
    meshes: HashMap<AssetId<Mesh>, Arc<fl::Mesh>>,
    /// Of the image, pixels.
    size: UVec2,
}

impl Traced {
    fn new(session: fl::Session) -> Self {
        Self { session, twins: default(), materials: default(), meshes: default(), size: UVec2::ZERO }
    }

    /// The entity that mirrors one of Bevy's.
    fn twin(&mut self, of: Entity) -> EntityWorldMut<'_> {
        let world = self.session.world_mut();
        let twin = *self.twins.entry(of).or_insert_with(|| world.spawn_empty().id());
        world.entity_mut(twin)
    }

    fn material(&mut self, of: AssetId<StandardMaterial>) -> EntityWorldMut<'_> {
        let world = self.session.world_mut();
        let material = *self.materials.entry(of).or_insert_with(|| world.spawn_empty().id());
        world.entity_mut(material)
    }
}

fn forget<C: Component>(gone: On<Remove<C>>, mut traced: ResMut<Traced>) {
    if let Some(twin) = traced.twins.remove(&gone.entity) {
        traced.session.world_mut().despawn(twin);
    }
}

fn rgb(color: Color) -> Vec3 {
    color.to_linear().to_vec3()
}

fn mirror_materials(
    mut events: MessageReader<AssetEvent<StandardMaterial>>,
    materials: Res<Assets<StandardMaterial>>,
    camera: Query<&Exposure, With<Camera3d>>,
    mut traced: ResMut<Traced>,
) {
    let exposure = camera.single().copied().unwrap_or_default().exposure();
    for event in events.read() {
        if let AssetEvent::Added { id } | AssetEvent::Modified { id } = event
            && let Some(material) = materials.get(*id)
        {
            traced.material(*id).insert(fl::SurfaceMaterial(surface(material, exposure)));
        }
    }
}

fn surface(of: &StandardMaterial, exposure: f32) -> fl::Material {
    let mut surface = fl::Material::principled(rgb(of.base_color).into());
    if let fl::Material::Principled {
        metallic,
        roughness,
        ior,
        specular,
        specular_color,
        transmission,
        clearcoat,
        clearcoat_roughness,
        emission,
        two_sided,
        ..
    } = &mut surface
    {
        *metallic = of.metallic.into();
        *roughness = of.perceptual_roughness.into();
        *ior = of.ior;
        // Bevy's reflectance of 0.5 is that of an index of 1.5.
        *specular = (4.0 * of.reflectance * of.reflectance).min(1.0).into();
        *specular_color = rgb(of.specular_tint).into();
        *transmission = of.specular_transmission.into();
        *clearcoat = of.clearcoat.into();
        *clearcoat_roughness = of.clearcoat_perceptual_roughness.into();
        *emission = (of.emissive.to_vec3() * 1.0_f32.lerp(exposure, of.emissive_exposure_weight)).into();
        *two_sided = of.cull_mode.is_none() || of.specular_transmission > 0.0;
    }
    surface
}

type ChangedObject = Or<(
    Changed<Mesh3d>,
    AssetChanged<Mesh3d>,
    Changed<MeshMaterial3d<StandardMaterial>>,
    Changed<GlobalTransform>,
    Changed<InheritedVisibility>,
)>;

fn mirror_objects(
    objects: Query<
        (Entity, &Mesh3d, &MeshMaterial3d<StandardMaterial>, &GlobalTransform, &InheritedVisibility),
        ChangedObject,
    >,
    mut edited: MessageReader<AssetEvent<Mesh>>,
    meshes: Res<Assets<Mesh>>,
    mut traced: ResMut<Traced>,
) {
    for event in edited.read() {
        if let AssetEvent::Modified { id } | AssetEvent::Removed { id } = event {
            traced.meshes.remove(id);
        }
    }
    for (entity, mesh, material, transform, visibility) in &objects {
        // Objects of one mesh share its tree.
        let known = traced.meshes.get(&mesh.id()).cloned();
        let shape = known.or_else(|| Some(Arc::new(triangles(meshes.get(&mesh.0)?)?)));
        let Some(shape) = shape.filter(|_| visibility.get()) else {
            traced.twin(entity).remove::<fl::Shape>();
            continue;
        };
        traced.meshes.insert(mesh.id(), shape.clone());
        let slots = fl::MaterialSlots(vec![traced.material(material.id()).id()]);
        traced.twin(entity).insert((fl::Shape::Mesh(shape), placement(transform), slots));
    }
}

fn placement(of: &GlobalTransform) -> fl::Placement {
    of.affine().as_daffine3().into()
}

/// The triangles of a mesh; `None` if it has none that the main world can read.
fn triangles(of: &Mesh) -> Option<fl::Mesh> {
    let positions = of.try_attribute(Mesh::ATTRIBUTE_POSITION).ok()?.as_float3()?;
    let indices: Vec<u32> = match of.try_indices() {
        Ok(indices) => indices.iter().map(|index| index as u32).collect(),
        Err(_) => (0..positions.len() as u32).collect(),
    };
    let positions: Vec<_> = positions.iter().map(|point| Vec3::from(*point).as_dvec3()).collect();
    let mut mesh = fl::Mesh::from_f64(&positions, indices.as_chunks().0.to_vec()).ok()?;
    let normals = of.try_attribute(Mesh::ATTRIBUTE_NORMAL).ok().and_then(|normals| normals.as_float3());
    mesh.normals = normals.into_iter().flatten().map(|normal| Vec3::from(*normal)).collect();
    mesh.validate().ok().map(|()| mesh)
}

fn mirror_lights(
    points: Query<(Entity, Ref<PointLight>, Ref<GlobalTransform>)>,
    spots: Query<(Entity, Ref<SpotLight>, Ref<GlobalTransform>)>,
    suns: Query<(Entity, Ref<DirectionalLight>, Ref<GlobalTransform>)>,
    ambient: Res<GlobalAmbientLight>,
    exposure: Single<Ref<Exposure>, With<Camera3d>>,
    mut traced: ResMut<Traced>,
) {
    let (exposed, all) = (exposure.exposure(), exposure.is_changed());
    for (entity, light, transform) in &points {
        if all || light.is_changed() || transform.is_changed() {
            let intensity = rgb(light.color) * light.intensity / (4.0 * PI) * exposed;
            let light = fl::PointLight { intensity, radius: light.radius.into() };
            traced.twin(entity).insert((light, placement(&transform)));
        }
    }
    for (entity, light, transform) in &spots {
        if all || light.is_changed() || transform.is_changed() {
            let cone = fl::SpotLight {
                intensity: rgb(light.color) * light.intensity / (4.0 * PI) * exposed,
                inner_angle_deg: light.inner_angle.to_degrees().into(),
                outer_angle_deg: light.outer_angle.to_degrees().into(),
                ..default()
            };
            traced.twin(entity).insert((cone, placement(&transform)));
        }
    }
    for (entity, light, transform) in &suns {
        if all || light.is_changed() || transform.is_changed() {
            let irradiance = rgb(light.color) * light.illuminance * exposed;
            let light = fl::DirectionalLight { irradiance, direction: fl::DVec3::NEG_Z };
            traced.twin(entity).insert((light, placement(&transform)));
        }
    }
    if all || ambient.is_changed() {
        let light = Environment::Constant(rgb(ambient.color) * ambient.brightness * exposed);
        traced.session.world_mut().insert_resource(fl::SceneEnvironment { light, ..default() });
    }
}

fn mirror_camera(
    camera: Single<(Entity, Ref<GlobalTransform>, Ref<Projection>), With<Camera3d>>,
    mut traced: ResMut<Traced>,
) {
    let (entity, transform, projection) = camera.into_inner();
    if !transform.is_changed() && !projection.is_changed() {
        return;
    }
    let projection = match &*projection {
        Projection::Perspective(lens) => fl::Projection::perspective(lens.fov.to_degrees().into()),
        Projection::Orthographic(lens) => {
            fl::Projection { orthographic_height: Some(lens.area.height().into()), ..default() }
        }
        Projection::Custom(_) => return,
    };
    let eye = transform.translation();
    let [eye, ahead, up] = [eye, eye + *transform.forward(), *transform.up()].map(|vector| vector.as_dvec3());
    if let Ok(view) = fl::View::look_at(eye, ahead, up) {
        traced.twin(entity).insert((view, projection));
    }
}

/// The sprite that shows the image and fills the window.
#[derive(Component)]
struct Screen;

fn open_screen(mut commands: Commands) {
    commands.spawn((Screen, Camera2d, Msaa::Off));
    commands.spawn((Screen, Sprite::default()));
}

/// Bevy renders nothing behind the image. If this camera is active and that of `Screen` is not, Bevy's image is back.
fn rest_own_camera(mut camera: Single<&mut Camera, With<Camera3d>>) {
    camera.is_active = false;
}

fn show(
    time: Res<Time<Real>>,
    camera: Single<Ref<Camera>, With<Screen>>,
    mut window: Single<&mut Window>,
    mut sprite: Single<&mut Sprite, With<Screen>>,
    mut images: ResMut<Assets<Image>>,
    mut traced: ResMut<Traced>,
    mut shown: Local<u64>,
) {
    let Traced { session, size, .. } = &mut *traced;
    if *size != window.physical_size() {
        *size = window.physical_size();
        session.send(fl::Command::Resize { width: size.x, height: size.y });
        sprite.custom_size = Some(window.size());
    }
    if camera.is_changed() {
        session.send(fl::Command::SetHidden { hidden: !camera.is_active });
    }
    // Never waits for the image: its samples are taken by other threads.
    session.update(time.elapsed());
    let picture = session.picture();
    if picture.number == *shown || picture.rgba.is_empty() {
        return;
    }
    *shown = picture.number;
    let extent = Extent3d { width: picture.width, height: picture.height, depth_or_array_layers: 1 };
    let (rgba, format) = (picture.rgba.clone(), TextureFormat::Rgba8UnormSrgb);
    let image = Image::new(extent, TextureDimension::D2, rgba, format, RenderAssetUsages::default());
    // One of the same size is written into the texture that the sprite has bound.
    let fits = images.get(&sprite.image).is_some_and(|old| old.size() == image.size());
    if fits && let Some(mut old) = images.get_mut(&sprite.image) {
        *old = image;
    } else {
        sprite.image = images.add(image);
    }
    window.title = format!("firstlight in Bevy, {} samples per pixel", picture.spp);
}

#[cfg(test)]
mod tests {
    use super::*;
    use bevy::tasks::{ComputeTaskPool, TaskPoolBuilder};
    use std::sync::mpsc::channel;
    use std::time::Duration;

    fn update(mut traced: ResMut<Traced>) {
        traced.session.update(Duration::ZERO);
    }

    /// Machines of two processors have one such thread.
    #[test]
    fn a_session_needs_no_thread_of_bevy_beside_its_own() {
        let one = || TaskPoolBuilder::new().num_threads(1).build();
        ComputeTaskPool::get_or_init(one);
        let (done, is_done) = channel();
        std::thread::spawn(move || {
            let mut app = App::new();
            let session = fl::Session::new(default()).expect("the threads of firstlight start");
            app.insert_resource(Traced::new(session)).add_systems(Update, update);
            app.update();
            done.send(())
        });
        is_done.recv_timeout(Duration::from_secs(60)).expect("the frame ends");
    }
}
