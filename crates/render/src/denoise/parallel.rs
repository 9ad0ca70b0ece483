//! Work on many values at once that can be given up, and a limit that all of it shares.

use bytemuck::{Zeroable, zeroed_vec};
use rayon::prelude::*;

/// Lower limit of the albedo as a divisor, so that light that dark surfaces reflect independently of it is not
/// amplified.
pub(super) const LEAST_ALBEDO: f32 = 0.04;

/// Whether to give up what is being done.
pub(super) type Stop<'a> = &'a (dyn Fn() -> bool + Sync);

/// Number of values between two calls of `stop`: some tenths of a millisecond at most.
pub(super) const AT_ONCE: usize = 256;

/// What `of` returns for 0 up to `n`, in parallel; `None` if `stop` returned true.
pub(super) fn each<T: Zeroable + Send>(n: usize, stop: Stop, of: impl Fn(usize) -> T + Sync) -> Option<Vec<T>> {
    // The system gives zeroed memory when it is written first: what is given up early costs nothing.
    let mut all = zeroed_vec(n);
    fill(&mut all, AT_ONCE, stop, |part, values| {
        values.iter_mut().enumerate().for_each(|(i, value)| *value = of(part * AT_ONCE + i));
    })?;
    Some(all)
}

/// Calls `of` with the number and the values of each part, in parallel; `None` if `stop` returned true.
///
/// - `length`: of a part; the last one may be shorter.
pub(super) fn fill<T: Send>(
    all: &mut [T],
    length: usize,
    stop: Stop,
    of: impl Fn(usize, &mut [T]) + Sync,
) -> Option<()> {
    all.par_chunks_mut(length).enumerate().try_for_each(|(part, values)| {
        go_on(stop)?;
        of(part, values);
        Some(())
    })
}

/// `None` if `stop` returned true.
pub(super) fn go_on(stop: Stop) -> Option<()> {
    (!stop()).then_some(())
}
