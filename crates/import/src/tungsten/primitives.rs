//! Primitives as objects.

use crate::model::foreign::cut;
use crate::model::placing;
use crate::tungsten::converter::{Converter, PrimitiveMesh};
use crate::tungsten::fields::Fields;
use crate::tungsten::meshes::{Geometry, MeshRequest};
use firstlight_files::printable;
use firstlight_files::relative::{path_to_text, text_to_path};
use firstlight_format::material_textures::texture_names;
use firstlight_format::parts::{MaterialPart, ObjectPart, TransformPart};
use firstlight_format::sources::MeshSource;
use firstlight_format::value::ColorValue;
use firstlight_render::Material;
use glam::{DAffine3, DMat3, DVec3, Vec3};
use serde_json::Value;
use std::f64::consts::PI;
use std::path::Path;

/// From the axes of our sphere, whose texture has its poles at ±Y, to those of Tungsten's, with poles at ±Z.
const SPHERE_AXES: DMat3 = DMat3::from_cols(DVec3::X, DVec3::NEG_Z, DVec3::NEG_Y);

impl<'a> Converter<'a> {
    /// The mesh that a primitive needs; `None` if it needs none, or is left out, which is told.
    pub(crate) fn mesh_of(&mut self, of: &Fields<'a>) -> Option<MeshRequest> {
        match of.kind() {
            "mesh" => {
                let Some(file) = of.text("file") else {
                    of.tell("a mesh has no `file`: it is left out");
                    return None;
                };
                let path = self.folder.join(text_to_path(&self.file_of(of, file)?));
                if of.flag("backface_culling") == Some(true) {
                    of.tell("holes seen from behind (`backface_culling`) are not modelled: there are none");
                }
                let n_slots = of.get("bsdf").and_then(Value::as_array).map_or(1, Vec::len);
                Some(MeshRequest {
                    geometry: Geometry::File(path),
                    smooth: of.flag("smooth").unwrap_or(false),
                    recompute: of.flag("recompute_normals").unwrap_or(false),
                    n_slots: u16::try_from(n_slots).unwrap_or(u16::MAX),
                })
            }
            "cube" => Some(MeshRequest::of_shape(Geometry::Cube)),
            "disk" => Some(MeshRequest::of_shape(Geometry::Disk)),
            "quad" => Some(MeshRequest::of_shape(Geometry::Quad)),
            "cylinder" => {
                let capped = of.flag("capped").unwrap_or(true);
                Some(MeshRequest::of_shape(Geometry::Cylinder { capped }))
            }
            _ => None,
        }
    }

    /// Adds a primitive.
    pub(crate) fn primitive(&mut self, of: &Fields<'a>, mesh: Option<PrimitiveMesh>) {
        let world = of.transform("transform");
        match of.kind() {
            "point" => return self.point(of, &world),
            "skydome" => return self.sky(of, &world),
            "infinite_sphere" => return self.environment(of, &world),
            "infinite_sphere_cap" => return self.sun(of, &world),
            "sphere" | "mesh" | "cube" | "disk" | "quad" | "cylinder" => {}
            "" => {
                of.tell("a primitive without a `type` is left out");
                return;
            }
            other => {
                let other = printable::name(other);
                of.tell(format!("primitives of the kind `{other}` are not modelled: this one is left out"));
                return;
            }
        }
        if !placing::is_placement(&world) {
            of.tell("it is flattened or too far away, and is left out");
            return;
        }
        // Its own name, that of its file or of its BSDF, or its kind.
        let stem = of.get("file").and_then(Value::as_str).and_then(|file| Path::new(file).file_stem());
        let other = stem.map(|it| path_to_text(it.as_ref())).or(of.get("bsdf").and_then(Value::as_str).map(Into::into));
        let name = other.filter(|_| of.get("name").is_none()).map_or(of.name().to_owned(), |it| cut(&it).to_owned());
        let name = Some(name);
        let scale = DVec3::from_array([0, 1, 2].map(|i| world.matrix3.col(i).length()));
        let radius = scale.max_element();
        let area = match (of.kind(), &mesh) {
            ("sphere", _) => 4.0 * PI * radius * radius,
            (_, Some(mesh)) => placing::area_of(&mesh.mesh, &world),
            (_, None) => return,
        };
        let light = self.radiance(of, 1.0 / (PI * area));
        let inside = of.text("int_medium").unwrap_or_default();
        let mut material = |bsdf: Option<&'a Value>| match &light {
            None => self.surface(of, bsdf, inside),
            Some(radiance) => {
                if let Some(surface) = self.surface(of, bsdf, "")
                    && !is_black(self.file.materials.get(&surface))
                {
                    of.tell("what a light reflects is not modelled: it only emits");
                }
                Some(self.add(of, Material::Emissive { radiance: radiance.clone() }))
            }
        };
        let (material, materials) = match of.get("bsdf") {
            Some(Value::Array(bsdfs)) if bsdfs.len() > 1 && light.is_none() => {
                let all: Vec<Option<String>> = bsdfs.iter().map(|bsdf| material(Some(bsdf))).collect();
                let Some(any) = all.iter().flatten().next().cloned() else { return };
                if all.contains(&None) {
                    of.tell("parts of a mesh that light passes are not modelled: they are as another part");
                }
                (None, Some(all.into_iter().map(|it| it.unwrap_or_else(|| any.clone())).collect()))
            }
            Some(Value::Array(bsdfs)) => (material(bsdfs.first()), None),
            bsdf => (material(bsdf), None),
        };
        // Light passes it.
        if material.is_none() && materials.is_none() {
            return;
        }
        let is_textured = self.is_textured(material.as_deref());
        let object = match (of.kind(), material, mesh) {
            ("sphere", Some(material), _) => {
                if scale.min_element() < radius * (1.0 - 1e-5) {
                    of.tell("a stretched sphere is not modelled: its radius is the largest");
                }
                let (center, transform) = match is_textured {
                    false => (world.translation, TransformPart::default()),
                    true => {
                        let turned = world.matrix3 * DMat3::from_diagonal(scale.recip()) * SPHERE_AXES;
                        let turned = DAffine3 { matrix3: turned, translation: world.translation };
                        (DVec3::ZERO, placing::transform(&turned))
                    }
                };
                ObjectPart::Sphere { name, hidden: false, center, radius, material, transform }
            }
            ("quad", Some(material), _) if !is_textured => {
                // From the corner from which it faces +Y.
                let (edge_u, edge_v) = (world.matrix3.z_axis, world.matrix3.x_axis);
                let corner = world.translation - 0.5 * (edge_u + edge_v);
                let transform = TransformPart::default();
                ObjectPart::Quad { name, hidden: false, corner, edge_u, edge_v, material, transform }
            }
            (_, material, Some(mesh)) => {
                let source = MeshSource::Part {
                    file: self.file_name.clone(),
                    shape: mesh.number,
                    defines: self.defines.to_vec(),
                };
                ObjectPart::mesh(name, source, material, materials, placing::transform(&world))
            }
            _ => return,
        };
        self.file.objects.push(object);
    }

    /// Whether texture coordinates matter.
    fn is_textured(&self, material: Option<&str>) -> bool {
        let Some(part) = material.and_then(|name| self.file.materials.get(name)) else { return false };
        let is_part = |name: &String| self.is_textured(Some(name));
        !texture_names(part).is_empty()
            || matches!(part, Material::Blend { a, b, .. } if is_part(a) || a != b && is_part(b))
    }
}

fn is_black(part: Option<&MaterialPart>) -> bool {
    matches!(part, Some(Material::Diffuse { albedo: ColorValue::Rgb(Vec3::ZERO) }))
}
