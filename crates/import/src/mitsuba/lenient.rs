//! The text of a scene as XML: what Mitsuba's parser passes over and a strict one refuses is blanked or escaped.
//!
//! Lines stay as they are, so that places in messages are right; columns do up to the first escape of a line.
//!
//! Source: pugixml, <https://pugixml.org/docs/manual.html#loading.options>

use crate::obj::lines::decoded;

/// Text of a file: UTF-8, UTF-16 with a byte order mark, and Latin-1, as old programs wrote it; also where a text in UTF-8
/// has some bytes of it.
pub(crate) fn text_of(bytes: &[u8]) -> String {
    let bytes = decoded(bytes);
    let mut text = String::with_capacity(bytes.len());
    for chunk in bytes.utf8_chunks() {
        text.push_str(chunk.valid());
        text.extend(chunk.invalid().iter().map(|&byte| char::from(byte)));
    }
    text
}

/// The tags of a text; everything else is blank, since a scene says all in attributes.
///
/// A document type with declarations stays, so that the parser refuses it.
pub(crate) fn tags_of(text: &str) -> String {
    /// What is passed over as a whole.
    const BLANKED: [(&str, &str); 3] = [("<!--", "-->"), ("<?", "?>"), ("<![CDATA[", "]]>")];
    let mut tags = String::with_capacity(text.len());
    let mut left = text;
    while let Some(start) = left.find('<') {
        let (before, from) = left.split_at(start);
        blank(before, &mut tags);
        let blanked = BLANKED.iter().find(|(opening, _)| from.starts_with(opening));
        let end = match blanked {
            Some((opening, closing)) => {
                from[opening.len()..].find(closing).map(|at| opening.len() + at + closing.len())
            }
            // Which may stand in the value of an attribute before.
            None => unquoted(from, b'>').map(|at| at + 1),
        };
        let Some(end) = end else {
            tags.push_str(from);
            return tags;
        };
        let (tag, after) = from.split_at(end);
        match blanked.is_some() || (tag.starts_with("<!DOCTYPE") && unquoted(tag, b'[').is_none()) {
            true => blank(tag, &mut tags),
            false => escape(tag, &mut tags),
        }
        left = after;
    }
    blank(left, &mut tags);
    tags
}

/// Adds a space for each character; lines stay.
fn blank(text: &str, out: &mut String) {
    out.extend(text.chars().map(|c| if c == '\n' || c == '\r' { c } else { ' ' }));
}

/// The place of the first such byte outside of quotes.
fn unquoted(text: &str, wanted: u8) -> Option<usize> {
    let mut quote = None;
    text.bytes().position(|byte| match quote {
        Some(open) => {
            quote = quote.filter(|_| byte != open);
            false
        }
        None => {
            quote = Some(byte).filter(|byte| matches!(byte, b'"' | b'\''));
            byte == wanted
        }
    })
}

/// Adds a tag: values of attributes may have `<`, `&` and control characters.
fn escape(tag: &str, out: &mut String) {
    let mut quote = None;
    for (at, c) in tag.char_indices() {
        match (quote, c) {
            (Some(_), '<') => out.push_str("&lt;"),
            (Some(_), '&') if !is_reference(&tag[at + 1..]) => out.push_str("&amp;"),
            (_, c) if c.is_ascii_control() && !matches!(c, '\t' | '\n' | '\r') => out.push(' '),
            _ => out.push(c),
        }
        quote = match quote {
            Some(open) => Some(open).filter(|open| *open != c),
            None => Some(c).filter(|c| matches!(c, '"' | '\'')),
        };
    }
}

/// Whether the text behind an `&` is a reference to a character that XML has.
fn is_reference(text: &str) -> bool {
    /// No longer one is a character.
    const LONGEST: usize = 10;
    let Some((name, _)) = text.char_indices().nth(LONGEST).map_or(text, |(end, _)| &text[..end]).split_once(';') else {
        return false;
    };
    let is_character = |digits: &str, radix: u32| {
        let number = Some(digits).filter(|digits| !digits.starts_with('+'));
        let code = number.and_then(|digits| u32::from_str_radix(digits, radix).ok());
        code.and_then(char::from_u32)
            .is_some_and(|c| matches!(c, '\t' | '\n' | '\r' | ' '..='\u{fffd}' | '\u{10000}'..='\u{10ffff}'))
    };
    match name.strip_prefix('#') {
        Some(number) => number.strip_prefix('x').map_or_else(|| is_character(number, 10), |hex| is_character(hex, 16)),
        None => matches!(name, "lt" | "gt" | "amp" | "apos" | "quot"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_tags_stay_and_lines_too() {
        for (text, tags) in [
            (
                "\n<?xml version=\"1.0\"?>\n<a>ä\n<!-- b -- <c> --->\n</a> end\0",
                "\n                     \n<a> \n                  \n</a>     ",
            ),
            ("<a b=\"<&&amp;&#38;&x;\" c='\">'/>", "<a b=\"&lt;&amp;&amp;&#38;&amp;x;\" c='\">'/>"),
            ("<a b=\"&#0;&#+5;&#xD800;&#x9;\"/>", "<a b=\"&amp;#0;&amp;#+5;&amp;#xD800;&#x9;\"/>"),
            ("<!DOCTYPE scene><a/>", "                <a/>"),
            ("<!DOCTYPE a PUBLIC \"-//b[1]\" 'c>'><a/>", "                                  <a/>"),
            ("<!DOCTYPE scene [<!ENTITY a \"b\">]><a/>", "<!DOCTYPE scene [<!ENTITY a \"b\">  <a/>"),
            ("<a><![CDATA[<b>]]>\u{c}</a>", "<a>                </a>"),
            ("<a><!-- b", "<a><!-- b"),
            ("<a b=\"c", "<a b=\"c"),
        ] {
            assert_eq!(tags_of(text), tags);
        }
    }

    #[test]
    fn old_encodings_are_text() {
        let utf16: Vec<u8> = [0xfeff_u16].into_iter().chain("ä".encode_utf16()).flat_map(u16::to_le_bytes).collect();
        for bytes in ["ä".as_bytes(), b"\xef\xbb\xbf\xc3\xa4", b"\xe4", &utf16] {
            assert_eq!(text_of(bytes), "ä");
        }
        // A comment in Latin-1 does not change a name in UTF-8.
        assert_eq!(text_of(b"<!-- \xfc --> \xc3\xa4 \xe4\xe4 \xe2\x82"), "<!-- ü --> ä ää â\u{82}");
    }
}
