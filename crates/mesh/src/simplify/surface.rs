//! A triangle surface for edge collapses: connectivity, checks, and the collapse itself.
//!
//! Each vertex has a ring list of its corners (corner 3t + k is corner k of triangle t). Corners of removed triangles
//! stay in the lists of vertices that were not collapsed and are skipped.

use glam::{Vec2, Vec3};

/// How a vertex may move.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(super) enum Kind {
    /// Inside a smooth sheet: moves freely.
    Free,
    /// On one border, seam or material edge: slides along it.
    Curve,
    /// Where such lines end or meet, and wherever the surface is not manifold: stays.
    Fixed,
    /// On the rim of a part that is processed separately: neither it nor its edges change.
    Frozen,
}

/// Shading data of a wedge: the corners at one vertex that share it.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Wedge {
    pub normal: Vec3,
    pub uv: Vec2,
}

impl Wedge {
    fn between(self, other: Self, t: f32) -> Self {
        let normal = self.normal.lerp(other.normal, t);
        Self { normal: normal.try_normalize().unwrap_or(other.normal), uv: self.uv.lerp(other.uv, t) }
    }
}

/// Limit on the triangles around a merged vertex: it bounds the work on meshes with a hub.
const MAX_VALENCE: u32 = 256;
/// Cosine of the largest rotation of a triangle, about 75°.
const MIN_TURN_COS: f64 = 0.25;
/// Corners of removed triangles that a ring list may hold beyond its live ones.
const MANY_DEAD: usize = 64;
pub(super) const NONE: u32 = u32::MAX;

#[derive(Debug)]
pub(super) struct Surface {
    pub positions: Vec<Vec3>,
    pub kinds: Vec<Kind>,
    /// The vertex of each corner; `NONE` in the first corner of a removed triangle.
    corner_vertex: Vec<u32>,
    next_corner: Vec<u32>,
    first_corner: Vec<u32>,
    valence: Vec<u32>,
    /// The wedge of each corner; empty if the mesh has positions only.
    corner_wedge: Vec<u32>,
    pub wedges: Vec<Wedge>,
    pub face_count: usize,
    marks: Vec<u32>,
    stamp: u32,
    /// Wedges that the checked collapse would join: from, to.
    joins: Vec<(u32, u32)>,
    /// The triangles around both ends of the checked collapse, see [`Self::fan`].
    fans: [Vec<(u32, u32, u32)>; 2],
    scratch: Vec<u32>,
}

impl Surface {
    /// Creates a surface.
    ///
    /// - `triangles`: three different vertices each.
    /// - `corner_wedges`: empty, or one per corner, indices into `wedges`.
    pub fn new(
        triangles: &[[u32; 3]],
        positions: Vec<Vec3>,
        kinds: Vec<Kind>,
        corner_wedges: Vec<u32>,
        wedges: Vec<Wedge>,
    ) -> Self {
        let count = positions.len();
        let corner_vertex = triangles.as_flattened().to_vec();
        let mut first_corner = vec![NONE; count];
        let mut next_corner = vec![NONE; corner_vertex.len()];
        let mut valence = vec![0; count];
        for (corner, &vertex) in corner_vertex.iter().enumerate() {
            let first = &mut first_corner[vertex as usize];
            if *first == NONE {
                next_corner[corner] = corner as u32;
                *first = corner as u32;
            } else {
                next_corner[corner] = next_corner[*first as usize];
                next_corner[*first as usize] = corner as u32;
            }
            valence[vertex as usize] += 1;
        }
        Self {
            positions,
            kinds,
            corner_vertex,
            next_corner,
            first_corner,
            valence,
            corner_wedge: corner_wedges,
            wedges,
            face_count: triangles.len(),
            marks: vec![0; count],
            stamp: 0,
            joins: Vec::new(),
            fans: Default::default(),
            scratch: Vec::new(),
        }
    }

    /// Iterates over live triangles: index, vertices, and wedges if there are any.
    pub fn live_triangles(&self) -> impl Iterator<Item = (usize, [u32; 3], Option<[u32; 3]>)> {
        let wedges = self.corner_wedge.as_chunks::<3>().0;
        let live = self.corner_vertex.as_chunks::<3>().0.iter().enumerate().filter(|(_, t)| t[0] != NONE);
        live.map(|(t, &vertices)| (t, vertices, wedges.get(t).copied()))
    }

    /// Number of live triangles at a vertex.
    pub fn valence(&self, vertex: usize) -> u32 {
        self.valence[vertex]
    }

    /// Whether a vertex has too many triangles to collapse.
    pub fn is_hub(&self, vertex: u32) -> bool {
        self.valence[vertex as usize] > MAX_VALENCE
    }

    /// Number of live triangles with a vertex of this kind.
    pub fn faces_at(&self, kind: Kind) -> usize {
        self.live_triangles().filter(|(_, t, _)| t.iter().any(|&v| self.kinds[v as usize] == kind)).count()
    }

    /// Iterates over the live triangles around a vertex, as (vertex's corner, next vertex, the one after).
    #[inline]
    pub fn fan(&self, vertex: u32) -> Fan<'_> {
        let first = self.first_corner[vertex as usize];
        Fan { surface: self, first, corner: first, dead: 0 }
    }

    /// Collects [`Self::fan`] in a list. If most corners of the ring list are dead, they are removed: otherwise every
    /// walk around a former hub would visit all corners it ever had.
    #[inline]
    fn fill_fan(&mut self, vertex: u32, fan: &mut Vec<(u32, u32, u32)>) {
        fan.clear();
        let mut walk = self.fan(vertex);
        fan.extend(walk.by_ref());
        if walk.dead as usize > MANY_DEAD + fan.len() {
            for (i, &(corner, ..)) in fan.iter().enumerate() {
                self.next_corner[corner as usize] = fan[(i + 1) % fan.len()].0;
            }
            self.first_corner[vertex as usize] = fan.first().map_or(NONE, |first| first.0);
        }
    }

    /// Calls `f` once for each neighbour.
    pub fn for_each_neighbor(&mut self, vertex: u32, mut f: impl FnMut(u32)) {
        let stamp = self.new_stamps(1);
        let mut fan = std::mem::take(&mut self.fans[0]);
        self.fill_fan(vertex, &mut fan);
        let mut marks = std::mem::take(&mut self.marks);
        for &(_, b, c) in &fan {
            for other in [b, c] {
                if marks[other as usize] != stamp {
                    marks[other as usize] = stamp;
                    f(other);
                }
            }
        }
        self.marks = marks;
        self.fans[0] = fan;
    }

    /// Whether `from` may be merged into `to` at `position`; stores what [`Self::collapse`] needs.
    ///
    /// Rejected: collapses that change the topology (Dey et al. 1999, link condition), move a border or seam off its
    /// line, fold or flatten a triangle, or tear shading data apart.
    pub fn may_collapse(&mut self, from: u32, to: u32, position: Vec3) -> bool {
        let (kind, kept) = (self.kinds[from as usize], self.kinds[to as usize]);
        debug_assert!(kind <= kept && kept != Kind::Frozen && kind < Kind::Fixed);
        if self.valence[from as usize] + self.valence[to as usize] > MAX_VALENCE {
            return false;
        }
        // The rings are walked once; all checks use these lists.
        let mut fans = std::mem::take(&mut self.fans);
        for (fan, vertex) in fans.iter_mut().zip([from, to]) {
            self.fill_fan(vertex, fan);
        }
        let shared = self.shared_if_linked(from, to, &fans);
        let allowed = shared.is_some_and(|shared| {
            (kind == Kind::Free || self.is_constraint(from, to, shared))
                && (shared == 2 || kind == Kind::Curve)
                && self.keeps_orientation(&fans[0], from, to, position)
                && self.keeps_orientation(&fans[1], to, from, position)
        });
        self.fans = fans;
        allowed && self.plan_wedges(from, to)
    }

    /// Returns the number of triangles at the edge, if the link condition holds.
    fn shared_if_linked(&mut self, from: u32, to: u32, fans: &[Vec<(u32, u32, u32)>; 2]) -> Option<u32> {
        // Marks: `near` for neighbours of `from`, `common` for those of both.
        let near = self.new_stamps(2);
        let common = near + 1;
        let marks = &mut self.marks;
        let mut shared = 0;
        for &(_, b, c) in &fans[0] {
            marks[b as usize] = near;
            marks[c as usize] = near;
            shared += u32::from(b == to || c == to);
        }
        let mut both = 0;
        for &(_, b, c) in &fans[1] {
            for other in [b, c] {
                if marks[other as usize] == near && other != from {
                    marks[other as usize] = common;
                    both += 1;
                }
            }
        }
        // A triangle opposite the edge on both sides would become a duplicate.
        let opposite = |fan: &[(u32, u32, u32)], end: u32| {
            fan.iter()
                .any(|&(_, b, c)| marks[b as usize] == common && marks[c as usize] == common && b != end && c != end)
        };
        let linked = shared == both && (1..=2).contains(&shared);
        (linked && !(shared == 2 && opposite(&fans[0], to) && opposite(&fans[1], from))).then_some(shared)
    }

    /// Whether the edge itself is a border, seam or material edge; `shared` is the number of triangles at it.
    pub fn is_constraint(&self, from: u32, to: u32, shared: u32) -> bool {
        if shared == 1 {
            return true;
        }
        if self.corner_wedge.is_empty() {
            return false;
        }
        let mut sides = self.edge_wedges(from, to);
        let (Some(first), Some(second)) = (sides.next(), sides.next()) else { return false };
        first.0 != second.0 || first.1 != second.1
    }

    /// Iterates over the triangles at the edge: the wedges at its two ends.
    fn edge_wedges(&self, from: u32, to: u32) -> impl Iterator<Item = (u32, u32)> {
        self.fan(from).filter(move |&(_, b, c)| b == to || c == to).map(move |(corner, b, _)| {
            let other = if b == to { next_in_triangle(corner) } else { next_in_triangle(next_in_triangle(corner)) };
            (self.corner_wedge[corner as usize], self.corner_wedge[other as usize])
        })
    }

    /// Whether the triangles around `vertex` that are not at `other` keep an area and roughly their orientation.
    fn keeps_orientation(&self, fan: &[(u32, u32, u32)], vertex: u32, other: u32, position: Vec3) -> bool {
        let old = self.positions[vertex as usize].as_dvec3();
        let new = position.as_dvec3();
        fan.iter().filter(|&&(_, b, c)| b != other && c != other).all(|&(_, b, c)| {
            let b = self.positions[b as usize].as_dvec3();
            let c = self.positions[c as usize].as_dvec3();
            let side = c - b;
            let (before, after) = (side.cross(old - b), side.cross(new - b));
            let (length2, scale2) = (after.length_squared(), before.length_squared());
            let turn = before.dot(after);
            length2 > 0.0
                && (scale2 == 0.0 || (turn > 0.0 && turn * turn >= MIN_TURN_COS * MIN_TURN_COS * scale2 * length2))
        })
    }

    /// Pairs the wedges of the two ends over the triangles that vanish. Fails if a wedge at `from` has no partner or
    /// two.
    fn plan_wedges(&mut self, from: u32, to: u32) -> bool {
        if self.corner_wedge.is_empty() {
            return true;
        }
        let mut joins = std::mem::take(&mut self.joins);
        joins.clear();
        joins.extend(self.edge_wedges(from, to));
        joins.sort_unstable();
        joins.dedup();
        // Unique in both directions: a wedge of `to` that absorbed two would join them.
        let unique = joins.windows(2).all(|pair| pair[0].0 != pair[1].0)
            && joins.iter().enumerate().all(|(i, p)| joins[i + 1..].iter().all(|q| p.1 != q.1));
        let complete =
            self.fan(from).all(|(corner, ..)| joins.iter().any(|join| join.0 == self.corner_wedge[corner as usize]));
        self.joins = joins;
        unique && complete
    }

    /// Moves `to` to `position` and gives it all triangles of `from` except those at the edge, which are removed.
    ///
    /// - `t`: parameter of the position between `from` (0) and `to` (1), for shading data.
    ///
    /// Call it only directly after [`Self::may_collapse`] has allowed the same collapse.
    pub fn collapse(&mut self, from: u32, to: u32, position: Vec3, t: f32) {
        if !self.corner_wedge.is_empty() {
            for &(gone, kept) in &self.joins {
                self.wedges[kept as usize] = self.wedges[gone as usize].between(self.wedges[kept as usize], t);
            }
        }
        let mut corners = std::mem::take(&mut self.scratch);
        corners.clear();
        let mut died = 0;
        for &(corner, b, c) in &self.fans[0] {
            if b == to || c == to {
                self.corner_vertex[(corner - corner % 3) as usize] = NONE;
                self.valence[if b == to { c } else { b } as usize] -= 1;
                died += 1;
                continue;
            }
            self.corner_vertex[corner as usize] = to;
            corners.push(corner);
            if !self.corner_wedge.is_empty() {
                let wedge = &mut self.corner_wedge[corner as usize];
                *wedge = self.joins.iter().find(|join| join.0 == *wedge).map_or(*wedge, |join| join.1);
            }
        }
        corners.extend(self.fans[1].iter().filter(|&&(_, b, c)| b != from && c != from).map(|&(corner, ..)| corner));
        for (i, &corner) in corners.iter().enumerate() {
            self.next_corner[corner as usize] = corners[(i + 1) % corners.len()];
        }
        self.first_corner[to as usize] = corners.first().copied().unwrap_or(NONE);
        self.first_corner[from as usize] = NONE;
        self.valence[to as usize] = corners.len() as u32;
        self.valence[from as usize] = 0;
        self.positions[to as usize] = position;
        self.face_count -= died;
        self.scratch = corners;
    }

    fn new_stamps(&mut self, count: u32) -> u32 {
        if self.stamp > u32::MAX - 2 * count {
            self.marks.fill(0);
            self.stamp = 0;
        }
        let stamp = self.stamp + 1;
        self.stamp += count;
        stamp
    }
}

#[inline]
fn next_in_triangle(corner: u32) -> u32 {
    if corner % 3 == 2 { corner - 2 } else { corner + 1 }
}

/// Iterator of [`Surface::fan`].
pub(super) struct Fan<'a> {
    surface: &'a Surface,
    first: u32,
    corner: u32,
    /// Number of corners of removed triangles skipped so far.
    dead: u32,
}

impl Iterator for Fan<'_> {
    type Item = (u32, u32, u32);

    #[inline]
    fn next(&mut self) -> Option<Self::Item> {
        while self.corner != NONE {
            let corner = self.corner;
            let after = self.surface.next_corner[corner as usize];
            self.corner = if after == self.first { NONE } else { after };
            let k = corner % 3;
            let base = (corner - k) as usize;
            let vertices = &self.surface.corner_vertex[base..base + 3];
            if vertices[0] != NONE {
                let (b, c) = match k {
                    0 => (vertices[1], vertices[2]),
                    1 => (vertices[2], vertices[0]),
                    _ => (vertices[0], vertices[1]),
                };
                return Some((corner, b, c));
            }
            self.dead += 1;
        }
        None
    }
}
