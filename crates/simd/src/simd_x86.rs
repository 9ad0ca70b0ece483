//! The x86 implementations of [`Simd`]: sixteen numbers in one AVX-512 register or two AVX2 registers.

use super::{Kernel, LANES, Mask, SET_BITS, Simd, last_index};
use std::arch::x86_64::*;

/// Proof that the processor has AVX-512 F, VL, DQ and BW, and everything that [`Avx2`] proves.
#[derive(Clone, Copy)]
pub struct Avx512(());

/// Proof that the processor has AVX2, FMA, BMI 1 and 2, LZCNT and POPCNT.
#[derive(Clone, Copy)]
pub struct Avx2(());

impl Avx512 {
    /// Creates the proof.
    ///
    /// # Safety
    /// The processor must have the instructions that this type proves.
    #[inline(always)]
    pub unsafe fn new() -> Self {
        Self(())
    }
}

impl Avx2 {
    /// Creates the proof.
    ///
    /// # Safety
    /// The processor must have the instructions that this type proves.
    #[inline(always)]
    pub unsafe fn new() -> Self {
        Self(())
    }
}

/// Defines functions whose body is one expression of intrinsics. All loads and stores accept any alignment.
macro_rules! operations {
    ($($(#[$attribute:meta])* fn $name:ident($($arg:ident: $kind:ty),*) $(-> $result:ty)? $body:block)*) => {
        $($(#[$attribute])*
        #[inline(always)]
        fn $name(self, $($arg: $kind),*) $(-> $result)? {
            // SAFETY: `self` proves that the processor has the instructions. Pointers come from references to arrays of
            // the size that is read or written; a gather reads at most index `last_index` of its slice, which is
            // checked there.
            unsafe { $body }
        })*
    };
}

impl Simd for Avx512 {
    type F = __m512;
    type U = __m512i;
    type D = [__m512d; 2];

    #[inline(always)]
    fn call<K: Kernel<Self>>(self, kernel: K) -> K::Output {
        #[inline(never)]
        #[target_feature(enable = "avx512f,avx512vl,avx512dq,avx512bw,avx2,fma,bmi1,bmi2,lzcnt,popcnt")]
        fn apart<K: Kernel<Avx512>>(s: Avx512, kernel: K) -> K::Output {
            kernel.run(s)
        }
        // SAFETY: `self` proves that the processor has the instructions.
        unsafe { apart(self, kernel) }
    }

    operations! {
        fn splat(x: f32) -> __m512 { _mm512_set1_ps(x) }
        fn load(from: &[f32; LANES]) -> __m512 { _mm512_loadu_ps(from.as_ptr()) }
        fn store(a: __m512, to: &mut [f32; LANES]) { _mm512_storeu_ps(to.as_mut_ptr(), a) }
        fn add(a: __m512, b: __m512) -> __m512 { _mm512_add_ps(a, b) }
        fn sub(a: __m512, b: __m512) -> __m512 { _mm512_sub_ps(a, b) }
        fn mul(a: __m512, b: __m512) -> __m512 { _mm512_mul_ps(a, b) }
        fn div(a: __m512, b: __m512) -> __m512 { _mm512_div_ps(a, b) }
        fn min(a: __m512, b: __m512) -> __m512 { _mm512_min_ps(a, b) }
        fn max(a: __m512, b: __m512) -> __m512 { _mm512_max_ps(a, b) }
        fn abs(a: __m512) -> __m512 { _mm512_abs_ps(a) }
        fn mul_sub(a: __m512, b: __m512, c: __m512) -> __m512 { _mm512_fmsub_ps(a, b, c) }
        fn neg_mul_add(a: __m512, b: __m512, c: __m512) -> __m512 { _mm512_fnmadd_ps(a, b, c) }
        fn mul_add_about(a: __m512, b: __m512, c: __m512) -> __m512 { _mm512_fmadd_ps(a, b, c) }
        fn neg_mul_add_about(a: __m512, b: __m512, c: __m512) -> __m512 { _mm512_fnmadd_ps(a, b, c) }
        fn reciprocal_about(a: __m512) -> __m512 {
            // One Newton step from 14 bits.
            let r = _mm512_rcp14_ps(a);
            _mm512_mul_ps(r, _mm512_fnmadd_ps(a, r, _mm512_set1_ps(2.0)))
        }
        fn negative(a: __m512) -> Mask { _mm512_movepi32_mask(_mm512_castps_si512(a)) }
        fn lt(a: __m512, b: __m512) -> Mask { _mm512_cmp_ps_mask::<_CMP_LT_OQ>(a, b) }
        fn le(a: __m512, b: __m512) -> Mask { _mm512_cmp_ps_mask::<_CMP_LE_OQ>(a, b) }
        fn eq(a: __m512, b: __m512) -> Mask { _mm512_cmp_ps_mask::<_CMP_EQ_OQ>(a, b) }
        fn select(mask: Mask, a: __m512, b: __m512) -> __m512 { _mm512_mask_blend_ps(mask, b, a) }
        fn least(mask: Mask, a: __m512) -> f32 { _mm512_mask_reduce_min_ps(mask, a) }
        fn pick(point: &[f32; 4], axes: __m512i) -> __m512 {
            _mm512_permutevar_ps(_mm512_broadcast_f32x4(_mm_loadu_ps(point.as_ptr())), axes)
        }
        fn lookup(table: __m512, indices: __m512i) -> __m512 { _mm512_permutexvar_ps(indices, table) }
        fn splat_u(x: u32) -> __m512i { _mm512_set1_epi32(x as i32) }
        fn load_u(from: &[u32; LANES]) -> __m512i { _mm512_loadu_si512(from.as_ptr().cast()) }
        fn load_bytes(from: &[u8; LANES]) -> __m512i { _mm512_cvtepu8_epi32(_mm_loadu_si128(from.as_ptr().cast())) }
        fn store_u(a: __m512i, to: &mut [u32; LANES]) { _mm512_storeu_si512(to.as_mut_ptr().cast(), a) }
        fn lt_u(a: __m512i, b: __m512i) -> Mask { _mm512_cmplt_epu32_mask(a, b) }
        fn select_u(mask: Mask, a: __m512i, b: __m512i) -> __m512i { _mm512_mask_blend_epi32(mask, b, a) }
        fn splat_d(x: f64) -> Self::D { [_mm512_set1_pd(x); 2] }
        fn widen(a: __m512) -> Self::D {
            [_mm512_cvtps_pd(_mm512_castps512_ps256(a)), _mm512_cvtps_pd(_mm512_extractf32x8_ps::<1>(a))]
        }
        fn narrow(a: Self::D) -> __m512 {
            let low = _mm512_castps256_ps512(_mm512_cvtpd_ps(a[0]));
            _mm512_insertf32x8::<1>(low, _mm512_cvtpd_ps(a[1]))
        }
        fn add_d(a: Self::D, b: Self::D) -> Self::D { [_mm512_add_pd(a[0], b[0]), _mm512_add_pd(a[1], b[1])] }
        fn sub_d(a: Self::D, b: Self::D) -> Self::D { [_mm512_sub_pd(a[0], b[0]), _mm512_sub_pd(a[1], b[1])] }
        fn mul_d(a: Self::D, b: Self::D) -> Self::D { [_mm512_mul_pd(a[0], b[0]), _mm512_mul_pd(a[1], b[1])] }
        fn div_d(a: Self::D, b: Self::D) -> Self::D { [_mm512_div_pd(a[0], b[0]), _mm512_div_pd(a[1], b[1])] }
        fn sqrt_d(a: Self::D) -> Self::D { [_mm512_sqrt_pd(a[0]), _mm512_sqrt_pd(a[1])] }
        fn abs_d(a: Self::D) -> Self::D { [_mm512_abs_pd(a[0]), _mm512_abs_pd(a[1])] }
        fn max_d(a: Self::D, b: Self::D) -> Self::D { [_mm512_max_pd(a[0], b[0]), _mm512_max_pd(a[1], b[1])] }
        fn le_d(a: Self::D, b: Self::D) -> Mask {
            let low = Mask::from(_mm512_cmp_pd_mask::<_CMP_LE_OQ>(a[0], b[0]));
            low | Mask::from(_mm512_cmp_pd_mask::<_CMP_LE_OQ>(a[1], b[1])) << 8
        }
        fn sqrt(a: __m512) -> __m512 { _mm512_sqrt_ps(a) }
        fn truncate(a: __m512) -> __m512i { _mm512_cvttps_epi32(a) }
        fn to_f(a: __m512i) -> __m512 { _mm512_cvtepi32_ps(a) }
        fn to_bits(a: __m512) -> __m512i { _mm512_castps_si512(a) }
        fn float_of(a: __m512i) -> __m512 { _mm512_castsi512_ps(a) }
        fn add_u(a: __m512i, b: __m512i) -> __m512i { _mm512_add_epi32(a, b) }
        fn mul_u(a: __m512i, b: __m512i) -> __m512i { _mm512_mullo_epi32(a, b) }
        fn and_u(a: __m512i, b: __m512i) -> __m512i { _mm512_and_si512(a, b) }
        fn or_u(a: __m512i, b: __m512i) -> __m512i { _mm512_or_si512(a, b) }
        fn xor_u(a: __m512i, b: __m512i) -> __m512i { _mm512_xor_si512(a, b) }
        fn shl_u(a: __m512i, bits: u32) -> __m512i { _mm512_sllv_epi32(a, _mm512_set1_epi32(bits as i32)) }
        fn shr_u(a: __m512i, bits: u32) -> __m512i { _mm512_srlv_epi32(a, _mm512_set1_epi32(bits as i32)) }
        fn eq_u(a: __m512i, b: __m512i) -> Mask { _mm512_cmpeq_epi32_mask(a, b) }
        fn gather(from: &[f32], indices: __m512i) -> __m512 {
            // Tables of sixteen or thirty-two numbers are looked up in registers.
            if let Some(table) = from.as_array::<LANES>() {
                return _mm512_permutexvar_ps(indices, _mm512_loadu_ps(table.as_ptr()));
            }
            if let Some(table) = from.as_array::<{ 2 * LANES }>() {
                let (low, high) = (_mm512_loadu_ps(table.as_ptr()), _mm512_loadu_ps(table.as_ptr().add(LANES)));
                return _mm512_permutex2var_ps(low, indices, high);
            }
            let last = _mm512_set1_epi32(last_index(from.len()) as i32);
            _mm512_i32gather_ps::<4>(_mm512_min_epu32(indices, last), from.as_ptr())
        }
        fn gather_u(from: &[u32], indices: __m512i) -> __m512i {
            if let Some(table) = from.as_array::<LANES>() {
                return _mm512_permutexvar_epi32(indices, _mm512_loadu_si512(table.as_ptr().cast()));
            }
            let last = _mm512_set1_epi32(last_index(from.len()) as i32);
            _mm512_i32gather_epi32::<4>(_mm512_min_epu32(indices, last), from.as_ptr().cast())
        }
        fn compress(mask: Mask, a: __m512) -> __m512 { _mm512_maskz_compress_ps(mask, a) }
        fn compress_u(mask: Mask, a: __m512i) -> __m512i { _mm512_maskz_compress_epi32(mask, a) }
    }
}

/// Expands a mask of 8 bits to a register whose lanes are all ones or all zeros.
///
/// # Safety
/// The processor must have the instructions that [`Avx2`] proves.
#[inline(always)]
unsafe fn lanes_of(mask: Mask) -> __m256 {
    // SAFETY: guaranteed by the caller; no memory is accessed.
    unsafe {
        let bit = _mm256_setr_epi32(1, 2, 4, 8, 16, 32, 64, 128);
        let both = _mm256_and_si256(_mm256_set1_epi32(i32::from(mask)), bit);
        _mm256_castsi256_ps(_mm256_cmpeq_epi32(both, bit))
    }
}

/// Collects the sign bits of all lanes.
///
/// # Safety
/// As [`lanes_of`].
#[inline(always)]
unsafe fn bits_of(low: __m256, high: __m256) -> Mask {
    // SAFETY: guaranteed by the caller; no memory is accessed.
    unsafe { _mm256_movemask_ps(low) as Mask | (_mm256_movemask_ps(high) as Mask) << 8 }
}

/// Selects `a` where the bit is set, else `b`.
///
/// # Safety
/// As [`lanes_of`].
#[inline(always)]
unsafe fn blend(mask: Mask, a: [__m256; 2], b: [__m256; 2]) -> [__m256; 2] {
    // SAFETY: guaranteed by the caller; no memory is accessed.
    unsafe { [_mm256_blendv_ps(b[0], a[0], lanes_of(mask)), _mm256_blendv_ps(b[1], a[1], lanes_of(mask >> 8))] }
}

/// Moves the lanes of the mask to the front: each half separately, then the upper one behind the lower.
///
/// # Safety
/// As [`lanes_of`].
#[inline(always)]
unsafe fn compress(mask: Mask, a: [__m256i; 2]) -> [__m256i; 2] {
    // SAFETY: guaranteed by the caller; the second store starts at index 8 of sixteen numbers at the latest.
    unsafe {
        let (low, high) = (compress_half(mask as u8, a[0]), compress_half((mask >> 8) as u8, a[1]));
        let mut both = [0u32; 16];
        _mm256_storeu_si256(both.as_mut_ptr().cast(), low);
        _mm256_storeu_si256(both.as_mut_ptr().add((mask as u8).count_ones() as usize).cast(), high);
        [_mm256_loadu_si256(both.as_ptr().cast()), _mm256_loadu_si256(both.as_ptr().add(8).cast())]
    }
}

/// Moves the lanes of the mask to the front. By a table: the instructions that collect bits are slow on AMD before Zen 3.
///
/// # Safety
/// As [`lanes_of`].
#[inline(always)]
unsafe fn compress_half(mask: u8, a: __m256i) -> __m256i {
    // SAFETY: guaranteed by the caller; no memory is accessed.
    unsafe {
        let lanes = _mm256_cvtepu8_epi32(_mm_cvtsi64_si128(SET_BITS[usize::from(mask)] as i64));
        _mm256_permutevar8x32_epi32(a, lanes)
    }
}

/// Looks up table entries by the low four bits of the indices.
///
/// # Safety
/// As [`lanes_of`].
#[inline(always)]
unsafe fn lookup_half(table: [__m256; 2], indices: __m256i) -> __m256 {
    // SAFETY: guaranteed by the caller; no memory is accessed.
    unsafe {
        let low = _mm256_permutevar8x32_ps(table[0], indices);
        let high = _mm256_permutevar8x32_ps(table[1], indices);
        // The fourth bit becomes the sign bit, which selects in a blend.
        _mm256_blendv_ps(low, high, _mm256_castsi256_ps(_mm256_slli_epi32::<28>(indices)))
    }
}

/// Applies an operation to both halves.
macro_rules! halves {
    ($operation:ident($($arg:ident),+)) => { [$operation($($arg[0]),+), $operation($($arg[1]),+)] };
    ($operation:ident($($arg:ident),+), 4) => {
        [$operation($($arg[0]),+), $operation($($arg[1]),+), $operation($($arg[2]),+), $operation($($arg[3]),+)]
    };
}

impl Simd for Avx2 {
    type F = [__m256; 2];
    type U = [__m256i; 2];
    type D = [__m256d; 4];

    #[inline(always)]
    fn call<K: Kernel<Self>>(self, kernel: K) -> K::Output {
        #[inline(never)]
        #[target_feature(enable = "avx2,fma,bmi1,bmi2,lzcnt,popcnt")]
        fn apart<K: Kernel<Avx2>>(s: Avx2, kernel: K) -> K::Output {
            kernel.run(s)
        }
        // SAFETY: `self` proves that the processor has the instructions.
        unsafe { apart(self, kernel) }
    }

    operations! {
        fn splat(x: f32) -> Self::F { [_mm256_set1_ps(x); 2] }
        fn load(from: &[f32; LANES]) -> Self::F { [_mm256_loadu_ps(from.as_ptr()), _mm256_loadu_ps(from.as_ptr().add(8))] }
        fn store(a: Self::F, to: &mut [f32; LANES]) {
            _mm256_storeu_ps(to.as_mut_ptr(), a[0]);
            _mm256_storeu_ps(to.as_mut_ptr().add(8), a[1]);
        }
        fn add(a: Self::F, b: Self::F) -> Self::F { halves!(_mm256_add_ps(a, b)) }
        fn sub(a: Self::F, b: Self::F) -> Self::F { halves!(_mm256_sub_ps(a, b)) }
        fn mul(a: Self::F, b: Self::F) -> Self::F { halves!(_mm256_mul_ps(a, b)) }
        fn div(a: Self::F, b: Self::F) -> Self::F { halves!(_mm256_div_ps(a, b)) }
        fn min(a: Self::F, b: Self::F) -> Self::F { halves!(_mm256_min_ps(a, b)) }
        fn max(a: Self::F, b: Self::F) -> Self::F { halves!(_mm256_max_ps(a, b)) }
        fn abs(a: Self::F) -> Self::F {
            let sign = _mm256_set1_ps(-0.0);
            [_mm256_andnot_ps(sign, a[0]), _mm256_andnot_ps(sign, a[1])]
        }
        fn mul_sub(a: Self::F, b: Self::F, c: Self::F) -> Self::F { halves!(_mm256_fmsub_ps(a, b, c)) }
        fn neg_mul_add(a: Self::F, b: Self::F, c: Self::F) -> Self::F { halves!(_mm256_fnmadd_ps(a, b, c)) }
        fn mul_add_about(a: Self::F, b: Self::F, c: Self::F) -> Self::F { halves!(_mm256_fmadd_ps(a, b, c)) }
        fn neg_mul_add_about(a: Self::F, b: Self::F, c: Self::F) -> Self::F { halves!(_mm256_fnmadd_ps(a, b, c)) }
        fn reciprocal_about(a: Self::F) -> Self::F {
            // One Newton step from 11 bits.
            let (r, two) = (halves!(_mm256_rcp_ps(a)), [_mm256_set1_ps(2.0); 2]);
            let rest = halves!(_mm256_fnmadd_ps(a, r, two));
            halves!(_mm256_mul_ps(r, rest))
        }
        fn negative(a: Self::F) -> Mask { bits_of(a[0], a[1]) }
        fn lt(a: Self::F, b: Self::F) -> Mask {
            bits_of(_mm256_cmp_ps::<_CMP_LT_OQ>(a[0], b[0]), _mm256_cmp_ps::<_CMP_LT_OQ>(a[1], b[1]))
        }
        fn le(a: Self::F, b: Self::F) -> Mask {
            bits_of(_mm256_cmp_ps::<_CMP_LE_OQ>(a[0], b[0]), _mm256_cmp_ps::<_CMP_LE_OQ>(a[1], b[1]))
        }
        fn eq(a: Self::F, b: Self::F) -> Mask {
            bits_of(_mm256_cmp_ps::<_CMP_EQ_OQ>(a[0], b[0]), _mm256_cmp_ps::<_CMP_EQ_OQ>(a[1], b[1]))
        }
        fn select(mask: Mask, a: Self::F, b: Self::F) -> Self::F { blend(mask, a, b) }
        fn least(mask: Mask, a: Self::F) -> f32 {
            let [low, high] = blend(mask, a, [_mm256_set1_ps(f32::INFINITY); 2]);
            let eight = _mm256_min_ps(low, high);
            let four = _mm_min_ps(_mm256_castps256_ps128(eight), _mm256_extractf128_ps::<1>(eight));
            let two = _mm_min_ps(four, _mm_movehl_ps(four, four));
            _mm_cvtss_f32(_mm_min_ss(two, _mm_shuffle_ps::<1>(two, two)))
        }
        fn pick(point: &[f32; 4], axes: Self::U) -> Self::F {
            let point = _mm_loadu_ps(point.as_ptr());
            let point = _mm256_set_m128(point, point);
            [_mm256_permutevar_ps(point, axes[0]), _mm256_permutevar_ps(point, axes[1])]
        }
        fn lookup(table: Self::F, indices: Self::U) -> Self::F {
            [lookup_half(table, indices[0]), lookup_half(table, indices[1])]
        }
        fn splat_u(x: u32) -> Self::U { [_mm256_set1_epi32(x as i32); 2] }
        fn load_u(from: &[u32; LANES]) -> Self::U {
            [_mm256_loadu_si256(from.as_ptr().cast()), _mm256_loadu_si256(from.as_ptr().add(8).cast())]
        }
        fn load_bytes(from: &[u8; LANES]) -> Self::U {
            let (low, high) = (_mm_loadu_si64(from.as_ptr()), _mm_loadu_si64(from.as_ptr().add(8)));
            [_mm256_cvtepu8_epi32(low), _mm256_cvtepu8_epi32(high)]
        }
        fn store_u(a: Self::U, to: &mut [u32; LANES]) {
            _mm256_storeu_si256(to.as_mut_ptr().cast(), a[0]);
            _mm256_storeu_si256(to.as_mut_ptr().add(8).cast(), a[1]);
        }
        fn lt_u(a: Self::U, b: Self::U) -> Mask {
            // Only signed comparisons exist.
            let flip = _mm256_set1_epi32(i32::MIN);
            let low = _mm256_cmpgt_epi32(_mm256_xor_si256(b[0], flip), _mm256_xor_si256(a[0], flip));
            let high = _mm256_cmpgt_epi32(_mm256_xor_si256(b[1], flip), _mm256_xor_si256(a[1], flip));
            bits_of(_mm256_castsi256_ps(low), _mm256_castsi256_ps(high))
        }
        fn select_u(mask: Mask, a: Self::U, b: Self::U) -> Self::U {
            let a = [_mm256_castsi256_ps(a[0]), _mm256_castsi256_ps(a[1])];
            let b = [_mm256_castsi256_ps(b[0]), _mm256_castsi256_ps(b[1])];
            let [low, high] = blend(mask, a, b);
            [_mm256_castps_si256(low), _mm256_castps_si256(high)]
        }
        fn splat_d(x: f64) -> Self::D { [_mm256_set1_pd(x); 4] }
        fn widen(a: Self::F) -> Self::D {
            [
                _mm256_cvtps_pd(_mm256_castps256_ps128(a[0])), _mm256_cvtps_pd(_mm256_extractf128_ps::<1>(a[0])),
                _mm256_cvtps_pd(_mm256_castps256_ps128(a[1])), _mm256_cvtps_pd(_mm256_extractf128_ps::<1>(a[1])),
            ]
        }
        fn narrow(a: Self::D) -> Self::F {
            [
                _mm256_set_m128(_mm256_cvtpd_ps(a[1]), _mm256_cvtpd_ps(a[0])),
                _mm256_set_m128(_mm256_cvtpd_ps(a[3]), _mm256_cvtpd_ps(a[2])),
            ]
        }
        fn add_d(a: Self::D, b: Self::D) -> Self::D { halves!(_mm256_add_pd(a, b), 4) }
        fn sub_d(a: Self::D, b: Self::D) -> Self::D { halves!(_mm256_sub_pd(a, b), 4) }
        fn mul_d(a: Self::D, b: Self::D) -> Self::D { halves!(_mm256_mul_pd(a, b), 4) }
        fn div_d(a: Self::D, b: Self::D) -> Self::D { halves!(_mm256_div_pd(a, b), 4) }
        fn sqrt_d(a: Self::D) -> Self::D { halves!(_mm256_sqrt_pd(a), 4) }
        fn abs_d(a: Self::D) -> Self::D {
            let sign = [_mm256_set1_pd(-0.0); 4];
            halves!(_mm256_andnot_pd(sign, a), 4)
        }
        fn max_d(a: Self::D, b: Self::D) -> Self::D { halves!(_mm256_max_pd(a, b), 4) }
        fn le_d(a: Self::D, b: Self::D) -> Mask {
            let low = _mm256_movemask_pd(_mm256_cmp_pd::<_CMP_LE_OQ>(a[0], b[0]))
                | _mm256_movemask_pd(_mm256_cmp_pd::<_CMP_LE_OQ>(a[1], b[1])) << 4;
            let high = _mm256_movemask_pd(_mm256_cmp_pd::<_CMP_LE_OQ>(a[2], b[2]))
                | _mm256_movemask_pd(_mm256_cmp_pd::<_CMP_LE_OQ>(a[3], b[3])) << 4;
            (low | high << 8) as Mask
        }
        fn sqrt(a: Self::F) -> Self::F { halves!(_mm256_sqrt_ps(a)) }
        fn truncate(a: Self::F) -> Self::U { halves!(_mm256_cvttps_epi32(a)) }
        fn to_f(a: Self::U) -> Self::F { halves!(_mm256_cvtepi32_ps(a)) }
        fn to_bits(a: Self::F) -> Self::U { halves!(_mm256_castps_si256(a)) }
        fn float_of(a: Self::U) -> Self::F { halves!(_mm256_castsi256_ps(a)) }
        fn add_u(a: Self::U, b: Self::U) -> Self::U { halves!(_mm256_add_epi32(a, b)) }
        fn mul_u(a: Self::U, b: Self::U) -> Self::U { halves!(_mm256_mullo_epi32(a, b)) }
        fn and_u(a: Self::U, b: Self::U) -> Self::U { halves!(_mm256_and_si256(a, b)) }
        fn or_u(a: Self::U, b: Self::U) -> Self::U { halves!(_mm256_or_si256(a, b)) }
        fn xor_u(a: Self::U, b: Self::U) -> Self::U { halves!(_mm256_xor_si256(a, b)) }
        fn shl_u(a: Self::U, bits: u32) -> Self::U {
            let bits = [_mm256_set1_epi32(bits as i32); 2];
            halves!(_mm256_sllv_epi32(a, bits))
        }
        fn shr_u(a: Self::U, bits: u32) -> Self::U {
            let bits = [_mm256_set1_epi32(bits as i32); 2];
            halves!(_mm256_srlv_epi32(a, bits))
        }
        fn eq_u(a: Self::U, b: Self::U) -> Mask {
            let [low, high] = halves!(_mm256_cmpeq_epi32(a, b));
            bits_of(_mm256_castsi256_ps(low), _mm256_castsi256_ps(high))
        }
        fn gather(from: &[f32], indices: Self::U) -> Self::F {
            let last = _mm256_set1_epi32(last_index(from.len()) as i32);
            let (low, high) = (_mm256_min_epu32(indices[0], last), _mm256_min_epu32(indices[1], last));
            [_mm256_i32gather_ps::<4>(from.as_ptr(), low), _mm256_i32gather_ps::<4>(from.as_ptr(), high)]
        }
        fn gather_u(from: &[u32], indices: Self::U) -> Self::U {
            let last = _mm256_set1_epi32(last_index(from.len()) as i32);
            let (low, high) = (_mm256_min_epu32(indices[0], last), _mm256_min_epu32(indices[1], last));
            let from = from.as_ptr().cast();
            [_mm256_i32gather_epi32::<4>(from, low), _mm256_i32gather_epi32::<4>(from, high)]
        }
        fn compress(mask: Mask, a: Self::F) -> Self::F {
            let [low, high] = compress(mask, [_mm256_castps_si256(a[0]), _mm256_castps_si256(a[1])]);
            [_mm256_castsi256_ps(low), _mm256_castsi256_ps(high)]
        }
        fn compress_u(mask: Mask, a: Self::U) -> Self::U { compress(mask, a) }
    }
}
