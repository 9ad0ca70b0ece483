//! The effect of mesh simplification on the image: the difference between the images with the whole and with the
//! simplified mesh.
//!
//! Both images are compared as displayed, including their noise, from one view with one display setting. For another
//! view there is no difference to report until the whole mesh has been seen from it.

use crate::frame::navigation::Rig;
use crate::frame::{Picture, Session, ViewMode, ViewOptions};
use crate::render::Display;
use bevy_ecs::prelude::Entity;

#[derive(Default)]
pub struct PictureChange {
    before: Option<Before>,
    measured: Option<Difference>,
    /// Number of the image compared last.
    seen: u64,
}

/// The image with the whole mesh.
struct Before {
    entity: Entity,
    rig: Rig,
    display: Display,
    picture: Picture,
}

/// Difference of two images of one size.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Difference {
    /// Mean difference of the displayed values, as a fraction of the range from black to white.
    pub mean: f64,
    /// Fraction of the pixels in which some channel differs by more than a twentieth of that range.
    pub plain: f64,
    /// Samples per pixel of the image before, and of the current one.
    pub spp: [u32; 2],
}

impl PictureChange {
    /// Records the image before the mesh of `entity` is rebuilt, if the mesh `is_whole`.
    pub fn begin(&mut self, entity: Entity, is_whole: bool, session: &Session) {
        let picture = session.picture();
        if !is_whole || picture.divider != 1 || !is_plain(session) {
            return;
        }
        let status = session.status();
        let before = Before { entity, rig: status.rig, display: status.display, picture: picture.clone() };
        (self.before, self.measured) = (Some(before), None);
    }

    /// Compares, if there is a new image and it is comparable.
    pub fn follow(&mut self, session: &Session) {
        let picture = session.picture();
        let Some(before) = &self.before else { return };
        if std::mem::replace(&mut self.seen, picture.number) == picture.number {
            return;
        }
        let status = session.status();
        let comparable = is_plain(session) && before.rig == status.rig && before.display == status.display;
        if !comparable {
            self.measured = None;
        } else if picture.divider == 1 && picture.generation != before.picture.generation {
            self.measured = difference(&before.picture, picture);
        }
    }

    /// The difference to the image with the whole mesh of `entity`, if that was seen from this view.
    pub fn of(&self, entity: Entity) -> Option<Difference> {
        self.measured.filter(|_| self.before.as_ref().is_some_and(|before| before.entity == entity))
    }
}

/// Whether the image is shown, without inspection or overlay.
fn is_plain(session: &Session) -> bool {
    let view_mode = session.world().resource::<ViewMode>().0;
    view_mode == ViewOptions { denoising: view_mode.denoising, ..ViewOptions::default() }
}

/// Computes the difference; `None` for images of different sizes.
fn difference(a: &Picture, b: &Picture) -> Option<Difference> {
    let size = (a.width, a.height);
    if size != (b.width, b.height) || a.denoising != b.denoising || a.rgba.len() != b.rgba.len() || a.rgba.is_empty() {
        return None;
    }
    let (mut sum, mut plain) = (0u64, 0u64);
    for (a, b) in a.rgba.chunks_exact(4).zip(b.rgba.chunks_exact(4)) {
        let apart = [0, 1, 2].map(|channel| u32::from(a[channel].abs_diff(b[channel])));
        sum += u64::from(apart[0] + apart[1] + apart[2]);
        plain += u64::from(20 * apart[0].max(apart[1]).max(apart[2]) > 255);
    }
    let n = a.rgba.len() as f64 / 4.0;
    Some(Difference { mean: sum as f64 / (3.0 * 255.0 * n), plain: plain as f64 / n, spp: [a.spp, b.spp] })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::frame::{Command, Edit, MeshMeasure, Selection, SessionOptions, Target};
    use crate::scene::{MeshOptions, SceneSource};
    use std::time::{Duration, Instant};

    #[test]
    fn differences_are_counted_in_shares() {
        let picture = |levels: &[u8], spp| Picture {
            rgba: levels.iter().flat_map(|&level| [level, level, level, 255]).collect(),
            width: levels.len() as u32,
            height: 1,
            spp,
            ..Picture::default()
        };
        let (a, b) = (picture(&[0, 100, 255, 7], 4), picture(&[0, 110, 0, 7], 9));
        let found = difference(&a, &b).unwrap();
        assert!((found.mean - (10.0 + 255.0) / (4.0 * 255.0)).abs() < 1e-12, "{found:?}");
        assert_eq!((found.plain, found.spp), (0.25, [4, 9]));
        assert_eq!(difference(&a, &picture(&[0], 1)), None);
        assert_eq!(difference(&Picture::default(), &Picture::default()), None);
    }

    /// The fewer faces, the larger the difference; from another view there is nothing to compare.
    #[test]
    fn a_coarser_mesh_changes_the_picture_more() {
        let target = Target { spp: Some(16), ..Target::default() };
        let options = SessionOptions { width: 96, height: 64, threads: Some(2), target, ..SessionOptions::default() };
        let mut session = Session::new(options).unwrap();
        session.open(SceneSource::Builtin("gallery".to_owned()));
        let start = Instant::now();
        let mut change = PictureChange::default();
        let settle = |session: &mut Session, change: &mut PictureChange| {
            loop {
                session.update(start.elapsed());
                change.follow(session);
                if session.status().done && session.is_idle() {
                    return;
                }
                assert!(start.elapsed() < Duration::from_secs(120), "{:?}", session.status());
                std::thread::sleep(Duration::from_millis(2));
            }
        };
        settle(&mut session, &mut change);
        let serpent = session.inputs().objects.iter().find(|object| object.name.as_deref() == Some("serpent"));
        let entity = serpent.expect("the gallery has a serpent").entity;
        let coarse = |session: &mut Session, change: &mut PictureChange, ratio, is_whole| {
            change.begin(entity, is_whole, session);
            let edit = Edit::Remesh {
                id: entity.to_bits(),
                options: MeshOptions { simplify: Some(ratio), ..Default::default() },
            };
            session.send(Command::Edit(edit));
            settle(session, change);
            assert!(session.world().get::<MeshMeasure>(entity).is_some());
            change.of(entity)
        };
        let little = coarse(&mut session, &mut change, 0.2, true).expect("the same view");
        let much = coarse(&mut session, &mut change, 0.01, false).expect("the same view");
        assert!(0.0 < little.mean && little.mean < much.mean && much.mean < 0.5, "{little:?} {much:?}");
        assert_eq!(little.spp, [16, 16]);
        assert_eq!(session.world().resource::<Selection>().0, [], "it is not about what is selected");
        session.send(Command::Orbit { yaw_deg: 5.0, pitch_deg: 0.0 });
        assert_eq!(coarse(&mut session, &mut change, 0.02, false), None);
    }
}
