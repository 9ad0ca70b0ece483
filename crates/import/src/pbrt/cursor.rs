//! Reads the arguments of directives from the text of one file; every error has file, line and column.

use crate::pbrt::params::{Param, Params, Values};
use crate::pbrt::tokens::{Token, TokenKind, Tokens, Unterminated, unescaped};
use firstlight_files::printable;
use firstlight_format::error::SceneError;
use firstlight_format::locate::line_and_column;
use glam::{DAffine3, DMat4, DVec3};
use std::cell::Cell;
use std::path::PathBuf;

/// Parameters that a directive may have.
const MAX_PARAMS: usize = 1024;

/// A file with its text.
#[derive(Debug)]
pub(crate) struct SourceText {
    pub path: PathBuf,
    pub text: String,
}

/// A position in a file.
pub(crate) struct Cursor<'a> {
    source: &'a SourceText,
    tokens: Tokens<'a>,
    /// A position in bytes and the number of line ends before it: places are asked for in the order of the text.
    counted: Cell<(usize, usize)>,
}

impl<'a> Cursor<'a> {
    pub(crate) fn new(source: &'a SourceText) -> Self {
        Self { source, tokens: Tokens::new(&source.text), counted: Cell::default() }
    }

    /// An error at a position in bytes.
    pub(crate) fn wrong(&self, at: usize, message: impl Into<String>) -> SceneError {
        SceneError::at(&self.source.path, line_and_column(&self.source.text, at), message)
    }

    /// `file:line`, for remarks.
    pub(crate) fn place(&self, at: usize) -> String {
        let text = self.source.text.as_bytes();
        let at = at.min(text.len());
        let (from, before) = if self.counted.get().0 <= at { self.counted.get() } else { (0, 0) };
        let lines = before + text[from..at].iter().filter(|byte| **byte == b'\n').count();
        self.counted.set((at, lines));
        format!("{}:{}", self.source.path.display(), lines + 1)
    }

    fn unterminated(&self, Unterminated { at }: Unterminated) -> SceneError {
        self.wrong(at, "the string does not end on its line: add a `\"`")
    }

    fn peek(&mut self) -> Result<Option<Token<'a>>, SceneError> {
        self.tokens.peek().map_err(|error| self.unterminated(error))
    }

    fn token(&mut self) -> Result<Option<Token<'a>>, SceneError> {
        self.tokens.next().map_err(|error| self.unterminated(error))
    }

    /// The next directive and its position; `None` at the end of the file.
    pub(crate) fn directive(&mut self) -> Result<Option<(&'a str, usize)>, SceneError> {
        match self.token()? {
            None => Ok(None),
            Some(Token { kind: TokenKind::Word(word), at }) => Ok(Some((word, at))),
            Some(token) => Err(self.unexpected(Some(token), "a directive, such as Shape")),
        }
    }

    fn unexpected(&self, token: Option<Token>, expected: &str) -> SceneError {
        let (at, found) = match token {
            None => (self.source.text.len(), "the end of the file".to_owned()),
            Some(Token { kind, at }) => {
                let found = match kind {
                    TokenKind::Quoted(text) => format!("the string `{}`", printable::name(text)),
                    TokenKind::Open => "`[`".to_owned(),
                    TokenKind::Close => "`]`".to_owned(),
                    TokenKind::Word(word) => format!("`{}`", printable::name(word)),
                };
                (at, found)
            }
        };
        self.wrong(at, format!("expected {expected}, found {found}"))
    }

    /// A string in quotes.
    pub(crate) fn string(&mut self) -> Result<String, SceneError> {
        match self.token()? {
            Some(Token { kind: TokenKind::Quoted(text), .. }) => Ok(unescaped(text)),
            token => Err(self.unexpected(token, "a string in quotes")),
        }
    }

    /// A word without quotes.
    pub(crate) fn word(&mut self) -> Result<&'a str, SceneError> {
        match self.token()? {
            Some(Token { kind: TokenKind::Word(word), .. }) => Ok(word),
            token => Err(self.unexpected(token, "a word")),
        }
    }

    /// Finite numbers, with or without brackets around them.
    fn numbers<const N: usize>(&mut self) -> Result<[f64; N], SceneError> {
        let is_open = matches!(self.peek()?, Some(Token { kind: TokenKind::Open, .. }));
        if is_open {
            self.token()?;
        }
        let mut numbers = [0.0; N];
        for number in &mut numbers {
            let token = self.token()?;
            let word = match token {
                Some(Token { kind: TokenKind::Word(word), .. }) => word,
                _ => return Err(self.unexpected(token, &format!("{N} numbers"))),
            };
            *number = self::number(word)
                .filter(|number| number.is_finite())
                .ok_or_else(|| self.unexpected(token, &format!("{N} finite numbers")))?;
        }
        if is_open {
            match self.token()? {
                Some(Token { kind: TokenKind::Close, .. }) => {}
                token => return Err(self.unexpected(token, &format!("`]` after {N} numbers"))),
            }
        }
        Ok(numbers)
    }

    pub(crate) fn vector(&mut self) -> Result<DVec3, SceneError> {
        self.numbers::<3>().map(DVec3::from_array)
    }

    pub(crate) fn pair(&mut self) -> Result<[f64; 2], SceneError> {
        self.numbers()
    }

    /// A string in quotes, if one follows.
    pub(crate) fn optional_string(&mut self) -> Result<Option<String>, SceneError> {
        match self.peek()? {
            Some(Token { kind: TokenKind::Quoted(_), .. }) => self.string().map(Some),
            _ => Ok(None),
        }
    }

    /// An angle in degrees and an axis.
    pub(crate) fn rotation(&mut self) -> Result<(f64, DVec3), SceneError> {
        let [angle, x, y, z] = self.numbers()?;
        Ok((angle, DVec3::new(x, y, z)))
    }

    /// Position of a camera, its target, and up.
    pub(crate) fn look_at(&mut self) -> Result<[DVec3; 3], SceneError> {
        let numbers = self.numbers::<9>()?;
        Ok([0, 3, 6].map(|i| DVec3::from_slice(&numbers[i..])))
    }

    /// A matrix of four columns, and whether it is an affine one: the last row of others is ignored.
    pub(crate) fn matrix(&mut self) -> Result<(DAffine3, bool), SceneError> {
        let matrix = DMat4::from_cols_array(&self.numbers()?);
        let affine = DAffine3::from_cols(
            matrix.x_axis.truncate(),
            matrix.y_axis.truncate(),
            matrix.z_axis.truncate(),
            matrix.w_axis.truncate(),
        );
        Ok((affine, matrix.row(3).to_array() == [0.0, 0.0, 0.0, 1.0]))
    }

    /// A name and its value, without a type.
    pub(crate) fn option(&mut self) -> Result<(), SceneError> {
        self.string()?;
        self.values().map(drop)
    }

    /// The parameters of a directive.
    pub(crate) fn params(&mut self) -> Result<Params, SceneError> {
        let mut list = Vec::new();
        while let Some(Token { kind: TokenKind::Quoted(declaration), at }) = self.peek()? {
            self.token()?;
            let mut words = declaration.split_ascii_whitespace();
            let (Some(kind), Some(name), None) = (words.next(), words.next(), words.next()) else {
                let declaration = printable::name(declaration);
                let message = format!("expected a type and a name, such as \"float radius\", found `{declaration}`");
                return Err(self.wrong(at, message));
            };
            if list.len() == MAX_PARAMS {
                return Err(self.wrong(at, format!("a directive has more than {MAX_PARAMS} parameters")));
            }
            let values = self.values()?;
            list.push(Param { kind: kind.to_owned(), name: name.to_owned(), values });
        }
        Ok(Params::new(list))
    }

    /// One value, or several in brackets.
    fn values(&mut self) -> Result<Values, SceneError> {
        const EXPECTED: &str = "a value: a number, a string in quotes, `true` or `false`, or several in brackets";
        let first = self.token()?;
        let mut values = Values::Numbers(Vec::new());
        if !matches!(first, Some(Token { kind: TokenKind::Open, .. })) {
            self.add_value(&mut values, first, EXPECTED)?;
            return Ok(values);
        }
        loop {
            match self.token()? {
                Some(Token { kind: TokenKind::Close, .. }) => return Ok(values),
                token => self.add_value(&mut values, token, "a value of the same kind, or `]`")?,
            }
        }
    }

    fn add_value(&self, values: &mut Values, token: Option<Token>, expected: &str) -> Result<(), SceneError> {
        let wrong = || self.unexpected(token, expected);
        let kind = token.ok_or_else(wrong)?.kind;
        if matches!(values, Values::Numbers(numbers) if numbers.is_empty()) {
            match kind {
                TokenKind::Quoted(_) => *values = Values::Strings(Vec::new()),
                TokenKind::Word("true" | "false") => *values = Values::Bools(Vec::new()),
                _ => {}
            }
        }
        match (values, kind) {
            (Values::Strings(strings), TokenKind::Quoted(text)) => strings.push(unescaped(text)),
            (Values::Bools(flags), TokenKind::Word(word @ ("true" | "false"))) => flags.push(word == "true"),
            (Values::Numbers(numbers), TokenKind::Word(word)) => numbers.push(number(word).ok_or_else(wrong)?),
            _ => return Err(wrong()),
        }
        Ok(())
    }
}

/// A number. Version 3 ignores what follows it: there are files with commas.
fn number(word: &str) -> Option<f64> {
    word.trim_end_matches(',').parse().ok()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn places_are_those_of_the_text_in_any_order() {
        let source = SourceText { path: "a.pbrt".into(), text: "a\n\nbc\nd".to_owned() };
        let cursor = Cursor::new(&source);
        for at in [0, 3, 4, 6, 6, 2, 100, 1] {
            let line = line_and_column(&source.text, at).0;
            assert_eq!(cursor.place(at), format!("a.pbrt:{line}"));
        }
    }
}
