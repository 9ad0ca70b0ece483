//! Text STL: `solid`, facets of one loop each, `endsolid`; case-insensitive, with any line breaks.

use crate::error::Place;
use crate::error::stl::StlProblem;
use crate::model::number::parse_number;
use crate::model::polygon::triangulate;
use crate::stl::soup::{Located, Soup};
use firstlight_files::printable;
use glam::DVec3;

/// The words with their line numbers.
struct StlWords<'a> {
    left: &'a [u8],
    line: usize,
}

impl<'a> StlWords<'a> {
    /// The next word; empty at the end of the file.
    fn next(&mut self) -> &'a [u8] {
        let start = self.left.iter().position(|byte| !byte.is_ascii_whitespace()).unwrap_or(self.left.len());
        let (space, rest) = self.left.split_at(start);
        // A `\r` without `\n` also ends a line.
        let ends = |at: usize| space[at] == b'\n' || space[at] == b'\r' && space.get(at + 1) != Some(&b'\n');
        self.line += (0..space.len()).filter(|&at| ends(at)).count();
        let end = rest.iter().position(u8::is_ascii_whitespace).unwrap_or(rest.len());
        let (word, rest) = rest.split_at(end);
        self.left = rest;
        word
    }

    /// Names may contain any words.
    fn skip_line(&mut self) {
        let end = self.left.iter().position(|&byte| byte == b'\n' || byte == b'\r').unwrap_or(self.left.len());
        self.left = &self.left[end..];
    }

    fn wrong(&self, found: &[u8], expected: &'static str) -> Located {
        let problem = if found.is_empty() {
            StlProblem::End { expected }
        } else {
            StlProblem::Word { text: printable::name(&String::from_utf8_lossy(found)).to_string(), expected }
        };
        (Place::Line(self.line), problem)
    }

    fn expect(&mut self, word: &[u8], expected: &'static str) -> Result<(), Located> {
        let found = self.next();
        if found.eq_ignore_ascii_case(word) { Ok(()) } else { Err(self.wrong(found, expected)) }
    }

    fn position(&mut self) -> Result<DVec3, Located> {
        let mut position = [0.0; 3];
        for coordinate in &mut position {
            let word = self.next();
            *coordinate = parse_number(word).ok_or_else(|| self.wrong(word, "a coordinate of a vertex"))?;
        }
        Ok(DVec3::from_array(position))
    }
}

/// Reads all solids of the text.
pub(super) fn parse(bytes: &[u8]) -> Result<Soup, Located> {
    let mut words = StlWords { left: bytes.strip_prefix(b"\xef\xbb\xbf").unwrap_or(bytes), line: 1 };
    let mut soup = Soup::default();
    let (mut corners, mut cut) = (Vec::new(), Vec::new());
    let mut is_open = false;
    loop {
        let word = words.next();
        if word.eq_ignore_ascii_case(b"solid") {
            is_open = true;
            words.skip_line();
        } else if word.eq_ignore_ascii_case(b"endsolid") {
            is_open = false;
            words.skip_line();
        } else if word.eq_ignore_ascii_case(b"facet") {
            facet(&mut words, &mut corners)?;
            if corners.len() < 3 || !corners.iter().all(|corner| corner.is_finite()) {
                soup.left_out += 1;
                continue;
            }
            cut.clear();
            triangulate(&corners, &mut cut);
            soup.corners.extend(cut.iter().flatten().map(|&corner| corners[corner]));
            soup.polygons += usize::from(corners.len() > 3);
        } else if word.starts_with(b"#") {
            words.skip_line();
        } else if word.is_empty() {
            break;
        } else {
            return Err(words.wrong(word, "`facet`, `endsolid` or `solid`"));
        }
    }
    if is_open {
        soup.notes.push("has no `endsolid` at its end: it may be incomplete".into());
    }
    Ok(soup)
}

/// Parses a facet after the word `facet`, up to `endfacet`.
fn facet(words: &mut StlWords, corners: &mut Vec<DVec3>) -> Result<(), Located> {
    let is_outer = |word: &[u8]| word.eq_ignore_ascii_case(b"outer");
    let mut word = words.next();
    if word.eq_ignore_ascii_case(b"normal") {
        word = words.next();
    } else if !is_outer(word) {
        return Err(words.wrong(word, "`normal`"));
    }
    // The normal is not used; some programs write none.
    for _ in 0..3 {
        word = if is_outer(word) { word } else { words.next() };
    }
    if !is_outer(word) {
        return Err(words.wrong(word, "`outer loop`"));
    }
    words.expect(b"loop", "`outer loop`")?;
    corners.clear();
    loop {
        let word = words.next();
        if word.eq_ignore_ascii_case(b"vertex") {
            corners.push(words.position()?);
        } else if word.eq_ignore_ascii_case(b"endloop") {
            break;
        } else {
            return Err(words.wrong(word, "`vertex` or `endloop`"));
        }
    }
    words.expect(b"endfacet", "`endfacet`")
}
