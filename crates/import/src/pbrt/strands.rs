//! Curves of a scene: neighbours of one material and one transform are one mesh, since hair has a great many.

use crate::pbrt::build::{Builder, Geometry, Item, TooMany};
use crate::pbrt::curves::tube;
use crate::pbrt::params::Params;
use crate::pbrt::shapes::meshed;
use crate::pbrt::state::State;
use firstlight_files::limits::Limits;
use firstlight_files::printable;
use firstlight_format::parts::ObjectPart;
use firstlight_format::sources::{MeshShading, MeshSource};
use glam::{DVec3, Vec2, Vec3};
use std::sync::Arc;

impl Builder<'_> {
    /// A curve, which is shape number `number`.
    pub(super) fn curve(&mut self, params: &Params, state: &State, number: u32) -> Result<(), TooMany> {
        let name = format!("curve {}", u64::from(number) + 1);
        let made = match self.bytes_left {
            0 => Err(format!("there are too many shapes like it: {}", Limits::advice())),
            _ => tube(params),
        };
        let tube = match made {
            Ok(tube) => tube,
            Err(why) => {
                self.tell(format!("`{name}` is left out: {why}"));
                return Ok(());
            }
        };
        let per_vertex = size_of::<DVec3>() + size_of::<Vec3>() + size_of::<Vec2>();
        let bytes = per_vertex * tube.positions.len() + size_of::<[u32; 3]>() * tube.triangles.len();
        self.bytes_left = self.bytes_left.saturating_sub(bytes as u64);
        if state.area_light.is_some() {
            self.tell(format!("`{name}` does not emit light: curves do not here"));
        }
        let opacity = self.opacity(params, &name);
        let Some(material) = self.surface(state, opacity, None, &name) else { return Ok(()) };
        if self.strands.add(number, tube, &material, &state.ctm) {
            return Ok(());
        }
        let geometry = Geometry::Mesh { source: self.shape_source(number), shading: MeshShading::Auto };
        self.add_item(Item { name, geometry, material, local: state.ctm })
    }

    /// Makes the meshes of all curves.
    pub(crate) fn finish_strands(&mut self) {
        for (number, indexed) in self.strands.take() {
            match meshed(indexed, false, self.path, &mut self.warnings) {
                Ok(mesh) => drop(self.parts.insert(number, Arc::new(mesh))),
                Err(why) => {
                    self.tell(format!("`{}` is left out: {why}", printable::name(&format!("curve {}", number + 1))));
                    self.objects.retain(|object| {
                        !matches!(object, ObjectPart::Mesh { source: MeshSource::Part { shape, .. }, .. } if *shape == number)
                    });
                }
            }
        }
    }
}
