//! The scene file: RON text to [`SceneFile`] and back.
//!
//! Reading has three steps, each with errors that give line and column: syntax and field names ([`SceneFile::parse`]),
//! values and limits (`check`), and, in the loader, the files that the scene refers to. Metres, right-handed, Y up,
//! linear Rec. 709 colours, degrees for angles; paths relative to the scene file.

pub mod animation;
pub mod bad_value;
pub mod bounds;
pub mod camera;
pub(crate) mod check;
pub(crate) mod check_animation;
pub mod choice;
mod defaults;
pub mod error;
pub(crate) mod expected;
pub mod film_size;
pub mod key;
pub mod light;
pub mod locate;
pub mod material_property;
pub mod material_textures;
pub mod model_format;
pub mod names;
pub mod numbers;
pub mod parts;
pub mod paths;
pub mod placement;
pub mod property;
pub mod quantity;
pub mod scene_file;
pub mod scene_format;
pub mod sources;
pub(crate) mod syntax;
pub mod units;
pub mod value;
pub mod view;

pub use crate::bounds::check_film_size;
pub use crate::value::Named;
pub use animation::{AnimationPart, EditedPart, ModelMotionPart, TrackPart};
pub use camera::CameraPart;
pub use locate::locate;
pub use parts::{
    FilmPart, InFile, LightPart, MaterialPart, ObjectPart, RadiiPart, ScalePart, TransformPart, ball_grid,
};
pub use scene_file::SceneFile;

use crate::error::{Problem, SceneError};
use firstlight_files::input_file::BYTE_ORDER_MARK;
use ron::extensions::Extensions;
use std::path::Path;

impl SceneFile {
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
