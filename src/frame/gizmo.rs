//! Handles to move, rotate and scale the selection: their positions in the window, which one is under the mouse, and
//! the effect of dragging it. Pure functions: no window, no world.
//!
//! A drag is measured from its start, so its result depends on the current mouse position only.

use crate::frame::state::selection::Projector;
use glam::{DVec2, DVec3};
use std::f64::consts::TAU;

/// Effect of the handles.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Mode {
    /// Moves along axes and in planes.
    #[default]
    Move,
    /// Rotates about axes.
    Turn,
    /// Scales along axes or uniformly.
    Scale,
}

impl Mode {
    /// All modes, in the order of menus.
    pub const ALL: [Self; 3] = [Self::Move, Self::Turn, Self::Scale];

    /// Name for the user, lower case.
    pub fn label(self) -> &'static str {
        match self {
            Self::Move => "move",
            Self::Turn => "rotate",
            Self::Scale => "scale",
        }
    }
}

/// A part of the gizmo that can be grabbed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Handle {
    /// Move or scale along an axis, or rotate about it.
    Axis(usize),
    /// Move in the plane perpendicular to an axis.
    Plane(usize),
    /// Move in the image plane; scale uniformly; rotate about the view axis.
    Middle,
}

/// Total effect of a drag.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Drag {
    /// Translation in world space, metres.
    Move(DVec3),
    /// Rotation about an axis through the centre of the gizmo.
    Turn {
        /// Unit vector in world space.
        axis: DVec3,
        /// Counter-clockwise about the axis, degrees.
        angle_deg: f64,
    },
    /// Scale factors along the axes of the gizmo.
    Scale(DVec3),
}

/// The handles around a point in world space.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Gizmo {
    /// Effect of the handles.
    pub mode: Mode,
    /// Their common centre in world space, metres.
    pub center: DVec3,
    /// Unit vectors: the world's axes, or for scaling those of the selected object.
    pub axes: [DVec3; 3],
    /// Length of an axis, metres.
    pub size: f64,
}

/// Drawing of a handle.
#[derive(Clone, Debug)]
pub struct Mark {
    /// The handle.
    pub handle: Handle,
    /// Points in the window.
    pub line: Vec<DVec2>,
    /// Whether it is an area rather than a line.
    pub filled: bool,
}

/// Length of an axis in the window, in points.
const LENGTH: f64 = 86.0;
/// Length of the head of an arrow beyond its axis, in points.
pub const ARROW_HEAD: f64 = 14.0;
/// Maximum distance of the mouse from a handle, in points.
const REACH: f64 = 8.0;
/// Range of the squares between two axes, as parts of their length.
const SQUARE: (f64, f64) = (0.3, 0.48);
const RING_STEPS: usize = 48;
/// Cosine of the angle between view and axis below which a ring is too narrow to follow the mouse around it: a pixel
/// across it would be many degrees.
const EDGE_ON: f64 = 0.35;
/// Sine of the angle between view and axis below which it points at the viewer: a pixel along it would be far, so it
/// cannot be grabbed.
const HEAD_ON: f64 = 0.3;
/// The same below which movement along it is that of the mouse in the image, because a few pixels further the exact one
/// would be at the horizon; and the least sine that counts where an axis is chosen by a key.
const OBLIQUE: f64 = 0.6;
const LEAST_SINE: f64 = 0.1;
/// Cosine of the angle between view and normal below which a square is seen too obliquely to be grabbed.
const GRAZING: f64 = 0.2;
/// Steps of a snapped drag in degrees.
const SNAP_DEG: f64 = 15.0;

impl Gizmo {
    /// Creates a gizmo of constant size in the window; `None` if `center` is not in front of the camera.
    pub fn at(center: DVec3, mode: Mode, axes: [DVec3; 3], projector: &Projector) -> Option<Self> {
        let size = LENGTH * projector.metres_at(center)?;
        size.is_normal().then_some(Self { mode, center, axes, size })
    }

    /// Everything to draw, the least important first.
    pub fn marks(&self, projector: &Projector) -> Vec<Mark> {
        let mut marks = Vec::new();
        let Some(view) = projector.towards(self.center) else { return marks };
        let mut add = |handle, filled, points: &mut dyn Iterator<Item = DVec3>| {
            let line: Option<Vec<DVec2>> = points.map(|point| projector.place(point)).collect();
            if let Some(line) = line {
                marks.push(Mark { handle, line, filled });
            }
        };
        for i in 0..3 {
            let (u, v) = (self.axes[(i + 1) % 3], self.axes[(i + 2) % 3]);
            match self.mode {
                Mode::Turn => {
                    let at = |k: usize| {
                        let (sin, cos) = (k as f64 / RING_STEPS as f64 * TAU).sin_cos();
                        self.center + self.size * (cos * u + sin * v)
                    };
                    add(Handle::Axis(i), false, &mut (0..=RING_STEPS).map(at));
                }
                Mode::Move | Mode::Scale => {
                    if self.mode == Mode::Move && view.dot(self.axes[i]).abs() > GRAZING {
                        let (a, b) = SQUARE;
                        let corner = |s: f64, t: f64| self.center + self.size * (s * u + t * v);
                        let corners = [corner(a, a), corner(b, a), corner(b, b), corner(a, b)];
                        add(Handle::Plane(i), true, &mut corners.into_iter());
                    }
                    if view.cross(self.axes[i]).length() > HEAD_ON {
                        let end = self.center + self.size * self.axes[i];
                        let start = self.center + 0.12 * self.size * self.axes[i];
                        add(Handle::Axis(i), false, &mut [start, end].into_iter());
                    }
                }
            }
        }
        add(Handle::Middle, false, &mut std::iter::once(self.center));
        marks
    }

    /// Returns the handle under the mouse.
    pub fn handle_at(&self, mouse: DVec2, projector: &Projector) -> Option<Handle> {
        let distance = |mark: &Mark| match (mark.handle, mark.filled) {
            // The centre of the rings is empty, so that clicks pass through.
            (Handle::Middle, _) if self.mode == Mode::Turn => f64::INFINITY,
            (Handle::Middle, _) => (mark.line[0] - mouse).length() - 4.0,
            (_, true) if is_inside(mouse, &mark.line) => 0.0,
            (_, true) => f64::INFINITY,
            (Handle::Axis(_), false) if self.mode == Mode::Move => {
                let [start, end] = [mark.line[0], mark.line[1]];
                to_segment(mouse, start, end + ARROW_HEAD * (end - start).normalize_or_zero())
            }
            (_, false) => {
                mark.line.windows(2).map(|ends| to_segment(mouse, ends[0], ends[1])).fold(f64::INFINITY, f64::min)
            }
        };
        let marks = self.marks(projector);
        let nearest = marks.iter().map(|mark| (distance(mark), mark.handle)).min_by(|a, b| a.0.total_cmp(&b.0))?;
        (nearest.0 <= REACH).then_some(nearest.1)
    }

    /// Returns the effect of dragging `handle` between two positions in the window; snapped to steps if requested.
    pub fn drag(&self, handle: Handle, from: DVec2, to: DVec2, projector: &Projector, snap: bool) -> Option<Drag> {
        let step = |value: f64, step: f64| if snap { (value / step).round() * step } else { value };
        let grid = 10f64.powf(self.size.log10().floor() - 1.0);
        let view = projector.towards(self.center)?;
        let on_plane = |normal: DVec3, place: DVec2| {
            let (from, dir) = projector.line(place);
            let t = (self.center - from).dot(normal) / dir.dot(normal);
            // Behind the camera, or so oblique that a pixel spans a large distance.
            let flat = dir.dot(normal).abs() < 0.02 * dir.length();
            (t > 0.0 && t.is_finite() && !flat).then(|| from + t * dir)
        };
        let along = |axis: DVec3, place: DVec2| {
            // The plane through the axis that faces the camera most.
            let normal = (view - view.dot(axis) * axis).try_normalize()?;
            Some((on_plane(normal, place)? - self.center).dot(axis))
        };
        match (self.mode, handle) {
            (Mode::Move, Handle::Axis(i)) => {
                let axis = self.axes[i];
                let sine = view.cross(axis).length();
                let by = if sine < OBLIQUE {
                    let next = self.center + 0.01 * self.size * axis;
                    let way = (projector.place(next)? - projector.place(self.center)?).try_normalize()?;
                    (to - from).dot(way) * self.size / LENGTH / sine.max(LEAST_SINE)
                } else {
                    along(axis, to)? - along(axis, from)?
                };
                Some(Drag::Move(step(by, grid) * axis))
            }
            (Mode::Move, Handle::Plane(i)) => {
                let by = on_plane(self.axes[i], to)? - on_plane(self.axes[i], from)?;
                let parts = self.axes.map(|axis| step(by.dot(axis), grid) * axis);
                Some(Drag::Move(parts[(i + 1) % 3] + parts[(i + 2) % 3]))
            }
            (Mode::Move, Handle::Middle) => Some(Drag::Move(on_plane(view, to)? - on_plane(view, from)?)),
            (Mode::Turn, handle) => {
                let axis = if let Handle::Axis(i) = handle { self.axes[i] } else { view };
                let grabbed = on_plane(axis, from).map(|point| point - self.center);
                let is_open = view.dot(axis).abs() > EDGE_ON;
                let angle = match (grabbed, on_plane(axis, to)) {
                    (Some(a), Some(b)) if is_open => {
                        let b = b - self.center;
                        a.cross(b).dot(axis).atan2(a.dot(b))
                    }
                    // By the movement along the tangent where the ring was grabbed, or where it is nearest.
                    _ => {
                        let radius = grabbed.unwrap_or(view.dot(axis) * axis - view).try_normalize()?;
                        let point = self.center + self.size * radius;
                        let next = point + 0.01 * self.size * axis.cross(radius);
                        let (a, b) = (projector.place(point)?, projector.place(next)?);
                        (to - from).dot((b - a).try_normalize()?) / LENGTH
                    }
                };
                Some(Drag::Turn { axis, angle_deg: step(angle.to_degrees(), SNAP_DEG) })
            }
            (Mode::Scale, Handle::Axis(i)) => {
                let (a, b) = (along(self.axes[i], from)?, along(self.axes[i], to)?);
                let mut factors = DVec3::ONE;
                factors[i] = positive(step(b / a, 0.1))?;
                Some(Drag::Scale(factors))
            }
            (Mode::Scale, _) => {
                // Right and up increase; the length of an axis doubles the size.
                let way = (to - from).dot(DVec2::new(1.0, -1.0)) / LENGTH;
                Some(Drag::Scale(DVec3::splat(positive(step(way.exp2(), 0.1))?)))
            }
        }
    }
}

fn positive(factor: f64) -> Option<f64> {
    (factor.is_finite() && factor > 0.0).then_some(factor.max(1e-3))
}

fn to_segment(point: DVec2, a: DVec2, b: DVec2) -> f64 {
    let along = b - a;
    let t = ((point - a).dot(along) / along.length_squared()).clamp(0.0, 1.0);
    let nearest = if t.is_finite() { a + t * along } else { a };
    (point - nearest).length()
}

fn is_inside(point: DVec2, corners: &[DVec2]) -> bool {
    let sides =
        (0..corners.len()).map(|i| (corners[(i + 1) % corners.len()] - corners[i]).perp_dot(point - corners[i]));
    let (mut left, mut right) = (false, false);
    sides.for_each(|side| (left, right) = (left || side > 0.0, right || side < 0.0));
    left != right
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::frame::core::rig::Rig;
    use crate::scene::View;

    fn projector() -> Projector {
        let view = View::look_at(DVec3::new(4.0, 3.0, 6.0), DVec3::ZERO, DVec3::Y).unwrap();
        Projector::new(&Rig { view, ..Rig::default() }, DVec2::new(800.0, 600.0))
    }

    fn gizmo(mode: Mode) -> Gizmo {
        Gizmo::at(DVec3::new(0.2, 0.1, -0.3), mode, DVec3::AXES, &projector()).unwrap()
    }

    fn place(point: DVec3) -> DVec2 {
        projector().place(point).unwrap()
    }

    #[test]
    fn dragging_an_axis_moves_as_far_as_the_mouse_along_it() {
        let (gizmo, projector) = (gizmo(Mode::Move), projector());
        for i in 0..3 {
            let axis = gizmo.axes[i];
            let (from, to) = (gizmo.center + 0.7 * gizmo.size * axis, gizmo.center + 2.0 * gizmo.size * axis);
            assert_eq!(gizmo.handle_at(place(from), &projector), Some(Handle::Axis(i)));
            let Some(Drag::Move(by)) = gizmo.drag(Handle::Axis(i), place(from), place(to), &projector, false) else {
                panic!()
            };
            assert!((by - (to - from)).length() < 1e-9, "axis {i}: {by}");
        }
        let (from, to) = (gizmo.center + DVec3::new(0.1, 0.0, 0.2), gizmo.center + DVec3::new(-0.4, 0.0, 0.6));
        let Some(Drag::Move(by)) = gizmo.drag(Handle::Plane(1), place(from), place(to), &projector, false) else {
            panic!()
        };
        assert!((by - (to - from)).length() < 1e-9, "{by}");
    }

    /// As in a room, with an axis along the view: its arrow is a dot beside the middle.
    #[test]
    fn an_axis_that_points_at_the_viewer_throws_nothing_away() {
        let seen_from = |eye: DVec3| {
            let view = View::look_at(eye, DVec3::ZERO, DVec3::Y).unwrap();
            let projector = Projector::new(&Rig { view, ..Rig::default() }, DVec2::new(800.0, 600.0));
            (Gizmo::at(DVec3::ZERO, Mode::Move, DVec3::AXES, &projector).unwrap(), projector)
        };
        let (along_z, projector) = seen_from(DVec3::new(0.3, 0.2, 3.0));
        let handles: Vec<Handle> = along_z.marks(&projector).iter().map(|mark| mark.handle).collect();
        assert!(!handles.contains(&Handle::Axis(2)) && handles.contains(&Handle::Axis(0)), "{handles:?}");
        assert!(!handles.contains(&Handle::Plane(1)) && handles.contains(&Handle::Plane(2)), "{handles:?}");
        // Some 25 degrees from the view, beyond its vanishing point.
        let (oblique, projector) = seen_from(DVec3::new(1.3, 0.5, 2.6));
        let middle = projector.place(DVec3::ZERO).unwrap();
        let way = (projector.place(DVec3::Z * 0.01).unwrap() - middle).normalize();
        for pixels in [-300.0, -140.0, 5.0, 140.0, 300.0] {
            let Some(Drag::Move(by)) = oblique.drag(Handle::Axis(2), middle, middle + pixels * way, &projector, false)
            else {
                panic!("{pixels} pixels")
            };
            let (metres, across) = (by.dot(DVec3::Z), by.cross(DVec3::Z).length());
            assert!(across == 0.0 && metres * pixels > 0.0 && metres.abs() < 0.02 * pixels.abs(), "{pixels}: {by}");
        }
    }

    #[test]
    fn squares_rings_and_the_middle_can_be_grabbed() {
        let (mover, ring, projector) = (gizmo(Mode::Move), gizmo(Mode::Turn), projector());
        let square = mover.center + 0.39 * mover.size * (DVec3::X + DVec3::Y);
        assert_eq!(mover.handle_at(place(square), &projector), Some(Handle::Plane(2)));
        assert_eq!(mover.handle_at(place(mover.center), &projector), Some(Handle::Middle));
        assert_eq!(mover.handle_at(DVec2::new(5.0, 5.0), &projector), None);
        for i in 0..3 {
            let (middle, end) = (place(mover.center), place(mover.center + mover.size * mover.axes[i]));
            let tip = end + ARROW_HEAD * (end - middle).normalize();
            assert_eq!(mover.handle_at(tip, &projector), Some(Handle::Axis(i)), "the tip of an arrow");
        }
        let on_ring = ring.center + ring.size * DVec3::new(0.6, 0.0, 0.8);
        assert_eq!(ring.handle_at(place(on_ring), &projector), Some(Handle::Axis(1)));
        assert_eq!(ring.handle_at(place(ring.center), &projector), None, "the middle of a ring is free");
    }

    #[test]
    fn dragging_along_a_ring_turns_by_that_angle_and_snaps() {
        let (ring, projector) = (gizmo(Mode::Turn), projector());
        let on_ring =
            |deg: f64| place(ring.center + ring.size * DVec3::new(deg.to_radians().sin(), 0.0, deg.to_radians().cos()));
        let turn = |snap| ring.drag(Handle::Axis(1), on_ring(10.0), on_ring(47.0), &projector, snap);
        let Some(Drag::Turn { axis: DVec3::Y, angle_deg }) = turn(false) else { panic!() };
        assert!((angle_deg - 37.0).abs() < 1e-9, "{angle_deg}");
        assert_eq!(turn(true), Some(Drag::Turn { axis: DVec3::Y, angle_deg: 30.0 }));
    }

    #[test]
    fn a_ring_that_is_seen_nearly_edge_on_turns_with_the_mouse_on_either_side() {
        let view = View::look_at(DVec3::new(0.0, 1.0, 9.0), DVec3::ZERO, DVec3::Y).unwrap();
        let projector = Projector::new(&Rig { view, ..Rig::default() }, DVec2::new(800.0, 600.0));
        let ring = Gizmo::at(DVec3::ZERO, Mode::Turn, DVec3::AXES, &projector).unwrap();
        let angle = |radius: DVec3, by: DVec2| {
            let from = projector.place(ring.size * radius).unwrap();
            match ring.drag(Handle::Axis(1), from, from + by, &projector, false) {
                Some(Drag::Turn { axis: DVec3::Y, angle_deg }) => angle_deg,
                other => panic!("{other:?}"),
            }
        };
        let right = DVec2::new(LENGTH, 0.0);
        let [near, far] = [DVec3::Z, DVec3::NEG_Z].map(|radius| angle(radius, right));
        assert!((near - 57.3).abs() < 0.1 && (far + near).abs() < 1e-6, "{near} {far}");
        // A few pixels across it are a few degrees.
        let end = angle(DVec3::X, DVec2::new(0.0, -4.0));
        assert!(end.abs() < 5.0 && angle(DVec3::Z, DVec2::new(0.0, -4.0)).abs() < 1e-6, "{end}");
    }

    #[test]
    fn scaling_is_by_the_ratio_along_an_axis_or_even() {
        let (gizmo, projector) = (gizmo(Mode::Scale), projector());
        let (from, to) = (gizmo.center + gizmo.size * DVec3::X, gizmo.center + 1.5 * gizmo.size * DVec3::X);
        let Some(Drag::Scale(factors)) = gizmo.drag(Handle::Axis(0), place(from), place(to), &projector, false) else {
            panic!()
        };
        assert!((factors - DVec3::new(1.5, 1.0, 1.0)).length() < 1e-9, "{factors}");
        let middle = place(gizmo.center);
        let even = gizmo.drag(Handle::Middle, middle, middle + DVec2::new(LENGTH, 0.0), &projector, false);
        assert_eq!(even, Some(Drag::Scale(DVec3::splat(2.0))));
        let inside_out =
            gizmo.drag(Handle::Axis(0), place(from), place(gizmo.center - DVec3::X * gizmo.size), &projector, false);
        assert_eq!(inside_out, None);
    }
}
