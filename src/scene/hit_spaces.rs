//! Where the hits of each mesh are decided, and which meshes share a tree.
//!
//! A mesh that one object uses is tested in the space of the snapshot ([`HitSpace::World`]), in a tree that it shares
//! with all others that stand still; a mesh that several objects use is tested in its own. That depends on the scene
//! alone, so an image does not tell how the scene came about. Two things that move are tested in their own space: an
//! object during the exposure, and in a session a large mesh while it is being moved.

use crate::format::placement::Placement;
use crate::kdtree::{BuildPreset, HitSpace, MeshTree, Shape as PlacedShape, StaticTree};
use crate::mesh::Mesh;
use crate::scene::world::components::Shape;
use crate::scene::world::inputs::{ObjectInput, SceneInputs};
use crate::scene::world::trees::{LARGE, Trees, address};
use glam::{Affine3A, DAffine3, DVec3};
use std::collections::HashMap;
use std::sync::Arc;

/// Meshes of up to so many triangles, and so many of all of them, are put into a tree within the frame.
const AT_ONCE: [usize; 2] = [2_000, 20_000];

/// Shared trees beyond this many are replaced by one.
const MAX_TREES: usize = 4;

/// The space of each object, in the order of `inputs`; that of the object for all that are not meshes.
///
/// - `base`: the same scene at another time; what has moved since is tested in its own space.
pub(crate) fn hit_spaces(
    inputs: &SceneInputs,
    trees: &Trees,
    origin: DVec3,
    base: Option<&SceneInputs>,
) -> Vec<HitSpace> {
    let mut left = AT_ONCE[1];
    let shapes = placed_meshes(inputs, trees, origin);
    let choose = |(i, shape): (usize, Option<PlacedShape>)| {
        let Some(shape) = shape else { return HitSpace::Object };
        if base.is_some_and(|base| base.objects.get(i).map(|it| it.placement) != Some(inputs.objects[i].placement)) {
            return HitSpace::Object;
        }
        if !trees.defers || trees.shares(&shape) {
            return HitSpace::World;
        }
        if let PlacedShape::Mesh { tree, .. } = &shape
            && !is_at_once(&shape, &mut left)
            && tree.is_built()
        {
            return HitSpace::Object;
        }
        HitSpace::World
    };
    shapes.into_iter().enumerate().map(choose).collect()
}

/// The meshes that one object uses, each placed relative to `origin`, by object; `None` for all other objects.
fn placed_meshes(inputs: &SceneInputs, trees: &Trees, origin: DVec3) -> Vec<Option<PlacedShape>> {
    let mut uses: HashMap<usize, usize> = HashMap::new();
    for object in &inputs.objects {
        if let Shape::Mesh(mesh) = &object.shape {
            *uses.entry(address(mesh)).or_default() += 1;
        }
    }
    let place = |object: &ObjectInput| {
        let Shape::Mesh(mesh) = &object.shape else { return None };
        let (_, tree) = trees.meshes.get(&address(mesh)).filter(|_| uses[&address(mesh)] == 1)?;
        let world_from_object = mesh_map(object, mesh, origin)?;
        Some(PlacedShape::Mesh { tree: tree.clone(), world_from_object, space: HitSpace::World })
    };
    inputs.objects.iter().map(place).collect()
}

/// The transform of a placement; `None` if it is not finite or flattens objects.
pub(super) fn sound_affine(placement: &Placement) -> Option<DAffine3> {
    let world = placement.affine();
    let determinant = world.matrix3.determinant();
    (world.is_finite() && determinant.is_finite() && determinant != 0.0).then_some(world)
}

/// The map of an object's mesh, relative to `origin`; `None` if its transform is invalid.
fn mesh_map(object: &ObjectInput, mesh: &Mesh, origin: DVec3) -> Option<Affine3A> {
    Some(about(sound_affine(&object.placement)?, mesh.center, origin))
}

/// The transform from coordinates relative to `center` to ones relative to `origin`.
pub(super) fn about(world: DAffine3, center: DVec3, origin: DVec3) -> Affine3A {
    let translation = world.transform_point3(center) - origin;
    Affine3A::from_mat3_translation(world.matrix3.as_mat3(), translation.as_vec3())
}

/// Whether a mesh can be put into a tree within the frame.
///
/// - `left`: triangles that still can, in all.
fn is_at_once(shape: &PlacedShape, left: &mut usize) -> bool {
    let n = n_triangles(shape);
    let fits = n <= AT_ONCE[0] && n <= *left;
    *left -= if fits { n } else { 0 };
    fits
}

fn n_triangles(shape: &PlacedShape) -> usize {
    if let PlacedShape::Mesh { tree, .. } = shape { tree.n_triangles() } else { 0 }
}

/// The trees of the meshes that several objects use, each once.
pub(super) fn own_trees<'a>(inputs: &SceneInputs, trees: &'a Trees) -> Vec<&'a Arc<MeshTree>> {
    let mut uses: HashMap<usize, usize> = HashMap::new();
    let mut found = Vec::new();
    for object in &inputs.objects {
        let Shape::Mesh(mesh) = &object.shape else { continue };
        let n = uses.entry(address(mesh)).or_default();
        *n += 1;
        if let (2, Some((_, tree))) = (*n, trees.meshes.get(&address(mesh))) {
            found.push(tree);
        }
    }
    found
}

/// Meshes to build a shared tree of.
#[derive(Debug, Default)]
pub(crate) struct StaticJob {
    shapes: Vec<PlacedShape>,
    /// Whether the new trees replace all others.
    pub replaces: bool,
}

impl StaticJob {
    /// All meshes of a scene that can share a tree.
    pub fn of_scene(inputs: &SceneInputs, trees: &Trees, origin: DVec3) -> Self {
        let shapes = placed_meshes(inputs, trees, origin).into_iter().flatten().collect();
        Self { shapes, replaces: true }
    }

    /// Meshes that are not in a shared tree, or all if that is better: if much of the trees is out of use, or if they
    /// were built in haste. `None` if nothing is to be done.
    pub fn next(inputs: &SceneInputs, trees: &Trees, origin: DVec3) -> Option<Self> {
        let all = Self::of_scene(inputs, trees, origin);
        let rest: Vec<PlacedShape> = all.shapes.iter().filter(|shape| !trees.shares(shape)).cloned().collect();
        if rest.is_empty() && !trees.has_preview_statics {
            return None;
        }
        let count = |shapes: &[PlacedShape]| shapes.iter().map(n_triangles).sum::<usize>();
        let [used, left] = [count(&all.shapes), count(&rest)];
        let built: usize = trees.statics.iter().map(|tree| tree.n_triangles()).sum();
        let is_worn = trees.statics.len() >= MAX_TREES || 2 * (used - left) < built || left > used / 4;
        Some(if is_worn || trees.has_preview_statics { all } else { Self { shapes: rest, replaces: false } })
    }

    /// Large meshes that are in no shared tree, and have no tree of their own to be drawn by until they are. `None` if
    /// there are none.
    pub fn missing(inputs: &SceneInputs, trees: &Trees, origin: DVec3) -> Option<Self> {
        let mut left = AT_ONCE[1];
        let is_missing = |shape: &PlacedShape| match shape {
            PlacedShape::Mesh { tree, .. } => !trees.shares(shape) && !is_at_once(shape, &mut left) && !tree.is_built(),
            _ => false,
        };
        let shapes: Vec<PlacedShape> =
            placed_meshes(inputs, trees, origin).into_iter().flatten().filter(is_missing).collect();
        (!shapes.is_empty()).then_some(Self { shapes, replaces: false })
    }

    /// Whether a mesh of the scene is among them.
    pub fn has(&self, shape: &Shape, trees: &Trees) -> bool {
        let Shape::Mesh(mesh) = shape else { return false };
        let Some((_, wanted)) = trees.meshes.get(&address(mesh)) else { return false };
        self.shapes.iter().any(|it| matches!(it, PlacedShape::Mesh { tree, .. } if Arc::ptr_eq(tree, wanted)))
    }

    /// Number of meshes.
    pub fn n_meshes(&self) -> usize {
        self.shapes.len()
    }

    /// Number of triangles.
    pub fn n_triangles(&self) -> usize {
        self.shapes.iter().map(n_triangles).sum()
    }

    /// Builds the trees.
    ///
    /// - `preview`: whether a quick first image is wanted: a large tree is then built several times as fast.
    pub fn build(&self, preview: bool) -> BuiltStatics {
        let is_preview = preview && self.n_triangles() >= LARGE;
        let preset = if is_preview { BuildPreset::Quick } else { BuildPreset::Best };
        let trees = StaticTree::build(&self.shapes, preset).into_iter().map(Arc::new).collect();
        BuiltStatics { trees, replaces: self.replaces, is_preview }
    }
}

/// The result of a [`StaticJob`].
#[derive(Debug)]
pub(crate) struct BuiltStatics {
    trees: Vec<Arc<StaticTree>>,
    replaces: bool,
    is_preview: bool,
}

impl Trees {
    /// Whether a shared tree has this mesh in this place.
    fn shares(&self, shape: &PlacedShape) -> bool {
        self.statics.iter().any(|tree| tree.has(shape))
    }

    /// Takes the trees that a job has built.
    pub(crate) fn take_statics(&mut self, built: BuiltStatics) {
        if built.replaces {
            self.statics = built.trees;
            self.has_preview_statics = built.is_preview;
        } else {
            self.statics.extend(built.trees);
            self.has_preview_statics |= built.is_preview;
        }
    }
}
