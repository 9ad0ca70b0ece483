//! The scene file: RON text to [`SceneFile`] and back.
//!
//! Reading has three steps, each with errors that give line and column: syntax and field names ([`SceneFile::parse`]),
//! values and limits (`check`), and, in the loader, the files that the scene refers to. Metres, right-handed, Y up,
//! linear Rec. 709 colours, degrees for angles; paths relative to the scene file.

pub(crate) mod animation;
pub(crate) mod bad_value;
pub(crate) mod bounds;
pub(crate) mod builtin;
pub(crate) mod camera;
pub(crate) mod check;
pub(crate) mod check_animation;
pub(crate) mod choice;
pub(crate) mod error;
pub(crate) mod expected;
pub(crate) mod film_size;
pub(crate) mod key;
pub(crate) mod light;
pub(crate) mod locate;
pub(crate) mod material_property;
pub(crate) mod material_textures;
pub(crate) mod model_format;
pub(crate) mod names;
pub(crate) mod numbers;
pub(crate) mod parts;
pub(crate) mod paths;
pub(crate) mod placement;
pub(crate) mod property;
pub(crate) mod property_get;
pub(crate) mod property_set;
pub(crate) mod source;
pub(crate) mod sources;
pub(crate) mod syntax;
pub(crate) mod units;
pub(crate) mod value;
pub(crate) mod view;

pub use crate::format::bounds::check_film_size;
pub use crate::format::value::Named;
pub use animation::{AnimationPart, EditedPart, TrackPart};
pub use camera::CameraPart;
pub use locate::locate;
pub use parts::{
    DisplayPart, FilmPart, InFile, LightPart, MaterialPart, ObjectPart, RadiiPart, ScalePart, SceneFile, TransformPart,
    ball_grid,
};

use crate::files::input_file::BYTE_ORDER_MARK;
use crate::format::error::{Problem, SceneError};
use ron::extensions::Extensions;
use std::path::Path;

impl SceneFile {
    /// Maximum number of spheres of one grid.
    pub const MAX_GRID_BALLS: u64 = 4_000_000;

    /// Maximum number of spheres in all grids together.
    pub const MAX_BALLS: u64 = 4 * Self::MAX_GRID_BALLS;

    /// Maximum number of ratios to which one mesh is simplified.
    pub const MAX_RATIOS: usize = 256;
    /// Maximum number of pixels along one side of a film.
    pub const MAX_FILM_SIDE: u32 = 65_536;
    /// Maximum number of pixels of a film: it takes 88 bytes per pixel, 22 GiB in all.
    pub const MAX_FILM_PIXELS: u64 = 1 << 28;
    /// Largest coordinate in metres: beyond it, squared distances leave the range of `f32`.
    pub const MAX_COORDINATE: f64 = 1e12;
    /// Smallest size in metres: below it, squared sizes leave the range of `f32`.
    pub const MIN_SIZE: f64 = 1e-12;

    /// Parses and checks the text of a scene file; `name` is used in messages.
    ///
    /// # Errors
    /// The problems of the text, with line and column where known.
    pub fn parse(text: &str, name: impl AsRef<Path>) -> Result<Self, SceneError> {
        let name = name.as_ref();
        let text = text.strip_prefix(BYTE_ORDER_MARK).unwrap_or(text);
        let file: Self = options().from_str(text).map_err(|error| syntax::explain(&error, text, name))?;
        let found = check::check(&file, SceneError::MAX_TOLD);
        let problem =
            |(path, message): (String, _)| Problem { file: Some(name.into()), at: Some(locate(text, &path)), message };
        let problems: Vec<Problem> = found.told.into_iter().map(problem).collect();
        if problems.is_empty() { Ok(file) } else { Err(SceneError::of(problems, found.untold, Some(name))) }
    }

    /// Converts the scene to text; parsing it gives an equal value.
    pub fn to_ron(&self) -> String {
        let pretty = ron::ser::PrettyConfig::new()
            .depth_limit(3)
            .indentor("    ")
            .extensions(Extensions::IMPLICIT_SOME)
            .compact_arrays(true);
        // Serialising plain data cannot fail.
        options().to_string_pretty(self, pretty).expect("a scene file is plain data") + "\n"
    }

    /// Checks the values.
    ///
    /// # Errors
    /// The problems, without positions.
    pub fn check(&self) -> Result<(), SceneError> {
        let found = check::check(self, SceneError::MAX_TOLD);
        let problem = |(path, message)| Problem { file: None, at: None, message: format!("{path}: {message}") };
        let problems: Vec<Problem> = found.told.into_iter().map(problem).collect();
        if problems.is_empty() { Ok(()) } else { Err(SceneError::of(problems, found.untold, None)) }
    }
}

fn options() -> ron::Options {
    ron::Options::default().with_default_extension(Extensions::IMPLICIT_SOME)
}
