//! Faults of an OBJ file that cost only what is faulty: what is left out or computed, counted for one warning per kind.

/// A kind of fault, and what is done.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Repair {
    /// A face of fewer than three corners is removed.
    FewCorners,
    /// A face with a corner that is no vertex of the file is removed.
    Corner,
    /// A texture coordinate that the file does not have is (0, 0).
    UvIndex,
    /// A normal that the file does not have is computed.
    NormalIndex,
    /// A texture coordinate that is not two finite numbers is (0, 0).
    Uv,
    /// A normal that is not three finite numbers is computed.
    Normal,
    /// A position is not three finite numbers, which matters only where a face uses it.
    Position,
    /// A face that uses such a position is removed.
    FaceWithoutPosition,
}

const N_REPAIRS: usize = 8;

/// How often each repair was made, and a line that needed it, from 1.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Repairs([(usize, usize); N_REPAIRS]);

impl Repairs {
    pub fn note(&mut self, repair: Repair, line: usize) {
        let (count, first) = &mut self.0[repair as usize];
        if *count == 0 {
            *first = line;
        }
        *count += 1;
    }

    /// Adds those of later lines.
    pub fn add(&mut self, later: Self) {
        for (own, (count, first)) in self.0.iter_mut().zip(later.0) {
            if own.0 == 0 {
                own.1 = first;
            }
            own.0 += count;
        }
    }

    pub fn count(&self, repair: Repair) -> usize {
        self.0[repair as usize].0
    }

    pub fn first_line(&self, repair: Repair) -> Option<usize> {
        let (count, line) = self.0[repair as usize];
        (count > 0).then_some(line)
    }

    /// One sentence per kind, without the path.
    pub fn sentences(&self) -> impl Iterator<Item = String> {
        let all = [
            (Repair::FewCorners, "faces have fewer than three corners and were removed"),
            (Repair::Corner, "faces have a corner that is no vertex of the file and were removed"),
            (Repair::FaceWithoutPosition, "faces use a position that is not three finite numbers and were removed"),
            (Repair::UvIndex, "corners use a texture coordinate that the file does not have; it is (0, 0)"),
            (Repair::Uv, "texture coordinates are not finite numbers and are (0, 0)"),
            (Repair::NormalIndex, "corners use a normal that the file does not have; it was computed"),
            (Repair::Normal, "normals are not three finite numbers and were computed"),
        ];
        all.into_iter().filter_map(|(repair, text)| {
            self.first_line(repair).map(|line| format!("{} {text} (line {line})", self.count(repair)))
        })
    }
}
