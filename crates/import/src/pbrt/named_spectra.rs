//! The spectra that pbrt knows by name: metals and optical glasses.

/// Wavelength in nm, index of refraction η, absorption coefficient k.
type Row = (f64, f64, f64);

/// Silver, gold and copper: Johnson and Christy 1972, "Optical Constants of the Noble Metals", table I, by photon energy.
const SILVER: [Row; 14] = [
    (381.5, 0.05, 1.864),
    (397.4, 0.05, 2.070),
    (413.3, 0.05, 2.275),
    (430.5, 0.04, 2.462),
    (450.9, 0.04, 2.657),
    (471.4, 0.05, 2.869),
    (495.9, 0.05, 3.093),
    (520.9, 0.05, 3.324),
    (548.6, 0.06, 3.586),
    (579.4, 0.05, 3.858),
    (616.8, 0.06, 4.152),
    (659.5, 0.05, 4.483),
    (704.5, 0.04, 4.838),
    (756.0, 0.03, 5.242),
];
const GOLD: [Row; 14] = [
    (381.5, 1.46, 1.933),
    (397.4, 1.47, 1.952),
    (413.3, 1.46, 1.958),
    (430.5, 1.45, 1.948),
    (450.9, 1.38, 1.914),
    (471.4, 1.31, 1.849),
    (495.9, 1.04, 1.833),
    (520.9, 0.62, 2.081),
    (548.6, 0.43, 2.455),
    (579.4, 0.29, 2.863),
    (616.8, 0.21, 3.272),
    (659.5, 0.14, 3.697),
    (704.5, 0.13, 4.103),
    (756.0, 0.14, 4.542),
];
const COPPER: [Row; 14] = [
    (381.5, 1.33, 2.045),
    (397.4, 1.32, 2.116),
    (413.3, 1.28, 2.207),
    (430.5, 1.25, 2.305),
    (450.9, 1.24, 2.397),
    (471.4, 1.25, 2.483),
    (495.9, 1.22, 2.564),
    (520.9, 1.18, 2.608),
    (548.6, 1.02, 2.577),
    (579.4, 0.70, 2.704),
    (616.8, 0.30, 3.205),
    (659.5, 0.22, 3.747),
    (704.5, 0.21, 4.205),
    (756.0, 0.24, 4.665),
];

/// Aluminium: Smith, Shiles and Inokuti 1985, in Palik, "Handbook of Optical Constants of Solids".
const ALUMINIUM: [Row; 7] = [
    (400.0, 0.490, 4.86),
    (450.0, 0.618, 5.47),
    (500.0, 0.769, 6.08),
    (550.0, 0.958, 6.69),
    (600.0, 1.20, 7.26),
    (650.0, 1.47, 7.79),
    (700.0, 1.83, 8.31),
];

/// Brass with 30 % zinc: Querry 1985, "Optical Constants", at red, green and blue.
const BRASS: [Row; 3] = [(460.0, 1.094, 1.829), (540.0, 0.527, 2.765), (640.0, 0.444, 3.695)];

/// Magnesium oxide and rutile, which hardly absorb: Stephens and Malitson 1952; DeVore 1951 (ordinary ray).
const MAGNESIUM_OXIDE: [Row; 3] = [(450.0, 1.7486, 0.0), (550.0, 1.7399, 0.0), (650.0, 1.7346, 0.0)];
const RUTILE: [Row; 3] = [(450.0, 2.7807, 0.0), (550.0, 2.6484, 0.0), (650.0, 2.5786, 0.0)];

/// Optical constants of a conductor by its name, such as `Au`.
pub(crate) fn conductor_data(name: &str) -> Option<&'static [Row]> {
    Some(match name {
        "Ag" => &SILVER,
        "Al" => &ALUMINIUM,
        "Au" => &GOLD,
        "Cu" => &COPPER,
        "CuZn" => &BRASS,
        "MgO" => &MAGNESIUM_OXIDE,
        "TiO2" => &RUTILE,
        _ => return None,
    })
}

/// Index of refraction at 587.6 nm of a glass by its name, such as `glass-BK7`, and its dispersion, 20 over the Abbe
/// number (catalogue of Schott; pbrt calls SF5, SF10 and SF11 by F5, F10 and F11).
pub(crate) fn glass_data(name: &str) -> Option<(f64, f64)> {
    let (ior, abbe) = match name.strip_prefix("glass-")? {
        "BK7" => (1.51680, 64.17),
        "BAF10" => (1.67003, 47.11),
        "FK51A" => (1.48656, 84.47),
        "LASF9" => (1.85025, 32.17),
        "F5" | "SF5" => (1.67270, 32.21),
        "F10" | "SF10" => (1.72825, 28.41),
        "F11" | "SF11" => (1.78472, 25.76),
        _ => return None,
    };
    Some((ior, 20.0 / abbe))
}
