//! Welding: vertices at exactly equal positions get one index.

use glam::{DVec3, Vec3};

/// The welding of a mesh's vertices: texture seams and duplicated vertices vanish in it.
///
/// Positions are equal if all coordinates compare equal (so −0 is 0); nothing is ever moved.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Welding {
    /// Welded position of each vertex, numbered in the order of first appearance.
    pub place: Vec<u32>,
    /// The first vertex at each position.
    pub first: Vec<u32>,
}

impl Welding {
    /// Welds positions in linear time on average. `positions` must hold no NaN and at most `u32::MAX` entries.
    pub fn of(positions: &[Vec3]) -> Self {
        // Adding zero turns −0 into 0 and changes nothing else.
        let words = |p: Vec3| (p + Vec3::ZERO).to_array().map(|v| u64::from(v.to_bits()));
        Self::by(positions, |p| {
            let [x, y, z] = words(p);
            mix(mix(x | y << 32).wrapping_add(z.wrapping_mul(GOLDEN)))
        })
    }

    /// Like [`of`](Self::of), for positions in double precision.
    pub fn of_f64(positions: &[DVec3]) -> Self {
        Self::by(positions, |p| {
            let [x, y, z] = (p + DVec3::ZERO).to_array().map(f64::to_bits);
            mix(mix(mix(x).wrapping_add(y.wrapping_mul(GOLDEN))).wrapping_add(z.wrapping_mul(GOLDEN)))
        })
    }

    /// Welds with a hash function.
    ///
    /// - `hash`: equal for positions that compare equal.
    fn by<P: Copy + PartialEq>(positions: &[P], hash: impl Fn(P) -> u64) -> Self {
        // Open addressing at half load: the standard map spends most of its time on a hash that resists attacks; here a
        // hostile input can only cost time, and the finaliser below leaves no cheap way to collide.
        const FREE: u32 = u32::MAX;
        let mask = (positions.len() * 2).next_power_of_two().max(2) - 1;
        let mut table = vec![FREE; mask + 1];
        let mut place = Vec::with_capacity(positions.len());
        let mut first: Vec<u32> = Vec::with_capacity(positions.len());
        for (vertex, &position) in positions.iter().enumerate() {
            let mut cell = hash(position) as usize & mask;
            let found = loop {
                match table[cell] {
                    FREE => {
                        table[cell] = first.len() as u32;
                        first.push(vertex as u32);
                        break table[cell];
                    }
                    other if positions[first[other as usize] as usize] == position => break other,
                    _ => cell = (cell + 1) & mask,
                }
            };
            place.push(found);
        }
        Self { place, first }
    }

    /// Number of distinct positions.
    pub fn len(&self) -> usize {
        self.first.len()
    }

    /// Whether there are no positions.
    pub fn is_empty(&self) -> bool {
        self.first.is_empty()
    }

    /// Returns the welded positions of a triangle's corners.
    #[inline]
    pub fn places(&self, triangle: [u32; 3]) -> [u32; 3] {
        triangle.map(|vertex| self.place[vertex as usize])
    }
}

/// 2⁶⁴ over the golden ratio.
const GOLDEN: u64 = 0x9e37_79b9_7f4a_7c15;

/// The finaliser of SplitMix64 (Steele, Lea, Flood 2014).
fn mix(mut h: u64) -> u64 {
    h = (h ^ (h >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    h = (h ^ (h >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    h ^ (h >> 31)
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::vec3;

    #[test]
    fn equal_places_share_a_number_and_signs_of_zero_do_not_matter() {
        let points = [vec3(0.0, 1.0, 2.0), vec3(1.0, 0.0, 0.0), vec3(-0.0, 1.0, 2.0), vec3(1.0, -0.0, 0.0)];
        assert_eq!(Welding::of(&points), Welding { place: vec![0, 1, 0, 1], first: vec![0, 1] });
        assert_eq!(Welding::of_f64(&points.map(Vec3::as_dvec3)), Welding::of(&points));
        assert_eq!(Welding::of_f64(&[DVec3::ONE, DVec3::ONE * (1.0 + 1e-15)]).len(), 2);
    }

    #[test]
    fn agrees_with_comparing_all_pairs() {
        let points: Vec<Vec3> =
            (0..600_u32).map(|i| vec3((i * 7 % 5) as f32, (i * 11 % 6) as f32, (i * 13 % 4) as f32)).collect();
        let welding = Welding::of(&points);
        for (i, p) in points.iter().enumerate() {
            let simplest = points.iter().position(|q| q == p).unwrap();
            assert_eq!(welding.first[welding.place[i] as usize] as usize, simplest);
        }
    }
}
