//! Widgets of the panel: labelled rows, numbers, vectors, colours.
//!
//! Each returns the new value if the user has changed it, and `None` otherwise. Typing takes effect at the end,
//! dragging at once.

use crate::files::printable;
use crate::frame::{Edit, Selection};
use crate::scene::Hidden;
use crate::viewer::panel::hints::hint_of;
use crate::viewer::panel::list::Listed;
use crate::viewer::panel::state::Asked;
use crate::viewer::panel::temperature::kelvins;
use crate::viewer::status;
use bevy_ecs::prelude::World;
use egui::text::{CCursor, CCursorRange};
use egui::text_edit::TextEditState;
use egui::{Color32, RichText, Ui};
use glam::{DVec3, Vec3};

/// Rows of a label and a widget, aligned throughout the panel.
pub fn rows<R>(ui: &mut Ui, id: &str, contents: impl FnOnce(&mut Ui) -> R) -> R {
    egui::Grid::new(id).num_columns(2).min_col_width(74.0).spacing([8.0, 4.0]).show(ui, contents).inner
}

/// A row whose label [`hint_of`] explains.
pub fn row<R>(ui: &mut Ui, name: &str, contents: impl FnOnce(&mut Ui) -> R) -> R {
    row_with_hint(ui, name, hint_of(name), contents)
}

/// A row whose hint is shown when the mouse rests on the label.
pub fn row_with_hint<R>(ui: &mut Ui, name: &str, hint: &str, contents: impl FnOnce(&mut Ui) -> R) -> R {
    let label = ui.label(RichText::new(name).color(egui::Color32::from_gray(170)));
    if !hint.is_empty() {
        label.on_hover_text(hint);
    }
    let result = contents(ui);
    ui.end_row();
    result
}

/// An editable name of an entity; takes effect when the field loses the focus.
pub fn name_field(ui: &mut Ui, id: u64, name: Option<&str>, asked: &mut Asked) {
    // A name is unchanged if its displayed form is not edited.
    let old = &*printable::name(name.unwrap_or_default());
    // The text being typed is kept in the field's state.
    let key = ui.id().with(("name", id));
    let mut text = ui.data(|data| data.get_temp::<String>(key)).unwrap_or_else(|| old.to_owned());
    let field = ui.add(egui::TextEdit::singleline(&mut text).hint_text("no name").desired_width(130.0));
    if field.has_focus() {
        ui.data_mut(|data| data.insert_temp(key, text));
        return;
    }
    ui.data_mut(|data| data.remove::<String>(key));
    if field.lost_focus() && text != old {
        asked.edit(Edit::Rename { id, name: text });
    }
}

/// A selectable row of a list, truncated to the available width.
pub fn choice(ui: &mut Ui, is_chosen: bool, text: impl Into<egui::WidgetText>) -> egui::Response {
    ui.with_layout(egui::Layout::left_to_right(egui::Align::Center), |ui| {
        ui.add(egui::Button::selectable(is_chosen, text.into()).truncate())
    })
    .inner
}

/// Choices side by side; returns the one that is clicked, unless it is the chosen one.
pub fn choices<T: Copy + PartialEq>(
    ui: &mut Ui,
    chosen: Option<T>,
    all: impl IntoIterator<Item = (T, &'static str)>,
) -> Option<T> {
    let is_new = |ui: &mut Ui, (value, label)| {
        let is_chosen = chosen == Some(value);
        (ui.selectable_label(is_chosen, label).clicked() && !is_chosen).then_some(value)
    };
    // All are drawn, whichever is clicked.
    ui.horizontal(|ui| all.into_iter().filter_map(|choice| is_new(ui, choice)).last()).inner
}

/// A number that can be dragged or typed. Typing takes effect at the end, dragging at once.
pub fn number(ui: &mut Ui, value: f64, speed: f64, range: std::ops::RangeInclusive<f64>, suffix: &str) -> Option<f64> {
    // Clamped by the field, a number outside of the range would be an edit that nobody made.
    let mut new = value.clamp(*range.start(), *range.end());
    let mut drag = egui::DragValue::new(&mut new)
        .speed(speed)
        .range(range)
        .suffix(suffix)
        .max_decimals(decimals(value))
        .update_while_editing(false);
    if suffix.trim() == "m" {
        drag = drag.custom_parser(|text| of_length(text, 1.0));
    }
    ui.add(drag).changed().then_some(new)
}

/// A length in the unit that suits it; any unit can be typed, and a number without one has that of the field.
pub fn length(ui: &mut Ui, metres: f64, speed: f64, hint: &str) -> Option<f64> {
    let mut new = metres;
    let shown = status::metres(metres);
    let unit = shown.split_once(' ').and_then(|(_, unit)| factor_of(unit)).unwrap_or(1.0);
    let drag = egui::DragValue::new(&mut new)
        .speed(speed)
        .range(0.0..=1e9)
        .custom_formatter(|metres, _| status::metres(metres))
        .custom_parser(|text| of_length(text, unit))
        .update_while_editing(false);
    ui.add(drag).on_hover_text(hint).changed().then_some(new)
}

/// The focal length of a lens: a number is in millimetres, as on lenses.
pub fn millimetres(ui: &mut Ui, metres: f64) -> Option<f64> {
    let value = 1e3 * metres;
    let mut new = value;
    let drag = egui::DragValue::new(&mut new)
        .speed(proportional(value))
        .range(0.1..=1e5)
        .suffix(" mm")
        .max_decimals(1)
        .custom_parser(|text| of_length(text, 1e-3).map(|metres| 1e3 * metres))
        .update_while_editing(false);
    ui.add(drag).changed().then_some(1e-3 * new)
}

/// Metres of a typed length.
///
/// - `unit`: of a number without one, metres.
fn of_length(text: &str, unit: f64) -> Option<f64> {
    let text = text.trim();
    // Not by the first letter, which may be that of an exponent.
    let end = text.trim_end_matches(|c: char| c.is_alphabetic()).len();
    let (number, word) = text.split_at(end);
    let factor = if word.is_empty() { unit } else { factor_of(word)? };
    number.trim().parse::<f64>().ok().map(|number| number * factor)
}

/// Metres of a unit of length.
fn factor_of(unit: &str) -> Option<f64> {
    Some(match unit {
        "µm" | "um" => 1e-6,
        "mm" => 1e-3,
        "cm" => 1e-2,
        "m" => 1.0,
        "km" => 1e3,
        _ => return None,
    })
}

/// Decimals with which a number is shown: four digits say more than anybody sees, and all rows are equally wide.
fn decimals(value: f64) -> usize {
    let before = value.abs().max(1.0).log10().floor();
    3 - (before as usize).min(3) + usize::from(value.abs() < 1.0)
}

/// Like [`number`], for integers.
pub fn whole(ui: &mut Ui, value: u32, range: std::ops::RangeInclusive<u32>) -> Option<u32> {
    let mut new = value;
    let drag = egui::DragValue::new(&mut new).speed(0.05).range(range).update_while_editing(false);
    ui.add(drag).changed().then_some(new)
}

/// Three numbers; `speed` is the change per pixel of a drag.
pub fn vector(ui: &mut Ui, value: DVec3, speed: f64) -> Option<DVec3> {
    let mut new = value;
    let mut changed = false;
    // Beside long labels there is less room.
    let width = ((ui.available_width() - 8.0) / 3.0).clamp(36.0, 52.0);
    ui.horizontal(|ui| {
        ui.spacing_mut().item_spacing.x = 3.0;
        ui.spacing_mut().interact_size.x = width;
        for axis in 0..3 {
            let decimals = decimals(value[axis]).min(3);
            let drag =
                egui::DragValue::new(&mut new[axis]).speed(speed).max_decimals(decimals).update_while_editing(false);
            changed |= ui.add(drag).changed();
        }
    });
    changed.then_some(new)
}

/// A number on a slider.
pub fn slider(ui: &mut Ui, value: f64, range: std::ops::RangeInclusive<f64>, logarithmic: bool) -> Option<f64> {
    // A slider rounds and clamps what it is given, which is no edit of the user.
    let decimals = decimals(value);
    let mut new = egui::emath::round_to_decimals(value.clamp(*range.start(), *range.end()), decimals);
    let slider = egui::Slider::new(&mut new, range)
        .logarithmic(logarithmic)
        .update_while_editing(false)
        .max_decimals(decimals)
        .smart_aim(true);
    ui.add(slider).changed().then_some(new)
}

/// The unit of radiance.
pub const RADIANCE: &str = "W/m²sr";

/// A linear colour.
///
/// - `unit`: of one that may be brighter than white, which is edited as a hue and a strength, one below the other: there
///   is no room for both. The unit is in the hint.
pub fn color(ui: &mut Ui, value: Vec3, unit: Option<&str>) -> Option<DVec3> {
    ui.vertical(|ui| color_with(ui, value, unit, true)).inner
}

/// Like [`color`], where there is no room for its code.
pub fn short_color(ui: &mut Ui, value: Vec3, unit: Option<&str>) -> Option<DVec3> {
    color_with(ui, value, unit, false)
}

fn color_with(ui: &mut Ui, value: Vec3, unit: Option<&str>, has_code: bool) -> Option<DVec3> {
    let strength = if unit.is_some() { value.max_element() } else { 1.0 };
    // Black has no hue: it becomes white when its strength is raised.
    let hue = if strength > 0.0 { value / strength } else { Vec3::ONE };
    let mut rgb = hue.to_array();
    let mut pick = |ui: &mut Ui| {
        let is_picked = egui::color_picker::color_edit_button_rgb(ui, &mut rgb).changed();
        // It rounds what it is given when it opens, which is no change.
        (is_picked && hex_of(rgb.into()) != hex_of(hue)).then(|| Vec3::from(rgb).as_dvec3())
    };
    let new_hue = match has_code {
        true => ui.horizontal(|ui| pick(ui).or(hex_field(ui, hue))).inner,
        false => pick(ui),
    };
    let strength_of = |ui: &mut Ui| unit.and_then(|unit| strength_drag(ui, f64::from(strength), unit));
    let (new_strength, of_light) = match unit {
        // What has no unit is no light.
        Some(unit) if has_code && !unit.is_empty() => ui.horizontal(|ui| (strength_of(ui), kelvins(ui, hue))).inner,
        _ => (strength_of(ui), None),
    };
    let new_hue = new_hue.or(of_light);
    if new_hue.is_none() && new_strength.is_none() {
        return None;
    }
    let strength = match new_strength {
        Some(strength) => strength,
        // A colour chosen for what was black gets a visible strength.
        None if strength == 0.0 => 1.0,
        None => f64::from(strength),
    };
    Some(new_hue.unwrap_or_else(|| hue.as_dvec3()) * strength)
}

/// The colour as `#rrggbb`, the sRGB code of paint programs; takes effect when the field loses the focus.
fn hex_field(ui: &mut Ui, color: Vec3) -> Option<DVec3> {
    let shown = hex_of(color);
    let key = ui.next_auto_id().with("hex");
    let mut text = ui.data(|data| data.get_temp::<String>(key)).unwrap_or_else(|| shown.clone());
    let field = egui::TextEdit::singleline(&mut text).desired_width(56.0).font(egui::TextStyle::Monospace);
    let field = ui.add(field).on_hover_text("sRGB code, such as #cc8844");
    if field.has_focus() {
        ui.data_mut(|data| data.insert_temp(key, text));
        return None;
    }
    ui.data_mut(|data| data.remove::<String>(key));
    // The code has fewer digits than the colour: only another code is an edit.
    (field.lost_focus() && text != shown).then(|| of_hex(&text))?
}

fn hex_of(color: Vec3) -> String {
    let [r, g, b, _] = Color32::from(egui::Rgba::from_rgb(color.x, color.y, color.z)).to_array();
    format!("#{r:02x}{g:02x}{b:02x}")
}

/// The linear colour of `#rrggbb` or `#rgb`, with or without `#`.
fn of_hex(text: &str) -> Option<DVec3> {
    let digits = text.trim().trim_start_matches('#');
    let color = Color32::from_hex(&format!("#{digits}")).ok().filter(|color| color.is_opaque())?;
    let linear = egui::Rgba::from(color);
    Some(DVec3::new(linear.r().into(), linear.g().into(), linear.b().into()))
}

/// The rest of the row of an object or a light: a click selects it, or with a modifier adds it to the selection; the
/// button hides it, or shows it again.
pub fn selectable<T: Listed>(ui: &mut Ui, item: &T, world: &World, asked: &mut Asked) {
    let (entity, label, kind) = item.listed();
    let selection = world.resource::<Selection>();
    let hidden = world.get::<Hidden>(entity).is_some();
    ui.with_layout(egui::Layout::right_to_left(egui::Align::Center), |ui| {
        let symbol = RichText::new("👁").size(11.0);
        let symbol = if hidden { symbol.weak().strikethrough() } else { symbol };
        let hint = if hidden { "hidden: click to show it" } else { "click to hide it" };
        if ui.add(egui::Button::new(symbol).frame(false)).on_hover_text(hint).clicked() {
            asked.edit(Edit::SetHidden { id: entity.to_bits(), hidden: !hidden });
        }
        ui.label(RichText::new(kind).size(11.0).weak());
        let text = if hidden { RichText::new(label).weak() } else { RichText::new(label) };
        if choice(ui, selection.0.contains(&entity), text).on_hover_text(label).clicked() {
            let add = ui.input(|input| input.modifiers.command || input.modifiers.shift);
            asked.edit(Edit::Select { id: entity.to_bits(), add });
        }
    });
}

/// A factor of any magnitude: each step of a drag changes it by the same ratio.
///
/// - `unit`: of what the factor 1 stands for; empty if it has none.
pub fn strength_drag(ui: &mut Ui, value: f64, unit: &str) -> Option<f64> {
    let mut new = value;
    let drag = egui::DragValue::new(&mut new).speed(proportional(value)).range(0.0..=1e9).prefix("× ");
    let mut drag = ui.add(drag.max_decimals(decimals(value)).update_while_editing(false));
    if !unit.is_empty() {
        drag = drag.on_hover_text(format!("strength, in {}: drag it, or click it and type", unit.trim()));
    }
    drag.changed().then_some(new)
}

/// After a double click in a field of a number, selects all of it: a word would be the digits on one side of the point.
/// To be called when everything is drawn.
pub fn select_number(context: &egui::Context) {
    let Some(id) = context.memory(|memory| memory.focused()) else { return };
    let is_double = context.input(|input| input.pointer.button_double_clicked(egui::PointerButton::Primary));
    // Only fields of numbers keep their text under their own id.
    if is_double
        && let Some(text) = context.data(|data| data.get_temp::<String>(id))
        && let Some(mut state) = TextEditState::load(context, id)
    {
        let end = CCursor::new(text.chars().count());
        state.cursor.set_char_range(Some(CCursorRange::two(CCursor::default(), end)));
        state.store(context, id);
        context.request_repaint();
    }
}

/// Drag speed per pixel, proportional to the value: doubling takes about 140 pixels at any magnitude. Starts slowly
/// from 0.
pub fn proportional(value: f64) -> f64 {
    0.005 * value.abs().max(1e-3)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn colours_are_written_as_in_paint_programs() {
        assert_eq!(
            [hex_of(Vec3::ZERO), hex_of(Vec3::ONE), hex_of(Vec3::splat(0.214))],
            ["#000000", "#ffffff", "#7f7f7f"]
        );
        for code in ["#cc8844", "#0080ff", "#010203"] {
            assert_eq!(hex_of(of_hex(code).unwrap().as_vec3()), code);
        }
        assert_eq!(of_hex("fff"), Some(DVec3::ONE));
        assert_eq!([of_hex("#12345"), of_hex("red"), of_hex(""), of_hex("#11223344")], [None; 4]);
    }

    #[test]
    fn lengths_are_typed_in_any_unit() {
        let centimetres = ["5", "5cm", " 5 cm ", "50 mm", "0.05 m", "5e-2m", "0.00005 km"];
        assert!(centimetres.iter().all(|text| (of_length(text, 0.01).unwrap() / 0.05 - 1.0).abs() < 1e-12));
        assert_eq!(of_length("5", 1.0), Some(5.0));
        assert_eq!(["", "cm", "5 inches", "f/2", "1 2 m"].map(|text| of_length(text, 1.0)), [None; 5]);
    }

    #[test]
    fn numbers_have_about_four_digits() {
        assert_eq!([32.9123, 6.2776, 0.134, 1234.5, 120.0, -45.25].map(decimals), [2, 3, 4, 0, 1, 2]);
    }

    /// It fails an assertion of emath, which the profile for development leaves out.
    #[test]
    fn a_drag_across_a_power_of_ten_is_no_fault() {
        let _ = egui::emath::smart_aim::best_in_range_f64(9.9, 9.999_999_999_999_996);
    }

    #[test]
    fn a_double_click_takes_a_number_as_a_whole() {
        let context = egui::Context::default();
        let (mut value, mut at) = (0.1, egui::Pos2::ZERO);
        let mut frame = |time: f64, events: Vec<egui::Event>| {
            let input = egui::RawInput { events, time: Some(time), ..egui::RawInput::default() };
            let _ = context.run(input, |context| {
                egui::CentralPanel::default().show(context, |ui| {
                    value = number(ui, value, 0.01, 0.0..=1.0, "").unwrap_or(value);
                    at = ui.min_rect().min + egui::vec2(8.0, 8.0);
                });
                select_number(context);
            });
            (value, at)
        };
        let at = frame(0.0, Vec::new()).1;
        for (time, pressed) in [(0.1, true), (0.15, false), (0.2, true), (0.25, false)] {
            let (button, modifiers) = (egui::PointerButton::Primary, egui::Modifiers::NONE);
            let click = egui::Event::PointerButton { pos: at, button, pressed, modifiers };
            frame(time, vec![egui::Event::PointerMoved(at), click]);
        }
        frame(0.4, vec![egui::Event::Text("0.35".to_owned())]);
        let (key, modifiers) = (egui::Key::Enter, egui::Modifiers::NONE);
        let enter = egui::Event::Key { key, physical_key: None, pressed: true, repeat: false, modifiers };
        frame(0.5, vec![enter]);
        assert_eq!(frame(0.6, Vec::new()).0, 0.35);
    }

    /// What is shown is rounded and clamped, and nobody has edited it.
    #[test]
    fn showing_a_number_is_no_edit() {
        let context = egui::Context::default();
        for value in [f64::from(0.07_f32).sqrt(), 1.0 / 3.0, 1e-9, -4.0, 5.0, f64::from(0.1_f32)] {
            let mut edits = Vec::new();
            // A field is laid out in the first frame, and may change its number in any of them.
            for _ in 0..3 {
                let _ = context.run(egui::RawInput::default(), |context| {
                    egui::CentralPanel::default().show(context, |ui| {
                        edits.push(slider(ui, value, 0.0..=1.0, false));
                        edits.push(number(ui, value, 0.01, 0.0..=1.0, ""));
                        edits.push(vector(ui, DVec3::splat(value), 0.1).map(|vector| vector.x));
                    });
                });
            }
            assert!(edits.iter().all(Option::is_none), "{value}: {edits:?}");
        }
    }
}
