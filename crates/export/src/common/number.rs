//! Numbers as text.

/// The shortest text that reads back as this number, without a sign of zero.
pub(crate) fn number(value: f64) -> String {
    // A number of single precision has its own shortest text.
    let single = value as f32;
    match f64::from(single) == value {
        true => format!("{}", single + 0.0),
        false => format!("{}", value + 0.0),
    }
}
