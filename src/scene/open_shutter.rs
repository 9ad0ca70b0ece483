//! Scenes that move while the shutter is open: adds motion blur to a snapshot.
//!
//! Nothing is computed in advance: the renderer asks for the snapshot at the time of each sample ([`Extraction::at`]).

use crate::render::{Moments, Prepared};
use crate::scene::animation::Animation;
use crate::scene::animation::moment::Moment;
use crate::scene::extract::Extraction;
use crate::scene::world::inputs::SceneInputs;
use crate::scene::world::trees::Trees;
use bevy_ecs::prelude::World;
use std::ops::RangeInclusive;
use std::sync::Arc;

/// A scene during the exposure of an image.
struct OpenShutter {
    extraction: Extraction,
    animation: Animation,
    inputs: SceneInputs,
    trees: Trees,
    /// The exposure interval, seconds.
    open: RangeInclusive<f64>,
}

impl Moments for OpenShutter {
    fn at(&self, open: f64) -> Prepared {
        let (start, end) = (self.open.start(), self.open.end());
        self.extraction.at(&self.animation, &self.inputs, &self.trees, start + open * (end - start))
    }
}

impl Extraction {
    /// The snapshot of a world, with motion blur if its animation has a shutter.
    pub fn of_world(world: &mut World, inputs: &SceneInputs, trees: &Trees) -> Self {
        let mut extraction = Self::new(inputs, trees);
        let seconds = world.get_resource::<Moment>().copied().unwrap_or_default().0;
        extraction.expose(world.get_resource::<Animation>(), seconds, inputs, trees);
        extraction
    }

    /// Gives the snapshot the motion blur of an image at this time, or removes it if nothing moves in the exposure
    /// interval. To be called again after each change of the snapshot.
    ///
    /// What was edited since the time was set differs from its tracks, and stands still.
    ///
    /// - `seconds`: the time of `inputs`.
    pub fn expose(&mut self, animation: Option<&Animation>, seconds: f64, inputs: &SceneInputs, trees: &Trees) {
        self.prepared = self.prepared.with_moments(None);
        let Some(animation) = animation.filter(|animation| animation.open_shutter(seconds).is_some()) else { return };
        let animation = animation.without(&animation.edited(inputs, seconds));
        let Some(open) = animation.open_shutter(seconds) else { return };
        let (extraction, inputs, trees) = (self.clone(), inputs.clone(), trees.clone());
        let moments = OpenShutter { extraction, animation, inputs, trees, open };
        self.prepared = self.prepared.with_moments(Some(Arc::new(moments)));
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::format::placement::Placement;
    use crate::scene::SceneSource;
    use crate::scene::animation::Shutter;
    use crate::scene::animation::moment::show_moment;
    use crate::scene::load;
    use crate::scene::load::LoadOptions;

    const SCENE: &str = r#"(
        camera: (eye: (0, 0, 5), look_at: (0, 0, 0)),
        materials: {"m": diffuse(albedo: 0.5)},
        objects: [
            sphere(name: "a", center: (0, 0, 0), radius: 1, material: "m"),
            sphere(name: "b", center: (3, 0, 0), radius: 1, material: "m"),
        ],
        animation: (fps: 10, shutter: 0.5, tracks: [
            camera(property: eye, keys: [(0, (0, 0, 5)), (1, (0, 0, 6))]),
            object(name: "a", property: translate, keys: [(1, (0, 0, 0)), (2, (1, 0, 0))]),
        ]),
    )"#;

    fn world() -> (World, Trees) {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("s.ron");
        std::fs::write(&path, SCENE).unwrap();
        let loaded = load(&SceneSource::Scene(path), &LoadOptions::default()).unwrap_or_else(|e| panic!("{e}"));
        let mut world = World::new();
        loaded.spawn(&mut world);
        (world, loaded.trees)
    }

    fn exposed(world: &mut World, trees: &Trees) -> Prepared {
        let inputs = SceneInputs::of(world);
        Extraction::of_world(world, &inputs, trees).prepared
    }

    /// Where the camera and the first sphere are at the ends of the exposure.
    fn ends(prepared: &Prepared) -> [(f32, f32); 2] {
        [0.0, 1.0].map(|open| {
            let moment = prepared.moments().expect("it moves").at(open);
            let crate::kdtree::Shape::Sphere { center, .. } = moment.geometry.tree.shapes()[0] else { panic!() };
            (moment.camera.eye.z, center.x)
        })
    }

    fn close(a: [(f32, f32); 2], b: [(f32, f32); 2]) -> bool {
        a.iter().zip(b).all(|(a, b)| (a.0 - b.0).abs() < 1e-6 && (a.1 - b.1).abs() < 1e-6)
    }

    #[test]
    fn the_exposure_is_centred_at_the_time_of_the_image_and_what_stands_still_pays_nothing() {
        let (mut world, trees) = world();
        show_moment(&mut world, 0.5);
        assert!(close(ends(&exposed(&mut world, &trees)), [(5.475, 0.0), (5.525, 0.0)]));
        show_moment(&mut world, 1.5);
        assert!(close(ends(&exposed(&mut world, &trees)), [(6.0, 0.475), (6.0, 0.525)]));
        show_moment(&mut world, 5.0);
        assert!(exposed(&mut world, &trees).moments().is_none());
        show_moment(&mut world, 1.5);
        world.resource_mut::<Animation>().shutter = Shutter::Share(0.0);
        assert!(exposed(&mut world, &trees).moments().is_none());
    }

    #[test]
    fn what_was_edited_stands_still() {
        let (mut world, trees) = world();
        show_moment(&mut world, 1.5);
        let entity = SceneInputs::of(&mut world).objects[0].entity;
        world.get_mut::<Placement>(entity).unwrap().translation.x = 7.0;
        assert!(exposed(&mut world, &trees).moments().is_none());
        // At another time its track counts again.
        show_moment(&mut world, 1.25);
        assert!(close(ends(&exposed(&mut world, &trees)), [(6.0, 0.225), (6.0, 0.275)]));
    }
}
