//! The frame: what happens in which order between an input and an image, and on which thread.
//!
//! | stage | system | what it does |
//! |---|---|---|
//! | [`Stage::Input`] | `input` | commands become changes of components |
//! | [`Stage::Edit`] | `edit` | scenes that were loaded in the background replace the current one |
//! | [`Stage::Rebuild`] | `rebuild` | detects changes, rebuilds the affected part of the snapshot |
//! | [`Stage::Reset`] | `reset` | discards invalid samples, and states the reason |
//! | [`Stage::Accumulate`] | `accumulate` | gives the workers their job |
//! | [`Stage::Develop`] | `develop` | passes the display settings to the workers |
//! | [`Stage::Present`] | `present` | fetches finished images |
//!
//! A [`Session`] owns all of it. The workers follow a [`Scheduler`] that knows no threads and no clock.

mod adopt;
mod camera_path;
mod command;
pub(crate) mod core;
mod edit;
mod focus;
pub mod gizmo;
pub(crate) mod image;
mod input;
mod material_preview;
pub mod navigation;
mod object_map;
mod recording;
mod recovery;
mod reel;
mod reload;
mod replay;
mod saving;
mod scene_bounds;
mod scene_cameras;
mod session;
mod settings;
pub(crate) mod state;
mod steer;
mod systems;
mod views;
mod walls;
mod watch;
pub(crate) mod worker;

pub use crate::frame::core::denoising::{DenoiseFilter, Denoising};
pub use crate::frame::core::exposure::usual_exposure;
pub use crate::frame::core::latency::LatencyHistogram;
pub use crate::frame::core::offline::{
    OfflineReport, Progress, Target, render_measured_until, render_offline, render_region_until,
};
pub use crate::frame::core::reset::{Change, Changes, Level, compare, compare_settings};
pub use crate::frame::core::scheduler::{RenderStep, Scheduler, StepReport};
pub use crate::frame::core::status::{Message, MessageKind, Picture, RenderProgress, Status};
pub use crate::frame::edit::remesh::wanted_mesh;
pub use crate::frame::image::feature_layers::{FeatureLayers, FeatureNames};
pub use crate::frame::image::film_file::{
    FilmError, FilmFile, FilmProblem, FilmSummary, check_film_source, check_replaced_film, read_film_file,
    read_film_file_within, read_film_summary, write_film_file, write_film_into, write_film_with_features,
};
pub use crate::frame::image::layered_picture::{LayeredPicture, PictureLayer};
pub use crate::frame::image::picture_file::{
    PictureFormat, Print, is_whole_picture, numbered, write_errors, write_film,
};
pub use crate::frame::image::snapshot_names::SnapshotNames;
pub use crate::frame::state::explain::{
    End, Explaining, LightRow, PathRecord, PixelStory, SeenObject, Stop, brightness,
};
pub use crate::frame::state::history::History;
pub use crate::frame::state::remake::MeshMeasure;
pub use crate::frame::state::resources::{
    CurrentScene, FrameChanges, Paused, PictureSize, PlayRange, RenderRegion, StopAt, Threads, ViewMode, WindowHidden,
};
pub use crate::frame::state::selection::{OwnBox, Picked, Projector, Selection, active_part, pick};
pub use camera_path::{along, turntable};
pub use command::Command;
#[cfg(feature = "cli")]
#[doc(hidden)]
pub use core::oidn;
pub use edit::{Edit, Id, NewThing, Property, PropertyError, set_by_name, sky_strength, textures};
pub use focus::{
    Aperture, Focus, FocusTarget, SharpZone, f_number, f_number_decimals, f_stop, focal_length, radius_of_f_stop,
    sharp_zone, vfov_of_focal_length,
};
pub use material_preview::MaterialPreview;
pub use object_map::{ObjectMap, ObjectMapSource, Outline};
pub use recording::check_recordable;
pub use recovery::{LeftBehind, Recovery};
pub use reel::{OpenReel, Reel, has_left_camera, scene_at};
pub use replay::{ReplayOptions, Replayed, replay};
pub use saving::SavedAs;
pub use scene_bounds::SceneBounds;
pub use session::{Session, SessionError, SessionOptions, Stage};
pub use settings::{LeftView, Navigation, SceneBookmarks, Settings, SettingsStore, scene_name};
pub use views::{Bookmarks, ViewTrail};
pub use worker::{KeptDenoised, KeptFilm, ViewOptions, Waker};
