//! Drawing of the image and the overlays to the window.

use crate::frame::{Command, Edit, Explaining, Navigation, SceneBounds, Selection, StopAt, ViewMode, active_part};
use crate::render::Inspection;
use crate::scene::{FileKind, InputFile};
use crate::viewer::app::{App, REPAINT_DELAY, SLOW, WIDGET_REPAINT_DELAY, outlasts};
use crate::viewer::bar::Figures;
use crate::viewer::keys::{self, Action, with_key};
use crate::viewer::menu::{self, MenuInput};
use crate::viewer::panel::select_number;
use crate::viewer::presenter::{PresentError, Presenter};
use crate::viewer::time_line::Strip;
use crate::viewer::{bar, greeting, help as key_list, overlay, panel, status, story, time_line};
use egui::{Pos2, Rect};
use std::path::Path;
use std::time::{Duration, Instant};
use winit::event_loop::ActiveEventLoop;

impl App {
    /// The texts of the bar: on the left what is on the image, on the right settings and what one may do.
    pub(super) fn figures(&self) -> Figures {
        let (status, world) = (self.session.status(), self.session.world());
        if let Some(grab) = &self.grab {
            return Figures { left: grab.line(), right: Vec::new() };
        }
        let mut right = status::settings(status);
        let is_selected = !world.resource::<Selection>().0.is_empty();
        let hints: &[&str] = match is_selected {
            true => &["right click: what to do with it"],
            false => &["click: select", "drop a file: open"],
        };
        if self.session.needs_keys() {
            let set_key = Action::Send(Command::Edit(Edit::SetKeys { camera: false }));
            right.push(format!("{} keeps this change", with_key(self.input.navigation(), "Set key", &set_key)));
        }
        right.extend(hints.iter().map(|hint| (*hint).to_owned()));
        let is_slow = self.loading_since.is_some_and(|since| since.elapsed() >= SLOW);
        Figures { left: status::line(status, world.resource::<StopAt>().0, is_slow), right }
    }

    fn draw(&mut self, now: Instant) -> Result<(), PresentError> {
        let figures = self.figures();
        let (projector, free) = self.projector();
        self.strip = Strip::of(&self.session);
        let (Some(presenter), Some(window)) = (&mut self.presenter, &self.window) else { return Ok(()) };
        let picture = self.session.picture();
        // When the panel has been opened, until there is as good an image of the new width.
        let is_held = self.held.is_some_and(|restarts| outlasts(restarts, self.session.status(), picture));
        if !is_held && self.shown_picture != Some(picture.number) {
            self.held = None;
            presenter.set_picture(picture, self.input.size()[0] as u32)?;
            tracing::debug!("image {} of view {} at 1/{}", picture.number, picture.generation, picture.divider);
            self.shown_picture = Some(picture.number);
        }
        let wanted = self.session.world().resource::<ViewMode>().0.inspection;
        self.inspected_since = match self.inspected_since {
            _ if wanted == self.session.picture().inspection || wanted == Inspection::Picture => None,
            Some((same, since)) if same == wanted => Some((same, since)),
            _ => Some((wanted, now)),
        };
        let is_late = self.inspected_since.filter(|(_, since)| now >= *since + SLOW);
        self.handles.update(&mut self.session, self.panel.gizmo, projector, free);
        let selected = self.session.world().resource::<Selection>().0.clone();
        self.outlines.leave(self.session.status().restarts);
        self.outlines.update(presenter.egui_context(), &selected, active_part(self.session.world()));
        let (outlines, grab) = (&self.outlines, &self.grab);
        let active = self.session.world().resource::<Selection>().active().filter(|_| self.here.is_open());
        let chosen_name = active.and_then(|entity| self.panel.label_of(&self.session, entity));
        let chosen_name = chosen_name.map(|name| match selected.len() {
            1 => name,
            n => format!("{name} and {} more", n - 1),
        });
        let (session, handles, brush, panel) = (&self.session, &self.handles, &self.brush, &mut self.panel);
        let path_filter = &mut self.path_filter;
        let around = panel::Around {
            reaction: &self.reaction,
            speed: self.input.speed(),
            spinning: self.input.is_spinning(),
            playing: self.input.is_playing(),
            orbits: self.input.orbits(),
            navigation: self.input.navigation(),
            place: self.input.place(),
            memory: panel.shown.then(memory_of_process).flatten(),
            brush: brush.is_armed(),
            recent: self.memory.recent(),
        };
        let mut asked = panel::Asked::default();
        let navigation = self.input.navigation();
        let (question, mut answer) = (&self.leaving.question, None);
        let opening = self.opening_since.filter(|since| now >= *since + SLOW);
        let opening = session.status().opening.zip(opening);
        let (toasts, help, overlays) = (self.toasts.at(now), &mut self.help, self.overlays);
        let (mut clicked, mut clicked_here, mut file, mut greeted) = (None, None, None, None);
        // Once there is something to look at, and nothing more urgent is asked.
        let greets = self.greeting && overlays && question.is_none() && !session.status().scene.is_empty();
        let menu_input = MenuInput { session, navigation, recent: self.memory.recent() };
        let (here, palette, browser) = (&mut self.here, &mut self.palette, &mut self.browser);
        let is_moving = self.input.is_moving() || self.input.is_dragging();
        let (strip, playing) = (self.strip.take(), self.input.is_playing());
        let mut on_strip = Vec::new();
        let (form, renders, mut wish) = (&mut self.form, &self.renders, None);
        let preview = match form.is_open() {
            true => self.form_preview.of(presenter.egui_context(), session, form.size(), is_moving),
            false => {
                self.form_preview.close();
                None
            }
        };
        let chosen_name = chosen_name.as_deref();
        let free_now = &mut self.free;
        let presented = presenter.present(|context| {
            if overlays {
                if let Some(story) = &session.world().resource::<Explaining>().story {
                    story::draw(
                        context,
                        story,
                        path_filter,
                        &projector,
                        session.world().resource::<SceneBounds>().extent.radius,
                    );
                }
                let image = Rect::from_min_size(Pos2::ZERO, egui::vec2(free.x as f32, free.y as f32));
                outlines.draw(context, image);
                let is_over_body = outlines.hovered().is_some_and(|entity| handles.is_body(entity));
                if let Some(cursor) = handles.cursor(is_over_body) {
                    context.set_cursor_icon(cursor);
                }
                handles.draw(context, |entity| outlines.has(entity), outlines.is_looked_for());
                if let Some(grab) = grab {
                    grab.draw(context);
                }
                brush.draw(context, image, session.status());
                clicked = bar::show(context, &menu_input, panel.shown, &figures);
                if let Some(strip) = &strip {
                    on_strip = time_line::show(context, strip, playing);
                }
                if panel.shown {
                    panel::show(context, panel, session, &around, &mut asked);
                }
                renders.show(context, context.available_rect());
                // Beside the panel, above the bar.
                handles.draw_hint(context, context.available_rect(), navigation);
                let picture = session.picture();
                if let Some((inspection, _)) = is_late {
                    overlay::legend(context, &format!("{}: working …", inspection.label()), None);
                } else if picture.inspection != Inspection::Picture {
                    overlay::legend(context, picture.inspection.label(), picture.legend);
                } else if session.world().resource::<SceneBounds>().is_below_ground(session.status().rig.view.eye) {
                    overlay::legend(context, &below_ground(navigation), None);
                }
            }
            clicked = clicked.take().or(overlay::toasts(context, toasts));
            if let Some((stage, since)) = opening {
                let text = session.status().loading.as_deref().unwrap_or_default();
                overlay::opening(context, stage, text, (now - since).as_secs());
            }
            clicked_here = here.show(context, &menu_input, chosen_name);
            if greets {
                greeted = greeting::show(context);
            }
            wish = form.show(context, session, preview.as_ref());
            file = browser.show(context);
            let found = palette.show(context, || menu::all(&menu_input));
            clicked = clicked.take().or(found);
            if help.open {
                key_list::draw(context, help, navigation);
            }
            if let Some(question) = question {
                answer = question.show(context);
            }
            *free_now = context.available_rect();
            select_number(context);
        })?;
        if !presented.again {
            let picture = self.session.picture();
            let generation = picture.generation;
            self.session.note_seen(picture.number);
            self.reaction.shown(generation, Instant::now());
            // A pending movement may have been waiting for this image.
            self.needs_tick |= generation > self.seen;
            self.seen = generation;
        }
        tracing::trace!("drawn in {:.1} ms", now.elapsed().as_secs_f64() * 1e3);
        if presented.again {
            window.request_redraw();
        }
        let soonest = if self.has_widgets() { WIDGET_REPAINT_DELAY } else { REPAINT_DELAY };
        let repaint_after = Some(presented.repaint_after.max(soonest)).filter(|wait| *wait < Duration::MAX);
        let repaint_at = repaint_after.and_then(|wait| now.checked_add(wait));
        let late_at = self.inspected_since.filter(|_| is_late.is_none()).map(|(_, since)| since + SLOW);
        self.repaint_at = repaint_at.into_iter().chain(late_at).min();
        (self.last_draw, self.unseen_since) = (Some(now), None);
        self.shown_figures = figures;
        self.leave_room(now)?;
        // The overlays may have requested a repaint that the last tick did not know.
        self.wake_at = self.wake_at.into_iter().chain(self.repaint_at).min();
        self.execute(asked, now);
        self.strip = strip;
        self.follow_strip(on_strip, now);
        if let Some(navigation) = greeted {
            self.greeting = false;
            self.set_navigation(navigation, now);
        }
        if let Some((purpose, path)) = file {
            self.take_file(purpose, path, now);
        }
        if let Some(wish) = wish {
            self.grant(wish, now);
        }
        if let Some(action) = clicked {
            self.act(action);
        }
        if let Some((action, place)) = clicked_here {
            self.act_at(menu::at(action, place), place);
        }
        if let Some(answer) = answer {
            self.leaving.answer = Some(answer);
            self.needs_tick = true;
        }
        Ok(())
    }

    /// Draws. If the graphics device is lost, creates a new one; if that fails too, saves the film and closes the
    /// window.
    pub(super) fn draw_or_leave(&mut self, event_loop: &ActiveEventLoop) {
        let now = Instant::now();
        let Err(error) = self.draw(now) else { return };
        log::error!("{error}");
        self.presenter = None;
        self.shown_picture = None;
        let again = self.window.clone().map(Presenter::new);
        match again {
            Some(Ok(presenter)) => {
                overlay::style(presenter.egui_context());
                self.presenter = Some(presenter);
                if self.draw(now).is_ok() {
                    return;
                }
            }
            Some(Err(error)) => log::error!("{error}"),
            None => {}
        }
        self.screenshot(true);
        self.failure = Some(error.into());
        event_loop.exit();
    }
}

/// What is said of an empty image, and the way out of it.
fn below_ground(navigation: Navigation) -> String {
    let key = keys::shortcut(navigation, &Action::Send(Command::Home));
    format!("below the ground: {} goes back", key.as_deref().unwrap_or("View, Initial view"))
}

/// Memory of the process in bytes, if the system reports it.
fn memory_of_process() -> Option<u64> {
    let statm = InputFile::open(Path::new("/proc/self/statm"), FileKind::Settings).ok()?.text().ok()?;
    let pages: u64 = statm.split_whitespace().nth(1)?.parse().ok()?;
    Some(pages * PAGE)
}

/// Page size in bytes of Linux on the supported processors.
const PAGE: u64 = 4096;
