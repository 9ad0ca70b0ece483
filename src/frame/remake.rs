//! A mesh to be made anew, and what comes of it.

use crate::mesh::{Deviation, Mesh};
use crate::scene::{MeshBase, MeshShading, MeshSource, SceneError};
use bevy_ecs::prelude::{Component, Entity};
use glam::DVec3;
use std::path::PathBuf;
use std::sync::Arc;

/// How far a simplified mesh is from the whole one.
#[derive(Component, Clone, Copy, Debug, PartialEq)]
pub struct MeshMeasure {
    /// Triangles of the whole mesh.
    pub whole_faces: usize,
    /// Triangles of the simplified mesh.
    pub faces: usize,
    /// Between the two surfaces; `None` for the whole one.
    pub deviation: Option<Deviation>,
}

/// Points for each direction of the measured distance: its mean to about a hundredth.
const SAMPLES: usize = 20_000;

/// What is to be made.
#[derive(Clone, Debug)]
pub struct Remake {
    pub for_whom: ForWhom,
    pub source: MeshSource,
    pub shading: MeshShading,
    pub ratio: f64,
    /// The state of the history that it was asked for in.
    pub revision: u64,
    pub folder: PathBuf,
}

#[derive(Clone, Copy, Debug, PartialEq)]
pub enum ForWhom {
    Object(Entity),
    /// A new object, to stand here, as large as this, metres.
    NewObject {
        place: DVec3,
        size: f64,
    },
}

/// What came of it.
pub struct Remade {
    pub job: Remake,
    pub result: Result<(Arc<Mesh>, MeshMeasure), SceneError>,
}

impl Remake {
    /// Does it; `base` is what the last one was made from, and then what this one was.
    pub fn run(&self, base: &mut Option<MeshBase>) -> Result<(Arc<Mesh>, MeshMeasure), SceneError> {
        let simplify = (self.ratio < 1.0).then_some(self.ratio);
        let known = base.take().filter(|base| base.serves(&self.source, self.shading, simplify, &self.folder));
        let whole = match known {
            Some(base) => base,
            None => MeshBase::read(&self.source, self.shading, simplify, &self.folder)?,
        };
        let mesh = whole.finish(self.shading, simplify);
        let measured = mesh.map(|mesh| {
            let deviation = simplify.map(|_| Deviation::between(whole.mesh(), &mesh, SAMPLES));
            let (whole_faces, faces) = (whole.mesh().triangles.len(), mesh.triangles.len());
            (Arc::new(mesh), MeshMeasure { whole_faces, faces, deviation })
        });
        *base = Some(whole);
        measured
    }

    /// For people.
    pub fn title(&self) -> String {
        let name = self.source.name();
        match self.for_whom {
            ForWhom::Object(_) => format!("simplifying {name}"),
            ForWhom::NewObject { .. } => format!("loading {name}"),
        }
    }
}
