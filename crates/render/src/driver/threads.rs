//! Threads with enough stack for rendering.

use rayon::ThreadPoolBuilder;

/// Stack size per worker in bytes. Without optimisation, which goes with debug assertions, the stack frames of SIMD shading
/// kernels exceed the default of 2 MiB many times. Only touched pages take memory.
const STACK: usize = if cfg!(debug_assertions) { 32 << 20 } else { 16 << 20 };

/// Returns a builder of rayon pools whose workers have enough stack to render at any optimisation level.
///
/// One worker per processor, unless [`ThreadPoolBuilder::num_threads`] says otherwise.
pub fn worker_threads() -> ThreadPoolBuilder {
    ThreadPoolBuilder::new().stack_size(STACK)
}
