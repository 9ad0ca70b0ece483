//! Camera pose, lens, and saved views.

use crate::files::printable;
use crate::frame::{
    Bookmarks, Command, CurrentScene, Focus, FocusTarget, Navigation, Session, ViewMode, f_number_decimals, f_stop,
    focal_length, radius_of_f_stop, sharp_zone, vfov_of_focal_length,
};
use crate::scene::{Lens, Projection, View};
use crate::viewer::keys::{Action, with_key};
use crate::viewer::panel::state::{Around, Asked};
use crate::viewer::panel::widgets::{
    choices, length, millimetres, number, proportional, row, row_with_hint, rows, slider, vector, whole,
};
use crate::viewer::status::metres;
use egui::Ui;

pub fn camera(ui: &mut Ui, session: &Session, around: &Around, asked: &mut Asked) {
    let rig = session.status().rig;
    let step = 0.005 * rig.view.pivot_distance;
    rows(ui, "camera", |ui| {
        row(ui, "position", |ui| {
            if let Some(eye) = vector(ui, rig.view.eye, step) {
                asked.send(Command::SetView(View { eye, ..rig.view }));
            }
        });
        row_with_hint(ui, "look at", "the pivot that orbiting moves around", |ui| {
            if let Some(target) = vector(ui, rig.view.pivot(), step)
                && let Ok(view) = View::look_at(rig.view.eye, target, rig.view.up)
            {
                asked.send(Command::SetView(view));
            }
        });
        row(ui, "projection", |ui| {
            let is_orthographic = rig.projection.orthographic_height.is_some();
            let all = [(false, "perspective"), (true, "orthographic")];
            if let Some(orthographic) = choices(ui, Some(is_orthographic), all) {
                let height = 2.0 * rig.projection.half_height(rig.view.pivot_distance);
                let orthographic_height = orthographic.then_some(height);
                asked.send(Command::SetProjection(Projection { orthographic_height, ..rig.projection }));
            }
        });
        match rig.projection.orthographic_height {
            None => {
                let set = |asked: &mut Asked, vfov_deg: f64| {
                    asked.send(Command::SetProjection(Projection { vfov_deg, ..rig.projection }));
                };
                row(ui, "field of view", |ui| {
                    if let Some(vfov_deg) = slider(ui, rig.projection.vfov_deg, 5.0..=120.0, false) {
                        set(asked, vfov_deg);
                    }
                });
                let metres = focal_length(&rig.projection);
                row_with_hint(ui, "focal length", "of the lens, for a sensor 24 mm high", |ui| {
                    if let Some(metres) = millimetres(ui, metres) {
                        set(asked, vfov_of_focal_length(metres));
                    }
                })
            }
            Some(height) => row_with_hint(ui, "height", "of what the image shows, at any distance", |ui| {
                if let Some(height) = number(ui, height, proportional(height), 1e-6..=1e9, " m") {
                    let orthographic_height = Some(height);
                    asked.send(Command::SetProjection(Projection { orthographic_height, ..rig.projection }));
                }
            }),
        };
        row(ui, "fly speed", |ui| asked.speed = slider(ui, around.speed, 1.0 / 64.0..=64.0, true));
        row_with_hint(ui, "drag", "what a drag with the left button does", |ui| {
            if choices(ui, Some(around.orbits), [(false, "look around"), (true, "orbit")]).is_some() {
                asked.action = Some(Action::ToggleDrag);
            }
        });
        row_with_hint(ui, "navigation", "keys and mouse as in this program; H lists them", |ui| {
            let all = Navigation::ALL.map(|navigation| (navigation, navigation.label()));
            asked.navigation = choices(ui, Some(around.navigation), all);
        });
    });
}

/// The cameras of the scene by name, if there is more than one.
fn cameras(ui: &mut Ui, session: &Session, asked: &mut Asked) {
    let Some(scene) = session.world().get_resource::<CurrentScene>() else { return };
    if scene.0.file.cameras.is_empty() {
        return;
    }
    ui.horizontal_wrapped(|ui| {
        ui.weak("cameras");
        for (name, part) in scene.0.file.cameras.iter() {
            let Ok((view, projection, lens)) = part.components() else { continue };
            if ui
                .button(&*printable::name(name))
                .on_hover_text("look through this camera of the scene (F3: the next one)")
                .clicked()
            {
                asked.send(Command::SetView(view));
                asked.send(Command::SetProjection(projection));
                asked.send(Command::SetLens(lens));
            }
        }
    });
}

/// Views to go to, and the turntable.
pub fn views(ui: &mut Ui, session: &Session, around: &Around, asked: &mut Asked) {
    ui.horizontal_wrapped(|ui| {
        for (label, hint, command) in [
            ("Frame", "frame the selection, or the whole scene", Command::FrameAll),
            ("Home", "go to the initial view", Command::Home),
            ("Level", "level the horizon", Command::Level),
            ("Previous", "go to the previous view", Command::PreviousView),
            ("Next", "go to the next view", Command::NextView),
        ] {
            let hint = with_key(around.navigation, hint, &Action::Send(command.clone()));
            if ui.button(label).on_hover_text(hint).clicked() {
                asked.send(command);
            }
        }
        let turntable = ui.selectable_label(around.spinning, "Turntable");
        let hint = with_key(around.navigation, "start or stop orbiting the pivot", &Action::ToggleSpin);
        if turntable.on_hover_text(hint).clicked() {
            asked.action = Some(Action::ToggleSpin);
        }
    });
    cameras(ui, session, asked);
    let bookmarks = session.world().resource::<Bookmarks>();
    ui.horizontal(|ui| {
        ui.spacing_mut().item_spacing.x = 2.0;
        ui.weak("bookmarks")
            .on_hover_text("a click keeps this view under a free number, or goes to that of a taken one");
        for slot in 1..=9 {
            let kept = bookmarks.get(slot).is_some();
            let hint = if kept { "go to the bookmark; Ctrl+click replaces it by this view" } else { "save this view" };
            if ui.selectable_label(kept, slot.to_string()).on_hover_text(hint).clicked() {
                let keep = !kept || ui.input(|input| input.modifiers.command);
                asked.send(if keep { Command::SetBookmark { slot } } else { Command::GoToBookmark { slot } });
            }
        }
    });
}

pub fn lens(ui: &mut Ui, session: &Session, around: &Around, asked: &mut Asked) {
    let rig = session.status().rig;
    let lens = rig.lens;
    let set = |asked: &mut Asked, lens: Lens| asked.send(Command::SetLens(lens));
    let mut enabled = lens.enabled;
    ui.horizontal(|ui| {
        if ui.checkbox(&mut enabled, "depth of field").changed() {
            asked.send(Command::ToggleDepthOfField);
        }
        let looking = session.world().resource::<ViewMode>().0;
        let mut shown = looking.sharp_zone;
        ui.add_enabled_ui(enabled, |ui| {
            if ui.checkbox(&mut shown, "show focus range").changed() {
                asked.send(Command::SetSharpZone { shown });
            }
        });
    });
    rows(ui, "lens", |ui| {
        row(ui, "focus distance", |ui| {
            ui.horizontal(|ui| {
                let distance = lens.focus_distance.min(1e9);
                if let Some(distance) = number(ui, distance, proportional(distance), 1e-6..=1e9, " m") {
                    asked.send(Command::SetFocus { distance });
                }
            })
        });
        row_with_hint(ui, "track", "what the focal plane follows", |ui| {
            ui.horizontal(|ui| {
                let kind = match session.world().resource::<Focus>().target {
                    FocusTarget::Camera => 0,
                    FocusTarget::Point(_) | FocusTarget::Object(..) => 1,
                    FocusTarget::Cursor(_) => 2,
                };
                let [x, y] = around.place;
                let hint = |text: &str, action: Action| with_key(around.navigation, text, &action);
                let object = "follow the selected object, else the point focused on last, when it or the camera moves";
                for (i, (label, hint)) in [
                    ("off", "keep the focus distance".to_owned()),
                    ("object", hint(object, Action::Send(Command::ToggleFocusLock))),
                    ("mouse", hint("follow what is under the mouse", Action::FocusFollows)),
                ]
                .into_iter()
                .enumerate()
                {
                    if !ui.selectable_label(kind == i, label).on_hover_text(hint).clicked() || kind == i {
                        continue;
                    }
                    // Switching between the others goes through the camera.
                    if kind != 0 {
                        asked.send(Command::ToggleFocusLock);
                    }
                    match i {
                        1 => asked.send(Command::ToggleFocusLock),
                        2 => asked.send(Command::FocusFollows { x, y }),
                        _ => {}
                    }
                }
            })
        });
        if !lens.enabled {
            return;
        }
        row(ui, "aperture", |ui| {
            ui.horizontal(|ui| {
                let diameter = 2.0 * lens.radius;
                if let Some(diameter) = length(ui, diameter, proportional(diameter), "diameter of the lens") {
                    asked.send(Command::SetAperture { radius: 0.5 * diameter });
                }
                let stop = f_stop(lens.radius, &rig.projection);
                // Numbers that no photographer knows too: what vanishes while one types leaves the keys to the scene.
                let range = 1e-4..=1e6;
                if rig.projection.orthographic_height.is_some() || !range.contains(&stop) {
                    return;
                }
                let mut new = stop;
                let drag = egui::DragValue::new(&mut new).prefix("f/").speed(0.01 * stop).range(range);
                let drag = drag.max_decimals(f_number_decimals(stop)).update_while_editing(false);
                if ui.add(drag).on_hover_text("f-number, for a sensor 24 mm high").changed() {
                    asked.send(Command::SetAperture { radius: radius_of_f_stop(new, &rig.projection) });
                }
            })
        });
        row(ui, "blades", |ui| {
            ui.horizontal(|ui| {
                if let Some(blades) = whole(ui, lens.blades, 0..=16) {
                    set(asked, Lens { blades, ..lens });
                }
                ui.weak(if lens.blades < 3 { "round" } else { "polygon" });
            })
        });
        row(ui, "blade rotation", |ui| {
            // A round aperture does not change when rotated.
            ui.add_enabled_ui(lens.blades >= 3, |ui| {
                if let Some(turn) = number(ui, lens.blade_rotation_deg, 0.5, -360.0..=360.0, "°") {
                    set(asked, Lens { blade_rotation_deg: turn, ..lens });
                }
            })
            .response
            .on_disabled_hover_text("needs 3 or more blades");
        });
        if let Some(zone) = sharp_zone(&lens, &rig.projection, session.picture().height) {
            row_with_hint(ui, "in focus", "range of distances that are sharp to within one pixel", |ui| {
                ui.label(format!("{} – {}", metres(zone.near), metres(zone.far)))
            });
        }
    });
}
