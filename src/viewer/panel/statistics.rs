//! Figures: speed, error, sizes, latency.

use crate::frame::{History, LatencyHistogram, Session};
use crate::scene::Shape;
use crate::scene::thousands;
use crate::viewer::panel::state::Around;
use crate::viewer::panel::widgets::{row, rows};
use crate::viewer::status::{bytes, percent, seconds};
use egui::{Label, Ui};

pub fn statistics(ui: &mut Ui, session: &Session, around: &Around) {
    let status = session.status();
    rows(ui, "statistics", |ui| {
        let mut figure = |name: &str, text: String| row(ui, name, |ui| drop(ui.add(Label::new(text).wrap())));
        figure("samples", format!("{} per pixel, {}", status.spp, seconds(status.seconds)));
        let coarse = if status.divider > 1 { format!(", 1/{} of the window", status.divider) } else { String::new() };
        figure("resolution", format!("{} × {}{coarse}", status.film_width, status.film_height));
        figure("rays", format!("{:.2} M/s", status.mrays()));
        let (camera, bounce, shadow) = (status.camera_mrays, status.bounce_mrays, status.shadow_mrays);
        figure("", format!("{camera:.2} camera, {bounce:.2} bounce"));
        figure("", format!("{shadow:.2} shadow"));
        figure("error estimate", status.estimated_error.map_or("–".to_owned(), percent));
        if status.denoised_error.is_some() {
            let denoised = status.known_denoised_error().map_or("not known yet,".to_owned(), percent);
            let mixed = if status.mixes_raw { ", mixed with raw" } else { "" };
            figure("denoised", format!("{denoised} of {} spp{mixed}", status.denoised_spp));
        }
        if let Some(caustics) = status.caustics {
            figure("caustics", caustics.to_string());
        }
        if status.n_portals > 0 {
            figure("portals", status.n_portals.to_string());
        }
        figure("discarded", format!("{} non-finite samples", status.n_bad));
        if status.n_above > 0 {
            figure("", format!("{} brighter than the scene allows", status.n_above));
        }
        let milliseconds = |waits: &LatencyHistogram| {
            let of = |share| waits.quantile(share).map(|wait| format!("{:.0} ms", wait.as_secs_f64() * 1e3));
            of(0.5).zip(of(0.99)).map_or("–".to_owned(), |(half, most)| format!("median {half}, 99 % {most}"))
        };
        figure("input latency", milliseconds(around.reaction.waits()));
        figure("cancel latency", milliseconds(&session.cancels()));
        let faces: usize = (session.inputs().objects.iter())
            .map(|object| if let Shape::Mesh(mesh) = &object.shape { mesh.triangles.len() } else { 0 })
            .sum();
        figure("triangles", thousands(faces));
        figure("kd-trees", bytes(session.tree_bytes() as u64));
        if let Some(memory) = around.memory {
            figure("memory", bytes(memory));
        }
        let history = session.world().resource::<History>();
        if let Some(label) = history.undo_label() {
            figure("undo", label.to_owned());
        }
        if let Some(label) = history.redo_label() {
            figure("redo", label.to_owned());
        }
        figure("last restart", status.restart_cause.clone());
    });
}
