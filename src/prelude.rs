//! The items that most programs that render a scene need: `use firstlight::prelude::*`.

pub use crate::embed::{Error, Flow, Image, RenderOptions, Scene};
pub use crate::frame::{Command, Progress, Session, SessionOptions, Target};
pub use crate::render::{ErrorMetric, Integrator, PixelFilter, SampleAllocation};
pub use crate::scene::{
    ColorParam, DirectionalLight, Lens, Material, MaterialSlots, Placement, PointLight, Projection, ScalarParam,
    SceneEnvironment, Shape, SpotLight, SurfaceMaterial, View,
};
pub use bevy_ecs::prelude::{Entity, Name, World};
pub use glam::{DVec3, Vec3};
