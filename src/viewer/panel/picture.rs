//! Rendering and display settings.

use crate::frame::{Command, DenoiseFilter, Denoising, Session, StopAt, Target, ViewMode};
use crate::render::{ErrorMetric, Inspection, Integrator, SampleAllocation, ToneCurve};
use crate::scene::Rendering;
use crate::viewer::keys::{Action, with_key};
use crate::viewer::panel::state::{Around, Asked};
use crate::viewer::panel::widgets::{choices, number, row, row_with_hint, rows, slider, whole};
use crate::viewer::status::tone_curve;
use egui::Ui;

pub fn render(ui: &mut Ui, session: &Session, around: &Around, asked: &mut Asked) {
    let status = session.status();
    rows(ui, "render", |ui| {
        row(ui, "integrator", |ui| {
            let all = [(Integrator::Path, "path tracing"), (Integrator::Phong, "Phong")];
            if let Some(integrator) = choices(ui, Some(status.integrator), all) {
                asked.send(Command::SetIntegrator(integrator));
            }
        });
        let allocation = session.world().get_resource::<Rendering>().map(|of_scene| of_scene.0.allocation);
        let allocation = allocation.unwrap_or_default();
        row(ui, "sampling", |ui| {
            use SampleAllocation::{Adaptive, Uniform};
            let is_display = matches!(allocation, Adaptive(ErrorMetric::Display { .. }));
            let choices = [
                (allocation == Uniform, "uniform", Uniform, "the same number of samples in every pixel"),
                (
                    allocation == Adaptive(ErrorMetric::RelativeMse),
                    "adaptive, relMSE",
                    Adaptive(ErrorMetric::RelativeMse),
                    "more samples where the relative error of linear light is large; the error estimate is of that",
                ),
                (
                    is_display,
                    "adaptive, display",
                    Adaptive(ErrorMetric::Display { exposure_stops: session.status().display.exposure_stops }),
                    "more samples where the error of the displayed image is large",
                ),
            ];
            let shown = choices.iter().find(|choice| choice.0).map_or("", |choice| choice.1);
            egui::ComboBox::from_id_salt("allocation").selected_text(shown).width(150.0).show_ui(ui, |ui| {
                for (is_chosen, label, allocation, about) in choices {
                    if ui.selectable_label(is_chosen, label).on_hover_text(about).clicked() {
                        asked.send(Command::SetAllocation(allocation));
                    }
                }
            })
        });
        let target = session.world().resource::<StopAt>().0;
        row(ui, "stop at error", |ui| {
            let shown = 100.0 * target.error.unwrap_or(0.0);
            limit(ui, target.error.is_some(), shown, 0.01, 0.5, " %", |on, value| {
                let error = on.then_some((value / 100.0).max(1e-5));
                asked.send(Command::SetTarget(Target { error, ..target }));
            });
        });
        row(ui, "stop at time", |ui| {
            limit(ui, target.seconds.is_some(), target.seconds.unwrap_or(0.0), 1.0, 60.0, " s", |on, value| {
                let seconds = on.then_some(value.max(0.1));
                asked.send(Command::SetTarget(Target { seconds, ..target }));
            });
        });
        row(ui, "stop at samples", |ui| {
            limit(ui, target.spp.is_some(), f64::from(target.spp.unwrap_or(0)), 4.0, 1024.0, "", |on, value| {
                let spp = on.then_some((value.round() as u32).max(1));
                asked.send(Command::SetTarget(Target { spp, ..target }));
            });
        });
        row(ui, "threads", |ui| {
            if let Some(threads) = whole(ui, status.threads as u32, 1..=256) {
                asked.send(Command::SetThreads { threads: threads as usize });
            }
        });
    });
    let hint = |text: &str, action: Action| with_key(around.navigation, text, &action);
    ui.horizontal(|ui| {
        if ui.button(if status.paused { "Resume" } else { "Pause" }).clicked() {
            asked.send(if status.paused { Command::Resume } else { Command::Pause });
        }
        if ui.button("Restart").clicked() {
            asked.send(Command::Restart);
        }
        if ui
            .selectable_label(around.brush, "Region")
            .on_hover_text(hint("drag a rectangle to render only that region", Action::Brush))
            .clicked()
        {
            asked.action = Some(Action::Brush);
        }
        if status.region.is_some()
            && ui.button("Whole image").on_hover_text(hint("render the whole image", Action::ClearRegion)).clicked()
        {
            asked.send(Command::SetRegion { region: None });
        }
    });
    ui.horizontal(|ui| {
        let larger = "render the image in any size and quality in the background, and save it";
        if ui.button("Save image …").on_hover_text(hint(larger, Action::RenderTo { frames: false })).clicked() {
            asked.action = Some(Action::RenderTo { frames: false });
        }
        let displayed =
            hint("save the image as it is displayed now, in a new file", Action::Screenshot { linear: false });
        if ui.button("PNG").on_hover_text(displayed).clicked() {
            asked.action = Some(Action::Screenshot { linear: false });
        }
        let linear = hint("save linear light (HDR) in a new file", Action::Screenshot { linear: true });
        if ui.button("EXR").on_hover_text(linear).clicked() {
            asked.action = Some(Action::Screenshot { linear: true });
        }
        let layers =
            "save linear light with layers in a new EXR: albedo, normal, depth, position, masks, samples, error";
        if ui.button("Layers").on_hover_text(layers).clicked() {
            asked.save_layers = true;
        }
    });
}

/// A limit that can be disabled.
fn limit(ui: &mut Ui, on: bool, value: f64, speed: f64, first: f64, suffix: &str, mut set: impl FnMut(bool, f64)) {
    ui.horizontal(|ui| {
        let mut checked = on;
        if ui.checkbox(&mut checked, "").changed() {
            set(checked, first);
        }
        if on {
            if let Some(value) = number(ui, value, speed, 0.0..=1e9, suffix) {
                set(true, value);
            }
        } else {
            ui.weak("off");
        }
    });
}

pub fn display(ui: &mut Ui, session: &Session, asked: &mut Asked) {
    let display = session.status().display;
    rows(ui, "display", |ui| {
        row(ui, "exposure", |ui| {
            ui.horizontal(|ui| {
                ui.spacing_mut().slider_width = 84.0;
                if let Some(stops) = slider(ui, f64::from(display.exposure_stops), -8.0..=8.0, false) {
                    asked.send(Command::SetExposure { stops: stops as f32 });
                }
                if ui.button("auto").on_hover_text("by the brightness of the image").clicked() {
                    asked.action = Some(Action::AutoExposure);
                }
            });
        });
        row(ui, "tone curve", |ui| {
            let all = [ToneCurve::Linear, ToneCurve::Neutral, ToneCurve::Filmic];
            if let Some(curve) = choices(ui, Some(display.tone_curve), all.map(|curve| (curve, tone_curve(curve)))) {
                asked.send(Command::SetToneCurve(curve));
            }
        });
        let view_mode = session.world().resource::<ViewMode>().0;
        row_with_hint(ui, "noise", "raw, denoised, or split: raw on the left; F2 goes through them", |ui| {
            let all = Denoising::ALL.map(|denoising| (denoising, denoising.label()));
            if let Some(denoising) = choices(ui, Some(view_mode.denoising), all) {
                asked.send(Command::SetDenoising(denoising));
            }
        });
        let hint = "of images at full resolution; OIDN is Open Image Denoise, where it is installed";
        row_with_hint(ui, "denoiser", hint, |ui| {
            let all = DenoiseFilter::ALL.map(|filter| (filter, filter.short_label()));
            asked.filter = choices(ui, Some(view_mode.filter), all);
        });
        row(ui, "show", |ui| {
            let shown = view_mode.inspection;
            egui::ComboBox::from_id_salt("inspection").selected_text(shown.label()).width(130.0).show_ui(ui, |ui| {
                for inspection in Inspection::ALL {
                    if ui.selectable_label(shown == inspection, inspection.label()).clicked() {
                        asked.send(Command::SetInspection(inspection));
                    }
                }
            })
        });
    });
}
