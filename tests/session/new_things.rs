//! New objects and lights in rooms.

use crate::driver::{Drive, Driver};
use crate::random::Random;
use bevy_ecs::entity::Entity;
use firstlight::frame::{Command, Edit, NewThing, Projector};
use firstlight::scene::{
    ColorParam, Material, MaterialSlots, Placement, PointLight, SceneSource, Shape, SurfaceMaterial,
};
use glam::{DVec2, DVec3};
use std::f64::consts::TAU;

fn opened(folder: &std::path::Path, camera: &str, objects: &str) -> Driver {
    let text = format!(
        "(camera: ({camera}), environment: constant(1), materials: {{ \"grey\": diffuse(albedo: 0.5) }},
          objects: [{objects}])"
    );
    let path = folder.join("room.ron");
    std::fs::write(&path, text.replace("quad(", "quad(material: \"grey\", ")).unwrap();
    Driver::opened(SceneSource::Scene(path))
}

/// Corners of the room, metres.
const ROOM: [DVec3; 2] = [DVec3::new(-3.0, 0.0, -3.0), DVec3::new(3.0, 2.6, 3.0)];

fn room(folder: &std::path::Path) -> Driver {
    let objects = "
        quad(corner: (-3, 0, -3), edge_u: (0, 0, 6), edge_v: (6, 0, 0)),
        quad(name: \"ceiling\", corner: (-3, 2.6, -3), edge_u: (6, 0, 0), edge_v: (0, 0, 6)),
        quad(name: \"wall\", corner: (-3, 0, -3), edge_u: (6, 0, 0), edge_v: (0, 2.6, 0)),
        quad(corner: (-3, 0, 3), edge_u: (0, 2.6, 0), edge_v: (6, 0, 0)),
        quad(corner: (-3, 0, -3), edge_u: (0, 2.6, 0), edge_v: (0, 0, 6)),
        quad(corner: (3, 0, -3), edge_u: (0, 0, 6), edge_v: (0, 2.6, 0)),";
    opened(folder, "eye: (0, 1.4, 2.8), look_at: (0, 1.3, 0), vfov: 70", objects)
}

/// What is seen where a point is in the image.
fn seen_at(driver: &Driver, point: DVec3) -> Option<Entity> {
    let rig = driver.session.status().rig;
    let aspect = f64::from(driver.session.picture().width) / f64::from(driver.session.picture().height);
    let at = Projector::new(&rig, DVec2::new(aspect, 1.0)).place(point).expect("it is in front of the camera");
    driver.session.entity_at(at.x / aspect, at.y)
}

/// The floor between a table and the wall behind it is in the middle of the image, but what stands there is hidden.
#[test]
fn a_new_object_is_seen_where_it_stands() {
    let folder = tempfile::tempdir().unwrap();
    let objects = "
        quad(corner: (-6, 0, -5), edge_u: (0, 0, 12), edge_v: (12, 0, 0)),
        quad(corner: (-6, 0, -5), edge_u: (12, 0, 0), edge_v: (0, 6, 0)),
        quad(name: \"table\", corner: (-6, 1.15, -1.9), edge_u: (0, 0, 3), edge_v: (12, 0, 0)),";
    let mut driver = opened(folder.path(), "eye: (0, 1.4, 5), look_at: (0, 1.3, 0), vfov: 50", objects);
    driver.edit([Edit::Add(NewThing::Sphere)]);
    driver.settle();
    let (center, radius) = (driver.get::<Placement>("ball").translation, driver.get::<Shape>("ball"));
    assert_eq!(seen_at(&driver, center), Some(driver.named("ball")), "{center} {radius:?}");
}

/// A light for a large object is far from it, and bright; in a room, most walls are nearer.
#[test]
fn a_new_light_burns_no_more_than_a_quarter_of_a_room() {
    let folder = tempfile::tempdir().unwrap();
    let mut driver = room(folder.path());
    driver.select("wall");
    driver.edit([Edit::Add(NewThing::PointLight)]);
    driver.session.send(Command::FrameAll);
    driver.settle();
    let [low, high] = ROOM;
    let (light, place) = (driver.get::<PointLight>("point light"), driver.get::<Placement>("point light").translation);
    assert!(place.cmpgt(low).all() && place.cmplt(high).all(), "{place}");
    let mut random = Random(7);
    let is_burnt = |_: &usize| {
        let direction = DVec3::from_array([(); 3].map(|()| f64::from(random.signed()))).normalize();
        let ways = ((low - place) / direction).max((high - place) / direction);
        // White becomes more than twice as bright as that of the display.
        f64::from(light.intensity.x) / ways.min_element().powi(2) > TAU
    };
    let share = (0..20_000).filter(is_burnt).count() as f64 / 20_000.0;
    assert!(share > 0.1 && share < 0.3, "{share} of what is around: {place}");
}

/// Where one clicks: under the ceiling a lamp that shines down, and elsewhere one that is seen, in the room with all of its
/// corners.
#[test]
fn a_new_area_light_hangs_from_the_ceiling_or_stays_in_the_room() {
    let folder = tempfile::tempdir().unwrap();
    let [low, high] = ROOM;
    for (selected, [x, y], hangs) in [
        (None, [0.5, 0.15], true),
        (Some("ceiling"), [0.3, 0.2], true),
        (None, [0.5, 0.5], false),
        (None, [0.2, 0.9], false),
        (None, [0.95, 0.6], false),
    ] {
        let mut driver = room(folder.path());
        if let Some(name) = selected {
            driver.select(name);
        }
        driver.edit([Edit::AddAt { thing: NewThing::AreaLight, x, y }]);
        driver.settle();
        let corner = driver.get::<Placement>("area light").translation;
        let Shape::Quad { edge_u, edge_v } = driver.get::<Shape>("area light") else { panic!("a square") };
        let corners = [corner, corner + edge_u, corner + edge_v, corner + edge_u + edge_v];
        let are_inside = corners.iter().all(|corner| corner.cmpgt(low).all() && corner.cmplt(high).all());
        let faces_down = edge_u.cross(edge_v).normalize().y < -0.999;
        assert!(are_inside && edge_u.length() > 0.2, "[{x}, {y}]: {corners:?}");
        assert_eq!(faces_down && corner.y > 2.3, hangs, "[{x}, {y}]: {corners:?}");
        let is_seen = seen_at(&driver, corner + 0.5 * (edge_u + edge_v));
        assert_eq!(is_seen, Some(driver.named("area light")), "[{x}, {y}]: {corners:?}");
        let material = driver.get::<MaterialSlots>("area light").0[0];
        let material = &driver.session.world().get::<SurfaceMaterial>(material).unwrap().0;
        let Material::Emissive { radiance: ColorParam::Rgb(radiance) } = material else { panic!("it emits") };
        assert!(radiance.x > 1.9, "[{x}, {y}]: it looks bright itself: {radiance}");
    }
}
