//! A list of what is in the scene: filtered by words, scrolled, made taller by its lower edge.
//!
//! Only rows that are seen are made, so that ten thousand cost no more than ten. What the words find is kept until
//! they or the scene change.

use bevy_ecs::prelude::Entity;
use egui::{CursorIcon, Rect, Sense, Ui, vec2};

/// Something that a list can show.
pub trait Listed {
    fn entity(&self) -> Entity;
    fn label(&self) -> &str;
    /// More words that find it.
    fn kind(&self) -> &str;
}

/// What a list remembers.
#[derive(Default)]
pub struct ListState {
    filter: String,
    /// Of the rows that are seen, points; none before somebody chose it.
    height: Option<f32>,
    /// The rows that the filter finds, in which state of the scene, for which words.
    found: Option<(u64, String, Vec<usize>)>,
    /// What was chosen when the list was shown last, to notice that something else is.
    chosen: Option<Entity>,
}

/// Which list, of which state of the scene, and what in it is to be in view.
pub struct Which {
    pub id: &'static str,
    pub revision: u64,
    pub chosen: Option<Entity>,
}

/// Rows that are seen at first.
const ROWS: f32 = 10.0;
/// From so many on, a field for words is worth its place.
const MANY: usize = 9;
const GRIP: f32 = 7.0;
/// What the bar that floats over a long list covers.
const SCROLL_BAR: f32 = 9.0;

/// Shows `items`; `row` fills a row.
pub fn list<T: Listed>(
    ui: &mut Ui,
    state: &mut ListState,
    which: &Which,
    items: &[T],
    mut row: impl FnMut(&mut Ui, &T),
) {
    if items.len() >= MANY {
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
    let text = ui.text_style_height(&egui::TextStyle::Body) + 4.0;
    let full = text + ui.spacing().item_spacing.y;
    let all = found.len() as f32 * full;
    let height = state.height.unwrap_or(ROWS * full).clamp(3.0 * full, all.max(3.0 * full));
    // Whoever chooses something in the picture wants to see it here.
    let news = which.chosen.filter(|_| which.chosen != state.chosen);
    let target = news.and_then(|entity| found.iter().position(|&i| items[i].entity() == entity));
    if target.is_some() || which.chosen.is_none() {
        state.chosen = which.chosen;
    }
    let mut area = egui::ScrollArea::vertical().id_salt(which.id).max_height(height);
    if is_new_search {
        area = area.vertical_scroll_offset(0.0);
    }
    area.min_scrolled_height(height.min(all)).auto_shrink([false, true]).animated(false).show_rows(
        ui,
        text,
        found.len(),
        |ui, range| {
            if let Some(target) = target {
                let top = ui.max_rect().top() + (target as f32 - range.start as f32) * full;
                let rect = Rect::from_min_size(egui::pos2(ui.max_rect().left(), top), vec2(1.0, text));
                // What is seen already stays where it is.
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
    if all > height || state.height.is_some() {
        let moved = grip(ui);
        if moved != 0.0 {
            state.height = Some(height + moved);
        }
    }
}

/// The lower edge, to be dragged: by how much.
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

/// The rows whose label or kind has all of the words, in any case of letters.
fn find<T: Listed>(items: &[T], filter: &str) -> Vec<usize> {
    let words: Vec<String> = filter.split_whitespace().map(str::to_lowercase).collect();
    let has = |item: &T| {
        let line = format!("{} {}", item.label(), item.kind()).to_lowercase();
        words.iter().all(|word| line.contains(word))
    };
    (0..items.len()).filter(|&i| words.is_empty() || has(&items[i])).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    impl Listed for (&str, &str) {
        fn entity(&self) -> Entity {
            Entity::PLACEHOLDER
        }

        fn label(&self) -> &str {
            self.0
        }

        fn kind(&self) -> &str {
            self.1
        }
    }

    #[test]
    fn all_words_must_be_found_in_name_or_kind() {
        let items = [("Gold ball", "sphere"), ("floor", "plane"), ("ball 2", "mesh")];
        assert_eq!(find(&items, ""), [0, 1, 2]);
        assert_eq!(find(&items, "BALL"), [0, 2]);
        assert_eq!(find(&items, " ball  sph "), [0]);
        assert_eq!(find(&items, "plane ball"), Vec::<usize>::new());
    }

    /// A list in a window that nobody sees: which rows it makes.
    fn rows_made(
        context: &egui::Context,
        state: &mut ListState,
        items: &[Thing],
        chosen: Option<Entity>,
    ) -> Vec<Entity> {
        let mut made = Vec::new();
        let which = Which { id: "list", revision: 1, chosen };
        let _ = context.run(egui::RawInput::default(), |context| {
            egui::CentralPanel::default().show(context, |ui| {
                list(ui, state, &which, items, |_, item| made.push(item.0));
            });
        });
        made
    }

    struct Thing(Entity, String);

    impl Listed for Thing {
        fn entity(&self) -> Entity {
            self.0
        }

        fn label(&self) -> &str {
            &self.1
        }

        fn kind(&self) -> &str {
            "ball"
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
        // Scrolled away from, it stays away: only another choice scrolls.
        assert_eq!(made(&mut state, Some(7_000)), there);
        assert_eq!(made(&mut state, Some(7_001)), there, "what is seen already moves nothing");
        state.filter = "99".to_owned();
        let found = made(&mut state, Some(7_001));
        assert_eq!(found[0], items[99].0);
    }
}
