//! Open surfaces of glass and water against closed bodies.

use crate::common::*;
use firstlight::kdtree::Shape;
use firstlight::render::{Environment, Material, RenderSettings, Techniques};
use glam::Vec3;

/// A basin before the camera: floor and three walls, a light above, and within them water that is open where no ray
/// gets: below the floor and behind the walls.
fn basin(water: Vec<(Shape, u32)>, absorption: Vec3) -> firstlight::render::Prepared {
    let (x, y, z) = (2.0 * Vec3::X, 2.0 * Vec3::Y, 2.0 * Vec3::Z);
    let low = Vec3::new(-1.0, 0.0, -1.0);
    let mut shapes = vec![
        (quad(low, z, x), 0),
        (quad(low, x, y), 0),
        (quad(low, y, z), 1),
        (quad(low + x, z, y), 1),
        (quad(Vec3::new(-0.3, 1.9, -0.3), 0.6 * Vec3::X, 0.6 * Vec3::Z), 2),
        (sphere(Vec3::new(0.3, 0.4, 0.1), 0.3), 5),
        (sphere(Vec3::new(-0.4, 1.0, 0.0), 0.35), 0),
    ];
    shapes.extend(water);
    // Two of one index: two parts of one surface need not have the same name.
    let water = || Material::Glass { ior: 1.33, absorption, dispersion: 0.0 };
    let glass = Material::Glass { ior: 1.6, absorption: Vec3::ZERO, dispersion: 0.0 };
    let materials = vec![diffuse(0.7), diffuse(0.4), emissive(9.0), water(), water(), glass];
    let sky = Environment::Constant(Vec3::new(0.1, 0.2, 0.4));
    scene(shapes, materials, sky, camera(Vec3::new(0.1, 1.3, 5.0), Vec3::new(0.0, 0.8, 0.0), 16.0))
}

#[test]
fn water_that_ends_at_the_walls_is_that_of_a_closed_body() {
    // Larger than the basin, so that its other faces are out of sight: the image shows nothing beside the basin.
    let low = Vec3::new(-1.5, -0.5, -1.5);
    let (x, y, z) = (3.0 * Vec3::X, 1.5 * Vec3::Y, 2.4 * Vec3::Z);
    let top_and_front = |[top, front]: [u32; 2]| vec![(quad(low + y, z, x), top), (quad(low + z, x, y), front)];
    let hidden = [(quad(low, x, z), 3), (quad(low, y, x), 3), (quad(low, z, y), 3), (quad(low + x, y, z), 3)];
    let techniques = Techniques { caustics: false, ..Techniques::ALL };
    let settings = RenderSettings { seed: 3, techniques, ..RenderSettings::default() };
    for absorption in [Vec3::ZERO, Vec3::new(0.9, 0.3, 0.1)] {
        let image = |water| render(&basin(water, absorption), &settings, 48, 36, 8).0.means();
        let closed = image([top_and_front([3, 3]), hidden.clone().into()].concat());
        for open in [[3, 3], [3, 4]] {
            let open = image(top_and_front(open));
            let same = closed.iter().zip(&open).filter(|(a, b)| a == b).count();
            // A last bit may differ where the order of equally near hits does.
            assert!(same as f64 > 0.999 * closed.len() as f64, "{same} of {} pixels are the same", closed.len());
        }
    }
}
