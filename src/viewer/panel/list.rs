//! A filterable, scrollable list of scene items, resizable at its lower edge.
//!
//! Only visible rows are laid out, so ten thousand items cost no more than ten. Search results are kept until the
//! search or the scene changes.

use bevy_ecs::prelude::Entity;
use egui::scroll_area::ScrollSource;
use egui::{CursorIcon, Pos2, Rect, Sense, Ui, Vec2, vec2};

/// An item that a list can show.
pub trait Listed {
    /// Its entity, its label, and its material or kind, which is searched as well.
    fn listed(&self) -> (Entity, &str, &str);
}

/// State of a list.
#[derive(Default)]
pub struct ListState {
    filter: String,
    /// Height of the visible rows in points; `None` until the user resizes the list.
    height: Option<f32>,
    /// Search results: the revision of the scene, the search, and the rows.
    found: Option<(u64, String, Vec<usize>)>,
    /// The chosen item when the list was last drawn, to detect a change.
    chosen: Option<Entity>,
    wheel: Wheel,
}

/// Whether a turn of the wheel is for a list: one that begins over the list. One that scrolls the panel goes on when a
/// list comes under the mouse.
#[derive(Default)]
struct Wheel {
    /// Where the list was drawn last.
    place: Option<Rect>,
    /// When the wheel was turned last, seconds.
    turned: f64,
    is_for_list: bool,
}

impl Wheel {
    /// Seconds of rest that end a turn.
    const REST: f64 = 0.4;

    /// - `now`: seconds; `turns`: the wheel is being turned; `mouse`: where it is.
    fn is_for_list(&mut self, now: f64, turns: bool, mouse: Option<Pos2>) -> bool {
        if turns {
            if now > self.turned + Self::REST {
                self.is_for_list = self.place.zip(mouse).is_some_and(|(place, mouse)| place.contains(mouse));
            }
            self.turned = now;
        }
        !turns || self.is_for_list
    }
}

/// Identity of a list, revision of the scene, the item that is to be in view, and the height of rows.
pub struct Which {
    pub id: &'static str,
    pub revision: u64,
    pub chosen: Option<Entity>,
    /// Of a row, points; at least that of its text.
    pub height: f32,
}

/// Initial number of visible rows.
const ROWS: f32 = 10.0;
/// Number of rows from which a search field is shown.
const MIN_SEARCHABLE: usize = 9;
const GRIP: f32 = 7.0;
/// Width covered by the bar that floats over a long list.
const SCROLL_BAR: f32 = 9.0;

/// Shows `items`; `row` draws the content of a row.
pub fn list<T: Listed>(
    ui: &mut Ui,
    state: &mut ListState,
    which: &Which,
    items: &[T],
    mut row: impl FnMut(&mut Ui, &T),
) {
    if items.len() >= MIN_SEARCHABLE {
        ui.horizontal(|ui| {
            let field = egui::TextEdit::singleline(&mut state.filter).hint_text("filter by name or kind");
            ui.add(field.desired_width(ui.available_width() - 26.0));
            if !state.filter.is_empty() && ui.small_button("✖").on_hover_text("clear the filter").clicked() {
                state.filter.clear();
            }
        });
    } else {
        state.filter.clear();
    }
    let is_new_search = state.found.as_ref().is_some_and(|(_, words, _)| *words != state.filter);
    let known = state.found.take().filter(|(revision, words, _)| (*revision, words) == (which.revision, &state.filter));
    let found = known.unwrap_or_else(|| (which.revision, state.filter.clone(), find(items, &state.filter)));
    let (_, _, found) = state.found.insert(found);
    if found.is_empty() {
        ui.weak(if items.is_empty() { "none" } else { "no matches" });
        return;
    }
    let text = (ui.text_style_height(&egui::TextStyle::Body) + 4.0).max(which.height);
    let full = text + ui.spacing().item_spacing.y;
    let all = found.len() as f32 * full;
    let height = state.height.unwrap_or(ROWS * full).clamp(3.0 * full, all.max(3.0 * full));
    // An item chosen in the image is scrolled into view.
    let news = which.chosen.filter(|_| which.chosen != state.chosen);
    let target = news.and_then(|entity| found.iter().position(|&i| items[i].listed().0 == entity));
    if target.is_some() || which.chosen.is_none() {
        state.chosen = which.chosen;
    }
    let (now, turns, mouse) = ui.input(|input| {
        let turns = [input.raw_scroll_delta, input.smooth_scroll_delta].iter().any(|delta| *delta != Vec2::ZERO);
        (input.time, turns, input.pointer.hover_pos())
    });
    let source = ScrollSource { mouse_wheel: state.wheel.is_for_list(now, turns, mouse), ..ScrollSource::ALL };
    let mut area = egui::ScrollArea::vertical().id_salt(which.id).max_height(height).scroll_source(source);
    if is_new_search {
        area = area.vertical_scroll_offset(0.0);
    }
    let drawn = area.min_scrolled_height(height.min(all)).auto_shrink([false, true]).animated(false).show_rows(
        ui,
        text,
        found.len(),
        |ui, range| {
            if let Some(target) = target {
                let top = ui.max_rect().top() + (target as f32 - range.start as f32) * full;
                let rect = Rect::from_min_size(egui::pos2(ui.max_rect().left(), top), vec2(1.0, text));
                // Rows that are visible already are not scrolled.
                if !ui.clip_rect().y_range().contains(rect.top()) || !ui.clip_rect().y_range().contains(rect.bottom()) {
                    ui.scroll_to_rect(rect, Some(egui::Align::Center));
                }
            }
            for &i in &found[range] {
                ui.push_id(i, |ui| {
                    ui.horizontal(|ui| {
                        ui.set_height(text);
                        if all > height {
                            ui.set_max_width(ui.available_width() - SCROLL_BAR);
                        }
                        row(ui, &items[i]);
                    });
                });
            }
        },
    );
    state.wheel.place = Some(drawn.inner_rect);
    if all > height || state.height.is_some() {
        let moved = grip(ui);
        if moved != 0.0 {
            state.height = Some(height + moved);
        }
    }
}

/// The draggable lower edge; returns the drag distance.
fn grip(ui: &mut Ui) -> f32 {
    let (rect, response) = ui.allocate_exact_size(vec2(ui.available_width(), GRIP), Sense::drag());
    let color = ui.style().interact(&response).fg_stroke.color;
    let strength = if response.hovered() || response.dragged() { 1.0 } else { 0.35 };
    for y in [-1.5, 1.5] {
        let middle = rect.center() + vec2(0.0, y);
        ui.painter().hline(middle.x - 14.0..=middle.x + 14.0, middle.y, (1.0, color.gamma_multiply(strength)));
    }
    let response = response.on_hover_cursor(CursorIcon::ResizeVertical).on_hover_text("drag to resize the list");
    response.drag_delta().y
}

/// Returns the rows whose label or kind contains all of the words, ignoring case.
fn find<T: Listed>(items: &[T], filter: &str) -> Vec<usize> {
    let words: Vec<String> = filter.split_whitespace().map(str::to_lowercase).collect();
    let has = |item: &T| {
        let (_, label, kind) = item.listed();
        let line = format!("{label} {kind}").to_lowercase();
        words.iter().all(|word| line.contains(word))
    };
    (0..items.len()).filter(|&i| words.is_empty() || has(&items[i])).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    impl Listed for (&str, &str) {
        fn listed(&self) -> (Entity, &str, &str) {
            (Entity::PLACEHOLDER, self.0, self.1)
        }
    }

    #[test]
    fn a_wheel_that_scrolls_the_panel_is_not_caught_by_a_list() {
        let place = Rect::from_min_max(Pos2::new(0.0, 100.0), Pos2::new(200.0, 300.0));
        let mut wheel = Wheel { place: Some(place), ..Wheel::default() };
        let (outside, inside) = (Some(Pos2::new(50.0, 50.0)), Some(Pos2::new(50.0, 150.0)));
        assert!(!wheel.is_for_list(10.0, true, outside));
        assert!(!wheel.is_for_list(10.3, true, inside), "the same turn");
        assert!(wheel.is_for_list(10.8, true, inside), "another one");
        assert!(wheel.is_for_list(11.1, true, outside) && wheel.is_for_list(20.0, false, outside));
    }

    #[test]
    fn all_words_must_be_found_in_name_or_kind() {
        let items = [("Gold ball", "sphere"), ("floor", "plane"), ("ball 2", "mesh")];
        assert_eq!(find(&items, ""), [0, 1, 2]);
        assert_eq!(find(&items, "BALL"), [0, 2]);
        assert_eq!(find(&items, " ball  sph "), [0]);
        assert_eq!(find(&items, "plane ball"), Vec::<usize>::new());
    }

    /// Draws a list in a window without a display; returns the rows that it lays out.
    fn rows_made(
        context: &egui::Context,
        state: &mut ListState,
        items: &[Thing],
        chosen: Option<Entity>,
    ) -> Vec<Entity> {
        let mut made = Vec::new();
        let which = Which { id: "list", revision: 1, chosen, height: 0.0 };
        let _ = context.run(egui::RawInput::default(), |context| {
            egui::CentralPanel::default().show(context, |ui| {
                list(ui, state, &which, items, |_, item| made.push(item.0));
            });
        });
        made
    }

    struct Thing(Entity, String);

    impl Listed for Thing {
        fn listed(&self) -> (Entity, &str, &str) {
            (self.0, &self.1, "ball")
        }
    }

    #[test]
    fn ten_thousand_cost_no_more_than_what_is_seen_and_what_is_chosen_comes_into_view() {
        let thing = |i: u32| Thing(Entity::from_raw_u32(i).expect("a small number"), format!("ball {i}"));
        let items: Vec<Thing> = (0..10_000).map(thing).collect();
        let (context, mut state) = (egui::Context::default(), ListState::default());
        let made = |state: &mut ListState, chosen: Option<u32>| {
            let chosen = chosen.map(|i| items[i as usize].0);
            rows_made(&context, state, &items, chosen);
            rows_made(&context, state, &items, chosen)
        };
        let first = made(&mut state, None);
        assert!((5..30).contains(&first.len()) && first[0] == items[0].0, "{first:?}");
        let there = made(&mut state, Some(7_000));
        assert!(there.contains(&items[7_000].0) && there.len() < 30, "{there:?}");
        // After scrolling away the list stays there: only another choice scrolls.
        assert_eq!(made(&mut state, Some(7_000)), there);
        assert_eq!(made(&mut state, Some(7_001)), there, "what is seen already moves nothing");
        state.filter = "99".to_owned();
        let found = made(&mut state, Some(7_001));
        assert_eq!(found[0], items[99].0);
    }
}
