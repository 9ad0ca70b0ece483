//! What a model gets that is opened by itself: a camera that frames it, ground, environment, key light.

use crate::format::bounds;
use crate::format::camera::camera;
use crate::format::choice::UpAxis;
use crate::format::parts::{LightPart, MaterialPart, ObjectPart, TransformPart};
use crate::format::scene_file::SceneFile;
use crate::format::sources::{EnvironmentSource, MeshSource};
use crate::format::value::{ColorValue, Rgb};
use crate::import::framing::{AWAY, Framing};
use crate::import::meshes::LoadedMesh;
use crate::import::model::placing::corners_of;
use crate::import::orientation::faces_away;
use crate::import::up_axis::guess_up;
use crate::scene::inner_light::RoomInside;
use glam::{DAffine3, DMat3, DVec3, Vec3};
use std::f64::consts::PI;

/// Names of the parts in a saved scene.
const CLAY: &str = "clay";
const KEY_LIGHT: &str = "key light";
const GROUND: &str = "ground";
const INNER_LIGHT: &str = "inner light";

/// Between model and ground, of the diagonal of the model: too small to be seen.
pub const GAP: f64 = 1.0 / 4096.0;

/// Radiance of the environment that a model gets: at the zenith, at the horizon, and below.
pub const SKY: [Vec3; 3] = [Vec3::new(0.35, 0.5, 0.8), Vec3::new(0.85, 0.9, 0.95), Vec3::splat(0.3)];

fn sky(share: f32) -> EnvironmentSource {
    let [zenith, horizon, ground] = SKY.map(|radiance| Rgb(share * radiance));
    EnvironmentSource::Gradient { zenith, horizon, ground }
}

fn ground_material() -> MaterialPart {
    MaterialPart::Diffuse { albedo: ColorValue::rgb(0.45, 0.45, 0.43) }
}

/// For a light of the size of the model, five radii away: about three times the irradiance of the environment.
fn key_material(share: f32) -> MaterialPart {
    MaterialPart::Emissive { radiance: ColorValue::Rgb(share * Vec3::new(26.0, 24.0, 21.0)) }
}

fn ground(material: String, (min, max): (DVec3, DVec3)) -> ObjectPart {
    let center = 0.5 * (min + max);
    ObjectPart::Plane {
        name: Some(GROUND.to_owned()),
        hidden: false,
        // Below what lies on it, or has a floor of its own.
        point: within(DVec3::new(center.x, min.y - GAP * (max - min).length(), center.z)),
        normal: DVec3::Y,
        material,
        transform: TransformPart::default(),
    }
}

/// The nearest point that a scene file may have: models may be larger.
fn within(point: DVec3) -> DVec3 {
    point.clamp(DVec3::splat(-bounds::MAX_COORDINATE), DVec3::splat(bounds::MAX_COORDINATE))
}

/// Centre and radius of the key light.
///
/// - `side`: signs of the direction of the front; `scale`: of both, so that it looks equally large.
fn key_sphere((min, max): (DVec3, DVec3), side: DVec3, scale: f64) -> (DVec3, f64) {
    let center = 0.5 * (min + max);
    let radius = (0.5 * scale * (max - min).length()).clamp(bounds::MIN_SIZE, bounds::MAX_COORDINATE);
    (within(center + 5.0 * radius * side * DVec3::new(-0.55, 0.75, 0.6).normalize()), radius)
}

/// The first place of the key light where it is not in the image, as it may be in that of a camera of the file: beside the
/// model, or behind a camera that is far away.
fn unseen_key(file: &SceneFile, bounds: (DVec3, DVec3), side: DVec3) -> (DVec3, f64) {
    let (view, projection, _) = camera(&file.camera);
    let aspect = f64::from(file.film.width) / f64::from(file.film.height);
    let is_seen = |&(center, radius): &(DVec3, f64)| {
        let offset = center - view.eye;
        let depth = offset.dot(view.forward);
        // The edges of the image may be oblique.
        let half_height = projection.half_height(depth.max(0.0)) + 2.0 * radius;
        depth > -radius
            && offset.dot(view.up).abs() <= half_height
            && offset.dot(view.right()).abs() <= half_height * aspect.max(1.0)
    };
    let sides = [(1.0, 1.0), (-1.0, 1.0), (1.0, -1.0), (-1.0, -1.0)].map(|(x, z)| side * DVec3::new(x, 1.0, z));
    let places = (0..12).flat_map(|doublings| sides.map(|side| key_sphere(bounds, side, f64::from(1 << doublings))));
    places.into_iter().find(|place| !is_seen(place)).unwrap_or_else(|| key_sphere(bounds, side, 1.0))
}

/// Adds an environment and a key light to a scene.
///
/// - `side`: signs of the direction of the front; `share`: of the usual light.
pub fn light(file: &mut SceneFile, bounds: (DVec3, DVec3), side: DVec3, share: f32) {
    let material = new_material(file, KEY_LIGHT, key_material(share));
    let (center, radius) = unseen_key(file, bounds, side);
    let (name, transform) = (Some(KEY_LIGHT.to_owned()), TransformPart::default());
    file.objects.push(ObjectPart::Sphere { name, hidden: false, center, radius, material, transform });
    file.environment = sky(share);
}

/// Adds a ground plane below a scene.
pub fn stand_on_ground(file: &mut SceneFile, bounds: (DVec3, DVec3)) {
    let name = new_material(file, GROUND, ground_material());
    file.objects.push(ground(name, bounds));
}

/// Adds a light inside of a model that is closed: a point, which cannot be seen.
pub fn light_inside(file: &mut SceneFile, &RoomInside { position, distance }: &RoomInside) {
    // Direct light on a white surface at this distance; walls reflect about twice as much again.
    const RADIANCE: f64 = 0.3;
    let intensity = Rgb(Vec3::splat((RADIANCE * PI * distance * distance) as f32));
    let position = within(position);
    file.lights.push(LightPart::Point {
        name: Some(INNER_LIGHT.to_owned()),
        hidden: false,
        position,
        intensity,
        radius: 0.0,
    });
}

/// Whether it is the material of the light of [`light`].
pub fn is_key_light(material: &str) -> bool {
    material.starts_with(KEY_LIGHT)
}

/// Whether it is the light of [`light_inside`].
pub fn is_inner(light: &LightPart) -> bool {
    light.name() == Some(INNER_LIGHT)
}

/// Adds a material under a new name, which is returned.
fn new_material(file: &mut SceneFile, wanted: &str, material: MaterialPart) -> String {
    let is_taken = |name: &String| file.materials.get(name).is_some();
    let names = std::iter::once(wanted.to_owned()).chain((2..).map(|number: u64| format!("{wanted} {number}")));
    let name = names.into_iter().find(|name| !is_taken(name)).unwrap_or_default();
    file.materials.0.insert(name.clone(), material);
    name
}

/// The scene of a model that is opened by itself, still without light and ground, and what its camera frames.
///
/// All sizes derive from the bounding box of the model, so that the unit of the model does not matter. The camera
/// stands in front of it.
pub fn around(loaded: &LoadedMesh, source: &MeshSource, up: Option<UpAxis>, aspect: f64) -> (SceneFile, Framing) {
    let up = up.unwrap_or_else(|| guess_up(source, &loaded.mesh));
    let (transform, world) = match up {
        UpAxis::Y => (TransformPart::default(), DAffine3::IDENTITY),
        UpAxis::Z => {
            let transform = TransformPart { rotate: Some(DVec3::new(-90.0, 0.0, 0.0)), ..TransformPart::default() };
            // Exact: (x, y, z) becomes (x, z, -y).
            (transform, DAffine3::from_mat3(DMat3::from_cols(DVec3::X, DVec3::NEG_Z, DVec3::Y)))
        }
    };
    let clay = MaterialPart::Diffuse { albedo: ColorValue::rgb(0.72, 0.56, 0.45) };
    let has_materials = !loaded.slots.is_empty();
    // Rotated half a turn about the vertical axis if the model faces the other way.
    let side = if faces_away(&loaded.mesh, up) { AWAY } else { DVec3::ONE };
    let mut framing = Framing::new(side, aspect);
    framing.add(&loaded.mesh, corners_of(&loaded.mesh), &world);
    let material = (!has_materials).then(|| CLAY.to_owned());
    let model = ObjectPart::mesh(Some("model".to_owned()), source.clone(), material, None, transform);
    let file = SceneFile {
        materials: (!has_materials).then(|| (CLAY.to_owned(), clay)).into_iter().collect(),
        objects: vec![model],
        ..SceneFile::new(framing.camera())
    };
    (file, framing)
}
