//! Actions of keys and of the panel.

use crate::console;
use crate::frame::navigation::Rig;
use crate::frame::{
    Command, Denoising, Edit, Explaining, Focus, FocusTarget, LeftView, Navigation, PictureFormat, Selection, ViewMode,
    gizmo,
};
use crate::render::{Inspection, Integrator};
use crate::viewer::app::App;
use crate::viewer::dialog::DialogPurpose;
use crate::viewer::keys::{Action, with_key};
use crate::viewer::panel::{DroppedMaterial, NOTHING_SELECTED};
use crate::viewer::saver::{DenoiseWith, Saved, Shown, new_file};
use crate::viewer::time_line::{Ask, NOTHING_MOVES, Strip};
use crate::viewer::toasts::{IN_FOLDER, Tone};
use crate::viewer::{camera_text, file_manager, panel};
use std::path::{Path, PathBuf};
use std::time::Instant;
use winit::window::{CursorGrabMode, Fullscreen};

/// Begins what is said about focus while depth of field is off.
pub(super) const FOCUS_IS_UNSEEN: &str = "focus is set, but everything is sharp";
/// The built-in scene without anything in it.
const EMPTY_SCENE: &str = "studio";
/// Says that a scene was left at another view.
pub(super) const LEFT: &str = "another view was left here last time";

impl App {
    /// Executes the requests of the panel.
    pub(super) fn execute(&mut self, asked: panel::Asked, now: Instant) {
        if !asked.commands.is_empty() {
            self.reaction.asked(now);
            self.needs_tick = true;
        }
        let dropped = asked.dropped.map(|(material, place)| self.drop_material(material, place, now));
        for command in dropped.into_iter().flatten().chain(asked.commands) {
            self.open(command, now);
        }
        if let Some(speed) = asked.speed {
            self.input.set_speed(speed, now);
        }
        if let Some(navigation) = asked.navigation {
            self.set_navigation(navigation, now);
        }
        if let Some(purpose) = asked.dialog {
            self.ask_for_file(purpose, now);
        }
        if let Some(filter) = asked.filter {
            match filter.check() {
                Ok(()) => self.session.send(Command::SetDenoiseFilter(filter)),
                Err(error) => self.toasts.add(Tone::Problem, error, now),
            }
        }
        if asked.save_layers {
            self.save_layers(now);
        }
        if let Some(action) = asked.action {
            self.act(action);
        }
    }

    /// The commands that give a material to the object at a place of the window, points.
    fn drop_material(&mut self, material: DroppedMaterial, place: egui::Pos2, now: Instant) -> Vec<Command> {
        let pixel = [place.x, place.y].map(|points| f64::from(points) * self.scale());
        let ([x, y], is_free) = (self.input.fractions(pixel), !self.has_widget_at(pixel));
        let Some(object) = self.session.entity_at(x, y).filter(|_| is_free) else {
            self.toasts.add(Tone::News, "there is no object: drop the material on one", now);
            return Vec::new();
        };
        let give = match material {
            DroppedMaterial::Ready(name) => Edit::Dress { name },
            DroppedMaterial::Own(material) => Edit::Assign { id: object.to_bits(), material: material.to_bits() },
        };
        vec![Command::Edit(Edit::PickAt { x, y, add: false }), Command::Edit(give)]
    }

    /// Does what the time line asks for.
    pub(super) fn follow_strip(&mut self, asked: Vec<Ask>, now: Instant) {
        for ask in asked {
            self.needs_tick = true;
            match ask {
                Ask::Act(action) => self.act(action),
                Ask::Send(command) => {
                    self.reaction.asked(now);
                    match command {
                        Command::SetPlayRange { seconds: Some(_) } => {
                            let news = "plays and renders this part until another scene opens; no file keeps it";
                            self.toasts.add(Tone::News, news, now);
                        }
                        Command::SetPlayRange { seconds: None } => self.toasts.end("plays"),
                        _ => {}
                    }
                    self.session.send(command);
                }
            }
        }
    }

    /// The mouse position in points, the unit of overlays.
    pub(super) fn mouse(&self) -> glam::DVec2 {
        glam::DVec2::from_array(self.input.cursor_place()) / self.scale()
    }

    /// Physical pixels per point.
    pub(super) fn scale(&self) -> f64 {
        self.presenter.as_ref().map_or(1.0, |presenter| f64::from(presenter.pixels_per_point()))
    }

    pub(super) fn act(&mut self, action: Action) {
        self.act_at(action, self.input.place());
    }

    /// Shows the menu of the image under the mouse, and selects what is there.
    pub(super) fn open_menu_here(&mut self) {
        let [x, y] = self.input.place();
        let there = self.session.entity_at(x, y);
        let selected = &self.session.world().resource::<Selection>().0;
        // One object alone may have several parts.
        if selected.len() < 2 || there.is_none_or(|entity| !selected.contains(&entity)) {
            self.session.send(Command::Edit(Edit::PickAt { x, y, add: false }));
        }
        let point = self.mouse();
        self.here.open(egui::pos2(point.x as f32, point.y as f32), [x, y]);
    }

    /// Says that focus is not seen while depth of field is off.
    pub(super) fn offer_depth_of_field(&mut self, now: Instant) {
        if !self.session.status().rig.lens.enabled {
            let switch = Action::Send(Command::ToggleDepthOfField);
            let off = with_key(self.input.navigation(), "depth of field is off", &switch);
            let text = format!("{FOCUS_IS_UNSEEN}: {off}");
            self.toasts.add_offer(Tone::News, text, ("Switch it on", switch), now);
        }
    }

    /// Carries out an action; one that is about a place of the image, at `place`, fractions of its size.
    pub(super) fn act_at(&mut self, action: Action, place: [f64; 2]) {
        let now = Instant::now();
        let [x, y] = place;
        self.needs_tick = true;
        match action {
            Action::Send(command) => {
                let wants_selection = matches!(command, Command::Edit(Edit::Delete | Edit::Duplicate));
                if wants_selection && self.session.world().resource::<Selection>().0.is_empty() {
                    self.toasts.add(Tone::News, NOTHING_SELECTED, now);
                }
                self.open(command, now);
            }
            Action::TogglePause => {
                let paused = self.session.status().paused;
                self.session.send(if paused { Command::Resume } else { Command::Pause });
            }
            Action::ToggleIntegrator => {
                let other = match self.session.status().integrator {
                    Integrator::Path => Integrator::Phong,
                    Integrator::Phong => Integrator::Path,
                };
                self.session.send(Command::SetIntegrator(other));
            }
            Action::Screenshot { linear } => self.screenshot(linear),
            Action::RenderTo { frames } => self.open_form(frames, now),
            Action::SaveScene { new: false } if self.session.scene_file().is_some() => self.save_scene(),
            Action::SaveScene { .. } => self.choose_place(DialogPurpose::SaveScene, &self.scene_path(true)),
            Action::CopyView => {
                let text = camera_text::camera_text(&self.session.status().rig);
                // Whoever started from a desktop has no terminal.
                let _ = console::print(console::lines(&text));
                self.copy(|context| context.copy_text(text));
                self.toasts.add(Tone::News, "camera copied to the clipboard, for a scene file", now);
            }
            Action::CopyImage => self.copy_image(now),
            Action::ShowSaved => self.show_saved(now),
            Action::ReturnTo(left) => {
                let LeftView { rig: Rig { view, projection, lens }, display } = *left;
                let commands = [
                    Command::SetView(view),
                    Command::SetProjection(projection),
                    Command::SetLens(lens),
                    Command::SetExposure { stops: display.exposure_stops },
                    Command::SetToneCurve(display.tone_curve),
                ];
                commands.into_iter().for_each(|command| self.session.send(command));
                self.toasts.end(LEFT);
            }
            Action::AutoExposure => self.set_exposure(now),
            Action::Explain => self.session.send(Command::ExplainAt { x, y }),
            Action::FocusHere => {
                self.session.send(Command::FocusAt { x, y });
                self.session.send(Command::PivotAt { x, y });
                self.offer_depth_of_field(now);
            }
            Action::Brush => self.toggle_brush(now),
            Action::ClearRegion => self.session.send(Command::SetRegion { region: None }),
            Action::Inspect(inspection) => {
                let shown = self.session.world().resource::<ViewMode>().0.inspection;
                let wanted = if shown == inspection { Inspection::Picture } else { inspection };
                self.session.send(Command::SetInspection(wanted));
            }
            Action::ToggleSharpZone => {
                let shown = !self.session.world().resource::<ViewMode>().0.sharp_zone;
                self.session.send(Command::SetSharpZone { shown });
                if shown && !self.session.status().rig.lens.enabled {
                    self.toasts.add(Tone::News, "depth of field is off: press O to enable it", now);
                }
            }
            Action::NextGizmo => {
                let modes = gizmo::Mode::ALL;
                self.panel.gizmo = match self.panel.gizmo {
                    None => Some(modes[0]),
                    Some(mode) => modes.into_iter().skip_while(|other| *other != mode).nth(1),
                };
                self.announce_handles(now);
            }
            Action::Gizmo(mode) => {
                self.panel.gizmo = mode;
                self.announce_handles(now);
            }
            Action::Grab(mode) => self.begin_grab(mode, now),
            Action::GrabCopy => self.grab_copy(now),
            Action::TogglePlay => self.toggle_play(now),
            Action::PlayRange(end) => {
                if let Some((strip, frame)) =
                    Strip::of(&self.session).and_then(|strip| strip.frame.map(|at| (strip, at)))
                {
                    self.session.send(strip.with_end(end, frame.round()));
                }
            }
            Action::PlayAll => self.session.send(Command::SetPlayRange { seconds: None }),
            Action::ToggleSpin => {
                if !self.input.is_spinning() {
                    // What was last orbited about may be a point of the floor.
                    self.session.send(Command::PivotOnMiddle);
                }
                self.input.toggle_spin(now);
            }
            Action::PlayOrDrag if Strip::of(&self.session).is_some() => self.toggle_play(now),
            Action::PlayOrDrag | Action::ToggleDrag => self.toggle_drag(now),
            Action::CaptureMouse => self.capture_mouse(!self.input.is_captured(), now),
            Action::FocusFollows => {
                let follows = self.session.world().resource::<Focus>().target;
                self.session.send(match follows {
                    FocusTarget::Cursor(_) => Command::ToggleFocusLock,
                    _ => Command::FocusFollows { x, y },
                });
            }
            Action::OpenDialog => self.ask_for_file(DialogPurpose::Open, now),
            Action::NewScene => self.open(Command::Open { path: EMPTY_SCENE.into() }, now),
            Action::AddDialog(at) => self.ask_for_file(DialogPurpose::AddMesh { at }, now),
            Action::EnvironmentDialog => self.ask_for_file(DialogPurpose::Environment, now),
            Action::TogglePanel => self.panel.shown = !self.panel.shown,
            Action::Section(title) => {
                (self.panel.shown, self.panel.section) = (true, Some(title));
                self.overlays = true;
            }
            Action::Palette => self.palette.open(""),
            Action::PaletteOf(search) => self.palette.open(search),
            Action::ToggleHelp => self.help.toggle(),
            Action::ToggleOverlays => {
                self.overlays = !self.overlays;
                if !self.overlays {
                    self.toasts.add(Tone::News, "Tab or Esc shows everything again", now);
                }
            }
            Action::ToggleFullscreen => {
                if let Some(window) = &self.window {
                    let full = window.fullscreen().is_some();
                    window.set_fullscreen((!full).then_some(Fullscreen::Borderless(None)));
                }
            }
            Action::Leave if self.input.is_captured() => self.capture_mouse(false, now),
            Action::Leave if self.help.open => self.help.open = false,
            Action::Leave if !self.overlays => self.overlays = true,
            Action::Leave if self.brush.is_armed() => drop(self.brush.toggle()),
            Action::Leave if self.session.world().resource::<Explaining>().story.is_some() => {
                self.session.send(Command::ForgetExplanation);
            }
            Action::Leave if !self.session.world().resource::<Selection>().0.is_empty() => {
                self.session.send(Command::Edit(Edit::SelectNone));
            }
            Action::Leave => self.toasts.add(Tone::News, "Ctrl+Q closes the window", now),
            Action::Quit => self.leaving.wanted = true,
        }
        self.repaint_at = Some(now);
    }

    /// Saves to the scene's own file, or to a new one if it has none.
    pub(super) fn save_scene(&mut self) {
        let path = self.scene_path(false);
        self.session.send(Command::SaveScene { path });
    }

    pub(super) fn scene_path(&self, new: bool) -> PathBuf {
        let known = self.session.scene_file().filter(|_| !new);
        known.unwrap_or_else(|| new_file(&self.options.folder, &self.session.status().scene, "ron", &[]))
    }

    fn toggle_play(&mut self, now: Instant) {
        let Some(strip) = Strip::of(&self.session) else {
            return self.toasts.add(Tone::News, NOTHING_MOVES, now);
        };
        if let Some(command) = strip.before_play(self.input.is_playing()) {
            self.session.send(command);
        }
        self.input.toggle_play(now);
    }

    fn announce_handles(&mut self, now: Instant) {
        let name = self.panel.gizmo.map_or("none", gizmo::Mode::label);
        let is_empty = self.session.world().resource::<Selection>().0.is_empty();
        let hint = if is_empty && self.panel.gizmo.is_some() { " (click an object)" } else { "" };
        self.toasts.add(Tone::News, format!("handles: {name}{hint}"), now);
    }

    /// Sets keys and gestures, for this window and later ones.
    pub(super) fn set_navigation(&mut self, navigation: Navigation, now: Instant) {
        self.input.set_navigation(navigation, now);
        self.greeting = false;
        let trouble = self.memory.keep_navigation(navigation);
        self.toasts.add(Tone::News, format!("navigation: {} (H lists the keys)", navigation.label()), now);
        if let Some(trouble) = trouble {
            self.toasts.add(Tone::Problem, trouble, now);
        }
    }

    fn toggle_drag(&mut self, now: Instant) {
        let orbits = self.input.toggle_orbits();
        self.toasts.add(Tone::News, if orbits { "drag: orbit" } else { "drag: look around" }, now);
    }

    /// Captures the mouse, so that it turns the view without a button, or releases it.
    pub(super) fn capture_mouse(&mut self, wanted: bool, now: Instant) {
        let Some(window) = self.window.clone().filter(|_| wanted != self.input.is_captured()) else { return };
        if !wanted {
            // An error does not matter: a window that cannot release the mouse is about to close.
            let _ = window.set_cursor_grab(CursorGrabMode::None);
        } else if let Err(error) =
            window.set_cursor_grab(CursorGrabMode::Locked).or_else(|_| window.set_cursor_grab(CursorGrabMode::Confined))
        {
            self.toasts.add(Tone::Problem, format!("cannot capture the mouse: {error}"), now);
            return;
        }
        window.set_cursor_visible(!wanted);
        self.input.set_captured(wanted);
        if wanted {
            self.toasts.add(Tone::News, "mouse captured: Enter or Esc releases it", now);
        }
    }

    /// Shows a dialog; [`Self::take_files`] receives the result.
    fn ask_for_file(&mut self, purpose: DialogPurpose, now: Instant) {
        let folder = self.session.scene_file().and_then(|path| path.parent().map(Path::to_path_buf));
        // A file name alone is in the folder in which the program runs.
        let folder = folder.filter(|folder| !folder.as_os_str().is_empty());
        let chosen = self.dialog.chosen_from(purpose);
        let folder = if purpose.adds() { chosen.or(folder) } else { folder.or(chosen) };
        let folder = folder.or_else(|| self.memory.last_folder());
        let folder = folder.unwrap_or_else(|| self.options.folder.clone());
        match self.dialog.ask(purpose, &folder) {
            Ok(true) => {}
            Ok(false) => {
                let screen = self.presenter.as_ref().map(|presenter| presenter.egui_context().content_rect().size());
                self.browser.open(purpose, &folder, "", screen.unwrap_or_default());
                self.repaint_at = Some(now);
            }
            Err(reason) => self.toasts.add(Tone::Problem, reason, now),
        }
    }

    /// Does what a file was chosen for.
    pub(super) fn take_file(&mut self, purpose: DialogPurpose, path: PathBuf, now: Instant) {
        self.dialog.remember(purpose, &path);
        match purpose.command(path.clone()) {
            Some(command) => self.open(command, now),
            None => self.form.place(purpose, path),
        }
    }

    /// Executes the results of dialogs.
    pub(super) fn take_files(&mut self, now: Instant) {
        for answer in self.dialog.answers() {
            match answer {
                Ok((purpose, path)) => {
                    self.reaction.asked(now);
                    self.take_file(purpose, path, now);
                }
                Err(reason) => self.toasts.add(Tone::Problem, reason, now),
            }
        }
    }

    /// Names what has been selected: of a floor there is no outline, and its handles may lie behind other things.
    pub(super) fn tell_selection(&mut self, now: Instant) {
        let selected = self.session.world().resource::<Selection>().active();
        if std::mem::replace(&mut self.selected, selected) != selected
            && let Some(label) = selected.and_then(|entity| self.panel.label_of(&self.session, entity))
        {
            self.toasts.add(Tone::News, format!("selected: {label}"), now);
        }
    }

    fn toggle_brush(&mut self, now: Instant) {
        if self.brush.toggle() {
            self.toasts.add(Tone::News, "region: drag a rectangle to render", now);
        }
    }

    pub(super) fn screenshot(&mut self, linear: bool) {
        // The film arrives when the workers have time for it; the key press is acknowledged at once.
        self.toasts.add_progress("screenshot: saving …", Instant::now());
        if let Some(window) = &self.window {
            window.request_redraw();
        }
        let format = if linear { PictureFormat::Exr } else { PictureFormat::Png };
        let status = self.session.status();
        let size = self.input.size().map(|side| side.max(1.0) as u32).into();
        let (display, scene) = (status.display, status.scene.clone());
        let draft = (!scene.is_empty()).then(|| self.session.shot_draft());
        // A PNG looks like the window; linear light is what the samples say.
        let look = self.session.world().resource::<ViewMode>().0;
        let denoiser = (!linear && look.denoising != Denoising::Raw).then_some(look.filter);
        let threads = self.session.status().threads;
        let denoise = denoiser
            .and_then(|filter| self.session.rendered().map(|rendered| (filter, rendered)))
            .map(|(filter, (prepared, settings))| DenoiseWith { prepared, settings, filter, threads });
        self.saver.leave_free(self.renders.paths());
        self.saver.save((self.session.keep_film(denoise.is_some()), denoise), draft, display, size, &scene, format);
    }

    /// Saves the image with all layers, in the size of the window.
    fn save_layers(&mut self, now: Instant) {
        let names = self.session.feature_names();
        let Some((names, (prepared, settings))) = names.zip(self.session.rendered()) else { return };
        self.toasts.add_progress("screenshot: saving layers …", now);
        let size = self.input.size().map(|side| side.max(1.0) as u32).into();
        let status = self.session.status();
        let (display, scene, threads) = (status.display, status.scene.clone(), status.threads);
        let draft = (!scene.is_empty()).then(|| self.session.shot_draft());
        let filter = self.session.world().resource::<ViewMode>().0.filter;
        let shown = Shown { prepared, names, settings, filter, threads, size };
        self.saver.leave_free(self.renders.paths());
        self.saver.save_layers(self.session.keep_film(false), shown, draft, display, &scene);
    }

    fn copy_image(&mut self, now: Instant) {
        let picture = self.session.picture();
        let size = [picture.width as usize, picture.height as usize];
        if picture.rgba.is_empty() {
            return;
        }
        let image = egui::ColorImage::from_rgba_unmultiplied(size, &picture.rgba);
        self.copy(|context| context.copy_image(image));
        self.toasts.add(Tone::News, "image copied to the clipboard", now);
    }

    /// Opens the folder of what was saved last; without a program for it, copies its path.
    fn show_saved(&mut self, now: Instant) {
        let Some(path) = self.last_saved.clone() else {
            self.toasts.add(Tone::News, "nothing has been saved yet", now);
            return;
        };
        // Without a program of the desktop, the browser of this one shows it.
        if let Err(reason) = file_manager::show(&path) {
            log::info!("{reason}");
            self.choose_place(DialogPurpose::Open, &path);
            self.repaint_at = Some(now);
        }
    }

    /// Has something copied to the clipboard when the window is drawn next.
    fn copy(&mut self, what: impl FnOnce(&egui::Context)) {
        if let Some(presenter) = &self.presenter {
            what(presenter.egui_context());
        }
    }

    /// Says that something was saved, and where.
    pub(super) fn tell_saved(&mut self, path: PathBuf, news: String, now: Instant) {
        // Whoever was elsewhere meanwhile finds it in the list of messages.
        self.session.log_saved(news.clone());
        self.toasts.add_offer(Tone::News, news, IN_FOLDER, now);
        self.last_saved = Some(path);
    }

    pub(super) fn report_saved(&mut self, saved: Saved) {
        let now = Instant::now();
        match saved {
            Ok(kept) => {
                let coarse = if kept.coarse { " (low resolution: the view changed too soon)" } else { "" };
                // The whole path: a window has no folder that one could see.
                let path = std::path::absolute(&kept.path).unwrap_or_else(|_| kept.path.clone());
                let news = format!("saved {}{coarse}", path.display());
                console::inform(&news);
                // Replaces the message that saving has started.
                self.tell_saved(path, format!("screenshot: {news}"), now);
            }
            Err(error) => {
                console::remark(format_args!("error: {error}"));
                self.toasts.end("screenshot:");
                self.toasts.add(Tone::Problem, error, now);
            }
        }
    }
}
