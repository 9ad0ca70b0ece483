//! Overlays of the selection: its bounds and its handles, and dragging them.

use crate::frame::gizmo::{ARROW_HEAD, Drag, Gizmo, Handle, Mode};
use crate::frame::{Command, Edit, Navigation, OwnBox, Projector, SceneBounds, Selection, Session};
use crate::scene::{Placement, light_of};
use crate::viewer::keys::{Action, with_key};
use bevy_ecs::name::Name;
use bevy_ecs::prelude::Entity;
use egui::{Align2, Color32, Context, CursorIcon, FontId, Pos2, Rect, Stroke};
use glam::{DVec2, DVec3};

const SELECTED: Color32 = Color32::from_rgb(255, 178, 70);
const OTHERS: Color32 = Color32::from_rgba_premultiplied(170, 118, 46, 170);
pub const AXES: [Color32; 3] =
    [Color32::from_rgb(235, 85, 85), Color32::from_rgb(125, 205, 85), Color32::from_rgb(85, 140, 245)];
const LIGHT: Color32 = Color32::from_rgb(255, 240, 200);
const MIDDLE: Color32 = Color32::from_gray(235);
/// Points that a pressed mouse may move without moving anything.
const CLICK_TOLERANCE: f64 = 4.0;
const GRABBED: Color32 = Color32::from_rgb(255, 235, 120);
/// From the end of an axis, points.
const END_REACH: f64 = 10.0;

/// The overlays to be drawn, computed before drawing.
#[derive(Default)]
pub struct Handles {
    /// Of the selection, in its order, and whether something without a size is to be marked.
    boxes: Vec<(Entity, OwnBox, bool)>,
    /// What of it a drag moves; not floors and walls, on which a drag is meant for the view.
    bodies: Vec<Entity>,
    /// Lights without a surface that are not selected.
    lights: Vec<DVec3>,
    /// Axes of selected spot lights, from the light to what they hit; their ends can be dragged.
    axes: Vec<(Entity, [DVec3; 2])>,
    /// The spot light whose end is under the mouse, or is dragged.
    aimed: Option<Entity>,
    is_aiming: bool,
    /// Of the part of the window that the panel leaves free, points.
    size: DVec2,
    gizmo: Option<(Gizmo, Projector)>,
    projector: Option<Projector>,
    hovered: Option<Handle>,
    grabbed: Option<Grabbed>,
    /// Where a selected object itself was pressed, while that may still be a click.
    pressed: Option<DVec2>,
    /// The selected object if it is out of view: its name and its centre.
    out_of_view: Option<(String, DVec3)>,
}

/// A drag in progress. The handles stay where they were grabbed, so that the drag does not move its own frame of
/// reference.
struct Grabbed {
    gizmo: Gizmo,
    handle: Handle,
    from: DVec2,
    now: Option<Drag>,
}

impl Handles {
    /// Updates to the current selection.
    ///
    /// - `size`: of the part of the window that the panel leaves free, points.
    pub fn update(&mut self, session: &mut Session, mode: Option<Mode>, projector: Projector, size: DVec2) {
        self.boxes.clear();
        self.bodies.clear();
        self.size = size;
        let radius = session.world().resource::<SceneBounds>().extent.radius;
        let selected = session.world().resource::<Selection>().0.clone();
        for &entity in &selected {
            if let Some(own) = session.box_of(entity) {
                // The reference point of a plane is anywhere.
                let is_point = light_of(session.world(), entity).is_some();
                if is_point || !own.is_backdrop(radius) {
                    self.bodies.push(entity);
                }
                self.boxes.push((entity, own, is_point));
            }
        }
        let lights = session.inputs().lights.iter().filter(|light| light.light.has_position());
        let others = lights.filter(|light| !selected.contains(&light.entity));
        self.lights = others.map(|light| light.placement.translation).collect();
        self.axes = selected.iter().filter_map(|light| Some((*light, session.axis_of(*light)?))).collect();
        self.projector = Some(projector);
        self.gizmo = mode.and_then(|mode| self.gizmo_of(session, mode));
        self.out_of_view = match (self.boxes.last(), selected.last()) {
            (Some((_, own, _)), Some(&active)) if !is_seen(own, &projector, size) => {
                let name = session.world().get::<Name>(active).map_or("selected", |name| name.as_str());
                Some((name.to_owned(), own.middle()))
            }
            _ => None,
        };
        if self.gizmo.is_none() {
            self.grabbed = None;
        }
    }

    /// Handles of a kind about the selection, as it was drawn last; `None` without one in view.
    pub fn gizmo_of(&self, session: &Session, mode: Mode) -> Option<(Gizmo, Projector)> {
        let (selected, (_, own, _)) = (&session.world().resource::<Selection>().0, self.boxes.last()?);
        let projector = self.projector?;
        let axes = match (mode, &selected[..]) {
            (Mode::Scale, [only]) => own_axes(session.world().get::<Placement>(*only)),
            _ => DVec3::AXES,
        };
        Gizmo::at(own.middle(), mode, axes, &projector).map(|gizmo| (gizmo, projector))
    }

    /// Handles a mouse press; returns whether it grabbed a handle.
    pub fn grab(&mut self, mouse: DVec2) -> bool {
        let handle = self.gizmo.and_then(|(gizmo, projector)| Some((gizmo, gizmo.handle_at(mouse, &projector)?)));
        self.grabbed = handle.map(|(gizmo, handle)| Grabbed { gizmo, handle, from: mouse, now: None });
        self.aimed = self.end_at(mouse).filter(|_| self.grabbed.is_none());
        self.is_aiming = self.aimed.is_some();
        self.is_grabbed()
    }

    /// An axis in the window; it ends where it leaves the window, so that its end can be dragged.
    fn shown_axis(&self, [from, to]: [DVec3; 2]) -> Option<[DVec2; 2]> {
        let [from, to] = self.projector?.segment(from, to)?;
        let [least, most] = [DVec2::splat(END_REACH), self.size - END_REACH];
        let is_in = |at: DVec2| at.cmpge(least).all() && at.cmple(most).all();
        if !is_in(from) {
            return Some([from, to]);
        }
        // The part of the way to the first edge.
        let way = to - from;
        let room = DVec2::select(way.cmpgt(DVec2::ZERO), most - from, least - from) / way;
        let part = [room.x, room.y].into_iter().filter(|part| part.is_finite()).fold(1.0, f64::min);
        Some([from, from + part * way])
    }

    /// The spot light whose axis ends at the mouse.
    fn end_at(&self, mouse: DVec2) -> Option<Entity> {
        let is_near = |axis: [DVec3; 2]| self.shown_axis(axis).is_some_and(|[_, end]| end.distance(mouse) <= END_REACH);
        self.axes.iter().find(|(_, axis)| is_near(*axis)).map(|(light, _)| *light)
    }

    /// The spot light that a drag aims.
    pub fn aimed(&self) -> Option<Entity> {
        self.aimed.filter(|_| self.is_aiming)
    }

    /// Whether a drag that begins on this moves it, if it is selected.
    pub fn is_body(&self, entity: Entity) -> bool {
        self.bodies.contains(&entity)
    }

    /// Handles a mouse press on a selected object itself, which moves it once the mouse moves.
    pub fn press_body(&mut self, mouse: DVec2) {
        self.pressed = self.gizmo.filter(|(gizmo, _)| gizmo.mode == Mode::Move).map(|_| mouse);
    }

    /// Handles a mouse movement after [`Self::press_body`]; returns whether a drag begins with it.
    pub fn grab_body(&mut self, mouse: DVec2) -> bool {
        let Some(from) = self.pressed.take_if(|from| (mouse - *from).length() > CLICK_TOLERANCE) else { return false };
        let grabbed = |(gizmo, _)| Grabbed { gizmo, handle: Handle::Middle, from, now: None };
        self.grabbed = self.gizmo.map(grabbed);
        self.grabbed.is_some()
    }

    /// Handles a mouse movement; returns the command of a drag, and whether the handles must be redrawn.
    pub fn mouse_at(&mut self, mouse: DVec2, snap: bool) -> (Option<Command>, bool) {
        if self.is_aiming {
            return (None, false);
        }
        let end = self.end_at(mouse).filter(|_| self.grabbed.is_none());
        let is_other_end = std::mem::replace(&mut self.aimed, end) != end;
        let Some((gizmo, projector)) = self.gizmo else { return (None, is_other_end) };
        if let Some(grabbed) = &mut self.grabbed {
            let drag = grabbed.gizmo.drag(grabbed.handle, grabbed.from, mouse, &projector, snap);
            if drag.is_none() || drag == grabbed.now {
                return (None, false);
            }
            grabbed.now = drag;
            let edit = drag.map(|drag| match drag {
                Drag::Move(by) => Edit::Move { by },
                Drag::Turn { axis, angle_deg } => Edit::Turn { axis, angle_deg },
                Drag::Scale(factors) => Edit::Scale { factors },
            });
            return (edit.map(Command::Edit), true);
        }
        let hovered = gizmo.handle_at(mouse, &projector);
        let news = hovered != self.hovered;
        self.hovered = hovered;
        (None, news || is_other_end)
    }

    /// Handles a mouse release; returns whether a handle was grabbed.
    pub fn release(&mut self) -> bool {
        self.pressed = None;
        std::mem::take(&mut self.is_aiming) | self.grabbed.take().is_some()
    }

    /// The shape of the mouse.
    ///
    /// - `is_over_body`: whether it is on a selected object, which a drag would move.
    pub fn cursor(&self, is_over_body: bool) -> Option<CursorIcon> {
        if self.aimed.is_some() {
            return Some(CursorIcon::Crosshair);
        }
        let moves = self.gizmo.is_some_and(|(gizmo, _)| gizmo.mode == Mode::Move);
        let is_body = self.grabbed.as_ref().map_or(is_over_body, |grabbed| grabbed.handle == Handle::Middle);
        (moves && is_body).then_some(CursorIcon::Move)
    }

    pub fn is_grabbed(&self) -> bool {
        self.grabbed.is_some() || self.is_aiming
    }

    /// Whether a press would take a handle, or has taken one.
    pub fn is_lit(&self) -> bool {
        self.is_grabbed() || self.hovered.is_some() || self.aimed.is_some()
    }

    /// Draws an arrow at the edge of `free`, the uncovered part of the window, if the selection is out of view.
    pub fn draw_hint(&self, context: &Context, free: Rect, navigation: Navigation) {
        let (Some(projector), Some((name, middle))) = (&self.projector, &self.out_of_view) else { return };
        let inner = free.shrink(16.0);
        if !inner.is_positive() {
            return;
        }
        let center = inner.center();
        // What is exactly behind the camera can be reached in either direction.
        let way = projector.way_to(*middle).map_or(egui::Vec2::DOWN, |way| egui::vec2(way.x as f32, way.y as f32));
        let part = (inner.width() / 2.0 / way.x.abs()).min(inner.height() / 2.0 / way.y.abs());
        let tip = center + part * way;
        let painter = context.layer_painter(egui::LayerId::background());
        let across = egui::vec2(-way.y, way.x);
        let arrow = vec![tip, tip - 15.0 * way + 8.0 * across, tip - 15.0 * way - 8.0 * across];
        painter.add(egui::Shape::convex_polygon(arrow, SELECTED, Stroke::new(1.0, Color32::BLACK)));
        let frame = Action::Send(Command::FrameAll);
        let text = with_key(navigation, &format!("{name} is out of view: frame it"), &frame);
        let galley = painter.layout_no_wrap(text, FontId::proportional(13.0), Color32::WHITE);
        // A window this small shows only the arrow.
        if inner.width() < galley.size().x + 8.0 || inner.height() < galley.size().y + 8.0 {
            return;
        }
        let room = inner.shrink2(galley.size() / 2.0 + egui::Vec2::splat(4.0));
        // Behind the arrow, which must stay visible.
        let half = 0.5 * (galley.size().x * way.x.abs() + galley.size().y * way.y.abs());
        let at = (tip - (24.0 + half) * way).clamp(room.min, room.max);
        let rect = Rect::from_center_size(at, galley.size());
        painter.rect_filled(rect.expand(4.0), 3.0, crate::viewer::overlay::GLASS);
        painter.galley(rect.min, galley, Color32::WHITE);
    }

    /// - `outlined`: what needs no box; `marks_lights`: lights that are not selected are marked too.
    pub fn draw(&self, context: &Context, outlined: impl Fn(Entity) -> bool, marks_lights: bool) {
        let Some(projector) = &self.projector else { return };
        let painter = context.layer_painter(egui::LayerId::background());
        let lights = self.lights.iter().filter(|_| marks_lights).filter_map(|light| projector.place(*light));
        lights.for_each(|place| draw_light(&painter, pos(place)));
        for (light, axis) in &self.axes {
            let Some([from, to]) = self.shown_axis(*axis) else { continue };
            painter.line_segment([pos(from), pos(to)], Stroke::new(3.0, Color32::from_black_alpha(110)));
            painter.line_segment([pos(from), pos(to)], Stroke::new(1.5, SELECTED));
            let (radius, color) = if self.aimed == Some(*light) { (6.0, GRABBED) } else { (4.5, SELECTED) };
            painter.circle(pos(to), radius, color, Stroke::new(1.0, Color32::BLACK));
        }
        for (i, (entity, own, is_point)) in self.boxes.iter().enumerate() {
            if outlined(*entity) || own.min == own.max && !is_point {
                continue;
            }
            let color = if i + 1 == self.boxes.len() { SELECTED } else { OTHERS };
            draw_box(&painter, own, projector, color);
        }
        let Some((gizmo, _)) = &self.gizmo else { return };
        let lit = self.grabbed.as_ref().map(|grabbed| grabbed.handle).or(self.hovered);
        for mark in gizmo.marks(projector) {
            let color = match mark.handle {
                handle if lit == Some(handle) => GRABBED,
                Handle::Axis(i) | Handle::Plane(i) => AXES[i],
                Handle::Middle => MIDDLE,
            };
            let line: Vec<Pos2> = mark.line.iter().map(|&place| pos(place)).collect();
            match (mark.handle, gizmo.mode) {
                (Handle::Middle, Mode::Turn) => {}
                (Handle::Middle, _) => drop(painter.circle(line[0], 4.5, color, Stroke::new(1.0, Color32::BLACK))),
                (Handle::Plane(_), _) => {
                    let shape = egui::Shape::convex_polygon(line, color.gamma_multiply(0.55), Stroke::new(1.0, color));
                    painter.add(shape);
                }
                (Handle::Axis(_), mode) => {
                    painter.add(egui::Shape::line(line.clone(), Stroke::new(6.5, Color32::from_black_alpha(170))));
                    painter.add(egui::Shape::line(line.clone(), Stroke::new(3.5, color)));
                    match (mode, &line[..]) {
                        (Mode::Move, [start, end]) => draw_arrow(&painter, *start, *end, color),
                        (Mode::Scale, [_, end]) => {
                            painter.rect_filled(egui::Rect::from_center_size(*end, egui::Vec2::splat(9.0)), 1.0, color);
                        }
                        _ => {}
                    }
                }
            }
        }
        if let Some(Grabbed { now: Some(drag), from, .. }) = &self.grabbed {
            let text = match drag {
                Drag::Move(by) => format!("{:+.3}  {:+.3}  {:+.3} m", by.x, by.y, by.z),
                Drag::Turn { angle_deg, .. } => format!("{angle_deg:+.1}°"),
                Drag::Scale(factors) if factors.x == factors.y && factors.y == factors.z => {
                    format!("× {:.3}", factors.x)
                }
                Drag::Scale(factors) => format!("× {:.3}  {:.3}  {:.3}", factors.x, factors.y, factors.z),
            };
            let at = pos(*from) + egui::vec2(14.0, -22.0);
            let galley = painter.layout_no_wrap(text, FontId::monospace(12.5), Color32::WHITE);
            let rect = Align2::LEFT_BOTTOM.anchor_size(at, galley.size());
            painter.rect_filled(rect.expand(4.0), 3.0, crate::viewer::overlay::GLASS);
            painter.galley(rect.min, galley, Color32::WHITE);
        }
    }
}

/// Whether any part of the bounds may be in the window. Unbounded objects are always visible.
fn is_seen(own: &OwnBox, projector: &Projector, size: DVec2) -> bool {
    if own.min == own.max {
        return true;
    }
    let corners = own.corners();
    // Bounds around the camera are visible, or what is in them; those that reach behind the camera may be.
    let places: Vec<Option<DVec2>> = corners.iter().map(|&corner| projector.place(corner)).collect();
    let in_front: Vec<DVec2> = places.iter().copied().flatten().collect();
    if in_front.is_empty() {
        return false;
    }
    if in_front.len() < places.len() {
        return true;
    }
    let (min, max) =
        in_front.iter().fold((in_front[0], in_front[0]), |(min, max), &place| (min.min(place), max.max(place)));
    max.x > 0.0 && max.y > 0.0 && min.x < size.x && min.y < size.y
}

fn own_axes(placement: Option<&Placement>) -> [DVec3; 3] {
    let matrix = placement.map(Placement::linear).unwrap_or_default();
    [matrix.x_axis, matrix.y_axis, matrix.z_axis].map(|axis| axis.try_normalize().unwrap_or(DVec3::X))
}

/// Draws only the corners of a box along its edges, so that its content stays visible.
fn draw_box(painter: &egui::Painter, own: &OwnBox, projector: &Projector, color: Color32) {
    let corners = own.corners();
    if own.min == own.max {
        // A light without a size.
        if let Some(place) = projector.place(own.middle()) {
            painter.circle_stroke(pos(place), 9.0, Stroke::new(1.5, color));
        }
        return;
    }
    for (i, &corner) in corners.iter().enumerate() {
        for axis in 0..3 {
            let along = corners[i ^ (1 << axis)] - corner;
            if let (Some(a), Some(b)) = (projector.place(corner), projector.place(corner + 0.22 * along)) {
                painter.line_segment([pos(a), pos(b)], Stroke::new(3.0, Color32::from_black_alpha(110)));
                painter.line_segment([pos(a), pos(b)], Stroke::new(1.5, color));
            }
        }
    }
}

/// A small sun.
fn draw_light(painter: &egui::Painter, at: Pos2) {
    for (width, color) in [(3.0, Color32::from_black_alpha(110)), (1.5, LIGHT)] {
        painter.circle_stroke(at, 3.5, Stroke::new(width, color));
        for i in 0..8 {
            let way = egui::Vec2::angled(std::f32::consts::TAU * i as f32 / 8.0);
            painter.line_segment([at + 6.0 * way, at + 9.0 * way], Stroke::new(width, color));
        }
    }
}

fn draw_arrow(painter: &egui::Painter, start: Pos2, end: Pos2, color: Color32) {
    let along = (end - start).normalized();
    let across = egui::vec2(-along.y, along.x);
    let points = vec![end + ARROW_HEAD as f32 * along, end + 6.5 * across, end - 6.5 * across];
    painter.add(egui::Shape::convex_polygon(points, color, Stroke::new(1.5, Color32::from_black_alpha(170))));
}

fn pos(place: DVec2) -> Pos2 {
    Pos2::new(place.x as f32, place.y as f32)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::frame::navigation::Rig;
    use crate::scene::View;
    use glam::DAffine3;

    #[test]
    fn the_mouse_says_what_a_drag_would_move() {
        let view = View::look_at(DVec3::new(0.0, 0.0, 10.0), DVec3::ZERO, DVec3::Y).unwrap();
        let projector = Projector::new(&Rig { view, ..Rig::default() }, DVec2::new(800.0, 600.0));
        let with = |mode| Gizmo::at(DVec3::ZERO, mode, DVec3::AXES, &projector).map(|gizmo| (gizmo, projector));
        let mut handles = Handles { gizmo: with(Mode::Move), ..Handles::default() };
        assert_eq!([true, false].map(|on| handles.cursor(on)), [Some(CursorIcon::Move), None]);
        // While it is dragged, wherever the mouse is.
        handles.press_body(DVec2::new(500.0, 400.0));
        assert!(handles.grab_body(DVec2::new(520.0, 400.0)));
        assert_eq!(handles.cursor(false), Some(CursorIcon::Move));
        for mode in [None, Some(Mode::Turn), Some(Mode::Scale)] {
            let handles = Handles { gizmo: mode.and_then(with), ..Handles::default() };
            assert_eq!(handles.cursor(true), None, "{mode:?}: a drag moves the camera");
        }
    }

    #[test]
    fn the_end_of_an_axis_can_be_grabbed_and_stays_in_the_window() {
        let view = View::look_at(DVec3::new(0.0, 0.0, 10.0), DVec3::ZERO, DVec3::Y).unwrap();
        let size = DVec2::new(800.0, 600.0);
        let projector = Projector::new(&Rig { view, ..Rig::default() }, size);
        let with = |end: DVec3| Handles {
            axes: vec![(Entity::PLACEHOLDER, [DVec3::ZERO, end])],
            projector: Some(projector),
            size,
            ..Handles::default()
        };
        let near = projector.place(DVec3::X).unwrap();
        for (end, place) in [(DVec3::X, near), (100.0 * DVec3::X, DVec2::new(790.0, 300.0))] {
            let mut handles = with(end);
            assert!(!handles.grab(place - 30.0) && handles.aimed().is_none());
            assert!(handles.mouse_at(place + 3.0, false).1, "it is marked");
            assert!(handles.grab(place + 3.0) && handles.aimed() == Some(Entity::PLACEHOLDER));
            assert!(handles.release() && handles.aimed().is_none());
        }
        // A light that is out of view keeps its axis as it is.
        let [_, end] = with(DVec3::X).shown_axis([100.0 * DVec3::X, DVec3::X]).unwrap();
        assert_eq!(end, near);
    }

    #[test]
    fn floors_and_walls_are_for_the_view() {
        let own = |size: DVec3, scale: f64| OwnBox {
            min: DVec3::ZERO,
            max: size,
            world_from_box: DAffine3::from_scale(DVec3::splat(scale)),
        };
        let backdrop = |size, scale| own(size, scale).is_backdrop(5.0);
        assert!(backdrop(DVec3::new(10.0, 0.0, 8.0), 1.0) && backdrop(DVec3::new(1.0, 0.005, 0.8), 10.0));
        assert!(backdrop(DVec3::ZERO, 1.0), "an infinite plane");
        assert!(!backdrop(DVec3::new(2.0, 0.0, 1.0), 1.0), "a picture on a wall");
        assert!(!backdrop(DVec3::splat(10.0), 1.0), "a model that was opened alone");
    }

    #[test]
    fn what_is_beside_the_picture_or_behind_the_eye_is_not_seen() {
        let view = View::look_at(DVec3::new(0.0, 0.0, 10.0), DVec3::ZERO, DVec3::Y).unwrap();
        let (rig, size) = (Rig { view, ..Rig::default() }, DVec2::new(800.0, 600.0));
        let projector = Projector::new(&rig, size);
        let seen = |x: f64, z: f64, half: f64| {
            let world_from_box = DAffine3::from_translation(DVec3::new(x, 0.0, z));
            let own = OwnBox { min: DVec3::splat(-half), max: DVec3::splat(half), world_from_box };
            is_seen(&own, &projector, size)
        };
        assert!(seen(0.0, 0.0, 1.0) && seen(0.0, 10.0, 50.0), "in the middle, and around the eye");
        assert!(!seen(100.0, 0.0, 1.0) && !seen(-100.0, 0.0, 1.0), "to either side");
        assert!(!seen(0.0, 20.0, 1.0), "behind");
        assert!(seen(100.0, 0.0, 99.0), "its edge reaches into the picture");
        assert!(seen(0.0, 0.0, 0.0), "what has no size is a plane");
    }
}
