//! One kd-tree over all meshes that stand still and are used once, in the space of the snapshot.
//!
//! A room of three hundred meshes is traversed as one mesh. The triangles are tested in the space of the snapshot, with
//! vertices rounded to it once ([`placed_vertices`]), so the hits of a mesh do not depend on which others are in its
//! tree. A tree outlives edits: members that the scene no longer has, or has elsewhere, are passed over
//! ([`PresentPrimitives`]).
//!
//! Start reading at [`StaticTree::build`].

use super::MeshTree;
use super::block_tree::BlockTree;
use super::blocks::TriangleBlock;
use super::leaf::{BLOCK, MAX_PRIMS};
use super::mesh_tree::{BuildPreset, LeafTriangles, Triangles};
use super::present::PresentPrimitives;
use super::shape::{HitSpace, Shape, transform_point};
use crate::geometry::Aabb;
use glam::{Affine3A, Vec3};
use rayon::prelude::*;
use std::collections::HashMap;
use std::sync::Arc;

/// A kd-tree over the triangles of many placed meshes.
#[derive(Debug)]
pub struct StaticTree {
    members: Vec<Member>,
    /// The first primitive of each member, close together: it is searched at every hit.
    firsts: Vec<u32>,
    /// The members by the address of their meshes.
    by_mesh: HashMap<usize, Vec<usize>>,
    pub(super) blocks: BlockTree<TriangleBlock>,
}

/// A mesh of a static tree.
#[derive(Clone, Debug)]
struct Member {
    mesh: Arc<Triangles>,
    world_from_object: Affine3A,
}

/// Transforms vertices to the space of the snapshot, in an order of roundings that is the same everywhere.
#[inline]
pub(super) fn placed_vertices(vertices: [Vec3; 3], world_from_object: &Affine3A) -> [Vec3; 3] {
    vertices.map(|vertex| transform_point(world_from_object, vertex))
}

/// A mesh is not put together with others whose common bounds are smaller by more than this: the tolerance of a tree
/// grows with its extent.
const MAX_RATIO: f32 = 256.0;

impl StaticTree {
    /// Builds trees over the shapes of [`HitSpace::World`]: one, or more if their sizes differ so much that a common
    /// tree would be inaccurate for the small ones.
    pub fn build<'a>(shapes: impl IntoIterator<Item = &'a Shape>, preset: BuildPreset) -> Vec<Self> {
        let members: Vec<Member> = shapes.into_iter().filter_map(Member::of).collect();
        groups(members).into_iter().map(|members| Self::build_group(members, preset)).collect()
    }

    fn build_group(members: Vec<Member>, preset: BuildPreset) -> Self {
        let (mut firsts, mut n_triangles) = (Vec::with_capacity(members.len()), 0);
        for member in &members {
            firsts.push(n_triangles as u32);
            n_triangles += member.mesh.triangles.len();
            assert!(n_triangles < MAX_PRIMS, "more than 2^31 triangles");
        }
        let (positions, triangles) = all_triangles(&members);
        let view = LeafTriangles { positions: &positions, triangles: &triangles, firsts: &firsts };
        let blocks = view.tree(&preset.config(BLOCK));
        let mut by_mesh: HashMap<usize, Vec<usize>> = HashMap::new();
        for (i, member) in members.iter().enumerate() {
            by_mesh.entry(address(&member.mesh)).or_default().push(i);
        }
        Self { members, firsts, by_mesh, blocks }
    }

    /// Number of meshes.
    pub fn n_members(&self) -> usize {
        self.members.len()
    }

    /// Number of triangles of all meshes.
    pub fn n_triangles(&self) -> usize {
        self.members.iter().map(|member| member.mesh.triangles.len()).sum()
    }

    /// Memory of nodes and blocks, bytes.
    pub fn bytes(&self) -> usize {
        self.blocks.bytes()
    }

    /// Whether the tree has this shape, in this place.
    pub fn has(&self, shape: &Shape) -> bool {
        Member::of(shape).is_some_and(|wanted| self.find(&wanted).next().is_some())
    }

    /// Whether the tree has this mesh, in any place.
    pub fn has_mesh(&self, mesh: &MeshTree) -> bool {
        self.by_mesh.contains_key(&address(&mesh.mesh))
    }

    /// Returns the members that are this mesh in this place.
    fn find(&self, wanted: &Member) -> impl Iterator<Item = usize> {
        let of_mesh = self.by_mesh.get(&address(&wanted.mesh)).into_iter().flatten().copied();
        of_mesh.filter(|&member| self.members[member].is(wanted))
    }

    /// Returns the member that a primitive belongs to, and its index there.
    #[inline]
    fn member_of(&self, prim: u32) -> (usize, u32) {
        let member = self.firsts.partition_point(|&first| first <= prim) - 1;
        (member, prim - self.firsts[member])
    }
}

fn address(mesh: &Arc<Triangles>) -> usize {
    Arc::as_ptr(mesh).addr()
}

impl Member {
    /// Returns the member for a shape whose hits are decided in the space of the snapshot; `None` for others.
    fn of(shape: &Shape) -> Option<Self> {
        match shape {
            Shape::Mesh { tree, world_from_object, space: HitSpace::World } => {
                Some(Self { mesh: tree.mesh.clone(), world_from_object: *world_from_object })
            }
            _ => None,
        }
    }

    /// Whether both are the same mesh in the same place.
    fn is(&self, other: &Self) -> bool {
        Arc::ptr_eq(&self.mesh, &other.mesh) && self.world_from_object == other.world_from_object
    }

    /// Bounds in the space of the snapshot, not tight.
    fn bounds(&self) -> Aabb {
        let Aabb { min, max } = self.mesh.bounds;
        if self.mesh.bounds.is_empty() {
            return Aabb::EMPTY;
        }
        let pick = |i: usize, axis: usize| if i >> axis & 1 == 0 { min[axis] } else { max[axis] };
        let corner = |i| transform_point(&self.world_from_object, Vec3::new(pick(i, 0), pick(i, 1), pick(i, 2)));
        Aabb::from_points((0..8).map(corner))
    }
}

/// Splits members into groups, each in the order given: a member that is larger than all smaller ones together by more
/// than [`MAX_RATIO`] begins a new group.
fn groups(members: Vec<Member>) -> Vec<Vec<Member>> {
    let extent = |bounds: &Aabb| if bounds.is_empty() { 0.0 } else { bounds.size().max_element() };
    let boxes: Vec<Aabb> = members.iter().map(Member::bounds).collect();
    let mut by_size: Vec<usize> = (0..members.len()).collect();
    by_size.sort_by(|&a, &b| extent(&boxes[a]).total_cmp(&extent(&boxes[b])));
    let (mut group_of, mut group, mut smaller) = (vec![0; members.len()], 0, Aabb::EMPTY);
    for i in by_size {
        let reach = extent(&smaller);
        if reach > 0.0 && extent(&boxes[i]) > MAX_RATIO * reach {
            group += 1;
        }
        group_of[i] = group;
        if !boxes[i].is_empty() {
            smaller = if smaller.is_empty() { boxes[i] } else { smaller.union(boxes[i]) };
        }
    }
    let mut groups = vec![Vec::new(); group + 1];
    members.into_iter().zip(group_of).for_each(|(member, group)| groups[group].push(member));
    groups.retain(|members| !members.is_empty());
    groups
}

/// All vertices of the members in the space of the snapshot, and their triangles.
fn all_triangles(members: &[Member]) -> (Vec<Vec3>, Vec<[u32; 3]>) {
    let count = |of: fn(&Triangles) -> usize| members.iter().map(|member| of(&member.mesh)).sum();
    let mut positions = Vec::with_capacity(count(|mesh| mesh.positions.len()));
    let mut triangles = Vec::with_capacity(count(|mesh| mesh.triangles.len()));
    for Member { mesh, world_from_object, .. } in members {
        let first = positions.len() as u32;
        triangles.par_extend(mesh.triangles.par_iter().map(|corners| corners.map(|vertex| first + vertex)));
        positions.par_extend(mesh.positions.par_iter().map(|&at| transform_point(world_from_object, at)));
    }
    (positions, triangles)
}

/// A static tree in a scene: which object each of its members is.
#[derive(Debug)]
pub(super) struct PlacedStatic {
    pub tree: Arc<StaticTree>,
    /// The members that objects of the scene are, if some are none.
    present: Option<PresentPrimitives>,
    /// By member; [`PlacedStatic::GONE`] for one that is no object of the scene.
    objects: Vec<u32>,
    /// Object and first primitive of the members that the scene has, in ascending order of both.
    order: Vec<(u32, u32)>,
}

impl PlacedStatic {
    const GONE: u32 = u32::MAX;

    /// Finds the members among the shapes, whose objects are their indices. Marks those found in `placed`.
    ///
    /// `None` if the scene has none of the members, or in another order: ties go to the lower object.
    pub fn new(tree: &Arc<StaticTree>, shapes: &[Shape], placed: &mut [bool]) -> Option<Self> {
        let mut objects = vec![Self::GONE; tree.members.len()];
        for (object, shape) in shapes.iter().enumerate().filter(|(object, _)| !placed[*object]) {
            let Some(wanted) = Member::of(shape) else { continue };
            if let Some(member) = tree.find(&wanted).find(|&member| objects[member] == Self::GONE) {
                objects[member] = object as u32;
            }
        }
        let members = objects.iter().copied().zip(tree.firsts.iter().copied());
        let order: Vec<(u32, u32)> = members.filter(|(object, _)| *object != Self::GONE).collect();
        if order.is_empty() || !order.is_sorted_by(|a, b| a.0 < b.0) {
            return None;
        }
        order.iter().for_each(|(object, _)| placed[*object as usize] = true);
        let here = (0..objects.len()).filter(|&member| objects[member] != Self::GONE);
        let is_whole = order.len() == objects.len();
        let present = (!is_whole).then(|| {
            let bounds = here.clone().map(|member| tree.members[member].bounds()).fold(Aabb::EMPTY, Aabb::union);
            let n_triangles = |member: usize| tree.members[member].mesh.triangles.len();
            let ranges = here.map(|member| (tree.firsts[member] as usize, n_triangles(member)));
            PresentPrimitives::new(tree.n_triangles(), bounds.intersection(tree.blocks.nodes.bounds), ranges)
        });
        Some(Self { tree: tree.clone(), present, objects, order })
    }

    /// The members that take part, with their objects.
    fn members(&self) -> impl Iterator<Item = (u32, &Member)> {
        self.objects.iter().copied().zip(&self.tree.members).filter(|(object, _)| *object != Self::GONE)
    }

    /// Number of triangles that take part.
    pub fn n_triangles(&self) -> usize {
        self.members().map(|(_, member)| member.mesh.triangles.len()).sum()
    }

    /// The triangles that take part: object, index there, and vertices in the space of the snapshot.
    pub fn triangles(&self) -> impl Iterator<Item = (u32, u32, [Vec3; 3])> {
        self.members().flat_map(|(object, Member { mesh, world_from_object })| {
            let indices = 0..mesh.triangles.len() as u32;
            indices.map(move |own| (object, own, placed_vertices(mesh.vertices(own), world_from_object)))
        })
    }

    /// The primitives that take part; `None` for all.
    pub fn present(&self) -> Option<&PresentPrimitives> {
        self.present.as_ref()
    }

    /// Bounds of the primitives that take part.
    pub fn bounds(&self) -> &Aabb {
        self.present.as_ref().map_or(&self.tree.blocks.nodes.bounds, |present| &present.bounds)
    }

    /// Returns the object of a primitive that takes part, and its index there.
    #[inline]
    pub fn object_of(&self, prim: u32) -> (u32, u32) {
        let (member, own) = self.tree.member_of(prim);
        (self.objects[member], own)
    }

    /// Returns the vertices of a primitive in the space of the snapshot.
    #[inline]
    pub fn vertices(&self, prim: u32) -> [Vec3; 3] {
        let (member, own) = self.tree.member_of(prim);
        let Member { mesh, world_from_object, .. } = &self.tree.members[member];
        placed_vertices(mesh.vertices(own), world_from_object)
    }

    /// Returns the exclusive limit on the primitives that win a tie against a hit of this object: those of lower
    /// objects.
    #[inline]
    pub fn wins_ties_below(&self, object: u32) -> u32 {
        let lower = self.order.partition_point(|(own, _)| *own < object);
        self.order.get(lower).map_or(u32::MAX, |(_, first)| *first)
    }
}

/// Finds the shapes of [`HitSpace::World`] in static trees, and builds a tree for those that are in none.
///
/// - `given`: trees of an earlier state of the scene.
pub(super) fn place(shapes: &[Shape], given: &[Arc<StaticTree>]) -> Vec<PlacedStatic> {
    let mut placed = vec![false; shapes.len()];
    let mut trees: Vec<PlacedStatic> =
        given.iter().filter_map(|tree| PlacedStatic::new(tree, shapes, &mut placed)).collect();
    let rest: Vec<&Shape> =
        shapes.iter().zip(&placed).filter(|(_, placed)| !**placed).map(|(shape, _)| shape).collect();
    // What is built beside given trees lasts until the next one is given.
    let preset = if given.is_empty() { BuildPreset::Best } else { BuildPreset::Quick };
    let built = StaticTree::build(rest, preset);
    trees.extend(built.into_iter().filter_map(|tree| PlacedStatic::new(&Arc::new(tree), shapes, &mut placed)));
    trees
}
