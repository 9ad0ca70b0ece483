//! The objects of a scene as a readable list: instances of one mesh in one line, with counts and sizes.

use crate::cli::number::{counted, three_digits};
use firstlight::mesh::{Faults, Mesh};
use firstlight::printable;
use firstlight::scene::{ExtentCache, ObjectInput, SceneInputs, Shape};
use glam::DVec3;
use std::collections::{BTreeMap, HashMap};
use std::sync::Arc;

/// Objects with the same shape.
pub struct ObjectGroup<'a> {
    first: &'a ObjectInput,
    /// Whether the objects of the group have different names.
    has_other_names: bool,
    count: usize,
    /// Size of the axis-aligned box of the largest object, metres; `None` for infinite ones.
    size: Option<DVec3>,
}

/// All objects of a scene, in the order of the scene.
pub struct ObjectList<'a> {
    groups: Vec<ObjectGroup<'a>>,
    /// Corners of the axis-aligned box of all finite objects, metres.
    bounds: Option<(DVec3, DVec3)>,
    /// By mesh.
    faults: BTreeMap<*const Mesh, Faults>,
}

/// More named quads, spheres or planes than these are one line.
const MOST_NAMED: usize = 6;

/// Objects with equal keys form one line of the list.
#[derive(PartialEq, Eq, Hash)]
enum GroupKey {
    /// Address of the mesh or group of spheres.
    Shared(usize),
    /// Unnamed objects of one kind, or many named ones.
    Kind(&'static str),
    /// Index of a named object.
    Own(usize),
}

impl<'a> ObjectList<'a> {
    pub fn of(inputs: &'a SceneInputs) -> Self {
        let (mut boxes, mut places) = (ExtentCache::default(), HashMap::new());
        let mut named: HashMap<&str, usize> = HashMap::new();
        for object in inputs.objects.iter().filter(|object| object.name.is_some()) {
            *named.entry(object.shape.kind()).or_default() += 1;
        }
        let mut list = Self { groups: Vec::new(), bounds: None, faults: BTreeMap::new() };
        for (i, object) in inputs.objects.iter().enumerate() {
            let key = match &object.shape {
                Shape::Mesh(mesh) => GroupKey::Shared(Arc::as_ptr(mesh) as usize),
                Shape::Spheres(cloud) => GroupKey::Shared(Arc::as_ptr(cloud) as usize),
                shape if object.name.is_none() || named[shape.kind()] > MOST_NAMED => GroupKey::Kind(shape.kind()),
                _ => GroupKey::Own(i),
            };
            if let Shape::Mesh(mesh) = &object.shape {
                list.faults.entry(Arc::as_ptr(mesh)).or_insert_with(|| Faults::of(mesh));
            }
            let place = *places.entry(key).or_insert_with(|| {
                list.groups.push(ObjectGroup { first: object, has_other_names: false, count: 0, size: None });
                list.groups.len() - 1
            });
            let group = &mut list.groups[place];
            group.count += 1;
            group.has_other_names |= object.name != group.first.name;
            let Some((min, max)) = boxes.world_box(object) else { continue };
            let size = max - min;
            group.size = Some(group.size.filter(|other| other.length() >= size.length()).unwrap_or(size));
            list.bounds = Some(list.bounds.map_or((min, max), |(low, high)| (low.min(min), high.max(max))));
        }
        list
    }

    /// The size of the scene as text.
    pub fn size(&self) -> String {
        let Some((min, max)) = self.bounds else { return "nothing finite".to_owned() };
        format!("{}, from {} to {}", sides(max - min), point(min), point(max))
    }

    /// One line per group, and one per defect of a mesh.
    pub fn lines(&self) -> Vec<String> {
        /// Further lines are omitted; `--json` has all.
        const MOST: usize = 60;
        let mut lines = Vec::new();
        for group in self.groups.iter().take(MOST) {
            let name = group.name();
            lines.push(format!("{name}: {}", group.what()));
            if let Shape::Mesh(mesh) = &group.first.shape {
                lines.extend(self.faults[&Arc::as_ptr(mesh)].sentences().map(|fault| format!("{name}: {fault}")));
            }
        }
        let (left, objects) = self.groups.iter().skip(MOST).fold((0, 0), |(n, sum), group| (n + 1, sum + group.count));
        if left > 0 {
            lines.push(format!("… and {} more (--json lists all)", counted(objects, "object")));
        }
        lines
    }

    /// Meshes and groups of spheres as JSON.
    pub fn json(&self) -> Vec<serde_json::Value> {
        let part = |group: &ObjectGroup| {
            let ObjectGroup { first, count, size, .. } = group;
            let size = size.map(|size| size.to_array());
            match &first.shape {
                Shape::Mesh(mesh) => {
                    let Faults { collapsed, duplicates, flat } = self.faults[&Arc::as_ptr(mesh)];
                    Some(serde_json::json!({
                        "name": first.name, "count": count, "size": size,
                        "triangles": mesh.triangles.len(), "vertices": mesh.positions.len(),
                        "collapsed_triangles": collapsed, "duplicate_triangles": duplicates, "flat_triangles": flat,
                    }))
                }
                Shape::Spheres(balls) => Some(serde_json::json!({
                    "name": first.name, "count": count, "size": size, "balls": balls.centers.len(),
                })),
                _ => None,
            }
        };
        self.groups.iter().filter_map(part).collect()
    }

    /// Corners of the bounding box of the scene as JSON; null if nothing is finite.
    pub fn bounds_json(&self) -> serde_json::Value {
        self.bounds.map_or(
            serde_json::Value::Null,
            |(min, max)| serde_json::json!({ "min": min.to_array(), "max": max.to_array() }),
        )
    }
}

impl ObjectGroup<'_> {
    fn name(&self) -> String {
        let name = printable::name(self.first.name.as_deref().unwrap_or("(no name)"));
        match (self.count, self.has_other_names) {
            (1, _) => name.into_owned(),
            (n, false) => format!("{n} × {name}"),
            (n, true) => {
                let same = if matches!(self.first.shape, Shape::Mesh(_)) { " of the same mesh" } else { "" };
                format!("{name} and {} more{same}", n - 1)
            }
        }
    }

    fn what(&self) -> String {
        let what = match &self.first.shape {
            Shape::Mesh(mesh) if mesh.triangles.is_empty() => return "left out".to_owned(),
            Shape::Mesh(mesh) => {
                let vertices = mesh.positions.len();
                let vertices = if vertices == 1 { "1 vertex".to_owned() } else { format!("{vertices} vertices") };
                format!("{}, {vertices}", counted(mesh.triangles.len(), "triangle"))
            }
            Shape::Spheres(balls) => counted(balls.centers.len(), "sphere"),
            shape => shape.kind().to_owned(),
        };
        match self.size {
            None => format!("{what}, infinite"),
            Some(size) if self.count > 1 => format!("{what}, the largest {}", sides(size)),
            Some(size) => format!("{what}, {}", sides(size)),
        }
    }
}

fn sides(size: DVec3) -> String {
    format!("{} × {} × {} m", three_digits(size.x), three_digits(size.y), three_digits(size.z))
}

fn point(point: DVec3) -> String {
    format!("({}, {}, {})", three_digits(point.x), three_digits(point.y), three_digits(point.z))
}
