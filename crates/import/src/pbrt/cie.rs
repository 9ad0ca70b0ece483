//! Colorimetry: the CIE 1931 2° observer and daylight D65, from spectra to linear Rec. 709.

use glam::DVec3;

/// Wavelength of the first row of the tables, and between rows, nm.
const FIRST: f64 = 380.0;
const STEP: f64 = 10.0;

/// x̄, ȳ, z̄ of the CIE 1931 2° observer and the relative power of D65 (ISO/CIE 11664-1 and -2), from 380 to 780 nm.
const TABLE: [[f64; 4]; 41] = [
    [0.001368, 0.000039, 0.006450, 49.9755],
    [0.004243, 0.000120, 0.020050, 54.6482],
    [0.014310, 0.000396, 0.067850, 82.7549],
    [0.043510, 0.001210, 0.207400, 91.4860],
    [0.134380, 0.004000, 0.645600, 93.4318],
    [0.283900, 0.011600, 1.385600, 86.6823],
    [0.348280, 0.023000, 1.747060, 104.865],
    [0.336200, 0.038000, 1.772110, 117.008],
    [0.290800, 0.060000, 1.669200, 117.812],
    [0.195360, 0.090980, 1.287640, 114.861],
    [0.095640, 0.139020, 0.812950, 115.923],
    [0.032010, 0.208020, 0.465180, 108.811],
    [0.004900, 0.323000, 0.272000, 109.354],
    [0.009300, 0.503000, 0.158200, 107.802],
    [0.063270, 0.710000, 0.078250, 104.790],
    [0.165500, 0.862000, 0.042160, 107.689],
    [0.290400, 0.954000, 0.020300, 104.405],
    [0.433450, 0.994950, 0.008750, 104.046],
    [0.594500, 0.995000, 0.003900, 100.000],
    [0.762100, 0.952000, 0.002100, 96.3342],
    [0.916300, 0.870000, 0.001650, 95.7880],
    [1.026300, 0.757000, 0.001100, 88.6856],
    [1.062200, 0.631000, 0.000800, 90.0062],
    [1.002600, 0.503000, 0.000340, 89.5991],
    [0.854450, 0.381000, 0.000190, 87.6987],
    [0.642400, 0.265000, 0.000050, 83.2886],
    [0.447900, 0.175000, 0.000020, 83.6992],
    [0.283500, 0.107000, 0.0, 80.0268],
    [0.164900, 0.061000, 0.0, 80.2146],
    [0.087400, 0.032000, 0.0, 82.2778],
    [0.046770, 0.017000, 0.0, 78.2842],
    [0.022700, 0.008210, 0.0, 69.7213],
    [0.011359, 0.004102, 0.0, 71.6091],
    [0.005790, 0.002091, 0.0, 74.3490],
    [0.002899, 0.001047, 0.0, 61.6040],
    [0.001440, 0.000520, 0.0, 69.8856],
    [0.000690, 0.000249, 0.0, 75.0870],
    [0.000332, 0.000120, 0.0, 63.5927],
    [0.000166, 0.000060, 0.0, 46.4182],
    [0.000083, 0.000030, 0.0, 66.8054],
    [0.000042, 0.000015, 0.0, 63.3828],
];

/// Relative power of D65 at a wavelength in nm.
pub(crate) fn daylight(nm: f64) -> f64 {
    let row = ((nm - FIRST) / STEP).clamp(0.0, (TABLE.len() - 1) as f64);
    let (low, high) = (TABLE[row.floor() as usize][3], TABLE[row.ceil() as usize][3]);
    low + (high - low) * row.fract()
}

/// Tristimulus values of a spectrum, which is called with wavelengths in nm.
pub(crate) fn xyz_of(spectrum: impl Fn(f64) -> f64) -> DVec3 {
    let at = |(i, [x, y, z, _]): (usize, &[f64; 4])| spectrum(FIRST + STEP * i as f64) * DVec3::new(*x, *y, *z);
    STEP * TABLE.iter().enumerate().map(at).sum::<DVec3>()
}

/// Linear Rec. 709 from tristimulus values (IEC 61966-2-1); D65 with Y = 1 is (1, 1, 1).
pub(crate) fn rgb_of_xyz(DVec3 { x, y, z }: DVec3) -> DVec3 {
    DVec3::new(
        3.240_970 * x - 1.537_383 * y - 0.498_611 * z,
        -0.969_244 * x + 1.875_968 * y + 0.041_555 * z,
        0.055_630 * x - 0.203_977 * y + 1.056_972 * z,
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_tables_add_up_to_known_sums() {
        // The integral of each matching function is that of ȳ, 106.857 nm; the white point of D65 is
        // (0.95047, 1, 1.08883).
        let equal = xyz_of(|_| 1.0);
        assert!((equal / 106.857 - DVec3::ONE).abs().max_element() < 1e-3, "{equal}");
        let white = xyz_of(daylight);
        let white = white / white.y;
        assert!((white - DVec3::new(0.95047, 1.0, 1.08883)).abs().max_element() < 1e-3, "{white}");
        assert!((rgb_of_xyz(white) - DVec3::ONE).abs().max_element() < 2e-3);
        assert!((daylight(565.0) - 98.1671).abs() < 1e-9);
    }
}
