//! Names of materials, textures and groups in the text of another program: each is one of its own, as it is written.

use firstlight_format::names::Names;

/// Characters of a name that are written. Readers cut long names, ours after 256 characters.
const MOST_OF_A_NAME: usize = 200;

/// Names that are written.
pub(crate) struct Identifiers {
    names: Names,
    /// Marks that mean something in a name.
    marks: &'static [char],
}

impl Identifiers {
    /// - `marks`: what no name may have, besides control characters and what is none of Unicode.
    pub(crate) fn without(marks: &'static [char]) -> Self {
        Self { names: Names::default(), marks }
    }

    /// A name like this one, as it is written, that no other has.
    pub(crate) fn free(&mut self, wanted: &str) -> String {
        let is_plain = |c: char| !c.is_control() && !matches!(c, '\u{fffe}' | '\u{ffff}') && !self.marks.contains(&c);
        let letters = wanted.chars().map(|c| if is_plain(c) { c } else { '_' });
        let name: String = letters.take(MOST_OF_A_NAME).collect();
        // None at all means that there is no such thing.
        self.names.free(if name.is_empty() { "_" } else { &name })
    }
}
