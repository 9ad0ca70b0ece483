//! Shapes as objects, with the lights that they are.

use crate::mitsuba::bsdf::{by_side, exchange_own, with_parts, without_own};
use crate::mitsuba::converter::Surface;
use crate::mitsuba::converter::{Converter, PlacedMaterial};
use crate::mitsuba::graph::Node;
use crate::mitsuba::meshes::{Geometry, MeshRequest};
use crate::mitsuba::read::find_file;
use crate::mitsuba::spectrum::Use;
use crate::mitsuba::transform::orthonormal;
use crate::model::foreign::{LIGHT_SHARE, MAX_OBJECTS, grey, n_lobes};
use crate::model::placing;
use crate::ply::has_normals;
use firstlight_files::input_file::{FileKind, InputFile};
use firstlight_files::printable;
use firstlight_format::error::SceneError;
use firstlight_format::material_textures::texture_names;
use firstlight_format::model_format::ModelFormat;
use firstlight_format::parts::{MaterialPart, ObjectPart, TransformPart};
use firstlight_format::sources::MeshSource;
use firstlight_format::value::{ColorValue, ScalarValue};
use firstlight_render::{MAX_LOBES, Material};
use glam::{DAffine3, DMat3, DMat4, DVec3, DVec4, Vec3};
use std::io::{BufRead, BufReader};
use std::path::Path;

/// Parts of all shapes that are placed, with those of instances: each shape asks for all of its own.
const MAX_PARTS: usize = 1 << 24;
/// Depth of instances.
const MAX_DEPTH: u32 = 8;

/// From the axes of our sphere, whose texture has its poles at ±Y, to those of Mitsuba's, with poles at ±Z.
const SPHERE_AXES: DMat3 = DMat3::from_cols(DVec3::NEG_X, DVec3::NEG_Z, DVec3::Y);

impl Converter<'_> {
    /// Adds a shape, or those of a group.
    ///
    /// - `outer`: from the space that the shape is placed in to our world.
    pub(crate) fn shape(&mut self, node: Node, outer: DMat4, depth: u32) -> Result<(), SceneError> {
        if depth > MAX_DEPTH {
            return Err(node.error("instances are nested too deep, or contain themselves"));
        }
        self.n_shapes += 1;
        if self.n_shapes > MAX_OBJECTS {
            return Err(node.error(format!("the scene has more than {MAX_OBJECTS} shapes")));
        }
        self.ask(node)?;
        let own = outer * node.transform("to_world")?;
        match node.plugin() {
            // Shown where it is instanced.
            "shapegroup" => return Ok(()),
            "instance" => {
                for group in node.children("shape")? {
                    self.ask(group)?;
                    for shape in group.children("shape")? {
                        self.shape(shape, own, depth + 1)?;
                    }
                }
                return Ok(());
            }
            "merge" => {
                return node.children("shape")?.into_iter().try_for_each(|shape| self.shape(shape, own, depth + 1));
            }
            _ => {}
        }
        let Some(mut material) = self.material_of(node)? else {
            node.skip();
            return Ok(());
        };
        let is_flipped = node.boolean_or("flip_normals", false)?;
        node.ignore(&["silhouette_sampling_weight"]);
        let name = Some(self.names.free(node.called()));
        // Nobody sees the back of a closed shape without holes.
        let is_open = matches!(node.plugin(), "rectangle" | "disk" | "cylinder");
        if !material.two_sided && (is_open || material.has_holes) {
            material.name = self.with_black_back(&material.name);
        }
        match node.plugin() {
            "sphere" => self.sphere(node, own, is_flipped, name, material)?,
            "rectangle" => self.rectangle(node, own, is_flipped, name, material)?,
            plugin => {
                let placed = match plugin {
                    "obj" | "ply" | "serialized" => self.file_geometry(node)?.map(|geometry| (geometry, own)),
                    "cube" => Some((Geometry::Cube, own)),
                    "disk" => Some((Geometry::Disk, own)),
                    "cylinder" => Some((Geometry::Cylinder, own * cylinder_placement(node)?)),
                    other => {
                        let other = printable::name(other).into_owned();
                        self.tell(node, &format!("shapes of type {other} are not modelled: this one is left out"));
                        node.skip();
                        None
                    }
                };
                if let Some((geometry, placed)) = placed {
                    self.mesh(node, geometry, placed, is_flipped, name, material)?;
                }
            }
        }
        Ok(())
    }

    /// Counts the parts of a shape, for all of which it is asked.
    fn ask(&mut self, node: Node) -> Result<(), SceneError> {
        self.n_parts += node.object().parameters.len() + node.object().children.len();
        match self.n_parts > MAX_PARTS {
            true => Err(node.error(format!("the shapes of the scene have more than {MAX_PARTS} parts"))),
            false => Ok(()),
        }
    }

    /// The material of this name on the front, and black on the back.
    pub(crate) fn with_black_back(&mut self, name: &str) -> String {
        if let Some(known) = self.backed.get(name) {
            return known.clone();
        }
        let Some(front) = self.file.materials.get(name).cloned() else { return name.to_owned() };
        // The back of these is black already.
        if matches!(front, Material::Emissive { .. }) {
            return name.to_owned();
        }
        if n_lobes(&self.file, &front) == MAX_LOBES {
            let (scene, shown) = (self.graph.files[0].path.display(), printable::name(name));
            self.warnings.push(format!(
                "{scene}: the black back of `{shown}`, a blend of {MAX_LOBES} lobes, is not modelled: it is like the front"
            ));
            self.backed.insert(name.to_owned(), name.to_owned());
            return name.to_owned();
        }
        let mut add = |wanted: &str, part: MaterialPart| {
            let name = self.material_names.free(wanted);
            self.file.materials.0.insert(name.clone(), part);
            name
        };
        let black = add("black", Material::Diffuse { albedo: ColorValue::grey(0.0) });
        let mut inner = front;
        let mut whole = by_side(String::new(), black);
        exchange_own(&mut inner, &mut whole);
        let inner = add(name, inner);
        if let Material::Blend { a, .. } = &mut whole {
            *a = inner;
        }
        let whole = add(&format!("{name}, one-sided"), whole);
        self.backed.insert(name.to_owned(), whole.clone());
        whole
    }

    fn file_geometry(&mut self, node: Node) -> Result<Option<Geometry>, SceneError> {
        let name = node.text("filename")?.ok_or_else(|| node.error("a mesh needs a `filename`"))?;
        node.ignore(&["load_materials", "max_smooth_angle", "collapse", "srgb", "vertex_count", "face_count"]);
        let index = node.integer("shape_index")?.unwrap_or(0);
        let path = match find_file(&self.references, &self.graph.folders, name) {
            Ok(path) => path,
            Err(why) => {
                self.tell(node, &format!("{why}; the shape is left out"));
                node.skip();
                return Ok(None);
            }
        };
        Ok(Some(match node.plugin() {
            "obj" => Geometry::Model(ModelFormat::Obj, path),
            "ply" => Geometry::Model(ModelFormat::Ply, path),
            _ => Geometry::Serialized(path, u32::try_from(index).map_err(|_| node.error("`shape_index` is below 0"))?),
        }))
    }

    fn mesh(
        &mut self,
        node: Node,
        geometry: Geometry,
        placed: DMat4,
        flip_normals: bool,
        name: Option<String>,
        material: PlacedMaterial,
    ) -> Result<(), SceneError> {
        let is_obj = matches!(geometry, Geometry::Model(ModelFormat::Obj, _));
        let face_normals = node.boolean_or("face_normals", false)?;
        // Mitsuba has the vertices of a file in the world: without normals, a mirrored mesh is turned inside out.
        let is_mirrored = node.transform("to_world")?.determinant() < 0.0;
        let is_turned = is_mirrored && (face_normals || self.lacks_normals(&geometry));
        let request = MeshRequest {
            flip_v: node.boolean_or("flip_tex_coords", is_obj)?,
            face_normals,
            flip_normals: flip_normals != (is_turned && geometry.file().is_some()),
            tangents: material.needs_tangents,
            attribute: material.attribute.clone(),
            geometry,
        };
        let Some(transform) = self.placement(node, placed) else { return Ok(()) };
        // Also those that must not be read have a number.
        let next = (self.n_shapes - 1) as u32;
        let may_be_body = !matches!(request.geometry, Geometry::Rectangle | Geometry::Disk | Geometry::Cylinder);
        let shape = *self.requests.entry(request).or_insert(next);
        if may_be_body && !material.two_sided && !material.has_holes {
            self.one_sided.push(self.file.objects.len());
        }
        if material.attribute.is_some() {
            self.colored.entry(shape).or_insert(node.index);
        }
        let source = MeshSource::Part { file: self.file_name.clone(), shape, defines: self.defines.to_vec() };
        let material = Some(material.name);
        self.file.objects.push(ObjectPart::mesh(name, source, material, None, transform));
        Ok(())
    }

    /// Whether it is a file of a mesh without normals.
    fn lacks_normals(&mut self, geometry: &Geometry) -> bool {
        let Geometry::Model(format, path) = geometry else { return false };
        let lacks = || match format {
            ModelFormat::Obj => !has_obj_normals(path),
            _ => has_normals(path) == Some(false),
        };
        *self.without_normals.entry(path.clone()).or_insert_with(lacks)
    }

    fn sphere(
        &mut self,
        node: Node,
        own: DMat4,
        is_flipped: bool,
        name: Option<String>,
        material: PlacedMaterial,
    ) -> Result<(), SceneError> {
        let (center, radius) = (node.vector("center")?.unwrap_or(DVec3::ZERO), node.float_or("radius", 1.0)?);
        let placed = own * DMat4::from_translation(center) * DMat4::from_scale(DVec3::splat(radius));
        if is_flipped != (own.determinant() * self.world.determinant() < 0.0) {
            if !node.children("emitter")?.is_empty() {
                // As around a scene that it lights.
                return self.mesh(node, Geometry::Sphere, placed, true, name, material);
            }
            self.tell(node, "a sphere whose normals point inwards is not modelled: they point outwards");
        }
        // Mitsuba takes the radius along X for all.
        let radius = placed.x_axis.truncate().length();
        let is_even = |axis: DVec4| (axis.truncate().length() / radius - 1.0).abs() < 1e-5;
        if !is_even(placed.y_axis) || !is_even(placed.z_axis) {
            self.tell(node, "a sphere may not be stretched: its radius is that along X");
        }
        let center = placed.w_axis.truncate();
        let turned = orthonormal(DMat3::from_mat4(placed)).unwrap_or(DMat3::ZERO) * radius * SPHERE_AXES;
        let placed = DMat4::from_translation(center) * DMat4::from_mat3(turned);
        let Some(transform) = self.placement(node, placed) else { return Ok(()) };
        let material_name = material.name;
        self.file.objects.push(match material.is_textured {
            true => {
                let (center, radius) = (DVec3::ZERO, 1.0);
                ObjectPart::Sphere { name, hidden: false, center, radius, material: material_name, transform }
            }
            false => {
                let transform = TransformPart::default();
                ObjectPart::Sphere { name, hidden: false, center, radius, material: material_name, transform }
            }
        });
        Ok(())
    }

    fn rectangle(
        &mut self,
        node: Node,
        own: DMat4,
        is_flipped: bool,
        name: Option<String>,
        material: PlacedMaterial,
    ) -> Result<(), SceneError> {
        if self.placement(node, own).is_none() {
            return Ok(());
        }
        let at = |x: f64, y: f64| own.transform_point3(DVec3::new(x, y, 0.0));
        let (edge_u, edge_v) = (2.0 * own.x_axis.truncate(), 2.0 * own.y_axis.truncate());
        // The normal is that of the plane, also where the transform mirrors.
        let normal = DMat3::from_mat4(own).inverse().transpose() * DVec3::Z;
        let is_turned = (edge_u.cross(edge_v).dot(normal) < 0.0) != is_flipped;
        // From the other side, the texture of a quad runs backwards.
        if is_turned && material.is_textured {
            return self.mesh(node, Geometry::Rectangle, own, is_flipped, name, material);
        }
        let transform = TransformPart::default();
        let (corner, edge_u, edge_v) = match is_turned {
            false => (at(-1.0, -1.0), edge_u, edge_v),
            true => (at(1.0, -1.0), -edge_u, edge_v),
        };
        self.file.objects.push(ObjectPart::Quad {
            name,
            hidden: false,
            corner,
            edge_u,
            edge_v,
            material: material.name,
            transform,
        });
        Ok(())
    }

    /// The placement of an object; `None`, which is told, if it is flat or too far away.
    fn placement(&mut self, node: Node, placed: DMat4) -> Option<TransformPart> {
        let world = DAffine3::from_mat4(placed);
        let is_affine = placed.row(3) == DVec4::W;
        if !is_affine || !placing::is_placement(&world) {
            self.tell(node, "its transform is flat, no affine one, or leads too far away: the shape is left out");
            node.skip();
            return None;
        }
        Some(placing::transform(&world))
    }

    /// The material of a shape; `None` for a surface that light passes.
    fn material_of(&mut self, node: Node) -> Result<Option<PlacedMaterial>, SceneError> {
        let bsdf = node.children("bsdf")?.first().copied();
        let emitter = node.children("emitter")?.first().copied();
        let media = node.children("medium")?;
        // The border of a medium: version 0.x shows no surface there.
        let is_border = !media.is_empty() && node.object().is_old;
        for medium in &media {
            let what = match is_border && bsdf.is_none() && emitter.is_none() {
                true => "a shape without a BSDF is left out",
                false => "the inside of the shape is empty",
            };
            self.tell(node, &format!("media are not modelled: {what}"));
            medium.skip();
        }
        for scattering in node.children("subsurface")? {
            self.tell(node, "subsurface scattering is not modelled: the surface is its BSDF alone");
            scattering.skip();
        }
        let key = (bsdf.map(|node| node.index), emitter.map(|node| node.index), is_border);
        if let Some(known) = self.materials.get(&key) {
            return Ok(known.clone());
        }
        let surface = match bsdf {
            Some(bsdf) => self.surface(bsdf, 0)?,
            None if emitter.is_some() => Some(black()),
            None if is_border => None,
            None => Some(Surface { part: grey(), two_sided: false }),
        };
        let surface = match emitter {
            Some(emitter) => Some(self.glowing(emitter, surface.unwrap_or_else(black))?),
            None => surface,
        };
        let placed = surface.map(|surface| {
            let is_textured = self.is_textured(&surface.part);
            let needs_tangents = needs_tangents(&surface.part);
            let has_holes = has_holes(&surface.part);
            let mut attributes = Vec::new();
            self.attributes_of(&surface.part, &mut attributes);
            if attributes.get(1..).unwrap_or_default().iter().any(|other| *other != attributes[0]) {
                self.tell(node, "two attributes of one mesh are not modelled: the first is used for both");
            }
            let attribute = attributes.into_iter().next();
            let name = self.add_material(bsdf.or(emitter).unwrap_or(node), surface.part);
            PlacedMaterial { name, is_textured, needs_tangents, has_holes, attribute, two_sided: surface.two_sided }
        });
        self.materials.insert(key, placed.clone());
        Ok(placed)
    }

    /// A surface that emits as well.
    fn glowing(&mut self, emitter: Node, surface: Surface) -> Result<Surface, SceneError> {
        emitter.ignore(&["sampling_weight"]);
        if emitter.plugin() != "area" {
            let plugin = printable::name(emitter.plugin()).into_owned();
            self.tell(emitter, &format!("emitters of type {plugin} are not modelled: the shape does not emit"));
            emitter.skip();
            return Ok(surface);
        }
        let radiance = self.color(emitter, "radiance", 1.0, Use::Emission)?;
        let Surface { part: reflecting, two_sided } = surface;
        let part = match reflecting.clone() {
            Material::Diffuse { albedo: ColorValue::Rgb(albedo) } if albedo.max_element() <= 0.0 => {
                return Ok(Surface::one_sided(Material::Emissive { radiance }));
            }
            // Without the reflection of a dielectric, its base is diffuse.
            Material::Diffuse { albedo } => {
                let mut part = Material::principled(albedo);
                if let Material::Principled { specular, roughness, emission, .. } = &mut part {
                    (*specular, *roughness, *emission) = (0.0.into(), 1.0.into(), radiance);
                }
                part
            }
            part => {
                let part = self.share_of_light(emitter, part, &radiance).unwrap_or_else(|| {
                    self.tell(emitter, "what a light of this kind reflects is not modelled: it only emits");
                    Material::Emissive { radiance }
                });
                return Ok(Surface { part, two_sided });
            }
        };
        if !two_sided {
            return Ok(Surface::one_sided(part));
        }
        // Only the front emits.
        let (mut front, mut whole) = (part, by_side(String::new(), String::new()));
        exchange_own(&mut front, &mut whole);
        let sides = [front, without_own(reflecting)].map(|part| self.add_material(emitter, part));
        Ok(Surface::two_sided(with_parts(whole, sides)))
    }

    /// A surface of which a share is a light that is as much brighter; `None` if it cannot have one.
    fn share_of_light(&mut self, node: Node, mut part: MaterialPart, radiance: &ColorValue) -> Option<MaterialPart> {
        if n_lobes(&self.file, &part) >= MAX_LOBES || self.has_textured_weight(&part) {
            return None;
        }
        let radiance = match radiance {
            ColorValue::Rgb(rgb) => ColorValue::Rgb(*rgb / LIGHT_SHARE),
            ColorValue::Texture(name) => ColorValue::Texture(self.tinted(name, Vec3::splat(LIGHT_SHARE.recip()))?),
        };
        let mut whole = Material::blend(LIGHT_SHARE.into(), String::new(), String::new());
        exchange_own(&mut part, &mut whole);
        Some(with_parts(whole, [part, Material::Emissive { radiance }].map(|part| self.add_material(node, part))))
    }

    fn has_textured_weight(&self, part: &MaterialPart) -> bool {
        let Material::Blend { weight, a, b, .. } = part else { return false };
        let mut parts = [a, b].into_iter().filter_map(|name| self.file.materials.get(name));
        matches!(weight, ScalarValue::Texture(_)) || parts.any(|part| self.has_textured_weight(part))
    }

    /// Adds the mesh attributes that a material and its parts read.
    fn attributes_of(&self, part: &MaterialPart, found: &mut Vec<String>) {
        found.extend(texture_names(part).iter().filter_map(|name| self.attributes.get(name)).cloned());
        if let Material::Blend { a, b, .. } = part {
            let parts = [a, b].into_iter().filter_map(|name| self.file.materials.get(name));
            parts.for_each(|part| self.attributes_of(part, found));
        }
    }

    fn is_textured(&self, part: &MaterialPart) -> bool {
        match part {
            Material::Blend { weight, a, b, .. } => {
                let mut parts = [a, b].into_iter().filter_map(|name| self.file.materials.get(name));
                matches!(weight, ScalarValue::Texture(_)) || parts.any(|part| self.is_textured(part))
            }
            _ => part.is_anisotropic() || !texture_names(part).is_empty(),
        }
    }
}

fn black() -> Surface {
    Surface { part: Material::Diffuse { albedo: ColorValue::grey(0.0) }, two_sided: false }
}

fn has_holes(part: &MaterialPart) -> bool {
    matches!(part, Material::Blend { opacity, .. } if *opacity != ScalarValue::Number(1.0))
}

/// Whether an OBJ file has normals; also if it cannot be read, which is told when it is loaded.
fn has_obj_normals(path: &Path) -> bool {
    let Ok(file) = InputFile::open(path, FileKind::Model) else { return true };
    BufReader::new(file).split(b'\n').any(|line| line.is_ok_and(|line| line.trim_ascii_start().starts_with(b"vn")))
}

fn needs_tangents(part: &MaterialPart) -> bool {
    matches!(part, Material::Blend { normal_map: ColorValue::Texture(_), .. })
}

/// From the cylinder of radius 1 between 0 and +Z to the one between two points.
fn cylinder_placement(node: Node) -> Result<DMat4, SceneError> {
    let (from, to) = (node.vector("p0")?.unwrap_or(DVec3::ZERO), node.vector("p1")?.unwrap_or(DVec3::Z));
    let radius = node.float_or("radius", 1.0)?;
    let axis = to - from;
    let along = axis.try_normalize().ok_or_else(|| node.error("`p0` and `p1` of a cylinder are the same point"))?;
    // Mitsuba's frame, so that textures start at the same angle.
    let (x, y) = frame(along);
    Ok(DMat4::from_cols((radius * x).extend(0.0), (radius * y).extend(0.0), axis.extend(0.0), from.extend(1.0)))
}

/// Two directions that are perpendicular to a unit vector and each other (Duff et al. 2017, "Building an Orthonormal
/// Basis, Revisited").
fn frame(n: DVec3) -> (DVec3, DVec3) {
    let sign = 1_f64.copysign(n.z);
    let a = -1.0 / (sign + n.z);
    let b = n.x * n.y * a;
    (DVec3::new(1.0 + sign * n.x * n.x * a, sign * b, -sign * n.x), DVec3::new(b, sign + n.y * n.y * a, -n.y))
}
