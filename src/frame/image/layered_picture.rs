//! Images with layers: one OpenEXR file with radiance in its plain channels and further channels whose names
//! compositing programs know.
//!
//! | layer | channels |
//! |---|---|
//! | radiance | `R`, `G`, `B` |
//! | albedo, and its variance | `albedo.R` …, `albedo_variance.R` … |
//! | normal, position | `normal.X` …, `position.X` … |
//! | depth, coverage, samples, error | `depth.Z`, `coverage.Y`, `samples.Y`, `error.Y` |
//! | denoised radiance | `denoised.R` … |
//! | objects, materials | `CryptoObject00.R` …, `CryptoMaterial00.R` … (Cryptomatte, see [`crate::frame::image::cryptomatte`]) |
//!
//! All channels are 32-bit floats with lossless compression. Start reading at [`LayeredPicture::write`].

use crate::files::whole_file::{Replace, WholeFile, unwritable};
use crate::frame::image::cryptomatte::Cryptomatte;
use crate::frame::image::feature_layers::{FeatureLayers, channels_of};
use crate::frame::image::picture_file::{free_of, mean_channels, numbered};
use crate::render::{Film, Purpose, Room, relative_errors};
use crate::scene::WriteError;
use crate::scene::image_metadata::{NOTE_KEY, exr_channels, exr_text};
use exr::prelude::{
    AnyChannel, AnyChannels, Encoding, FlatSamples, Image, Layer, LayerAttributes, Text, WritableImage,
};
use glam::Vec3;
use std::io::{self, Write};
use std::path::{Path, PathBuf};

/// Depth in metres of pixels without a surface: programs that blur or scale a layer cannot use infinity.
const FAR: f32 = 1e10;

/// Layers of an image besides its radiance.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum PictureLayer {
    /// Albedo, without lighting.
    Albedo,
    /// Shading normal in world space.
    Normal,
    /// Depth along the view axis, metres.
    Depth,
    /// Position in world space, metres.
    Position,
    /// Share of samples that hit a surface.
    Coverage,
    /// Cryptomatte of objects.
    Object,
    /// Cryptomatte of materials.
    Material,
    /// Variances of the means of those of albedo, normal, depth and position that are present.
    Variance,
    /// Samples per pixel.
    Samples,
    /// Estimated relative error per pixel.
    Error,
    /// Denoised radiance.
    Denoised,
}

impl PictureLayer {
    /// All layers.
    pub const ALL: [Self; 11] = [
        Self::Albedo,
        Self::Normal,
        Self::Depth,
        Self::Position,
        Self::Coverage,
        Self::Object,
        Self::Material,
        Self::Variance,
        Self::Samples,
        Self::Error,
        Self::Denoised,
    ];

    /// Name on the command line, in lower case, and what it holds.
    const fn about(self) -> (&'static str, &'static str) {
        match self {
            Self::Albedo => ("albedo", "Colour without light, seen through mirrors and glass"),
            Self::Normal => ("normal", "Shading normal in world space"),
            Self::Depth => ("depth", "Metres along the view axis"),
            Self::Position => ("position", "Metres in world space"),
            Self::Coverage => ("coverage", "Share of samples that see a surface"),
            Self::Object => ("object", "Cryptomatte of objects"),
            Self::Material => ("material", "Cryptomatte of materials"),
            Self::Variance => ("variance", "Variance of albedo, normal, depth and position, of those that are given"),
            Self::Samples => ("samples", "Number of samples of each pixel"),
            Self::Error => ("error", "Estimated relative error of each pixel: 0.05 is 5 %"),
            Self::Denoised => ("denoised", "Light without most of its noise: raw and filtered combined"),
        }
    }

    /// Name for the user, lower case.
    pub fn name(self) -> &'static str {
        self.about().0
    }

    /// What it holds, a phrase.
    pub fn help(self) -> &'static str {
        self.about().1
    }

    /// Returns the layers of an EXR file, an image or a film with feature buffers; empty for other files.
    pub fn in_file(path: &Path) -> Vec<Self> {
        let channels = exr_channels(path).unwrap_or_default();
        let has = |name: &str| channels.iter().any(|channel| channel == name);
        let is_there = |layer: &Self| match layer {
            Self::Albedo => has("albedo.R"),
            Self::Normal => has("normal.X"),
            Self::Depth => has("depth.Z"),
            Self::Position => has("position.X"),
            Self::Coverage => has("coverage.Y"),
            Self::Object => has("CryptoObject00.R") || has("object.id0"),
            Self::Material => has("CryptoMaterial00.R") || has("material.id0"),
            Self::Variance => channels.iter().any(|channel| channel.contains("_variance.")),
            Self::Samples => has("samples.Y"),
            Self::Error => has("error.Y"),
            Self::Denoised => has("denoised.R"),
        };
        Self::ALL.into_iter().filter(is_there).collect()
    }

    /// Whether the layer comes from feature buffers; the others come from the film.
    pub fn is_feature(self) -> bool {
        !matches!(self, Self::Samples | Self::Error | Self::Denoised)
    }
}

/// A film as an image with layers.
#[derive(Clone, Copy)]
pub struct LayeredPicture<'a> {
    /// The film, linear radiance.
    pub film: &'a Film,
    /// Features of the same image; required by layers that are features.
    pub features: Option<&'a FeatureLayers>,
    /// Denoised radiance of each pixel, row by row from the top; required by that layer.
    pub denoised: Option<&'a [Vec3]>,
    /// The requested layers.
    pub layers: &'a [PictureLayer],
    /// Metadata of the image.
    pub note: Option<&'a str>,
}

impl LayeredPicture<'_> {
    /// Writes the image to a temporary file, which then replaces `path`.
    ///
    /// # Errors
    /// If the error layer is requested and not known yet, or the file cannot be written.
    pub fn write(&self, path: &Path, replace: Replace) -> Result<(), WriteError> {
        drop(self.room().map_err(|error| unwritable(path, error))?);
        let channels = self.channels().ok_or_else(|| WriteError::ErrorUnknown(path.to_path_buf()))?;
        let bytes = self.encode(channels).map_err(|error| unwritable(path, error))?;
        let mut out = WholeFile::begin(path, replace)?;
        out.write_all(&bytes).map_err(|error| unwritable(path, error))?;
        out.finish()
    }

    /// Encodes the image as the bytes of a file; `path` is used in errors.
    ///
    /// # Errors
    /// If the error layer is requested and not known yet, or there is not enough memory.
    pub fn bytes(&self, path: &Path) -> Result<Vec<u8>, WriteError> {
        drop(self.room().map_err(WriteError::Memory)?);
        let channels = self.channels().ok_or_else(|| WriteError::ErrorUnknown(path.to_path_buf()))?;
        self.encode(channels).map_err(|error| WriteError::Encode(Box::new(error)))
    }

    /// Writes the image into `folder` as `STEM-0001.exr`, or with the next free number. Returns the path.
    ///
    /// - `taken`: absolute paths of files that are still to be written.
    ///
    /// # Errors
    /// As [`Self::write`], and if no number is free.
    pub fn write_new(&self, folder: &Path, stem: &str, taken: &[PathBuf]) -> Result<PathBuf, WriteError> {
        let mut names = numbered(folder, stem, "exr", taken);
        let path = free_of(&mut names)?;
        let bytes = self.bytes(&path)?;
        let mut out = WholeFile::begin(&path, Replace::AllButFilms)?;
        out.write_all(&bytes).map_err(|error| unwritable(&path, error))?;
        out.finish_new(std::iter::once(path.clone()).chain(names))?.ok_or(WriteError::NoFreeName(path))
    }

    fn room(&self) -> io::Result<Room> {
        Ok(Room::for_files(self.film.width(), self.film.height(), &[Purpose::Layers])?)
    }

    fn has(&self, layer: PictureLayer) -> bool {
        self.layers.contains(&layer)
    }

    /// The requested Cryptomattes.
    fn mattes(&self) -> Vec<Cryptomatte<'_>> {
        let Some(FeatureLayers { buffers, objects, materials }) = self.features else { return Vec::new() };
        let Some(ids) = &buffers.ids else { return Vec::new() };
        let matte = |name, names, shares| Cryptomatte { name, names, shares, samples: buffers.samples };
        let mut mattes = Vec::new();
        if self.has(PictureLayer::Object) {
            mattes.push(matte("CryptoObject", objects, &ids.objects));
        }
        if self.has(PictureLayer::Material) {
            mattes.push(matte("CryptoMaterial", materials, &ids.materials));
        }
        mattes
    }

    /// Names and values of all channels except radiance; `None` if the error is requested and not known.
    fn channels(&self) -> Option<Vec<(String, Vec<f32>)>> {
        let mut channels = Vec::new();
        if let Some(FeatureLayers { buffers, .. }) = self.features {
            for layer in [
                PictureLayer::Albedo,
                PictureLayer::Normal,
                PictureLayer::Depth,
                PictureLayer::Position,
                PictureLayer::Coverage,
            ] {
                if !self.has(layer) {
                    continue;
                }
                channels.extend(channels_of(buffers, layer.name()));
                if self.has(PictureLayer::Variance) && layer != PictureLayer::Coverage {
                    channels.extend(channels_of(buffers, &format!("{}_variance", layer.name())));
                }
            }
        }
        for number in channels.iter_mut().flat_map(|(_, numbers)| numbers).filter(|number| !number.is_finite()) {
            *number = FAR;
        }
        channels.extend(self.mattes().iter().flat_map(Cryptomatte::channels));
        if self.has(PictureLayer::Samples) {
            let (width, height) = (self.film.width(), self.film.height());
            let samples = |i: u32| self.film.samples(i % width, i / width) as f32;
            channels.push(("samples.Y".to_owned(), (0..width * height).map(samples).collect()));
        }
        if self.has(PictureLayer::Error) {
            channels.push(("error.Y".to_owned(), relative_errors(self.film)?));
        }
        if let Some(colors) = self.denoised.filter(|_| self.has(PictureLayer::Denoised)) {
            let channel = |name: &str, c: usize| (name.to_owned(), colors.iter().map(|color| color[c]).collect());
            channels.extend([channel("denoised.R", 0), channel("denoised.G", 1), channel("denoised.B", 2)]);
        }
        Some(channels)
    }

    /// Encodes a whole file in memory, because the encoder seeks.
    fn encode(&self, channels: Vec<(String, Vec<f32>)>) -> Result<Vec<u8>, exr::error::Error> {
        let mut all = mean_channels(self.film);
        all.extend(channels.into_iter().map(|(name, list)| AnyChannel::new(name.as_str(), FlatSamples::F32(list))));
        let mut attributes = LayerAttributes::named(env!("CARGO_PKG_NAME"));
        for (name, value) in self.mattes().iter().flat_map(Cryptomatte::attributes) {
            attributes.other.insert(Text::from(name.as_str()), exr_text(&value));
        }
        let size = (self.film.width() as usize, self.film.height() as usize);
        // Scan lines rather than tiles, and a compression that all programs read.
        let layer = Layer::new(size, attributes, Encoding::SMALL_LOSSLESS, AnyChannels::sort(all));
        let mut image = Image::from_layer(layer);
        if let Some(note) = self.note {
            image.attributes.other.insert(Text::from(NOTE_KEY), exr_text(note));
        }
        let mut memory = std::io::Cursor::new(Vec::new());
        image.write().non_parallel().to_buffered(&mut memory)?;
        let mut bytes = memory.into_inner();
        sort_attributes(&mut bytes);
        Ok(bytes)
    }
}

/// Sorts the attributes of a file with one header by name: the library stores them in a table of random order, and the
/// same image must give the same bytes.
fn sort_attributes(bytes: &mut [u8]) {
    // Length of magic number and version.
    const START: usize = 8;
    let text_end = |from: usize| bytes[from..].iter().position(|&byte| byte == 0).map(|length| from + length);
    let mut attributes = Vec::new();
    let mut at = START;
    while let Some(name_end) = text_end(at).filter(|&end| end > at) {
        // Name, type, size, then that many bytes.
        let Some(size_at) = text_end(name_end + 1).map(|end| end + 1) else { return };
        let Some(size) = bytes.get(size_at..size_at + 4).and_then(|size| size.try_into().ok()) else { return };
        let end = size_at + 4 + u32::from_le_bytes(size) as usize;
        attributes.push(bytes[at..end].to_vec());
        at = end;
    }
    attributes.sort_unstable();
    bytes[START..at].copy_from_slice(&attributes.concat());
}
