//! The filters of `KHR_meshopt_compression`, which turn decoded attributes into what accessors read.
//!
//! Source: Khronos and Arseny Kapoulkine, "KHR_meshopt_compression", appendix B (filters).

/// Decodes unit vectors in octahedral coordinates; the third component holds the encoding of 1.
pub(crate) fn octahedral(bytes: &mut [u8], stride: usize) {
    let size = stride / 4;
    let most = if size == 1 { 127.0 } else { 32767.0 };
    for element in bytes.chunks_exact_mut(stride) {
        let get = |i: usize| match size {
            1 => f32::from(element[i] as i8),
            _ => f32::from(i16::from_le_bytes([element[2 * i], element[2 * i + 1]])),
        };
        let (mut x, mut y, one) = (get(0), get(1), get(2));
        let z = one - x.abs() - y.abs();
        let fold = z.min(0.0);
        x += if x >= 0.0 { fold } else { -fold };
        y += if y >= 0.0 { fold } else { -fold };
        let length = (x * x + y * y + z * z).sqrt();
        let scale = if length > 0.0 { most / length } else { 0.0 };
        for (i, value) in [x, y, z].into_iter().enumerate() {
            let rounded = (value * scale).round();
            match size {
                1 => element[i] = (rounded as i8) as u8,
                _ => element[2 * i..2 * i + 2].copy_from_slice(&(rounded as i16).to_le_bytes()),
            }
        }
    }
}

/// Decodes unit quaternions without their largest component, whose index is in two bits of the fourth number.
pub(crate) fn quaternion(bytes: &mut [u8]) {
    for element in bytes.chunks_exact_mut(8) {
        let get = |i: usize| i16::from_le_bytes([element[2 * i], element[2 * i + 1]]);
        let (which, one) = ((get(3) & 3) as usize, f32::from(get(3) | 3));
        let scale = std::f32::consts::FRAC_1_SQRT_2 / one;
        let [x, y, z] = [0, 1, 2].map(|i| f32::from(get(i)) * scale);
        let w = (1.0 - x * x - y * y - z * z).max(0.0).sqrt();
        for (i, value) in [w, x, y, z].into_iter().enumerate() {
            let at = 2 * ((which + i) & 3);
            element[at..at + 2].copy_from_slice(&((value * 32767.0).round() as i16).to_le_bytes());
        }
    }
}

/// Decodes numbers with a mantissa of 24 bits and an exponent of 8 bits.
pub(crate) fn exponential(bytes: &mut [u8]) {
    for four in bytes.chunks_exact_mut(4) {
        let value = i32::from_le_bytes([four[0], four[1], four[2], four[3]]);
        let (exponent, mantissa) = (value >> 24, (value << 8) >> 8);
        let number = (f64::from(mantissa) * 2_f64.powi(exponent)) as f32;
        four.copy_from_slice(&number.to_le_bytes());
    }
}

/// Decodes colours: luma, two differences, and an alpha whose highest bit tells the number of bits of all four.
pub(crate) fn color(bytes: &mut [u8], stride: usize) {
    let size = stride / 4;
    let most = if size == 1 { 255.0 } else { 65535.0 };
    for element in bytes.chunks_exact_mut(stride) {
        let number = |i: usize| match size {
            1 => i32::from(element[i]),
            _ => i32::from(u16::from_le_bytes([element[2 * i], element[2 * i + 1]])),
        };
        let signed = |i: usize| match size {
            1 => i32::from(element[i] as i8),
            _ => i32::from(i16::from_le_bytes([element[2 * i], element[2 * i + 1]])),
        };
        let (luma, orange, green, alpha) = (number(0), signed(1), signed(2), number(3));
        // Without any bit the element is invalid; its colour is then 0.
        let ones = (1 << (32 - alpha.leading_zeros())) - 1;
        let alpha = alpha & (ones >> 1);
        let values = [luma + orange - green, luma + green, luma - orange - green, (alpha << 1) | (alpha & 1)];
        let scale = most / f64::from(ones.max(1));
        for (i, value) in values.into_iter().enumerate() {
            let value = (f64::from(value) * scale).round().clamp(0.0, most);
            match size {
                1 => element[i] = value as u8,
                _ => element[2 * i..2 * i + 2].copy_from_slice(&(value as u16).to_le_bytes()),
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn filters_give_unit_vectors_turns_and_numbers() {
        let mut bytes: Vec<u8> = [100_i8, -20, 127, 5, 60, 120, 127, -9].map(|b| b as u8).to_vec();
        octahedral(&mut bytes, 4);
        for (element, (x, y)) in bytes.chunks(4).zip([(100.0, -20.0), (60.0, 120.0)]) {
            let found = [0, 1, 2].map(|i| f32::from(element[i] as i8) / 127.0);
            let z = 127.0 - f32::abs(x) - f32::abs(y);
            let fold = f32::min(z, 0.0);
            let (x, y) = (x + fold * x.signum(), y + fold * y.signum());
            let length = (x * x + y * y + z * z).sqrt();
            for (found, expected) in found.iter().zip([x, y, z]) {
                assert!((found - expected / length).abs() < 0.01);
            }
        }
        assert_eq!((bytes[3], bytes[7]), (5, (-9_i8) as u8));
        let mut bytes: Vec<u8> = [0_i16, 0, 1000, 1022].iter().flat_map(|v| v.to_le_bytes()).collect();
        quaternion(&mut bytes);
        let turn: Vec<f32> = bytes.chunks(2).map(|b| f32::from(i16::from_le_bytes([b[0], b[1]])) / 32767.0).collect();
        assert!((turn.iter().map(|v| v * v).sum::<f32>() - 1.0).abs() < 1e-3);
        // 1022 has 2 in its low bits: the third component is the largest, and the others follow cyclically.
        assert!(turn[1] > 0.6 && turn[2] > 0.6 && turn[0] == 0.0 && turn[3] == 0.0, "{turn:?}");
        let mut bytes = ((-3_i32 << 24) | (0x00ff_ffff & -20)).to_le_bytes().to_vec();
        exponential(&mut bytes);
        assert_eq!(bytes, (-2.5_f32).to_le_bytes());
    }

    #[test]
    fn colors_have_the_bits_that_their_alpha_tells() {
        // With 8 bits: luma 100, orange 30, green -20, alpha 64 of 127.
        let mut bytes = [100, 30, -20_i8 as u8, 0x80 | 64];
        color(&mut bytes, 4);
        assert_eq!(bytes, [150, 80, 90, 128]);
        // With 4 bits of 16.
        let mut bytes: Vec<u8> = [5_i16, 2, -1, 0b1111].iter().flat_map(|v| v.to_le_bytes()).collect();
        color(&mut bytes, 8);
        let found: Vec<u16> = bytes.chunks(2).map(|two| u16::from_le_bytes([two[0], two[1]])).collect();
        assert_eq!(found, [8, 4, 4, 15].map(|v| v * 4369));
        let mut bytes = [200, 100, 100, 0];
        color(&mut bytes, 4);
    }
}
