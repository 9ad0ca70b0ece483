//! The items that most programs that render a scene need: `use firstlight::prelude::*`.

pub use crate::embed::{Error, Flow, Image, RenderOptions, Scene};
pub use crate::frame::{Command, Denoising, Progress, Session, SessionOptions, Stage, Target, write_film};
pub use crate::mesh::{Mesh, MeshError};
pub use crate::render::{Display, ErrorMetric, Integrator, PixelFilter, RenderSettings, SampleAllocation};
pub use crate::scene::{
    ColorParam, DirectionalLight, DisplaySettings, FilmSize, Hidden, Lens, Material, MaterialSlots, Placement,
    PointLight, Projection, Rendering, ScalarParam, SceneEnvironment, SceneSource, Shape, SpotLight, SurfaceMaterial,
    View,
};
// The crate too: its derive macros name it.
pub use bevy_ecs;
pub use bevy_ecs::prelude::{Component, Entity, IntoScheduleConfigs, Name, Query, Res, ResMut, Resource, World};
pub use glam::{DVec3, Vec3};
