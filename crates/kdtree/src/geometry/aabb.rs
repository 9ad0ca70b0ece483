use glam::Vec3;

/// An axis-aligned box, closed on all sides. Empty when any `min` exceeds its `max`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Aabb {
    /// Smallest coordinate along each axis.
    pub min: Vec3,
    /// Largest coordinate along each axis.
    pub max: Vec3,
}

/// The empty box.
impl Default for Aabb {
    fn default() -> Self {
        Self::EMPTY
    }
}

impl Aabb {
    /// The box that contains no point.
    pub const EMPTY: Self = Self { min: Vec3::INFINITY, max: Vec3::NEG_INFINITY };

    /// The smallest box around the points; empty if there are none.
    pub fn from_points(points: impl IntoIterator<Item = Vec3>) -> Self {
        points.into_iter().fold(Self::EMPTY, Self::grown_by)
    }

    /// The smallest box around this one and the point.
    pub fn grown_by(self, point: Vec3) -> Self {
        Self { min: self.min.min(point), max: self.max.max(point) }
    }

    /// The smallest box around both boxes.
    pub fn union(self, other: Self) -> Self {
        Self { min: self.min.min(other.min), max: self.max.max(other.max) }
    }

    /// The box of the points that lie in both boxes; empty if there are none.
    pub fn intersection(self, other: Self) -> Self {
        Self { min: self.min.max(other.min), max: self.max.min(other.max) }
    }

    /// Whether the box contains no point.
    pub fn is_empty(&self) -> bool {
        !self.min.cmple(self.max).all()
    }

    /// Side lengths along the axes; negative along an axis where the box is empty.
    pub fn size(&self) -> Vec3 {
        self.max - self.min
    }

    /// The point halfway between `min` and `max`.
    pub fn center(&self) -> Vec3 {
        0.5 * self.min + 0.5 * self.max
    }

    /// Surface area in square metres; 0 for an empty box.
    pub fn area(&self) -> f32 {
        if self.is_empty() {
            return 0.0;
        }
        let size = self.size();
        2.0 * (size.x * size.y + size.y * size.z + size.z * size.x)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::vec3;
    use proptest::prelude::*;

    fn point() -> impl Strategy<Value = Vec3> {
        // Integer coordinates make boxes share faces; the others do not.
        let whole = (-3i8..=3, -3i8..=3, -3i8..=3).prop_map(|(x, y, z)| vec3(x.into(), y.into(), z.into()));
        let any = (-1e3f32..1e3, -1e-3f32..1e-3, -1e6f32..1e6).prop_map(|(x, y, z)| vec3(x, y, z));
        prop_oneof![whole, any]
    }

    fn contains(bounds: &Aabb, p: Vec3) -> bool {
        bounds.min.cmple(p).all() && p.cmple(bounds.max).all()
    }

    proptest! {
        #![proptest_config(crate::geometry::robust::fixed_cases(5_000))]

        #[test]
        fn sets_of_points_behave_like_sets(a in point(), b in point(), c in point(), d in point(), p in point()) {
            let (left, right) = (Aabb::from_points([a, b]), Aabb::from_points([c, d]));
            let (union, common) = (left.union(right), left.intersection(right));
            for corner in [a, b, c, d] {
                prop_assert!(contains(&union, corner));
            }
            prop_assert_eq!(contains(&common, p), contains(&left, p) && contains(&right, p));
            prop_assert!(!contains(&left, p) || contains(&union, p));
            prop_assert_eq!(common.is_empty(), !common.min.cmple(common.max).all());
            prop_assert!(!contains(&common, p) || !common.is_empty());
            prop_assert_eq!(left.grown_by(p), left.union(Aabb::from_points([p])));
            prop_assert!(contains(&left, left.center()), "{left:?} {}", left.center());
        }

        #[test]
        fn a_part_has_no_more_area_than_the_whole(a in point(), b in point(), c in point()) {
            let part = Aabb::from_points([a, b]);
            prop_assert!(part.area() >= 0.0 && part.area() <= part.grown_by(c).area());
            prop_assert_eq!(Aabb::EMPTY.area(), 0.0);
            prop_assert!(Aabb::EMPTY.is_empty() && Aabb::EMPTY.union(part) == part);
        }
    }
}
