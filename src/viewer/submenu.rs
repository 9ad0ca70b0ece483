//! Menus in menus. One stays open while the pointer is led to it across the lines between.

use egui::containers::menu::{MenuState, SubMenuButton};
use egui::{Id, ScrollArea, TextWrapMode, Ui};
use std::time::Duration;

/// Height of the longest menu, points; windows below it scroll.
const TALL: f32 = 526.0;
/// For how long a menu stays open while the pointer rests on another line or comes no nearer, seconds.
const PATIENCE: f64 = 0.3;

/// A line of a menu that is a menu itself.
pub fn part(ui: &mut Ui, title: &str, contents: impl FnOnce(&mut Ui)) {
    let before = open_item(ui);
    let (line, shown) = SubMenuButton::new(title).ui(ui, |ui| scrolled(ui, contents));
    let Some(menu) = shown else { return };
    let id = line.id.with("approach");
    let (now, pointer) = (ui.input(|input| input.time), ui.ctx().pointer_hover_pos());
    let distance = pointer.map_or(f32::INFINITY, |at| menu.response.rect.distance_to_pos(at));
    let (last, mut since) = ui.data(|data| data.get_temp::<(f32, f64)>(id)).unwrap_or((distance, now));
    if distance < last || distance == 0.0 || line.contains_pointer() {
        since = now;
    }
    ui.data_mut(|data| data.insert_temp(id, (distance, since)));
    if before.is_none() || open_item(ui).is_some() || ui.will_parent_close() {
        return;
    }
    // The toolkit closes it as soon as the pointer stops on another line, which every late image makes it do.
    if now - since < PATIENCE {
        MenuState::from_ui(ui, |state, _| state.open_item = before);
        ui.ctx().request_repaint_after(Duration::from_secs_f64(PATIENCE));
    } else {
        // The line under the pointer opens with the next image, and the pointer may rest.
        ui.ctx().request_repaint();
    }
}

/// The submenu of this menu that is open.
fn open_item(ui: &Ui) -> Option<Id> {
    MenuState::from_ui(ui, |state, _| state.open_item)
}

/// The lines of a menu; scrolls what is taller than the window, from the top each time that it is opened.
pub fn scrolled(ui: &mut Ui, contents: impl FnOnce(&mut Ui)) {
    // A menu is as wide as when it was open last: a longer name makes it wider, and is not broken.
    ui.style_mut().wrap_mode = Some(TextWrapMode::Extend);
    let height = ui.ctx().content_rect().height();
    if height >= TALL {
        return contents(ui);
    }
    ui.set_min_width(190.0);
    // With a bar that is there before one scrolls: else nothing says that there is more.
    ui.spacing_mut().scroll = egui::style::ScrollStyle::solid();
    let (id, pass) = (ui.id().with("shown"), ui.ctx().cumulative_pass_nr());
    let was_shown = ui.data(|data| data.get_temp::<u64>(id)).is_some_and(|last| last + 1 >= pass);
    ui.data_mut(|data| data.insert_temp(id, pass));
    let mut area = ScrollArea::vertical().max_height((height - 20.0).max(40.0));
    if !was_shown {
        area = area.vertical_scroll_offset(0.0);
    }
    area.show(ui, contents);
}

#[cfg(test)]
mod tests {
    use super::*;
    use egui::{Button, Context, Event, Popup, PopupAnchor, PopupKind, Pos2, RawInput, Rect, pos2, vec2};
    use std::cell::RefCell;

    /// A list that was looked at while it was empty has remembered a width that its names do not fit into.
    #[test]
    fn a_menu_that_has_grown_breaks_no_line() {
        for height in [900.0, 300.0] {
            let context = Context::default();
            let screen = Rect::from_min_size(Pos2::ZERO, vec2(800.0, height));
            let heights = |names: &[&str]| {
                let mut heights = Vec::new();
                for _ in 0..3 {
                    heights.clear();
                    let _ = context.run(RawInput { screen_rect: Some(screen), ..Default::default() }, |context| {
                        egui::Area::new(Id::new("menu")).show(context, |ui| {
                            scrolled(ui, |ui| {
                                for name in names {
                                    let button = Button::new(*name).shortcut_text("in a folder");
                                    heights.push(ui.add(button).rect.height());
                                }
                            });
                        });
                    });
                }
                heights
            };
            let empty = heights(&["none"]);
            let long = "a scene whose name is longer than everything else.ron";
            assert_eq!(heights(&["none", long]), [empty[0]; 2], "in a window of height {height}");
        }
    }

    /// A menu with three parts, which counts time by itself.
    #[derive(Default)]
    struct Shown {
        context: Context,
        time: f64,
        /// Titles of the parts that were open in the last image, and the place of their last line.
        open: RefCell<Vec<(&'static str, Rect)>>,
        lines: RefCell<Vec<Rect>>,
    }

    impl Shown {
        /// One image with the pointer at a place, after some seconds.
        fn at(&mut self, place: Pos2, seconds: f64) -> Vec<&'static str> {
            self.time += seconds;
            let screen = Some(Rect::from_min_size(Pos2::ZERO, vec2(800.0, 900.0)));
            let events = vec![Event::PointerMoved(place)];
            let input = RawInput { screen_rect: screen, time: Some(self.time), events, ..Default::default() };
            let (open, lines) = (&self.open, &self.lines);
            open.borrow_mut().clear();
            lines.borrow_mut().clear();
            let _ = self.context.run(input, |context| {
                let at = PopupAnchor::Position(pos2(10.0, 10.0));
                let popup = Popup::new(Id::new("menu"), context.clone(), at, egui::LayerId::background());
                popup.kind(PopupKind::Menu).style(egui::containers::menu::menu_style).open(true).show(|ui| {
                    for title in ["first", "second", "third"] {
                        let top = ui.cursor().min;
                        part(ui, title, |ui| {
                            let last = (0..6).map(|i| ui.button(format!("line {i} of {title}")).rect).last();
                            open.borrow_mut().push((title, last.unwrap()));
                        });
                        lines.borrow_mut().push(Rect::from_min_max(top, pos2(top.x + 40.0, ui.cursor().min.y)));
                    }
                });
            });
            open.borrow().iter().map(|(title, _)| *title).collect()
        }
    }

    #[test]
    fn a_menu_stays_open_while_the_pointer_is_led_to_it_and_gives_way_where_that_rests() {
        let mut shown = Shown::default();
        for _ in 0..3 {
            shown.at(pos2(700.0, 700.0), 0.1);
        }
        let first = shown.lines.borrow()[0].center();
        let second = shown.lines.borrow()[1].center();
        for _ in 0..4 {
            shown.at(first, 0.1);
        }
        assert_eq!(shown.at(first, 0.1), ["first"]);
        // Straight to its last line, by images that come late: the pointer seems to rest in each.
        let last = shown.open.borrow()[0].1.center();
        for i in 1..=20 {
            let place = first.lerp(last, i as f32 / 20.0);
            for seconds in [0.02, 0.12] {
                assert_eq!(shown.at(place, seconds), ["first"], "at {place}, step {i}");
            }
        }
        // Resting on another line opens that one.
        shown.at(second, 0.1);
        for _ in 0..6 {
            shown.at(second, 0.1);
        }
        assert_eq!(shown.at(second, 0.1), ["second"]);
    }
}
