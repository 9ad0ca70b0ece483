//! Cache of the kd-trees of meshes and of groups of spheres, and of the trees that meshes share.

use crate::kdtree::{BuildPreset, MeshTree, SphereTree, StaticTree};
use crate::mesh::Mesh;
use crate::scene::world::components::{Balls, Shape};
use crate::scene::world::inputs::SceneInputs;
use std::collections::{HashMap, HashSet};
use std::sync::Arc;

/// Trees by the address of the mesh or group of spheres they were built from.
#[derive(Clone, Debug, Default)]
pub struct Trees {
    pub(crate) meshes: HashMap<usize, (Arc<Mesh>, Arc<MeshTree>)>,
    pub(crate) balls: HashMap<usize, (Arc<Balls>, Arc<SphereTree>)>,
    /// Shapes without a tree because they are invalid, and why.
    pub(crate) unfit: HashMap<usize, (Shape, String)>,
    /// Meshes whose tree has the quick preset: equal hits, slower traversal.
    pub(crate) preview: HashSet<usize>,
    /// Trees that meshes share which stand still, for this or an earlier state of the scene.
    pub(crate) statics: Vec<Arc<StaticTree>>,
    /// Whether they have the quick preset.
    pub(crate) has_preview_statics: bool,
    /// Whether large meshes that are in no shared tree are drawn by their own until somebody builds one, rather than at
    /// once: for sessions, which do not wait.
    pub(crate) defers: bool,
}

/// Below this number of triangles, the best tree is built within a frame or two.
pub(crate) const LARGE: usize = 10_000;

impl Trees {
    /// Whether this shape is known: it has a tree, or one that is built when it is needed, or none for a reason.
    pub fn has(&self, shape: &Shape) -> bool {
        if shared(shape).is_some_and(|key| self.unfit.contains_key(&key)) {
            return true;
        }
        match shape {
            Shape::Mesh(mesh) => self.meshes.contains_key(&address(mesh)),
            Shape::Spheres(balls) => self.balls.contains_key(&address(balls)),
            _ => true,
        }
    }

    /// Whether nothing is left to build of a shape of its own: false for a known mesh whose tree is deferred.
    pub(crate) fn is_built(&self, shape: &Shape) -> bool {
        let own = |mesh: &Arc<Mesh>| self.meshes.get(&address(mesh)).is_none_or(|(_, tree)| tree.is_built());
        if let Shape::Mesh(mesh) = shape { own(mesh) } else { true }
    }

    /// Adds a mesh or a group of spheres, unless it is known. The tree of a mesh is built when something needs it.
    ///
    /// # Errors
    /// If the mesh has no triangles, an index out of range or a coordinate that is not finite.
    pub fn add(&mut self, shape: &Shape) -> Result<(), String> {
        self.add_by(shape, BuildPreset::Best)
    }

    /// Like [`Self::add`], but for a quick first image: the tree of a large mesh is built several times as fast and
    /// gives the same hits with slower traversal. [`Self::preview`] lists such meshes.
    ///
    /// # Errors
    /// Like [`Self::add`].
    pub fn add_preview(&mut self, shape: &Shape) -> Result<(), String> {
        let is_large = matches!(shape, Shape::Mesh(mesh) if mesh.triangles.len() >= LARGE);
        self.add_by(shape, if is_large { BuildPreset::Quick } else { BuildPreset::Best })
    }

    fn add_by(&mut self, shape: &Shape, preset: BuildPreset) -> Result<(), String> {
        if self.has(shape) {
            return Ok(());
        }
        match shape {
            Shape::Mesh(mesh) => {
                check_mesh(mesh)?;
                let tree = MeshTree::deferred(&mesh.positions, &mesh.triangles, preset);
                self.meshes.insert(address(mesh), (mesh.clone(), Arc::new(tree)));
                if preset == BuildPreset::Quick {
                    self.preview.insert(address(mesh));
                }
            }
            Shape::Spheres(balls) => {
                balls.check()?;
                let tree = SphereTree::build(&balls.centers, &balls.radii);
                self.balls.insert(address(balls), (balls.clone(), Arc::new(tree)));
            }
            _ => {}
        }
        Ok(())
    }

    /// Builds the tree of a shape of these trees now, with the best preset or, if `preview`, as
    /// [`Self::add_preview`]; returns it alone.
    ///
    /// # Errors
    /// Like [`Self::add`].
    pub(crate) fn built(&self, shape: &Shape, preview: bool) -> Result<Self, String> {
        let mut built = Self::default();
        match shape {
            Shape::Mesh(mesh) if self.meshes.contains_key(&address(mesh)) => {
                let (mesh, known) = &self.meshes[&address(mesh)];
                let is_quick = preview && mesh.triangles.len() >= LARGE;
                let preset = if is_quick { BuildPreset::Quick } else { BuildPreset::Best };
                built.meshes.insert(address(mesh), (mesh.clone(), Arc::new(known.rebuilt(preset))));
                if is_quick {
                    built.preview.insert(address(mesh));
                }
            }
            _ if preview => built.add_preview(shape)?,
            _ => built.add(shape)?,
        }
        Ok(built)
    }

    /// The meshes with a built tree of the quick preset, in ascending order of size.
    pub fn preview(&self) -> Vec<Shape> {
        let meshes = self.meshes.iter().filter(|(key, (_, tree))| self.preview.contains(key) && tree.is_built());
        let mut meshes: Vec<Arc<Mesh>> = meshes.map(|(_, (mesh, _))| mesh.clone()).collect();
        // The largest takes the longest to rebuild.
        meshes.sort_by_key(|mesh| mesh.triangles.len());
        meshes.into_iter().map(Shape::Mesh).collect()
    }

    /// Whether some trees are quick ones, to be replaced by better ones.
    pub fn is_preview(&self) -> bool {
        self.has_preview_statics || !self.preview().is_empty()
    }

    /// Adds a shape, or records why it can have no tree: its objects are left out.
    pub fn add_or_mark(&mut self, shape: &Shape) {
        if let Err(reason) = self.add(shape) {
            self.mark_unfit(shape, reason);
        }
    }

    /// Records that no tree can be built, so that it is not tried again; without a reason if it was told already.
    pub fn mark_unfit(&mut self, shape: &Shape, reason: String) {
        if let Some(key) = shared(shape) {
            self.unfit.insert(key, (shape.clone(), reason));
        }
    }

    /// Why this shape has no tree.
    pub(crate) fn reason(&self, shape: &Shape) -> String {
        let reason = shared(shape).and_then(|key| self.unfit.get(&key));
        reason.map_or("its kd-tree is not built yet".to_owned(), |(_, reason)| reason.clone())
    }

    /// Memory of all trees, bytes; for groups of spheres, of the spheres only.
    pub fn bytes(&self) -> usize {
        self.meshes.values().map(|(_, tree)| tree.bytes()).sum::<usize>()
            + self.statics.iter().map(|tree| tree.bytes()).sum::<usize>()
            + self.balls.values().map(|(_, tree)| tree.len() * size_of::<[f32; 4]>()).sum::<usize>()
    }

    /// Adds all trees of `other`, except quick ones for which one is built already.
    pub fn extend(&mut self, other: Self) {
        self.unfit.extend(other.unfit);
        for (key, tree) in other.meshes {
            if !other.preview.contains(&key) {
                self.preview.remove(&key);
            } else if self.meshes.get(&key).is_some_and(|(_, known)| known.is_built()) {
                continue;
            } else {
                self.preview.insert(key);
            }
            self.meshes.insert(key, tree);
        }
        self.balls.extend(other.balls);
        if !other.statics.is_empty() {
            (self.statics, self.has_preview_statics) = (other.statics, other.has_preview_statics);
        }
    }

    /// Removes the trees of shapes that no object uses.
    pub fn keep_used(&mut self, inputs: &SceneInputs) {
        let hidden = inputs.hidden.objects.iter().map(|(_, object)| object);
        let used: HashSet<usize> = inputs.objects.iter().chain(hidden).filter_map(|o| shared(&o.shape)).collect();
        self.meshes.retain(|key, _| used.contains(key));
        self.balls.retain(|key, _| used.contains(key));
        self.unfit.retain(|key, _| used.contains(key));
        self.preview.retain(|key| used.contains(key));
        let meshes = &self.meshes;
        self.statics.retain(|statics| meshes.values().any(|(_, tree)| statics.has_mesh(tree)));
        self.has_preview_statics &= !self.statics.is_empty();
    }
}

pub(crate) fn address<T>(shared: &Arc<T>) -> usize {
    Arc::as_ptr(shared) as usize
}

fn shared(shape: &Shape) -> Option<usize> {
    match shape {
        Shape::Mesh(mesh) => Some(address(mesh)),
        Shape::Spheres(balls) => Some(address(balls)),
        _ => None,
    }
}

fn check_mesh(mesh: &Mesh) -> Result<(), String> {
    let n = mesh.positions.len();
    if mesh.triangles.is_empty() {
        return Err("the mesh has no triangles".to_owned());
    }
    if let Some(i) = mesh.triangles.iter().position(|corners| corners.iter().any(|&v| v as usize >= n)) {
        return Err(format!("triangle {i} uses vertex {:?}, but the mesh has {n}", mesh.triangles[i].iter().max()));
    }
    if let Some(i) = mesh.positions.iter().position(|p| !p.is_finite()) {
        return Err(format!("vertex {i} of the mesh is not finite"));
    }
    let per_vertex = |len: usize| len == 0 || len == n;
    let attributes = [mesh.normals.len(), mesh.uvs.len(), mesh.uvs2.len(), mesh.colors.len(), mesh.tangents.len()];
    if !attributes.into_iter().all(per_vertex) {
        return Err("the mesh needs one value of each attribute per vertex, or none".to_owned());
    }
    if !mesh.slots.is_empty() && mesh.slots.len() != mesh.triangles.len() {
        return Err("the mesh needs one material slot per triangle, or none".to_owned());
    }
    Ok(())
}
