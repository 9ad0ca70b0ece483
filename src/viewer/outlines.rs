//! Silhouettes of what is selected and of what is under the mouse.
//!
//! The map of objects is traced on a thread of its own once the view rests, and only while somebody may look at it;
//! until then, the selection has [boxes](crate::viewer::handles). What is under the mouse is outlined while the mouse
//! moves, so that an image that is looked at has no lines in it.

use crate::frame::{ObjectMap, Outline, Session, Waker};
use bevy_ecs::prelude::Entity;
use egui::{Color32, ColorImage, Context, LayerId, Pos2, Rect, TextureHandle, TextureOptions};
use glam::{DVec2, UVec2};
use std::collections::HashSet;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{Receiver, channel};
use std::time::{Duration, Instant};

/// Pixels of a map: larger windows have one of fewer pixels.
const MOST_PIXELS: f64 = 1_100_000.0;
/// How long after the last movement of the mouse what is under it is outlined.
const HOVER: Duration = Duration::from_millis(1200);
/// Time after the last movement of the view before the map is traced.
const REST: Duration = Duration::from_millis(80);
const ACTIVE: Color32 = Color32::from_rgb(255, 178, 70);
const OTHERS: Color32 = Color32::from_rgb(214, 140, 50);
const HOVERED: Color32 = Color32::from_rgb(236, 240, 246);

pub struct Outlines {
    waker: Waker,
    /// With the number of the view that it shows.
    map: Option<(u64, ObjectMap)>,
    tracing: Option<Tracing>,
    /// What the mouse was on when it moved last, and until when that matters.
    hovered: Option<Entity>,
    hover_until: Option<Instant>,
    /// When the map may be traced.
    trace_at: Option<Instant>,
    lines: [Option<Line>; 3],
}

/// A map that is being traced.
struct Tracing {
    view: u64,
    stop: Arc<AtomicBool>,
    receiver: Receiver<Option<ObjectMap>>,
}

/// An outline as a texture.
struct Line {
    view: u64,
    of: HashSet<Entity>,
    /// The part that is meant of one of them.
    part: Option<(Entity, usize)>,
    /// `None` where nothing of it is seen.
    drawn: Option<(TextureHandle, UVec2, UVec2)>,
}

impl Outlines {
    pub fn new(waker: Waker) -> Self {
        Self {
            waker,
            map: None,
            tracing: None,
            hovered: None,
            hover_until: None,
            trace_at: None,
            lines: [None, None, None],
        }
    }

    /// The mouse has moved to a place of the image, fractions; `None` if it is on something else, or drags. Returns
    /// whether another object is to be outlined.
    pub fn mouse_at(&mut self, place: Option<[f64; 2]>, now: Instant) -> bool {
        self.hover_until = place.map(|_| now + HOVER);
        let entity = place.and_then(|[x, y]| self.map.as_ref()?.1.at(x, y));
        std::mem::replace(&mut self.hovered, entity) != entity
    }

    /// What is under the mouse.
    pub fn hovered(&self) -> Option<Entity> {
        self.hovered
    }

    /// Whether the mouse has moved over the image just now.
    pub fn is_looked_for(&self) -> bool {
        self.hover_until.is_some()
    }

    /// When to [`follow`](Self::follow) again even if nothing happens.
    pub fn wake_at(&self) -> Option<Instant> {
        self.hover_until.into_iter().chain(self.trace_at).min()
    }

    /// Takes a map that is ready, and has one traced if it is missing; returns whether there is a reason to draw.
    ///
    /// - `view`: number of the view that is rendered; `rested`: since when it has not moved.
    /// - `wanted`: something is selected.
    pub fn follow(&mut self, session: &Session, view: u64, rested: Instant, wanted: bool, now: Instant) -> bool {
        let mut news = false;
        if self.hover_until.is_some_and(|until| now >= until) {
            (self.hover_until, news) = (None, self.hovered.take().is_some());
        }
        if let Some(tracing) = &self.tracing {
            if tracing.view != view {
                tracing.stop.store(true, Ordering::Relaxed);
            }
            match tracing.receiver.try_recv() {
                Err(std::sync::mpsc::TryRecvError::Empty) => return news,
                Ok(Some(map)) if tracing.view == view => (self.map, news) = (Some((view, map)), true),
                _ => {}
            }
            self.tracing = None;
        }
        self.leave(view);
        self.trace_at = (self.map.is_none() && (wanted || self.hover_until.is_some())).then_some(rested + REST);
        if self.trace_at.take_if(|at| now >= *at).is_some() {
            self.tracing = self.trace(session, view);
        }
        news
    }

    /// Forgets what shows another view.
    pub fn leave(&mut self, view: u64) {
        if self.map.as_ref().is_some_and(|(of, _)| *of != view) {
            (self.map, self.hovered) = (None, None);
        }
    }

    fn trace(&self, session: &Session, view: u64) -> Option<Tracing> {
        let (source, picture) = (session.object_map()?, session.picture());
        let size = UVec2::new(picture.width, picture.height).as_dvec2();
        let shrink = (MOST_PIXELS / (size.x * size.y)).sqrt().min(1.0);
        let size = (size * shrink).round().max(DVec2::ONE).as_uvec2();
        let ((sender, receiver), stop) = (channel(), Arc::new(AtomicBool::default()));
        let (stopped, waker) = (stop.clone(), self.waker.clone());
        let work = move || {
            // If the window is gone, nobody waits for it.
            let _ = sender.send(source.trace(size, &|| stopped.load(Ordering::Relaxed)));
            waker();
        };
        std::thread::Builder::new().name("outline".to_owned()).spawn(work).ok()?;
        Some(Tracing { view, stop, receiver })
    }

    /// Whether this is outlined, so that it needs no box.
    pub fn has(&self, entity: Entity) -> bool {
        let has = |line: &Line| line.drawn.is_some() && line.of.contains(&entity);
        self.map.is_some() && self.lines[..2].iter().flatten().any(has)
    }

    /// Makes the lines of what is selected, the last one being the active one, and of what is under the mouse.
    ///
    /// - `part`: the part that is meant of the active one.
    pub fn update(&mut self, context: &Context, selected: &[Entity], part: Option<(Entity, usize)>) {
        let Some((view, map)) = &self.map else { return };
        let (active, others) =
            selected.split_last().map_or((None, selected), |(active, others)| (Some(*active), others));
        // A part is meant for its material; whatever else is done, is done to the whole object.
        let others = if part.is_some() { selected } else { others };
        let hovered = self.hovered.filter(|entity| self.hover_until.is_some() && !selected.contains(entity));
        let wanted = [others.to_vec(), active.into_iter().collect(), hovered.into_iter().collect()];
        // Pixels of the map for each point of the window.
        let scale = map.size().x as f32 / context.content_rect().width().max(1.0);
        for ((line, of), color) in self.lines.iter_mut().zip(wanted).zip([OTHERS, ACTIVE, HOVERED]) {
            let of: HashSet<Entity> = of.into_iter().collect();
            let part = part.filter(|_| color == ACTIVE);
            if line.as_ref().is_some_and(|line| line.view == *view && line.of == of && line.part == part) {
                continue;
            }
            let radius = if color == HOVERED { 0.6 } else { 1.1 };
            let outline = if of.is_empty() { None } else { map.outline(&of, part, (radius * scale).max(0.5)) };
            let drawn = outline.map(|outline| {
                let texture = context.load_texture("outline", image_of(&outline, color), TextureOptions::LINEAR);
                (texture, outline.start, outline.size)
            });
            *line = Some(Line { view: *view, of, part, drawn });
        }
    }

    /// Draws the lines over the image.
    pub fn draw(&self, context: &Context, image: Rect) {
        let Some((view, map)) = &self.map else { return };
        let points = image.size() / egui::vec2(map.size().x as f32, map.size().y as f32);
        let place = |pixel: UVec2| image.min + egui::vec2(pixel.x as f32, pixel.y as f32) * points;
        let painter = context.layer_painter(LayerId::background());
        for line in self.lines.iter().flatten().filter(|line| line.view == *view) {
            let Some((texture, start, size)) = &line.drawn else { continue };
            let rect = Rect::from_min_max(place(*start), place(*start + *size));
            let whole = Rect::from_min_max(Pos2::ZERO, Pos2::new(1.0, 1.0));
            painter.image(texture.id(), rect, whole, Color32::WHITE);
        }
    }
}

/// The line in its colour, over a dark rim that sets it off from what has that colour.
fn image_of(outline: &Outline, color: Color32) -> ColorImage {
    let pixels = outline.pixels.iter().map(|[line, rim]| {
        let shadow = 0.62 * rim * (1.0 - line);
        let alpha = line + shadow;
        let of = |channel: u8| (f32::from(channel) * line) as u8;
        Color32::from_rgba_premultiplied(of(color.r()), of(color.g()), of(color.b()), (255.0 * alpha) as u8)
    });
    ColorImage::new([outline.size.x as usize, outline.size.y as usize], pixels.collect())
}
