//! The table in readable form: names of keys, and `docs/keys.md`.

use crate::frame::Navigation;
use crate::viewer::keys::binding::{Binding, Chord, Trigger, Typed};
use crate::viewer::keys::presets::groups_of;
use crate::viewer::keys::table::BINDINGS;
use std::fmt::Write as _;
use winit::keyboard::{KeyCode, NamedKey};

impl Chord {
    pub(super) fn label(&self) -> String {
        let key = match self.key {
            Typed::Text(text) => text.to_uppercase(),
            Typed::Named(NamedKey::Escape) => "Esc".to_owned(),
            Typed::Named(NamedKey::PageUp) => "Page Up".to_owned(),
            Typed::Named(NamedKey::PageDown) => "Page Down".to_owned(),
            Typed::Named(name) => format!("{name:?}"),
            Typed::Pad(_, name) => name.to_owned(),
        };
        let ctrl = if self.ctrl { "Ctrl+" } else { "" };
        let shift = if self.shift == Some(true) { "Shift+" } else { "" };
        let alt = if self.alt { "Alt+" } else { "" };
        format!("{ctrl}{alt}{shift}{key}")
    }
}

impl Binding {
    /// The names of the keys for the user.
    pub fn keys(&self) -> String {
        let is_item = |trigger: &&Trigger| matches!(trigger, Trigger::Item(_));
        // The name of a command stands for a key that it does not have.
        let has_keys = !self.triggers.iter().all(|trigger| is_item(&trigger));
        let labels: Vec<String> = self
            .triggers
            .iter()
            .filter(|trigger| !(has_keys && is_item(trigger)))
            .map(|trigger| match trigger {
                Trigger::Hold(code, _) => match code {
                    KeyCode::ArrowLeft => "⬅".to_owned(),
                    KeyCode::ArrowRight => "➡".to_owned(),
                    KeyCode::ArrowUp => "⬆".to_owned(),
                    KeyCode::ArrowDown => "⬇".to_owned(),
                    _ => format!("{code:?}").replace("Key", ""),
                },
                Trigger::Press(chord, _) => chord.label(),
                Trigger::Digit { ctrl, .. } => if *ctrl { "Ctrl+1…9" } else { "Shift+1…9" }.to_owned(),
                Trigger::Mouse(gesture) => (*gesture).to_owned(),
                Trigger::Item(item) => item.name.to_owned(),
            })
            .collect();
        labels.join("  ")
    }
}

/// The content of `docs/keys.md`.
pub fn markdown() -> String {
    let mut page = String::from(
        "# Keys and mouse\n\n\
         H shows this list in the window. It is written from the table in `src/viewer/keys/table.rs`, which the window obeys;\n\
         after a change there, `FIRSTLIGHT_BLESS=1 cargo test keys_page` writes it again. The groups at the end are those of the\n\
         presets that are chosen in the panel under Camera; they take the place of Fly, Orbit and the same keys.\n",
    );
    let presets = Navigation::ALL.into_iter().flat_map(groups_of);
    for group in BINDINGS.iter().chain(presets) {
        write!(page, "\n## {}\n\n| keys | what they do |\n|---|---|\n", group.title).expect("a string takes all");
        for binding in group.bindings {
            let keys = binding.keys();
            let keys: Vec<String> = keys.split("  ").map(|key| format!("`{key}`")).collect();
            writeln!(page, "| {} | {} |", keys.join(" "), binding.effect).expect("a string takes all");
        }
    }
    page
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn keys_page_says_what_the_window_obeys() {
        let path = concat!(env!("CARGO_MANIFEST_DIR"), "/docs/keys.md");
        if std::env::var_os("FIRSTLIGHT_BLESS").is_some() {
            std::fs::write(path, markdown()).expect("docs/keys.md can be written");
        }
        let page = std::fs::read_to_string(path).expect("docs/keys.md is there");
        assert!(page == markdown(), "docs/keys.md is out of date: run FIRSTLIGHT_BLESS=1 cargo test keys_page");
    }
}
