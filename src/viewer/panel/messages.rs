//! What the session has said, the latest first: warnings stay readable after their toasts have gone.

use crate::frame::{MessageKind, Session};
use egui::{Color32, RichText, Ui};

/// Messages that are listed; a session keeps more.
const SHOWN: usize = 30;

pub fn messages(ui: &mut Ui, session: &Session) {
    let messages = &session.status().messages;
    if messages.is_empty() {
        ui.weak("none");
    }
    for message in messages.iter().rev().take(SHOWN) {
        let color = match message.kind {
            MessageKind::Note | MessageKind::Saved => Color32::from_gray(180),
            MessageKind::Warning => Color32::from_rgb(240, 200, 120),
            MessageKind::Error => Color32::from_rgb(250, 140, 120),
        };
        ui.add(egui::Label::new(RichText::new(&message.text).color(color)).wrap());
        for other in &message.others {
            ui.add(egui::Label::new(RichText::new(other).weak()).wrap());
        }
    }
}
