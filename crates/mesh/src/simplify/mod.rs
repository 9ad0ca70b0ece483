//! Mesh simplification by edge collapses.
//!
//! Both methods collapse edges one after another, cheapest first, under the same checks: a closed manifold remains one;
//! borders, texture seams, creases and material edges remain lines; no triangle folds over or loses its area; normals
//! and texture coordinates are kept. Parts of a mesh that are not manifold are left unchanged.
//!
//! | file | what it does |
//! |---|---|
//! | `prepare` | welds the mesh, determines the kind of each vertex, sums its quadrics |
//! | `surface` | connectivity, checks, the collapse itself |
//! | `greedy`, `queue`, `quadric` | the quadric method on one thread |
//! | `parts` | the quadric method on all threads |
//! | `melax`, `heap` | Melax's method |
//! | `assemble` | the mesh of what remains |
//!
//! Start reading at [`simplify`].

mod assemble;
mod greedy;
mod heap;
mod melax;
mod parts;
mod prepare;
mod quadric;
mod queue;
mod surface;

use super::{Deviation, Mesh};
use assemble::assemble;
use greedy::CollapseLimits;
use prepare::PreparedMesh;

/// The cost of an edge.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Method {
    /// Quadric error metric with optimal positions (Garland and Heckbert 1997): the most accurate, and parallel.
    #[default]
    Quadric,
    /// Edge length times bend (Melax 1998): vertices keep their positions; single-threaded.
    Melax,
}

/// When to stop.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Target {
    /// Keep at most this share of the triangles, `(0, 1]`.
    Ratio(f64),
    /// Keep at most this many triangles, at least 1.
    Faces(usize),
    /// Keep as few triangles as possible within this largest distance between the two surfaces, metres, above 0.
    Error(f64),
}

/// Reasons why a mesh cannot be simplified.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
pub enum SimplifyError {
    /// [`Target::Ratio`] is outside `(0, 1]` or NaN.
    #[error("the ratio of triangles to keep must be above 0 and at most 1, not {0}")]
    Ratio(f64),
    /// [`Target::Faces`] is 0.
    #[error("at least one triangle must be kept")]
    NoFaces,
    /// [`Target::Error`] is not above 0, or not finite.
    #[error("the largest error must be a length above 0, not {0}")]
    Error(f64),
    /// No triangle has three corners at different positions.
    #[error("the mesh has no triangle with three different corners")]
    Degenerate,
}

/// Sample points per direction for measuring the error.
const ERROR_SAMPLES: usize = 100_000;

/// Collapses edges until the target is reached or no further collapse is allowed.
///
/// The result has normals and texture coordinates if the mesh has them. Without either, vertices at one place are
/// welded. The same mesh and options give the same bytes with any number of threads.
///
/// # Errors
/// As [`check_target`], and when no triangle has three different corners.
pub fn simplify(mesh: &Mesh, method: Method, target: Target) -> Result<Mesh, SimplifyError> {
    check_target(target)?;
    let total = mesh.triangles.len();
    let faces = match target {
        Target::Ratio(ratio) => ((total as f64 * ratio) as usize).max(1),
        Target::Faces(faces) => faces,
        Target::Error(error) => return within_error(mesh, method, error),
    };
    let mut prepared = prepare(mesh, method)?;
    run(&mut prepared, method, faces, f64::INFINITY);
    Ok(assemble(&prepared, mesh))
}

/// Checks that the target is in range, independent of a mesh.
///
/// # Errors
/// If the target is out of range.
pub fn check_target(target: Target) -> Result<(), SimplifyError> {
    match target {
        Target::Ratio(ratio) if !(ratio > 0.0 && ratio <= 1.0) => Err(SimplifyError::Ratio(ratio)),
        Target::Faces(0) => Err(SimplifyError::NoFaces),
        Target::Error(error) if !(error > 0.0 && error.is_finite()) => Err(SimplifyError::Error(error)),
        _ => Ok(()),
    }
}

fn prepare(mesh: &Mesh, method: Method) -> Result<PreparedMesh, SimplifyError> {
    let prepared = PreparedMesh::of(mesh, method == Method::Quadric);
    if prepared.triangles.is_empty() { Err(SimplifyError::Degenerate) } else { Ok(prepared) }
}

/// Runs a method on a prepared mesh.
///
/// - `error`: metres; it limits an estimate, which is the root of an edge's mean squared distance (quadric) or its cost
///   (Melax).
fn run(prepared: &mut PreparedMesh, method: Method, faces: usize, error: f64) {
    let error = error * f64::from(prepared.scale);
    match method {
        Method::Quadric => {
            parts::simplify(prepared, CollapseLimits { faces, cost: f32::INFINITY, mean_square: error * error });
        }
        Method::Melax => melax::simplify(prepared, faces, error as f32),
    }
}

/// Varies the limit on the estimate until the measured error is within `error`. The estimate is a mean, so the first
/// limit may be too large.
fn within_error(mesh: &Mesh, method: Method, error: f64) -> Result<Mesh, SimplifyError> {
    let start = prepare(mesh, method)?;
    let (mut best, mut limit) = (mesh.clone(), error);
    let (mut works, mut fails) = (0.0, f64::INFINITY);
    for _ in 0..8 {
        let mut work = start.clone();
        run(&mut work, method, 1, limit);
        let candidate = assemble(&work, mesh);
        let measured = Deviation::between(mesh, &candidate, ERROR_SAMPLES).max();
        if measured <= error {
            works = limit;
            if candidate.triangles.len() < best.triangles.len() {
                best = candidate;
            }
        } else {
            fails = limit;
        }
        // The best limit lies between one that works and one that fails; until both are known, extrapolate.
        limit = match (works, fails) {
            (0.0, _) => limit * (0.9 * error / measured).min(0.5),
            (_, f64::INFINITY) => 2.0 * limit,
            _ => 0.5 * (works + fails),
        };
    }
    Ok(best)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::procedural::{DisplacedSphere, displaced_sphere};

    #[test]
    fn many_parts_are_as_accurate_as_one_queue() {
        let mesh = displaced_sphere(&DisplacedSphere { frequency: 50, ..DisplacedSphere::default() });
        let rms = |parts: usize| {
            let mut prepared = PreparedMesh::of(&mesh, true);
            let limits =
                CollapseLimits { faces: mesh.triangles.len() / 5, cost: f32::INFINITY, mean_square: f64::INFINITY };
            parts::simplify_in(mesh.triangles.len() / parts, &mut prepared, limits);
            let result = assemble(&prepared, &mesh);
            assert!(result.triangles.len() <= limits.faces && result.triangles.len() + 2 > limits.faces);
            Deviation::between(&mesh, &result, 40_000).rms()
        };
        let one = rms(1);
        for parts in [2, 6, 12] {
            let many = rms(parts);
            assert!(many < 1.05 * one, "{parts} parts: {many}, one queue: {one}");
        }
    }
}
