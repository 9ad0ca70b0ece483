//! Text of foreign files made fit for a terminal or a window: one line, nothing that does not print, no endless names.
//!
//! Names of materials and objects, paths, and lines of files of unknown origin may hold anything: escape sequences that
//! rewrite what stands on a terminal, marks that turn the order of letters round, line ends that forge a message.
//! Everything that the program says passes [`line()`], which the `console` and the messages of a session
//! see to; [`name`] is for a name that is set in columns or in a list of its own.

use std::borrow::Cow;

/// Characters of a name that are shown.
pub const LONGEST_NAME: usize = 80;
/// Characters of anything without a space, such as a path, that are shown.
const LONGEST_WORD: usize = 240;
/// Characters of one line that are shown.
const LONGEST_LINE: usize = 2000;

/// One line of a message. Characters that do not print are escaped, line ends included. Text in backticks is truncated
/// like a [`name`]; other words and the line have limits of their own.
pub fn line(text: &str) -> Cow<'_, str> {
    // Nearly all that is ever said.
    if text.len() <= LONGEST_NAME && text.bytes().all(|byte| matches!(byte, b' '..=b'~')) {
        return Cow::Borrowed(text);
    }
    // A megabyte is not looked at in full.
    let text = cut(text, 4 * LONGEST_LINE);
    let text = escape(&text);
    let mut short = String::with_capacity(text.len());
    for (i, part) in text.split('`').enumerate() {
        if i > 0 {
            short.push('`');
        }
        // Every other part stands between two of them.
        if i % 2 == 1 {
            short += &cut(part, LONGEST_NAME);
        } else {
            for (k, word) in part.split(' ').enumerate() {
                if k > 0 {
                    short.push(' ');
                }
                short += &cut(word, LONGEST_WORD);
            }
        }
    }
    Cow::Owned(cut(&short, LONGEST_LINE).into_owned())
}

/// A foreign name: escaped, and cut in its middle where it is long.
pub fn name(text: &str) -> Cow<'_, str> {
    if text.len() <= LONGEST_NAME && text.chars().all(prints) {
        return Cow::Borrowed(text);
    }
    let text = cut(text, 4 * LONGEST_NAME);
    Cow::Owned(cut(&escape(&text), LONGEST_NAME).into_owned())
}

/// Lines that the program itself has put together, each as [`line()`] has it.
pub fn lines(text: &str) -> String {
    text.split('\n').map(line).collect::<Vec<_>>().join("\n")
}

/// What does not print as `\u{1b}` and the like, and nothing else.
pub fn escape(text: &str) -> Cow<'_, str> {
    if text.chars().all(prints) {
        return Cow::Borrowed(text);
    }
    let mut out = String::with_capacity(text.len() + 16);
    for c in text.chars() {
        if prints(c) { out.push(c) } else { out.extend(c.escape_unicode()) }
    }
    Cow::Owned(out)
}

/// JSON in which characters that do not print are escaped: they stand in strings alone, where the format has escapes of its
/// own (RFC 8259, section 7).
pub fn json(text: &str) -> Cow<'_, str> {
    if text.chars().all(prints) {
        return Cow::Borrowed(text);
    }
    let mut out = String::with_capacity(text.len() + 16);
    for c in text.chars() {
        if prints(c) {
            out.push(c);
        } else {
            let mut units = [0; 2];
            out.extend(c.encode_utf16(&mut units).iter().map(|unit| format!("\\u{unit:04x}")));
        }
    }
    Cow::Owned(out)
}

/// Truncates to `most` characters by replacing the middle with `…`; never splits an escape.
fn cut(text: &str, most: usize) -> Cow<'_, str> {
    // As many bytes or fewer can only be as many characters or fewer.
    if text.len() <= most || text.chars().count() <= most {
        return Cow::Borrowed(text);
    }
    let (head, tail) = ((most - 1) / 2, most / 2);
    let start = text.char_indices().nth(head).map_or(text.len(), |(at, _)| at);
    let end = text.char_indices().rev().nth(tail - 1).map_or(0, |(at, _)| at);
    /// Bytes of the longest escape.
    const LONGEST: usize = "\\u{10ffff}".len();
    // Where the escape begins that `at` stands in, and where it ends.
    let around = |at: usize| {
        let from = text[..at].rfind('\\').filter(|from| at - from < LONGEST && text[*from..].starts_with("\\u{"))?;
        let to = from + text[from..].find('}')? + 1;
        (at < to && to - from <= LONGEST).then_some((from, to))
    };
    let start = around(start).map_or(start, |(from, _)| from);
    let end = around(end).map_or(end, |(_, to)| to);
    Cow::Owned(format!("{}…{}", &text[..start], &text[end..]))
}

/// Whether a character shows as itself, and moves nothing else.
fn prints(c: char) -> bool {
    match c {
        ' '..='~' => true,
        // Spaces of other widths, which are in file names.
        '\u{a0}' | '\u{2000}'..='\u{200a}' | '\u{202f}' | '\u{205f}' | '\u{3000}' => true,
        // Letters and marks without a shape of their own, which the standard library counts as printing.
        '\u{34f}'
        | '\u{115f}'
        | '\u{1160}'
        | '\u{17b4}'
        | '\u{17b5}'
        | '\u{180b}'..='\u{180f}'
        | '\u{3164}'
        | '\u{fe00}'..='\u{fe0f}'
        | '\u{ffa0}'
        | '\u{e0000}'..='\u{e0fff}' => false,
        // Behind another letter, as marks stand that go with one.
        _ => {
            let mut bytes = [b'a'; 5];
            let length = 1 + c.encode_utf8(&mut bytes[1..]).len();
            str::from_utf8(&bytes[..length]).is_ok_and(|text| text.escape_debug().nth(2).is_none())
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn json_means_the_same_with_escapes() {
        let odd = "a\u{9b}31m\u{202e}x\u{7f}\u{feff}\u{e0001}é\u{3000}\n";
        let text = serde_json::json!({ "name": odd }).to_string();
        let fit = json(&text);
        assert!(fit.chars().all(prints), "{fit}");
        assert_eq!(serde_json::from_str::<serde_json::Value>(&fit).unwrap()["name"], odd);
        assert_eq!(json("{\"a\":1}"), "{\"a\":1}");
    }

    #[test]
    fn nothing_that_acts_on_a_terminal_is_left() {
        let acting = (0..0x20).chain(0x7f..0xa0).chain(0x200b..0x2010).chain(0x2028..0x202f).chain(0x2060..0x2070);
        let others = [0xad, 0x34f, 0x61c, 0x115f, 0x180e, 0x3164, 0xfe0f, 0xfeff, 0xfffb, 0xe000, 0xe0041, 0x10ffff];
        for code in acting.chain(others) {
            let c = char::from_u32(code).unwrap();
            let expected = format!("a\\u{{{code:x}}}b");
            assert_eq!((line(&format!("a{c}b")), name(&format!("a{c}b"))), (expected.clone().into(), expected.into()));
        }
        assert_eq!(line("\x1b[2J\x07red\nerror: no"), "\\u{1b}[2J\\u{7}red\\u{a}error: no");
    }

    #[test]
    fn what_people_write_stays_as_it_is() {
        for text in [
            "plain `name` of 5 × 3, 20 °C, α … “quoted” – →",
            "Größe, cafe\u{301}, naïve",
            "日本語\u{3000}の名前, 한국어, العربية, עברית, हिन्दी, ไทย",
            "smile 😀 and 👩",
            "C:\\folder\\file.obj",
        ] {
            assert_eq!((line(text), name(text)), (text.into(), text.into()));
        }
    }

    #[test]
    fn what_is_long_is_cut_in_its_middle() {
        let long = format!("begin{}end", "x".repeat(1 << 20));
        let short = name(&long);
        assert!(short.chars().count() == LONGEST_NAME && short.starts_with("begin") && short.ends_with("end"));
        let said = line(&format!("a.ron:3:4: material `{long}` is not defined")).into_owned();
        assert!(said.chars().count() < 200 && said.starts_with("a.ron:3:4: material `begin"), "{said}");
        assert!(said.ends_with("end` is not defined") && said.contains('…'), "{said}");
        let said = line(&format!("{long}: no such file")).into_owned();
        assert!(said.chars().count() < 300 && said.ends_with("end: no such file"), "{said}");
        let said = line(&"word `a\u{1b}b` ".repeat(100_000)).into_owned();
        assert!(said.chars().count() < 10 * LONGEST_LINE, "{}", said.len());
        // Escapes are not cut apart.
        for most in [20, 21, 22, 23, 24, 25, 26, 80] {
            let said = cut(&escape(&"\x1b".repeat(100)), most).into_owned();
            assert!(said.chars().count() <= most && said.replace("\\u{1b}", "") == "…", "{said}");
        }
    }

    #[test]
    fn twice_is_the_same_as_once() {
        let texts = ["\x1b\n`\u{202e}`".to_owned(), format!("`{}` {}", "é\x07".repeat(99), "y".repeat(9999))];
        for text in texts {
            let once = line(&text).into_owned();
            assert_eq!(line(&once), once);
            let once = name(&text).into_owned();
            assert_eq!(name(&once), once);
        }
        assert_eq!(lines("one\ntwo\x07"), "one\ntwo\\u{7}");
    }
}
