//! Errors of merging and of reading films.

use thiserror::Error;

/// Why two films cannot be merged.
#[derive(Clone, Debug, PartialEq, Eq, Error)]
pub enum MergeError {
    /// Width and height in pixels, of this film and the other.
    #[error("one film has {} x {} pixels, the other {} x {}", .0.0, .0.1, .1.0, .1.1)]
    Sizes((u32, u32), (u32, u32)),
    /// Sides of the tiles in pixels, of this film and the other.
    #[error("one film has tiles of {0}, the other of {1}")]
    TileSizes(u32, u32),
    /// Camera paths per light path, 0 without light paths; of this film and the other.
    #[error(
        "one film has a light path for every {0} camera paths, the other for every {1} (0: none): they were made by \
             different versions or of different views"
    )]
    LightPaths(u32, u32),
    /// The sample numbers that both films have.
    #[error(
        "both films have the samples {first} to {last}: render ranges that do not overlap, such as --samples 0..64 and \
         --samples 64..128"
    )]
    SharedSamples {
        /// Number of the first shared sample.
        first: u32,
        /// Number of the last shared sample.
        last: u32,
    },
}

/// Contradictions in the data of a film that is read.
#[derive(Clone, Debug, PartialEq, Eq, Error)]
pub enum RecordError {
    /// Width, height or tile size is 0.
    #[error("it has no pixels")]
    NoPixels,
    /// A list does not have the length that width, height and tile size require.
    #[error("its parts do not have the size that it names")]
    Size,
    /// A sum is infinite or no number.
    #[error("its sums are not finite")]
    NotFinite,
    /// A tile has more samples per pixel than `u32` can count.
    #[error("it has more samples than can be counted")]
    TooManySamples,
    /// The pixel of a rejected sample lies outside its tile, or a pixel has more rejected samples than samples.
    #[error("its list of samples that were left out is wrong")]
    BadSamples,
    /// The recorded doublings do not match the number of samples.
    #[error("what it knows of its error does not fit its samples")]
    Convergence,
    /// The recorded allocation does not match the samples.
    #[error("its allocation of samples contradicts its samples")]
    Allocation,
    /// The recorded samples per pixel of light tracing contradict its batches.
    #[error("its light from light paths has another number of samples")]
    LightPaths,
    /// Ranges of samples are missing, overlap, touch or have their ends swapped.
    #[error("its ranges of samples overlap or run backwards")]
    Ranges,
    /// A sample has a higher number than a film can hold.
    #[error("its samples have higher numbers than can be counted")]
    Numbers,
}
