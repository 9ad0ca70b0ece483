//! The words of a pbrt file: quoted strings, brackets, and words of any other characters; `#` begins a comment.

/// A word with its position in bytes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Token<'a> {
    pub kind: TokenKind<'a>,
    pub at: usize,
}

#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum TokenKind<'a> {
    /// The text between the quotes, with its escapes.
    Quoted(&'a str),
    /// `[`
    Open,
    /// `]`
    Close,
    /// A directive, a number, `true` or `false`.
    Word(&'a str),
}

/// Reads tokens one after the other.
#[derive(Clone, Debug)]
pub(crate) struct Tokens<'a> {
    text: &'a str,
    position: usize,
    peeked: Option<Token<'a>>,
}

/// A string that does not end.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Unterminated {
    pub at: usize,
}

impl<'a> Tokens<'a> {
    pub(crate) fn new(text: &'a str) -> Self {
        Self { text, position: 0, peeked: None }
    }

    /// The next token without consuming it; `None` at the end.
    pub(crate) fn peek(&mut self) -> Result<Option<Token<'a>>, Unterminated> {
        if self.peeked.is_none() {
            self.peeked = self.read()?;
        }
        Ok(self.peeked)
    }

    /// The next token; `None` at the end.
    pub(crate) fn next(&mut self) -> Result<Option<Token<'a>>, Unterminated> {
        match self.peeked.take() {
            Some(token) => Ok(Some(token)),
            None => self.read(),
        }
    }

    fn read(&mut self) -> Result<Option<Token<'a>>, Unterminated> {
        let bytes = self.text.as_bytes();
        loop {
            match bytes.get(self.position) {
                None => return Ok(None),
                Some(b'#') => {
                    let rest = &bytes[self.position..];
                    self.position += rest.iter().position(|byte| *byte == b'\n').unwrap_or(rest.len());
                }
                Some(byte) if byte.is_ascii_whitespace() => self.position += 1,
                Some(_) => break,
            }
        }
        let at = self.position;
        let kind = match bytes[at] {
            b'[' => {
                self.position += 1;
                TokenKind::Open
            }
            b']' => {
                self.position += 1;
                TokenKind::Close
            }
            b'"' => {
                let mut end = at + 1;
                loop {
                    match bytes.get(end) {
                        None | Some(b'\n') => return Err(Unterminated { at }),
                        Some(b'"') => break,
                        Some(b'\\') => end += 2,
                        Some(_) => end += 1,
                    }
                }
                self.position = end + 1;
                TokenKind::Quoted(&self.text[at + 1..end])
            }
            _ => {
                let ends = |byte: &u8| byte.is_ascii_whitespace() || matches!(byte, b'"' | b'[' | b']' | b'#');
                let rest = &bytes[at..];
                self.position += rest.iter().position(ends).unwrap_or(rest.len());
                TokenKind::Word(&self.text[at..self.position])
            }
        };
        Ok(Some(Token { kind, at }))
    }
}

/// A quoted string without its escapes.
pub(crate) fn unescaped(text: &str) -> String {
    if !text.contains('\\') {
        return text.to_owned();
    }
    let mut out = String::with_capacity(text.len());
    let mut chars = text.chars();
    while let Some(c) = chars.next() {
        match c {
            '\\' => out.extend(chars.next().map(|c| match c {
                'n' => '\n',
                't' => '\t',
                'r' => '\r',
                other => other,
            })),
            other => out.push(other),
        }
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;
    use firstlight_format::locate::line_and_column;

    #[test]
    fn words_strings_and_brackets_are_told_apart() {
        let text = "Shape \"a \\\"b\"[1.5 -2]# no \"end\n  true\"x\"";
        let mut tokens = Tokens::new(text);
        let mut found = Vec::new();
        while let Some(token) = tokens.next().unwrap() {
            found.push((token.kind, line_and_column(text, token.at)));
        }
        let expected = [
            (TokenKind::Word("Shape"), (1, 1)),
            (TokenKind::Quoted("a \\\"b"), (1, 7)),
            (TokenKind::Open, (1, 14)),
            (TokenKind::Word("1.5"), (1, 15)),
            (TokenKind::Word("-2"), (1, 19)),
            (TokenKind::Close, (1, 21)),
            (TokenKind::Word("true"), (2, 3)),
            (TokenKind::Quoted("x"), (2, 7)),
        ];
        assert_eq!(found, expected);
        assert_eq!(unescaped("a \\\"b\\n"), "a \"b\n");
    }

    #[test]
    fn strings_end_on_their_line() {
        for text in ["\"", "\"\\", "\"a\nb\"", "\"a\\\""] {
            assert_eq!(Tokens::new(text).next(), Err(Unterminated { at: 0 }), "{text}");
        }
    }
}
