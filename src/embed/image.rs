//! A rendered image, as numbers or as a file.

use crate::embed::Error;
use crate::embed::threads::threads;
use crate::files::whole_file::Replace;
use crate::frame::{DenoiseFilter, FeatureLayers, LayeredPicture, OfflineReport, PictureFormat, PictureLayer, Print};
use crate::render::{Denoised, Display, ErrorEstimate, Film, develop, develop_colors};
use crate::scene::{ImageMetadata, ImageSamples, MetadataDraft, Warning, Warnings, WriteError};
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
    features: Option<FeatureLayers>,
    denoised: Option<Denoised>,
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
        Self { film, pixels, display, metadata, report, warnings, features: None, denoised: None }
    }

    pub(super) fn with(self, features: Option<FeatureLayers>, denoised: Option<Denoised>) -> Self {
        Self { features, denoised, ..self }
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

    /// Albedo, normal, depth, position, objects and materials of each pixel; `None` unless the options ask for them.
    pub fn features(&self) -> Option<&FeatureLayers> {
        self.features.as_ref()
    }

    /// The image without most of its noise, with its own error; `None` unless the options ask for it.
    pub fn denoised(&self) -> Option<&Denoised> {
        self.denoised.as_ref()
    }

    /// The bytes of a PNG: exposure and tone curve applied, denoised if the options ask for it, without metadata.
    ///
    /// # Errors
    /// If there is not enough memory.
    pub fn png(&self) -> Result<Vec<u8>, Error> {
        Ok(threads(None)?.install(|| self.print(None).bytes(PictureFormat::Png))?)
    }

    /// The image for a display: sRGB with exposure and tone curve applied, denoised if the options ask for it; four
    /// bytes per pixel, row by row from the top, opaque.
    ///
    /// # Errors
    /// If the threads cannot be started.
    pub fn to_rgba(&self) -> Result<Vec<u8>, Error> {
        let (size, mut rgba) = ((self.width(), self.height()), Vec::new());
        threads(None)?.install(|| match &self.denoised {
            Some(denoised) => develop_colors(&denoised.color, size, &self.display, size, &mut rgba),
            None => develop(&self.film, &self.display, size.0, size.1, &mut rgba),
        });
        Ok(rgba)
    }

    fn print<'a>(&'a self, note: Option<&'a str>) -> Print<'a> {
        let denoised = self.denoised.as_ref().map(|denoised| &denoised.color[..]);
        Print { film: &self.film, display: &self.display, size: (self.width(), self.height()), note, denoised }
    }

    /// Saves the image: `.png` in 8 bits with exposure and tone curve applied, `.exr` as unmodified 32-bit floats; the
    /// denoised one, if the options ask for it. An `.exr` with features has them as layers, and the denoised image as one
    /// more. The file carries the scene and the camera, so [`Scene::open`](crate::embed::Scene::open) can open it again,
    /// unless meshes came from no file. An existing file of that name is replaced, unless it is a film.
    ///
    /// # Errors
    /// If the extension is neither of the two, or the file cannot be written.
    pub fn save(&self, path: impl AsRef<Path>) -> Result<(), Error> {
        let path = path.as_ref();
        threads(None)?.install(|| self.write(path))
    }

    fn write(&self, path: &Path) -> Result<(), Error> {
        let size = (self.width(), self.height());
        let uneven = self.film.is_uneven();
        let samples = ImageSamples { first: self.film.first_sample(), spp: self.film.spp(), uneven };
        let mut note = self.metadata.note(path, size, samples, self.display);
        let is_layered = self.features.is_some() && PictureFormat::of(path)? == PictureFormat::Exr;
        if self.denoised.is_some() {
            let raw = ImageMetadata::from_note(&note).map_err(|error| WriteError::Encode(error.to_string().into()))?;
            note = raw.denoised_by(Some(DenoiseFilter::Own.name().to_owned()), is_layered).to_note();
        }
        if !is_layered {
            return Ok(self.print(Some(&note)).write(path, Replace::AllButFilms)?);
        }
        let is_there = |layer: &PictureLayer| match layer {
            PictureLayer::Error => self.film.error_estimate().is_some(),
            PictureLayer::Denoised => self.denoised.is_some(),
            _ => true,
        };
        let layers: Vec<PictureLayer> = PictureLayer::ALL.into_iter().filter(is_there).collect();
        let denoised = self.denoised.as_ref().map(|denoised| &denoised.color[..]);
        let (film, features) = (&self.film, self.features.as_ref());
        let picture = LayeredPicture { film, features, denoised, layers: &layers, note: Some(&note) };
        Ok(picture.write(path, Replace::AllButFilms)?)
    }
}
