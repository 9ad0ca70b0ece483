//! Words of a Mitsuba scene: names, numbers and colours in attributes, and what no text of one has.

use glam::DVec3;

/// Refuses what no scene has, and what takes the parser a time that grows with its square: an element with many
/// attributes, and names of namespaces, of which each element knows those of all around it.
pub(crate) fn check_tags(text: &str) -> Result<(), String> {
    const MAX_NAMESPACES: usize = 64;
    const MAX_ATTRIBUTES: usize = 64;
    if text.matches("xmlns").nth(MAX_NAMESPACES).is_some() {
        return Err(format!("has more than {MAX_NAMESPACES} namespaces, but Mitsuba knows none"));
    }
    let is_long = |tag: &str| !tag.starts_with(['!', '?']) && tag.matches('=').nth(MAX_ATTRIBUTES).is_some();
    match text.split('<').any(is_long) {
        true => Err(format!("has an element with more than {MAX_ATTRIBUTES} attributes")),
        false => Ok(()),
    }
}

/// Whether a version is before 2.
pub(crate) fn is_old(version: &str) -> bool {
    version.trim_start().starts_with(['0', '1']) && version.trim_start()[1..].starts_with('.')
}

/// `toWorld` as `to_world`, `intIOR` as `int_ior`.
pub(crate) fn snake_case(name: &str) -> String {
    let mut out = String::new();
    let mut before_is_lower = false;
    for c in name.chars() {
        if c.is_uppercase() && before_is_lower {
            out.push('_');
        }
        before_is_lower = c.is_lowercase() || c.is_ascii_digit();
        out.extend(c.to_lowercase());
    }
    out
}

/// A finite number.
pub(crate) fn number(text: &str) -> Option<f64> {
    text.trim().parse().ok().filter(|number: &f64| number.is_finite())
}

/// Numbers between spaces and commas.
pub(crate) fn numbers(text: &str) -> Option<Vec<f64>> {
    text.split([' ', ',', '\t', '\r', '\n']).filter(|word| !word.is_empty()).map(number).collect()
}

/// `#rrggbb` in sRGB, of files before version 2.
pub(crate) fn hex(text: &str) -> Option<DVec3> {
    firstlight_format::value::hex_color(text.trim()).map(|rgb| rgb.as_dvec3())
}
