//! From the objects of a Mitsuba scene to a scene file.
//!
//! Coordinates stay as they are, unless an environment image has its poles elsewhere than at ±Y or the camera mirrors:
//! then the whole scene is turned, which shows the same image. Start reading at [`Converter::convert`].

use crate::mitsuba::camera::default_camera;
use crate::mitsuba::converter::Converter;
use crate::mitsuba::graph::{Graph, Node};
use crate::mitsuba::meshes::{Geometry, MeshRequest};
use crate::mitsuba::serialized::UnpackedBytes;
use crate::mitsuba::sunsky::{SKIES, upright};
use crate::mitsuba::transform::orthonormal;
use crate::model::foreign::ForeignOptions;
use crate::model::placing::corners_of;
use firstlight_files::printable;
use firstlight_files::reference::References;
use firstlight_files::relative::{path_to_text, relative_path};
use firstlight_files::stamp::{Stamp, stamp};
use firstlight_files::warnings::{Warning, Warnings};
use firstlight_format::camera::CameraPart;
use firstlight_format::error::SceneError;
use firstlight_format::names::Names;
use firstlight_format::parts::{FilmPart, MaterialPart, ObjectPart};
use firstlight_format::placement::Placement;
use firstlight_format::scene_file::SceneFile;
use firstlight_format::sources::MeshSource;
use firstlight_mesh::Mesh;
use firstlight_render::PixelFilter;
use glam::{DMat3, DMat4, DVec3};
use rayon::prelude::*;
use std::collections::{HashMap, HashSet};
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// A converted scene.
pub(crate) struct Converted {
    pub file: SceneFile,
    pub parts: HashMap<u32, Arc<Mesh>>,
    /// The files of meshes, each with its stamp from before it was read.
    pub part_files: HashMap<u32, (PathBuf, Stamp)>,
    pub warnings: Warnings,
}

impl<'a> Converter<'a> {
    pub(crate) fn new(
        graph: &'a Graph,
        references: References,
        folder: &'a Path,
        file_name: String,
        options: &'a ForeignOptions,
    ) -> Self {
        let file = SceneFile::new(CameraPart::looking_at(DVec3::ZERO, DVec3::Z));
        Self {
            graph,
            world: DMat4::IDENTITY,
            file,
            warnings: Warnings::default(),
            references,
            folder,
            defines: &options.defines,
            light_images: &options.light_images,
            meshes: &options.meshes,
            file_name,
            textures: HashMap::new(),
            numbers: Vec::new(),
            texture_depth: 0,
            surfaces: HashMap::new(),
            n_shapes: 0,
            n_parts: 0,
            materials: HashMap::new(),
            requests: HashMap::new(),
            one_sided: Vec::new(),
            backed: HashMap::new(),
            without_normals: HashMap::new(),
            attributes: HashMap::new(),
            colored: HashMap::new(),
            has_environment: false,
            names: Names::default(),
            material_names: Names::default(),
        }
    }

    /// Converts the whole scene and makes its meshes.
    ///
    /// # Errors
    /// If a plugin has a value that it cannot have.
    pub(crate) fn convert(mut self) -> Result<Converted, SceneError> {
        let root = self.graph.root();
        let (emitters, sensors) = (root.children("emitter")?, root.children("sensor")?);
        self.turn_world(&emitters, sensors.first().copied())?;
        for integrator in root.children("integrator")?.into_iter().take(1) {
            self.integrator(integrator, 0)?;
        }
        for shape in root.children("shape")? {
            self.shape(shape, self.world, 0)?;
        }
        for emitter in emitters {
            self.emitter(emitter)?;
        }
        self.settle_numbers();
        let has_camera = self.sensors(&sensors)?;
        // Definitions that nothing uses are no loss.
        for tag in ["bsdf", "texture", "medium", "volume", "sampler", "phase", "film", "subsurface"] {
            root.children(tag)?;
        }
        root.ignore(&["embree_use_robust_intersections", "bvh_max_depth"]);
        for (object, name, place) in self.graph.unread() {
            let (name, plugin) = (printable::name(name), printable::name(&object.plugin));
            let sentence = format!("{name} of the {} {plugin} is not known and has no effect", object.tag);
            self.graph.tell(place, &sentence, &mut self.warnings);
        }
        let files = self.requests.iter().filter_map(|(request, &number)| Some((number, request.geometry.file()?)));
        let part_files = files.map(|(number, file)| (number, (file.to_owned(), stamp(file)))).collect();
        let parts = self.make_meshes(has_camera);
        if !has_camera {
            let (min, max) = self.bounds(&parts);
            self.file.camera = default_camera(min, max);
            self.file.film = FilmPart { width: 768, height: 576, filter: PixelFilter::Gaussian };
            self.warnings.push(Warning::notice(format!(
                "{}: has no sensor that is modelled: the camera sees the whole scene from the front",
                self.graph.files[0].path.display()
            )));
        }
        Ok(Converted { file: self.file, parts, part_files, warnings: self.warnings })
    }

    /// Tells what is not shown as the scene says, with its place and the object.
    pub(crate) fn tell(&mut self, node: Node, message: &str) {
        let called = printable::name(node.called());
        self.graph.tell(node.object().place, &format!("`{called}`: {message}"), &mut self.warnings);
    }

    /// A path as the scene file says it: relative to its folder.
    pub(crate) fn file_path(&self, path: &Path) -> String {
        if self.folder.as_os_str().is_empty() { path_to_text(path) } else { relative_path(self.folder, path) }
    }

    pub(crate) fn add_material(&mut self, node: Node, part: MaterialPart) -> String {
        let name = self.material_names.free(node.called());
        self.file.materials.0.insert(name.clone(), part);
        name
    }

    /// Chooses our world so that environment and camera are ones that we have.
    fn turn_world(&mut self, emitters: &[Node], sensor: Option<Node>) -> Result<(), SceneError> {
        let mirror = DMat3::from_diagonal(DVec3::new(-1.0, 1.0, 1.0));
        let is_sky = |emitter: &&Node| SKIES.contains(&emitter.plugin());
        // The last environment is the one that is shown.
        if let Some(envmap) = emitters.iter().rfind(|emitter| emitter.plugin() == "envmap") {
            if let Some(axes) = orthonormal(DMat3::from_mat4(envmap.transform("to_world")?)) {
                // That it mirrors is left to the image.
                let turned = if axes.determinant() < 0.0 { axes * mirror } else { axes };
                self.world = DMat4::from_mat3(turned.transpose());
            }
        } else if let Some(sky) = emitters.iter().rfind(is_sky) {
            self.world = upright(*sky)?;
        }
        if let Some(sensor) = sensor
            && Self::sensor_to_world(sensor)?.determinant() < 0.0
        {
            self.world = DMat4::from_mat3(mirror) * self.world;
        }
        Ok(())
    }

    /// The first camera is that of the scene. Returns whether there is one.
    fn sensors(&mut self, sensors: &[Node]) -> Result<bool, SceneError> {
        let mut has_camera = false;
        for &sensor in sensors {
            let film = self.file.film;
            match self.sensor(sensor)? {
                Some(camera) if has_camera => {
                    self.file.film = film;
                    let name = match sensor.object().id {
                        Some(_) => sensor.called().to_owned(),
                        None => format!("sensor {}", sensor.index),
                    };
                    self.file.cameras.0.insert(self.names.free(&name), camera);
                }
                Some(camera) => (self.file.camera, has_camera) = (camera, true),
                None => self.file.film = film,
            }
        }
        Ok(has_camera)
    }

    /// Corners of a box around all objects, metres; a cube about the origin if there is none.
    fn bounds(&self, parts: &HashMap<u32, Arc<Mesh>>) -> (DVec3, DVec3) {
        let mut points = Vec::new();
        for object in &self.file.objects {
            match object {
                ObjectPart::Mesh { source: MeshSource::Part { shape, .. }, .. } => {
                    let Some(mesh) = parts.get(shape) else { continue };
                    let world = Placement::from_part(object.transform()).affine();
                    let (min, max) = corners_of(mesh);
                    let corner = |i: usize| DVec3::from_array(std::array::from_fn(|k| [min, max][i >> k & 1][k]));
                    points.extend((0..8).map(|i| world.transform_point3(corner(i))));
                }
                ObjectPart::Sphere { center, radius, .. } => {
                    let world = Placement::from_part(object.transform()).affine();
                    let reach = world.matrix3.x_axis.length() * *radius;
                    points.extend([-reach, reach].map(|reach| world.transform_point3(*center) + reach));
                }
                ObjectPart::Quad { corner, edge_u, edge_v, .. } => {
                    points.extend([DVec3::ZERO, *edge_u, *edge_v, *edge_u + *edge_v].map(|edge| *corner + edge));
                }
                _ => {}
            }
        }
        let all = points.into_iter().map(|point| (point, point)).reduce(|a, b| (a.0.min(b.0), a.1.max(b.1)));
        all.unwrap_or((DVec3::NEG_ONE, DVec3::ONE))
    }

    /// Makes the meshes in parallel; objects of broken ones are left out.
    fn make_meshes(&mut self, has_camera: bool) -> HashMap<u32, Arc<Mesh>> {
        let mut requests: Vec<(&MeshRequest, u32)> = self.requests.iter().map(|(request, n)| (request, *n)).collect();
        requests.sort_by_key(|(_, number)| *number);
        let serialized = requests.iter().filter_map(|(request, _)| match &request.geometry {
            Geometry::Serialized(path, _) => Some(path.as_path()),
            _ => None,
        });
        let room = UnpackedBytes::of_files(serialized.collect::<HashSet<_>>().into_iter());
        let budget = self.meshes;
        let made: Vec<(u32, Result<(Mesh, Warnings), String>)> =
            requests.par_iter().map(|(request, number)| (*number, request.make(&room, budget))).collect();
        let (mut parts, mut lost) = (HashMap::new(), HashSet::new());
        for (number, mesh) in made {
            match mesh {
                Ok((mesh, of_file)) => {
                    self.warnings.append(&of_file);
                    parts.insert(number, Arc::new(mesh));
                }
                Err(why) => {
                    lost.insert(number);
                    self.warnings.push(format!("{why}; the shape is left out"));
                }
            }
        }
        let part_of = |object: &ObjectPart| match object {
            ObjectPart::Mesh { source: MeshSource::Part { shape, .. }, .. } => Some(*shape),
            _ => None,
        };
        self.blacken_backs(&parts, has_camera);
        let mut plain: Vec<usize> = (self.colored.iter())
            .filter(|(number, _)| parts.get(number).is_some_and(|mesh: &Arc<Mesh>| mesh.colors.is_empty()))
            .map(|(_, &index)| index)
            .collect();
        plain.sort_unstable();
        for index in plain {
            let node = Node { graph: self.graph, index };
            self.tell(node, "the mesh has no attribute of the name that its texture reads: it is white");
        }
        self.file.objects.retain(|object| part_of(object).is_none_or(|shape| !lost.contains(&shape)));
        parts
    }
}
