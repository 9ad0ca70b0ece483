//! `--layers`: additional layers of an EXR image.

use crate::cli::console::remark;
use crate::cli::failure::Failure;
use clap::builder::PossibleValue;
use clap::{Args, ValueEnum};
use firstlight::frame::{FeatureLayers, PictureLayer};
use firstlight::render::Film;

/// Layers of an image.
#[derive(Args, Clone, Debug, Default)]
pub struct LayerArgs {
    /// Layers of an .exr image besides its light, such as albedo,normal,depth, or all
    ///
    /// A film that is saved as well keeps them, for --resume and `firstlight merge`.
    #[arg(long, value_name = "NAMES", value_delimiter = ',', value_enum, help_heading = "Output")]
    layers: Vec<LayerArg>,
}

/// One layer, or all of them.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct LayerArg(Option<PictureLayer>);

impl ValueEnum for LayerArg {
    fn value_variants<'a>() -> &'a [Self] {
        const VARIANTS: [LayerArg; PictureLayer::ALL.len() + 1] = {
            let mut variants = [LayerArg(None); PictureLayer::ALL.len() + 1];
            let mut i = 0;
            while i < PictureLayer::ALL.len() {
                variants[i + 1] = LayerArg(Some(PictureLayer::ALL[i]));
                i += 1;
            }
            variants
        };
        &VARIANTS
    }

    fn to_possible_value(&self) -> Option<PossibleValue> {
        let (name, help) = self.0.map_or(("all", "All of these"), |layer| (layer.name(), layer.help()));
        Some(PossibleValue::new(name).help(help))
    }
}

impl LayerArg {
    /// The layers of this name.
    fn layers(&self) -> &[PictureLayer] {
        self.0.as_ref().map_or(&PictureLayer::ALL, std::slice::from_ref)
    }
}

impl LayerArgs {
    /// Turns `--denoise` into the layer `denoised`, if there are layers: the light of an image with layers stays raw.
    pub fn denoise(&mut self, denoise: &mut bool) {
        if !self.is_empty() && std::mem::take(denoise) {
            self.layers.push(LayerArg(Some(PictureLayer::Denoised)));
        }
    }

    /// Whether no layer is requested.
    pub fn is_empty(&self) -> bool {
        self.layers.is_empty()
    }

    /// All that are requested, in the order of the first mention.
    fn wanted(&self) -> Vec<PictureLayer> {
        let mut wanted = Vec::new();
        for &layer in self.layers.iter().flat_map(LayerArg::layers) {
            if !wanted.contains(&layer) {
                wanted.push(layer);
            }
        }
        wanted
    }

    /// Whether a layer needs feature buffers.
    pub fn have_features(&self) -> bool {
        self.wanted().into_iter().any(PictureLayer::is_feature)
    }

    pub fn has_denoised(&self) -> bool {
        self.wanted().contains(&PictureLayer::Denoised)
    }

    pub fn has_error(&self) -> bool {
        self.wanted().contains(&PictureLayer::Error)
    }

    /// Checks the combination of layers; called before rendering.
    pub fn check(&self) -> Result<(), Failure> {
        use PictureLayer::{Albedo, Depth, Normal, Position, Variance};
        let wanted = self.wanted();
        if wanted.contains(&Variance) && ![Albedo, Normal, Depth, Position].iter().any(|one| wanted.contains(one)) {
            let message = "--layers: variance goes with others: add albedo, normal, depth or position";
            return Err(Failure::Usage(message.to_owned()));
        }
        Ok(())
    }

    /// The layers that this film can have; warns if its error cannot be estimated yet.
    pub fn of(&self, film: &Film) -> Vec<PictureLayer> {
        let error_known = film.error_estimate().is_some();
        if self.has_error() && !error_known {
            remark(format_args!("warning: the image has no layer `error`: every pixel needs two samples for it"));
        }
        self.wanted().into_iter().filter(|layer| *layer != PictureLayer::Error || error_known).collect()
    }

    /// Fails if feature layers are requested but the film was rendered without them.
    pub fn check_kept(&self, features: Option<&FeatureLayers>) -> Result<(), Failure> {
        if self.have_features() && features.is_none() {
            let message = "the films have no such layers: render one of them with --film and the same --layers";
            return Err(Failure::Failed(message.to_owned()));
        }
        Ok(())
    }
}
