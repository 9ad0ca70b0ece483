//! Guesses the up axis of a model if the file does not say: the one on which the model would stand.

use firstlight_format::choice::UpAxis;
use firstlight_format::sources::MeshSource;
use firstlight_mesh::Mesh;
use glam::{DVec2, DVec3};

/// The up axis of a model that was loaded from `source`.
pub fn guess_up(source: &MeshSource, mesh: &Mesh) -> UpAxis {
    match source {
        MeshSource::Obj(_) => guess_up_of_obj(mesh),
        MeshSource::Ply(_) => guess_up_of_either(mesh),
        MeshSource::Stl(_) if is_plate(mesh) => UpAxis::Z,
        MeshSource::Stl(_) => guess_up_of_either(mesh),
        MeshSource::Gltf { .. } | MeshSource::Part { .. } | MeshSource::Builtin(_) => UpAxis::Y,
    }
}

/// For formats of either axis (PLY, STL): Y, unless the model would tip over that way and stands on its lower Z side.
///
/// A model stands if the centroid of its surface is above the convex hull of its lowest 2 %. For Z, this hull must also
/// have more than twice the relative area of that of Y.
fn guess_up_of_either(mesh: &Mesh) -> UpAxis {
    let Some(model) = Stands::of(mesh) else { return UpAxis::Y };
    let (on_y, on_z) = (model.stand(1, Side::Lower), model.stand(2, Side::Lower));
    if !on_y.stable && on_z.stable && on_z.support > 2.0 * on_y.support { UpAxis::Z } else { UpAxis::Y }
}

/// Whether a model lies flat on its lower Z side: of the programs that write STL, those for printers, machines and robots
/// have Z up.
fn is_plate(mesh: &Mesh) -> bool {
    const FLAT: f64 = 0.25;
    let Some(model) = Stands::of(mesh) else { return false };
    let size = model.max - model.min;
    size.z <= FLAT * size.x.min(size.y) && model.stand(2, Side::Lower).stable
}

/// For OBJ, a format of Y up: Z only for a model with a broad base that would tip over on all other sides along Y and Z,
/// and is too high to be a relief with a flat back; or for one that is longest along Y and stands on wheels there, as vehicles
/// do, rather than at its end.
fn guess_up_of_obj(mesh: &Mesh) -> UpAxis {
    const BROAD: f64 = 0.25;
    const HIGH: f64 = 0.5;
    const HIGH_AS_A_CAR: f64 = 0.25;
    let Some(model) = Stands::of(mesh) else { return UpAxis::Y };
    let size = model.max - model.min;
    let base = model.stand(2, Side::Lower);
    let is_sure = size.z >= HIGH * size.x.max(size.y)
        && base.stable
        && base.support >= BROAD
        && !model.stand(2, Side::Upper).stable
        && !model.stand(1, Side::Lower).stable
        && !model.stand(1, Side::Upper).stable;
    let is_long = size.y >= size.x.max(size.z) && size.z >= HIGH_AS_A_CAR * size.y;
    let is_vehicle = is_long
        && base.stable
        && base.support >= 2.0 * BROAD
        && model.stand(1, Side::Lower).support < BROAD * base.support
        && model.is_on_wheels();
    if is_sure || is_vehicle { UpAxis::Z } else { UpAxis::Y }
}

/// What is needed to stand a model on its sides.
struct Stands<'a> {
    mesh: &'a Mesh,
    /// Centroid of the surface.
    center: DVec3,
    min: DVec3,
    max: DVec3,
}

/// The end of an axis that is below.
#[derive(Clone, Copy, PartialEq)]
enum Side {
    Lower,
    Upper,
}

/// Stability of a model on one of its sides.
struct Stand {
    stable: bool,
    /// Area of the hull of the lowest points over the area of the floor of the bounding box.
    support: f64,
}

/// The corners of each triangle.
fn triangles(mesh: &Mesh) -> impl Iterator<Item = [DVec3; 3]> {
    mesh.triangles.iter().map(|corners| corners.map(|vertex| mesh.positions[vertex as usize].as_dvec3()))
}

impl<'a> Stands<'a> {
    /// `None` if the surface has no area.
    fn of(mesh: &'a Mesh) -> Option<Self> {
        let center = surface_center(mesh)?;
        let corners = triangles(mesh).flatten();
        let (min, max) = corners.fold((center, center), |(min, max), corner| (min.min(corner), max.max(corner)));
        Some(Self { mesh, center, min, max })
    }

    /// Whether what touches the ground with Z up is in front and behind, and not the back of a relief or its rim.
    fn is_on_wheels(&self) -> bool {
        const BETWEEN: f64 = 0.3;
        let (margin, length) = (0.02 * (self.max.z - self.min.z), self.max.y - self.min.y);
        let is_lowest = |corner: &DVec3| corner.z <= self.min.z + margin;
        let lowest = triangles(self.mesh).flatten().filter(is_lowest);
        let mut along: Vec<f64> = lowest.map(|corner| corner.y).collect();
        along.sort_by(f64::total_cmp);
        let has_gap = along.windows(2).any(|pair| pair[1] - pair[0] >= BETWEEN * length);
        // A flat back may have corners only at its ends.
        let is_back = |corners: [DVec3; 3]| {
            let [a, b, c] = corners.map(|corner| corner.y);
            corners.iter().all(is_lowest) && a.max(b).max(c) - a.min(b).min(c) >= BETWEEN * length
        };
        has_gap && !triangles(self.mesh).any(is_back)
    }

    fn stand(&self, axis: usize, side: Side) -> Stand {
        let seen_from_below = |point: DVec3| DVec2::new(point[(axis + 1) % 3], point[(axis + 2) % 3]);
        let margin = 0.02 * (self.max[axis] - self.min[axis]);
        let is_lowest = |corner: &DVec3| match side {
            Side::Lower => corner[axis] <= self.min[axis] + margin,
            Side::Upper => corner[axis] >= self.max[axis] - margin,
        };
        let lowest = triangles(self.mesh).flatten().filter(is_lowest);
        let hull = convex_hull(lowest.map(seen_from_below).collect());
        let size = seen_from_below(self.max - self.min);
        Stand { stable: contains(&hull, seen_from_below(self.center)), support: area(&hull) / (size.x * size.y) }
    }
}

/// The centroid of the surface; `None` if its area is 0.
fn surface_center(mesh: &Mesh) -> Option<DVec3> {
    let (mut sum, mut total) = (DVec3::ZERO, 0.0);
    for [a, b, c] in triangles(mesh) {
        let area = (b - a).cross(c - a).length();
        sum += area * (a + b + c) / 3.0;
        total += area;
    }
    (total > 0.0).then(|| sum / total)
}

/// Convex hull, counter-clockwise, by Andrew's monotone chain.
fn convex_hull(mut points: Vec<DVec2>) -> Vec<DVec2> {
    points.sort_by(|a, b| a.x.total_cmp(&b.x).then(a.y.total_cmp(&b.y)));
    points.dedup();
    let chain = |points: &mut dyn Iterator<Item = DVec2>| {
        let mut chain: Vec<DVec2> = Vec::new();
        for point in points {
            while let [.., a, b] = chain[..]
                && (b - a).perp_dot(point - a) <= 0.0
            {
                chain.pop();
            }
            chain.push(point);
        }
        // The last point is the first of the other chain.
        chain.pop();
        chain
    };
    let mut hull = chain(&mut points.iter().copied());
    hull.extend(chain(&mut points.iter().rev().copied()));
    hull
}

fn edges(hull: &[DVec2]) -> impl Iterator<Item = (DVec2, DVec2)> {
    hull.iter().zip(hull.iter().cycle().skip(1)).map(|(&a, &b)| (a, b))
}

fn area(hull: &[DVec2]) -> f64 {
    0.5 * edges(hull).map(|(a, b)| a.perp_dot(b)).sum::<f64>()
}

fn contains(hull: &[DVec2], point: DVec2) -> bool {
    hull.len() > 2 && edges(hull).all(|(a, b)| (b - a).perp_dot(point - a) >= 0.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_plate_of_stl_lies_and_a_model_of_any_other_format_stands_as_before() {
        let of = |size: DVec3| firstlight_mesh::procedural::cuboid(size);
        assert!(is_plate(&of(DVec3::new(0.25, 0.21, 0.003))) && !is_plate(&of(DVec3::new(1.0, 1.0, 0.5))));
        assert!(!is_plate(&of(DVec3::new(0.25, 0.003, 0.21))), "a plate that lies with Y up");
        let plate = of(DVec3::new(0.25, 0.21, 0.003));
        assert_eq!(guess_up(&MeshSource::of_file("bed.stl".to_owned()), &plate), UpAxis::Z);
        assert_eq!(guess_up(&MeshSource::of_file("bed.obj".to_owned()), &plate), UpAxis::Y);
    }

    #[test]
    fn a_car_of_obj_stands_on_its_wheels_and_a_shelf_on_its_foot() {
        let obj = MeshSource::of_file("a.obj".to_owned());
        let blocks = |of: &[(DVec3, DVec3)]| {
            let (mut positions, mut triangles) = (Vec::new(), Vec::new());
            for &(center, size) in of {
                let block = firstlight_mesh::procedural::cuboid(size);
                let first = positions.len() as u32;
                positions.extend(block.positions.iter().map(|p| p.as_dvec3() + block.center + center));
                triangles.extend(block.triangles.iter().map(|corners| corners.map(|corner| corner + first)));
            }
            Mesh::from_f64(&positions, triangles).unwrap()
        };
        // Along Y: a body, a cabin, a bumper in front and behind, four wheels.
        let mut car = vec![
            (DVec3::new(0.0, 0.0, 0.7), DVec3::new(1.7, 4.2, 0.6)),
            (DVec3::new(0.0, 0.3, 1.25), DVec3::new(1.4, 2.0, 0.5)),
            (DVec3::new(0.0, 0.0, 0.5), DVec3::new(1.4, 4.5, 0.15)),
        ];
        car.extend([(-0.75, -1.4), (0.75, -1.4), (-0.75, 1.4), (0.75, 1.4)].map(|(x, y)| {
            let middle = DVec3::new(x, y, 0.3);
            (middle, DVec3::new(0.2, 0.6, 0.6))
        }));
        assert_eq!(guess_up(&obj, &blocks(&car)), UpAxis::Z);
        let upright: Vec<_> =
            car.iter().map(|(p, s)| (DVec3::new(p.x, p.z, -p.y), DVec3::new(s.x, s.z, s.y))).collect();
        assert_eq!(guess_up(&obj, &blocks(&upright)), UpAxis::Y);
        // With a flat back; a mask, which is thin.
        let shelf = blocks(&[(DVec3::ZERO, DVec3::new(0.8, 2.0, 0.5))]);
        let mask = blocks(&[(DVec3::ZERO, DVec3::new(0.8, 1.0, 0.2)), (DVec3::NEG_Y, DVec3::new(0.1, 1.0, 0.1))]);
        assert_eq!([shelf, mask].map(|mesh| guess_up(&obj, &mesh)), [UpAxis::Y; 2]);
    }

    /// A table: a top and four legs, standing along +Z or +Y.
    fn table(up: UpAxis) -> Mesh {
        let mut positions = Vec::new();
        let mut triangles = Vec::new();
        let mut block = |center: DVec3, size: DVec3| {
            let cube = firstlight_mesh::procedural::cuboid(size);
            let first = positions.len() as u32;
            positions.extend(cube.positions.iter().map(|position| position.as_dvec3() + cube.center + center));
            triangles.extend(cube.triangles.iter().map(|corners| corners.map(|corner| corner + first)));
        };
        block(DVec3::new(0.0, 1.0, 0.1), DVec3::new(2.0, 0.1, 1.2));
        for (x, z) in [(-0.9, -0.4), (0.9, -0.4), (-0.9, 0.6), (0.9, 0.6)] {
            block(DVec3::new(x, 0.5, z), DVec3::new(0.1, 1.0, 0.1));
        }
        if up == UpAxis::Z {
            positions.iter_mut().for_each(|p| *p = DVec3::new(p.x, -p.z, p.y));
        }
        Mesh::from_f64(&positions, triangles).unwrap()
    }

    #[test]
    fn a_table_stands_on_its_legs() {
        assert_eq!(guess_up_of_either(&table(UpAxis::Y)), UpAxis::Y);
        assert_eq!(guess_up_of_either(&table(UpAxis::Z)), UpAxis::Z);
    }

    /// A cone on a base along +Z, with a tip that leans towards +Y.
    fn bust(height: f64) -> Mesh {
        let ring = (0..16).map(|i| DVec2::from_angle(f64::from(i) * std::f64::consts::TAU / 16.0).extend(0.0));
        let positions: Vec<DVec3> = ring.chain([DVec3::new(0.0, 1.2, height), DVec3::ZERO]).collect();
        let sides = (0..16).flat_map(|i| [[i, (i + 1) % 16, 16], [(i + 1) % 16, i, 17]]);
        Mesh::from_f64(&positions, sides.collect()).unwrap()
    }

    #[test]
    fn obj_is_y_up_unless_the_model_can_stand_on_nothing_else() {
        assert_eq!(guess_up_of_obj(&bust(3.0)), UpAxis::Z);
        assert_eq!(guess_up_of_obj(&bust(1.0)), UpAxis::Y, "a relief with a flat back");
        for mesh in [table(UpAxis::Y), table(UpAxis::Z), firstlight_mesh::procedural::cuboid(DVec3::new(1.0, 1.0, 3.0))]
        {
            assert_eq!(guess_up_of_obj(&mesh), UpAxis::Y);
        }
    }

    #[test]
    fn what_stands_either_way_is_y_up() {
        assert_eq!(guess_up_of_either(&firstlight_mesh::procedural::cuboid(DVec3::ONE)), UpAxis::Y);
        assert_eq!(guess_up_of_either(&firstlight_mesh::procedural::icosphere(8)), UpAxis::Y);
    }

    #[test]
    fn a_hull_holds_its_points() {
        let points: Vec<DVec2> = (0..50).map(|i| DVec2::from_angle(f64::from(i) * 2.4) * f64::from(i % 7)).collect();
        let hull = convex_hull(points.clone());
        assert!(area(&hull) > 0.0);
        assert!(points.iter().all(|&point| contains(&hull, point)));
        assert!(!contains(&hull, DVec2::new(6.5, 0.0)));
        assert_eq!(area(&convex_hull(vec![DVec2::ZERO, DVec2::ONE])), 0.0);
    }
}
