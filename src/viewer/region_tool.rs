//! The region tool: a rectangle dragged over the image, which gets all samples.

use crate::frame::Status;
use crate::viewer::overlay::GLASS;
use egui::{Align2, Color32, Context, FontId, Pos2, Rect, Stroke, StrokeKind};

const COLOR: Color32 = Color32::from_rgb(120, 220, 255);
/// Smallest side of a rectangle in window pixels; smaller drags are ignored.
const MIN_SIDE: f64 = 4.0;

/// Positions are fractions of the image from its upper left corner.
#[derive(Debug, Default)]
pub struct RegionTool {
    /// Whether the next drag is a rectangle.
    armed: bool,
    drag: Option<[[f64; 2]; 2]>,
}

impl RegionTool {
    /// Arms or disarms the tool.
    pub fn toggle(&mut self) -> bool {
        self.drag = None;
        self.armed = !self.armed;
        self.armed
    }

    pub fn is_armed(&self) -> bool {
        self.armed
    }

    pub fn is_drawing(&self) -> bool {
        self.drag.is_some()
    }

    /// Handles a mouse press; returns whether a rectangle begins.
    pub fn press(&mut self, at: [f64; 2]) -> bool {
        if self.armed {
            self.drag = Some([at, at]);
        }
        self.armed
    }

    /// Handles a mouse movement; returns whether the rectangle must be redrawn.
    pub fn mouse_at(&mut self, at: [f64; 2]) -> bool {
        self.drag.as_mut().is_some_and(|drag| std::mem::replace(&mut drag[1], at) != at)
    }

    /// Handles a mouse release; returns `None` if nothing was dragged, else the rectangle (left, top, right, bottom),
    /// if it is large enough.
    ///
    /// - `size`: of the window, pixels.
    pub fn release(&mut self, size: [f64; 2]) -> Option<Option<[f64; 4]>> {
        let [a, b] = self.drag.take()?;
        let meant = (0..2).all(|axis| (a[axis] - b[axis]).abs() * size[axis] >= MIN_SIDE);
        let rectangle = [a[0].min(b[0]), a[1].min(b[1]), a[0].max(b[0]), a[1].max(b[1])];
        self.armed = !meant;
        Some(meant.then_some(rectangle))
    }

    /// Draws the rectangle being dragged, or the one that gets the samples, over the image.
    pub fn draw(&self, context: &Context, image: Rect, status: &Status) {
        let painter = context.layer_painter(egui::LayerId::background());
        let at = |x: f64, y: f64| -> Pos2 { image.min + egui::vec2(x as f32, y as f32) * image.size() };
        let outline = |rect: Rect, stroke: f32| {
            painter.rect_stroke(
                rect,
                0.0,
                Stroke::new(stroke + 2.0, Color32::from_black_alpha(110)),
                StrokeKind::Middle,
            );
            painter.rect_stroke(rect, 0.0, Stroke::new(stroke, COLOR), StrokeKind::Middle);
        };
        if let Some([a, b]) = self.drag {
            outline(Rect::from_two_pos(at(a[0], a[1]), at(b[0], b[1])), 1.0);
        }
        let Some((region, spp)) = status.region else { return };
        let size = [f64::from(status.film_width.max(1)), f64::from(status.film_height.max(1))];
        let corner = |x: u32, y: u32| at(f64::from(x) / size[0], f64::from(y) / size[1]);
        let rect = Rect::from_two_pos(corner(region.start.x, region.start.y), corner(region.end.x, region.end.y));
        outline(rect, 1.5);
        let galley = painter.layout_no_wrap(format!("{spp} spp"), FontId::proportional(12.5), COLOR);
        let label = Align2::LEFT_BOTTOM.anchor_size(rect.left_top() + egui::vec2(2.0, -3.0), galley.size());
        let label = label.translate(egui::vec2(0.0, (image.top() + 2.0 - label.top()).max(0.0)));
        painter.rect_filled(label.expand2(egui::vec2(4.0, 1.0)), 2.0, GLASS);
        painter.galley(label.min, galley, COLOR);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_drag_is_a_rectangle_whichever_way_it_went() {
        let mut brush = RegionTool::default();
        assert!(!brush.press([0.5, 0.5]) && brush.release([800.0, 400.0]).is_none(), "a drag looks about unless asked");
        assert!(brush.toggle() && brush.press([0.75, 0.25]));
        assert!(brush.mouse_at([0.5, 0.5]) && !brush.mouse_at([0.5, 0.5]));
        assert_eq!(brush.release([800.0, 400.0]), Some(Some([0.5, 0.25, 0.75, 0.5])));
        assert!(!brush.is_armed(), "one drag, one rectangle");
    }

    #[test]
    fn a_slip_is_no_rectangle_and_the_brush_stays() {
        let mut brush = RegionTool::default();
        brush.toggle();
        brush.press([0.5, 0.5]);
        brush.mouse_at([0.502, 0.9]);
        assert_eq!(brush.release([800.0, 400.0]), Some(None));
        assert!(brush.is_armed() && !brush.toggle());
    }
}
