//! `--layers`: additional layers of an EXR image.

use super::console::remark;
use super::failure::Failure;
use clap::{Args, ValueEnum};
use firstlight::frame::{FeatureLayers, PictureLayer};
use firstlight::render::Film;

/// Layers of an image.
#[derive(Args, Clone, Debug, Default)]
pub struct LayerArgs {
    /// Layers of an .exr image besides its light, such as albedo,normal,depth
    ///
    /// A film that is saved as well keeps them, for --resume and `firstlight merge`.
    #[arg(long, value_name = "NAMES", value_delimiter = ',', value_enum, help_heading = "Output")]
    layers: Vec<LayerArg>,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum LayerArg {
    /// Colour without light, seen through mirrors and glass.
    Albedo,
    /// Shading normal in world space.
    Normal,
    /// Metres along the view axis.
    Depth,
    /// Metres in world space.
    Position,
    /// Share of samples that see a surface.
    Coverage,
    /// Cryptomatte of objects.
    Object,
    /// Cryptomatte of materials.
    Material,
    /// Variance of albedo, normal, depth and position, of those that are given.
    Variance,
    /// Number of samples of each pixel.
    Samples,
    /// Estimated relative error of each pixel: 0.05 is 5 %.
    Error,
    /// Light without most of its noise: raw and filtered combined.
    Denoised,
}

impl From<LayerArg> for PictureLayer {
    fn from(arg: LayerArg) -> Self {
        match arg {
            LayerArg::Albedo => Self::Albedo,
            LayerArg::Normal => Self::Normal,
            LayerArg::Depth => Self::Depth,
            LayerArg::Position => Self::Position,
            LayerArg::Coverage => Self::Coverage,
            LayerArg::Object => Self::Object,
            LayerArg::Material => Self::Material,
            LayerArg::Variance => Self::Variance,
            LayerArg::Samples => Self::Samples,
            LayerArg::Error => Self::Error,
            LayerArg::Denoised => Self::Denoised,
        }
    }
}

impl LayerArgs {
    /// Whether no layer is requested.
    pub fn is_empty(&self) -> bool {
        self.layers.is_empty()
    }

    /// Whether a layer needs feature buffers.
    pub fn have_features(&self) -> bool {
        self.layers.iter().any(|&layer| PictureLayer::from(layer).is_feature())
    }

    pub fn has_denoised(&self) -> bool {
        self.layers.contains(&LayerArg::Denoised)
    }

    pub fn has_error(&self) -> bool {
        self.layers.contains(&LayerArg::Error)
    }

    /// Checks the combination of layers; called before rendering.
    pub fn check(&self) -> Result<(), Failure> {
        const WITH_VARIANCE: [LayerArg; 4] = [LayerArg::Albedo, LayerArg::Normal, LayerArg::Depth, LayerArg::Position];
        if self.layers.contains(&LayerArg::Variance) && !WITH_VARIANCE.iter().any(|one| self.layers.contains(one)) {
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
        let is_known = |layer: &LayerArg| *layer != LayerArg::Error || error_known;
        self.layers.iter().filter(|layer| is_known(layer)).map(|&layer| layer.into()).collect()
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
