//! Numbers in text files.

/// Parses a number; NaN and infinity as C programs write them (`-nan(ind)`, `1.#QNAN`, `-1.#INF`) become NaN.
///
/// `None` if the word is no number.
pub(crate) fn parse_number(word: &[u8]) -> Option<f64> {
    let text = str::from_utf8(word).ok()?;
    text.parse().ok().or_else(|| {
        let unsigned = text.trim_start_matches(['-', '+']);
        let is_nan = unsigned.get(..3).is_some_and(|start| start.eq_ignore_ascii_case("nan"));
        (is_nan || unsigned.starts_with("1.#")).then_some(f64::NAN)
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_no_number_is_told_from_nan() {
        for text in ["nan", "-NaN", "-nan(ind)", "nan(snan)", "1.#QNAN", "-1.#IND", "1.#INF"] {
            assert!(parse_number(text.as_bytes()).unwrap().is_nan(), "{text}");
        }
        assert_eq!(
            [parse_number(b"-1e3"), parse_number(b"inf"), parse_number(b".5")].map(Option::unwrap),
            [-1e3, f64::INFINITY, 0.5]
        );
        for text in ["", "x", "1.#", "1,5", "na", "\u{e9}"] {
            assert_eq!(parse_number(text.as_bytes()).is_some(), text == "1.#", "{text}");
        }
    }
}
