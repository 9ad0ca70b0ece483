//! A rendered image, as numbers or as a file.

use super::Error;
use crate::frame::{OfflineReport, Print};
use crate::render::{Display, ErrorEstimate, Film};
use crate::scene::whole_file::Replace;
use crate::scene::{ImageSamples, MetadataDraft};
use std::path::Path;

/// A rendered image.
#[derive(Debug)]
pub struct Image {
    film: Film,
    /// Linear Rec. 709, row by row from the top, red, green and blue after each other.
    pixels: Vec<f32>,
    display: Display,
    metadata: MetadataDraft,
    report: OfflineReport,
    warnings: Vec<String>,
}

impl Image {
    pub(super) fn new(
        film: Film,
        display: Display,
        metadata: MetadataDraft,
        report: OfflineReport,
        warnings: Vec<String>,
    ) -> Self {
        let pixels = (0..film.height()).flat_map(|y| film.row(y)).flat_map(|rgb| rgb.to_array()).collect();
        Self { film, pixels, display, metadata, report, warnings }
    }

    /// Pixels.
    pub fn width(&self) -> u32 {
        self.film.width()
    }

    /// Pixels.
    pub fn height(&self) -> u32 {
        self.film.height()
    }

    /// Mean radiance: linear Rec. 709, not clamped, row by row from the top, three numbers per pixel.
    pub fn pixels(&self) -> &[f32] {
        &self.pixels
    }

    /// Samples that each pixel has at least.
    pub fn spp(&self) -> u32 {
        self.film.spp()
    }

    /// The estimated relative error of the whole image; `None` with too few samples.
    pub fn error(&self) -> Option<ErrorEstimate> {
        self.film.error_estimate()
    }

    /// Seconds, rays, and samples that were left out.
    pub fn report(&self) -> &OfflineReport {
        &self.report
    }

    /// Objects of the world that could not be rendered, and why.
    pub fn warnings(&self) -> &[String] {
        &self.warnings
    }

    /// The exact sums and counts behind the pixels.
    pub fn film(&self) -> &Film {
        &self.film
    }

    /// Saves the image: `.png` with exposure and tone curve, 8 bits; `.exr` as it is, 32-bit floats. The file carries
    /// scene and camera, so [`Scene::open`](super::Scene::open) opens it again. A file of that name is replaced, unless it
    /// is a film.
    ///
    /// # Errors
    /// When the extension is neither, or the file cannot be written.
    pub fn save(&self, path: impl AsRef<Path>) -> Result<(), Error> {
        let (path, size) = (path.as_ref(), (self.width(), self.height()));
        let uneven = self.film.max_spp() > self.film.spp();
        let samples = ImageSamples { first: self.film.first_sample(), spp: self.film.spp(), uneven };
        let note = self.metadata.note(path, size, samples, self.display.into());
        let print = Print { film: &self.film, display: &self.display, size, note: Some(&note) };
        Ok(print.write(path, Replace::AllButFilms)?)
    }
}
