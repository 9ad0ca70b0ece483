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
mod background;
mod camera_path;
mod command;
mod cryptomatte;
mod denoising;
mod edit;
mod explain;
mod feature_layers;
mod film_file;
mod focus;
pub mod gizmo;
mod history;
mod input;
mod latency;
mod layered_picture;
pub mod navigation;
mod offline;
mod picture_file;
mod recording;
mod recovery;
mod reload;
mod remake;
mod remesh;
mod replay;
mod reset;
mod resources;
mod rig;
mod saving;
mod scene_bounds;
mod scene_cameras;
mod scheduler;
mod selection;
mod session;
mod settings;
mod status;
mod systems;
mod views;
mod watch;
mod worker;

pub use camera_path::{along, turntable};
pub use command::Command;
pub use denoising::{DenoiseFilter, Denoising};
pub use edit::{Edit, Id, NewThing, Property, sky_strength, textures};
pub use explain::{End, Explaining, LightRow, PathRecord, PixelStory, SeenObject, SnapshotNames, Stop, brightness};
pub use feature_layers::{FeatureLayers, FeatureNames};
pub use film_file::{
    FilmError, FilmFile, FilmProblem, FilmSummary, check_film_source, check_replaced_film, read_film_file,
    read_film_file_within, read_film_summary, write_film_file, write_film_into, write_film_with_features,
};
pub use focus::{Focus, FocusTarget, SharpZone, f_number, f_number_decimals, f_stop, radius_of_f_stop, sharp_zone};
pub use history::History;
pub use latency::LatencyHistogram;
pub use layered_picture::{LayeredPicture, PictureLayer};
pub use offline::{
    OfflineReport, Progress, Target, render_measured_until, render_offline, render_offline_until, render_region_until,
};
pub use picture_file::{PictureFormat, Print, write_errors, write_film};
pub use recording::check_recordable;
pub use recovery::{LeftBehind, Recovery};
pub use remake::MeshMeasure;
pub use remesh::wanted_mesh;
pub use replay::{ReplayOptions, Replayed, replay};
pub use reset::{Change, Changes, Level, compare, compare_settings};
pub use resources::{CurrentScene, FrameChanges, Hidden, Paused, PictureSize, RenderRegion, StopAt, Threads, ViewMode};
pub use saving::SavedAs;
pub use scene_bounds::SceneBounds;
pub use scheduler::{RenderStep, Scheduler, StepReport};
pub use selection::{OwnBox, Picked, Projector, Selection, pick};
pub use session::{Session, SessionError, SessionOptions, Stage};
pub use settings::{Navigation, SceneBookmarks, Settings, SettingsStore};
pub use status::{Message, MessageKind, Picture, Status};
pub use views::{Bookmarks, ViewTrail};
pub use worker::{ViewOptions, Waker};
