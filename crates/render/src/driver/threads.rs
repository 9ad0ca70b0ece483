//! Threads that have the stack that rendering needs.

use rayon::ThreadPoolBuilder;

/// Bytes of stack per worker. Without optimisation, the frames of shading kernels for sixteen lanes exceed the two
/// megabytes that threads have by default. Only what is touched is ever taken from memory.
const STACK: usize = 16 << 20;

/// Returns a builder of rayon pools whose workers have enough stack to render in a build of any optimisation.
///
/// One worker per processor, unless [`ThreadPoolBuilder::num_threads`] says otherwise.
pub fn worker_threads() -> ThreadPoolBuilder {
    ThreadPoolBuilder::new().stack_size(STACK)
}
