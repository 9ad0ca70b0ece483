//! Finds the position of a value in the text of a scene file that has already been parsed.
//!
//! The parser returns values without positions. Semantic errors (a radius of zero, an unknown material) need a line, so
//! the text is scanned again, only if there is an error.

/// Returns line and column, from 1, of the value at `path`, or of the innermost value around it that the text has.
///
/// `path` consists of fields, list indices and map keys, separated by `/`: `objects/3/radius`, `materials/red/albedo`.
/// Names of enum variants are not part of it.
pub fn locate(text: &str, path: &str) -> (usize, usize) {
    let target: Vec<&str> = path.split('/').filter(|part| !part.is_empty()).collect();
    let mut walk = TextWalk { text: text.as_bytes(), at: 0, path: Vec::new(), target, best: 0, best_depth: None };
    walk.skip_header();
    walk.value(0);
    line_and_column(text, walk.best)
}

/// Returns line and column, from 1, of a byte offset; columns count characters.
pub fn line_and_column(text: &str, offset: usize) -> (usize, usize) {
    let before = &text.as_bytes()[..offset.min(text.len())];
    let line_start = before.iter().rposition(|&b| b == b'\n').map_or(0, |i| i + 1);
    let line = 1 + before.iter().filter(|&&b| b == b'\n').count();
    let column = 1 + String::from_utf8_lossy(&before[line_start..]).chars().count();
    (line, column)
}

struct TextWalk<'a> {
    text: &'a [u8],
    at: usize,
    path: Vec<String>,
    target: Vec<&'a str>,
    best: usize,
    best_depth: Option<usize>,
}

impl TextWalk<'_> {
    /// Deeper than any file that the parser accepts.
    const MAX_DEPTH: usize = 256;

    fn peek(&self) -> u8 {
        self.text.get(self.at).copied().unwrap_or(0)
    }

    fn done(&self) -> bool {
        self.at >= self.text.len()
    }

    /// Records the position if the current path matches more of the target than any before.
    fn visit(&mut self, offset: usize) {
        let depth = self.path.len();
        let towards = depth <= self.target.len() && self.path.iter().zip(&self.target).all(|(a, b)| a == b);
        if towards && self.best_depth.is_none_or(|best| depth > best) {
            (self.best, self.best_depth) = (offset, Some(depth));
        }
    }

    fn value(&mut self, nesting: usize) {
        self.skip_blank();
        self.visit(self.at);
        if nesting > Self::MAX_DEPTH {
            self.at = self.text.len();
            return;
        }
        let named = self.word();
        self.skip_blank();
        match self.peek() {
            b'(' => self.parenthesis(named, nesting),
            b'[' => self.list(b']', nesting),
            b'{' => self.map(nesting),
            b'"' => {
                self.string();
            }
            _ if named => {}
            // Not a value: advances, so that the scan terminates.
            _ => self.at += 1,
        }
    }

    /// Scans a struct `(a: 1)`, a tuple `(1, 2)`, or the contents of a variant.
    fn parenthesis(&mut self, variant: bool, nesting: usize) {
        let start = self.at;
        self.at += 1;
        self.skip_blank();
        let field_start = self.at;
        let is_struct = self.word() && {
            self.skip_blank();
            self.peek() == b':'
        };
        if !is_struct && !variant {
            self.at = start;
            return self.list(b')', nesting);
        }
        self.at = field_start;
        while !self.done() {
            self.skip_blank();
            if self.peek() == b')' {
                self.at += 1;
                return;
            }
            if is_struct {
                let name_start = self.at;
                self.word();
                let name = String::from_utf8_lossy(&self.text[name_start..self.at]).into_owned();
                self.path.push(name);
                self.visit(name_start);
                self.skip_blank();
                if self.peek() == b':' {
                    self.at += 1;
                }
                self.value(nesting + 1);
                self.path.pop();
            } else {
                self.value(nesting + 1);
            }
            self.skip_comma();
        }
    }

    fn list(&mut self, end: u8, nesting: usize) {
        self.at += 1;
        for i in 0.. {
            self.skip_blank();
            if self.done() {
                return;
            }
            if self.peek() == end {
                self.at += 1;
                return;
            }
            self.path.push(i.to_string());
            self.value(nesting + 1);
            self.path.pop();
            self.skip_comma();
        }
    }

    fn map(&mut self, nesting: usize) {
        self.at += 1;
        while !self.done() {
            self.skip_blank();
            if self.peek() == b'}' {
                self.at += 1;
                return;
            }
            let key_start = self.at;
            let key = self.string().unwrap_or_default();
            self.path.push(key);
            self.visit(key_start);
            self.skip_blank();
            if self.peek() == b':' {
                self.at += 1;
            }
            self.value(nesting + 1);
            self.path.pop();
            self.skip_comma();
        }
    }

    /// Scans a name or a number; true if there was one.
    fn word(&mut self) -> bool {
        let start = self.at;
        while self.peek().is_ascii_alphanumeric() || matches!(self.peek(), b'_' | b'+' | b'-' | b'.' | b'#') {
            self.at += 1;
        }
        self.at > start
    }

    /// Scans a quoted string and returns it without its quotes; escapes are unchanged.
    fn string(&mut self) -> Option<String> {
        if self.peek() != b'"' {
            self.at += 1;
            return None;
        }
        self.at += 1;
        let start = self.at;
        while !self.done() && self.peek() != b'"' {
            self.at += if self.peek() == b'\\' { 2 } else { 1 };
        }
        let end = self.at.min(self.text.len());
        self.at += 1;
        Some(String::from_utf8_lossy(&self.text[start..end]).into_owned())
    }

    fn skip_comma(&mut self) {
        self.skip_blank();
        if self.peek() == b',' {
            self.at += 1;
        }
    }

    /// Skips white space and comments; block comments nest.
    fn skip_blank(&mut self) {
        while !self.done() {
            if self.peek().is_ascii_whitespace() {
                self.at += 1;
            } else if self.text[self.at..].starts_with(b"//") {
                while !self.done() && self.peek() != b'\n' {
                    self.at += 1;
                }
            } else if self.text[self.at..].starts_with(b"/*") {
                let mut open = 0;
                while !self.done() {
                    if self.text[self.at..].starts_with(b"/*") {
                        (open, self.at) = (open + 1, self.at + 2);
                    } else if self.text[self.at..].starts_with(b"*/") {
                        (open, self.at) = (open - 1, self.at + 2);
                        if open == 0 {
                            break;
                        }
                    } else {
                        self.at += 1;
                    }
                }
            } else {
                return;
            }
        }
    }

    /// Skips `#![enable(…)]` lines before the value.
    fn skip_header(&mut self) {
        loop {
            self.skip_blank();
            if !self.text[self.at.min(self.text.len())..].starts_with(b"#!") {
                return;
            }
            while !self.done() && self.peek() != b']' {
                self.at += 1;
            }
            self.at += 1;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::locate;

    const TEXT: &str = r#"// a comment with (brackets
(
    film: (width: 3, height: 4),
    materials: {
        "red \" ]": diffuse(albedo: (1, 0, 0)),
        "b": diffuse(albedo: "check"), /* ( /* nested */ */
    },
    objects: [
        sphere(center: (0, 1, 2), radius: 1),
        sphere((center: (0, 1, 2),
            radius: -1)),
        mesh(file: "a(b.obj"),
        plane(point: (0, 0, 0)),
    ],
)"#;

    #[test]
    fn values_are_found_at_their_line() {
        assert_eq!(locate(TEXT, ""), (2, 1));
        // The position of a field is that of its name.
        assert_eq!(locate(TEXT, "film/height"), (3, 22));
        assert_eq!(locate(TEXT, "materials/b/albedo"), (6, 22));
        assert_eq!(locate(TEXT, "objects/0/center/2"), (9, 31));
        assert_eq!(locate(TEXT, "objects/1/radius"), (11, 13));
        assert_eq!(locate(TEXT, "objects/3"), (13, 9));
    }

    #[test]
    fn what_is_missing_is_placed_at_what_should_hold_it() {
        assert_eq!(locate(TEXT, "objects/0/material"), (9, 9));
        assert_eq!(locate(TEXT, "nothing/at/all"), (2, 1));
    }

    #[test]
    fn any_text_ends() {
        for end in 0..TEXT.len() {
            locate(&TEXT[..end], "objects/1/radius");
        }
        locate(&"(".repeat(100_000), "a");
        locate("\u{e9}\u{e9}: ] } )", "a");
    }
}
