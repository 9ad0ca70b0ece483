//! Requests for meshes and models, and their results.

use crate::mesh::{Deviation, Mesh};
use crate::scene::{LoadedScene, MeshBase, MeshOptions, MeshSource, SceneError, load_model};
use bevy_ecs::prelude::{Component, Entity};
use glam::DVec3;
use std::path::PathBuf;
use std::sync::Arc;

/// Deviation of a simplified mesh from the full one.
#[derive(Component, Clone, Copy, Debug, PartialEq)]
pub struct MeshMeasure {
    /// Triangles of the full mesh.
    pub whole_faces: usize,
    /// Triangles of the simplified mesh.
    pub faces: usize,
    /// Deviation between the two surfaces; `None` for the full mesh.
    pub deviation: Option<Deviation>,
}

/// Sample points per direction of the measured distance: its mean is accurate to about one per cent.
const SAMPLES: usize = 20_000;

/// A request for a mesh.
#[derive(Clone, Debug)]
pub struct Remake {
    pub for_whom: ForWhom,
    pub source: MeshSource,
    pub options: MeshOptions,
    /// Revision of the history at the time of the request.
    pub revision: u64,
    pub folder: PathBuf,
}

#[derive(Clone, Copy, Debug, PartialEq)]
pub enum ForWhom {
    Object(Entity),
    /// A new object at this position, of this size, metres.
    NewObject {
        place: DVec3,
        size: f64,
    },
}

/// A finished request.
pub struct Remade {
    pub job: Remake,
    pub result: Result<Made, SceneError>,
}

/// What was made.
pub enum Made {
    Mesh(Arc<Mesh>, MeshMeasure),
    /// A model for new objects.
    Model(Box<LoadedScene>),
}

impl Remake {
    /// Makes what is wanted; `base` caches the full mesh from one request to the next.
    pub fn run(&self, base: &mut Option<MeshBase>) -> Result<Made, SceneError> {
        match self.for_whom {
            ForWhom::Object(_) => self.mesh(base),
            ForWhom::NewObject { .. } => Ok(Made::Model(Box::new(load_model(&self.source, &self.folder)?))),
        }
    }

    fn mesh(&self, base: &mut Option<MeshBase>) -> Result<Made, SceneError> {
        let known = base.take().filter(|base| base.serves(&self.source, self.options, &self.folder));
        let whole = match known {
            Some(base) => base,
            None => MeshBase::read(&self.source, self.options, &self.folder)?,
        };
        let mesh = whole.finish(self.options);
        let measured = mesh.map(|mesh| {
            let deviation = self.options.simplify.map(|_| Deviation::between(whole.mesh(), &mesh, SAMPLES));
            let (whole_faces, faces) = (whole.mesh().triangles.len(), mesh.triangles.len());
            Made::Mesh(Arc::new(mesh), MeshMeasure { whole_faces, faces, deviation })
        });
        *base = Some(whole);
        measured
    }

    /// Title for messages.
    pub fn title(&self) -> String {
        let name = self.source.name();
        match self.for_whom {
            ForWhom::Object(_) => format!("simplifying {name}"),
            ForWhom::NewObject { .. } => format!("loading {name}"),
        }
    }
}
