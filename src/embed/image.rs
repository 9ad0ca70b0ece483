//! A rendered image, as numbers or as a file.

use crate::embed::Error;
use crate::files::whole_file::Replace;
use crate::frame::{OfflineReport, Print};
use crate::render::{Display, ErrorEstimate, Film};
use crate::scene::{ImageSamples, MetadataDraft, Warning, Warnings};
use std::path::Path;

/// A rendered image.
#[derive(Debug)]
pub struct Image {
    film: Film,
    /// Linear Rec. 709, row by row from the top, red, green and blue interleaved.
    pixels: Vec<f32>,
    display: Display,
    metadata: MetadataDraft,
    report: OfflineReport,
    warnings: Warnings,
}

impl Image {
    pub(super) fn new(
        film: Film,
        display: Display,
        metadata: MetadataDraft,
        report: OfflineReport,
        warnings: Warnings,
    ) -> Self {
        let pixels = (0..film.height()).flat_map(|y| film.row(y)).flat_map(|rgb| rgb.to_array()).collect();
        Self { film, pixels, display, metadata, report, warnings }
    }

    /// Width in pixels.
    pub fn width(&self) -> u32 {
        self.film.width()
    }

    /// Height in pixels.
    pub fn height(&self) -> u32 {
        self.film.height()
    }

    /// Mean radiance: linear Rec. 709, not clamped, row by row from the top, three numbers per pixel.
    pub fn pixels(&self) -> &[f32] {
        &self.pixels
    }

    /// The smallest number of samples that any pixel has.
    pub fn spp(&self) -> u32 {
        self.film.spp()
    }

    /// The estimated relative error of the whole image; `None` with too few samples.
    pub fn error(&self) -> Option<ErrorEstimate> {
        self.film.error_estimate()
    }

    /// Elapsed seconds, rays traced, and samples that were left out.
    pub fn report(&self) -> &OfflineReport {
        &self.report
    }

    /// Objects of the world that could not be rendered, each with the reason.
    pub fn warnings(&self) -> &[Warning] {
        &self.warnings
    }

    /// The exact sums and counts behind the pixels.
    pub fn film(&self) -> &Film {
        &self.film
    }

    /// Saves the image: `.png` in 8 bits with exposure and tone curve applied, `.exr` as unmodified 32-bit floats. The
    /// file carries the scene and the camera, so [`Scene::open`](crate::embed::Scene::open) can open it again. An existing
    /// file of that name is replaced, unless it is a film.
    ///
    /// # Errors
    /// If the extension is neither of the two, or the file cannot be written.
    pub fn save(&self, path: impl AsRef<Path>) -> Result<(), Error> {
        let (path, size) = (path.as_ref(), (self.width(), self.height()));
        let uneven = self.film.is_uneven();
        let samples = ImageSamples { first: self.film.first_sample(), spp: self.film.spp(), uneven };
        let note = self.metadata.note(path, size, samples, self.display.into());
        let print = Print { film: &self.film, display: &self.display, size, note: Some(&note), denoised: None };
        Ok(print.write(path, Replace::AllButFilms)?)
    }
}
