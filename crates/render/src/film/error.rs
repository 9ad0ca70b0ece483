//! What films refuse.

use thiserror::Error;

/// Why two films do not add up.
#[derive(Clone, Debug, PartialEq, Eq, Error)]
pub enum MergeError {
    /// Width and height in pixels, of this film and the other.
    #[error("one film has {} x {} pixels, the other {} x {}", .0.0, .0.1, .1.0, .1.1)]
    Sizes((u32, u32), (u32, u32)),
    /// Pixels along the sides of a tile.
    #[error("one film has tiles of {0}, the other of {1}")]
    TileSizes(u32, u32),
    /// The first and the last of the sample numbers that both have.
    #[error(
        "both films have the samples {first} to {last}: render ranges that do not overlap, such as --samples 0..64 and \
         --samples 64..128"
    )]
    SharedSamples { first: u32, last: u32 },
}

/// What is wrong with the numbers of a film that is read.
#[derive(Clone, Debug, PartialEq, Eq, Error)]
pub enum RecordError {
    #[error("it has no pixels")]
    NoPixels,
    #[error("its parts do not have the size that it names")]
    Size,
    #[error("it has more samples than can be counted")]
    TooManySamples,
    #[error("its list of samples that were left out is wrong")]
    BadSamples,
    #[error("what it knows of its error does not fit its samples")]
    Convergence,
    #[error("its light from light paths has another number of samples")]
    LightPaths,
    #[error("its ranges of samples overlap or run backwards")]
    Ranges,
    #[error("its samples have higher numbers than can be counted")]
    Numbers,
}
