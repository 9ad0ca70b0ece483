//! The list of everything that emits light, and the environment.

use crate::files::printable;
use crate::format::property::SkyProperty;
use crate::frame::{Edit, NewThing, Property, Selection, Session, sky_strength};
use crate::render::{Environment, MaterialKind};
use crate::scene::animation::LightProperty;
use crate::scene::light_of;
use crate::scene::{
    ColorParam, EnvironmentSource, GRADIENT, LightEntry, Material, MaterialProperty, SceneEnvironment, SurfaceMaterial,
};
use crate::viewer::dialog::DialogPurpose;
use crate::viewer::panel::list::{Listed, Which, list};
use crate::viewer::panel::selected::property_row;
use crate::viewer::panel::state::{Asked, PanelState};
use crate::viewer::panel::sun::{DAYS, SunPlace, SunTime, TILT, date_of, date_text, hour_of, hour_text};
use crate::viewer::panel::widgets::{
    RADIANCE, color, number, row, row_with_hint, rows, selectable, short_color, strength_drag,
};
use bevy_ecs::prelude::Entity;
use egui::{DragValue, RichText, Ui};
use glam::{DVec3, Vec3};
use std::path::Path;

impl Listed for LightEntry {
    fn listed(&self) -> (Entity, &str, &str) {
        (self.entity, &self.label, self.kind)
    }
}

pub fn lights(ui: &mut Ui, state: &mut PanelState, session: &Session, asked: &mut Asked) {
    let inventory = state.inventory(session);
    let selection = session.world().resource::<Selection>();
    let which = Which { id: "lights", revision: session.revision(), chosen: selection.active(), height: 0.0 };
    list(ui, &mut state.light_list, &which, &inventory.lights, |ui, entry| {
        emission(ui, session, entry, asked);
        selectable(ui, entry, session.world(), asked);
    });
    let environment = &session.inputs().environment;
    let light = &environment.light;
    rows(ui, "environment strength", |ui| {
        let hint = "radiance of the brightest colour, or scale factor of the image";
        row_with_hint(ui, "environment", hint, |ui| {
            ui.horizontal(|ui| {
                if let Some(strength) = strength_drag(ui, f64::from(sky_strength(light)), "") {
                    set_sky(asked, Property::SkyStrength, DVec3::splat(strength));
                }
                ui.label(RichText::new(kind_of_sky(environment)).size(11.0).weak());
            })
        });
    });
    ui.horizontal(|ui| {
        ui.weak("add");
        for (label, thing) in NewThing::NAMED {
            if let Some(kind) = label.strip_suffix(" light")
                && ui.button(kind).clicked()
            {
                asked.edit(Edit::Add(thing));
            }
        }
    });
}

/// Colour and strength of a light, editable in its row.
fn emission(ui: &mut Ui, session: &Session, entry: &LightEntry, asked: &mut Asked) {
    let world = session.world();
    ui.spacing_mut().interact_size.x = 30.0;
    if let Some(light) = light_of(world, entry.entity) {
        if let Some(value) = short_color(ui, light.strength(), Some(LightProperty::strength_of(&light).info().unit)) {
            let property = LightProperty::strength_of(&light);
            asked.edit(Edit::Set { id: entry.entity.to_bits(), property: Property::Light(property), value });
        }
        return;
    }
    let Some(id) = entry.material else { return };
    let (radiance, property) = match SurfaceMaterial::of(world, id) {
        Some(Material::Emissive { radiance }) => (radiance, MaterialProperty::main_color(MaterialKind::Emissive)),
        Some(Material::Principled { emission, .. }) => (emission, MaterialProperty::named("emission")),
        _ => return,
    };
    match radiance {
        ColorParam::Rgb(rgb) => {
            if let Some(value) = short_color(ui, *rgb, Some(RADIANCE)) {
                let property = Property::Material(property.expect("it is in the table"));
                asked.edit(Edit::Set { id: id.to_bits(), property, value });
            }
        }
        ColorParam::Texture(texture) => drop(ui.weak(&*printable::name(&texture.name))),
    }
}

fn kind_of_sky(environment: &SceneEnvironment) -> &'static str {
    match &environment.light {
        _ if matches!(environment.part, EnvironmentSource::Sky { .. }) => "clear sky",
        Environment::Black => "black",
        Environment::Constant(_) => "constant",
        Environment::Gradient { .. } => "gradient",
        Environment::Image { .. } => "image",
    }
}

fn strength_row(ui: &mut Ui, asked: &mut Asked, scale: Vec3) {
    row(ui, "strength", |ui| {
        if let Some(strength) = strength_drag(ui, f64::from(scale.max_element()), "") {
            set_sky(asked, Property::SkyStrength, DVec3::splat(strength));
        }
    });
}

fn set_sky(asked: &mut Asked, property: Property, value: DVec3) {
    asked.edit(Edit::Set { id: 0, property, value });
}

fn one_color(ui: &mut Ui, asked: &mut Asked, name: &str, value: Vec3, property: Property) {
    color_row(ui, asked, name, value, property, Some(RADIANCE));
}

fn color_row(ui: &mut Ui, asked: &mut Asked, name: &str, value: Vec3, property: Property, unit: Option<&str>) {
    row(ui, name, |ui| {
        if let Some(value) = color(ui, value, unit) {
            set_sky(asked, property, value);
        }
    });
}

/// The rows of a clear sky that set its sun by the time.
fn sun_rows(ui: &mut Ui, place: &mut SunPlace, sky: &EnvironmentSource, asked: &mut Asked) {
    let (Some(elevation), Some(azimuth)) = (SkyProperty::Elevation.get(sky), SkyProperty::Azimuth.get(sky)) else {
        return;
    };
    let now = SunTime::of([elevation, azimuth], place.latitude);
    let mut new = now;
    row(ui, "time of day", |ui| {
        let half = now.half_day(place.latitude);
        // Clamped by the field, it would be an edit that nobody made.
        let mut hour = now.hour.clamp(12.0 - half, 12.0 + half);
        let drag = DragValue::new(&mut hour).speed(0.02).range(12.0 - half..=12.0 + half);
        let drag = drag.custom_formatter(|hour, _| hour_text(hour)).custom_parser(hour_of);
        if ui.add(drag.update_while_editing(false)).changed() {
            new.hour = hour;
        }
    });
    row(ui, "date", |ui| {
        let mut day = place.day_of(now.declination).clamp(1.0, DAYS);
        let drag = DragValue::new(&mut day).speed(0.5).range(1.0..=DAYS).max_decimals(0);
        let drag = drag.custom_formatter(|day, _| date_text(day)).custom_parser(date_of);
        if ui.add(drag.update_while_editing(false)).changed() {
            new.declination = place.go_to(day);
        }
    });
    let mut latitude = place.latitude;
    row(ui, "latitude", |ui| {
        latitude = number(ui, latitude, 0.2, -89.0..=89.0, "°").unwrap_or(latitude);
    });
    if new == now && latitude == place.latitude {
        return;
    }
    place.latitude = latitude;
    // A sun that was set by its angles may be where it never is.
    new.declination = new.declination.clamp(-TILT, TILT);
    let half = new.half_day(latitude);
    new.hour = new.hour.clamp(12.0 - half, 12.0 + half);
    let [elevation, azimuth] = new.direction(latitude);
    for (property, value) in [(SkyProperty::Elevation, elevation.max(0.0)), (SkyProperty::Azimuth, azimuth)] {
        asked.edit(Edit::Set { id: 0, property: Property::ClearSky(property), value: DVec3::splat(value) });
    }
}

/// Strength of a clear sky with which white in full sun is the white of the display.
const IN_THE_SUN: f64 = 2.0;

/// Azimuth of a direction, whole degrees from -Z, clockwise as seen from above.
fn azimuth_of(direction: DVec3) -> f64 {
    direction.x.atan2(-direction.z).to_degrees().round()
}

/// The colours of the environment one by one, or its image.
pub fn sky(ui: &mut Ui, sun: &mut SunPlace, session: &Session, asked: &mut Asked) {
    let environment = &session.inputs().environment;
    rows(ui, "sky", |ui| match &environment.light {
        Environment::Black => one_color(ui, asked, "radiance", Vec3::ZERO, Property::Sky),
        Environment::Constant(radiance) => one_color(ui, asked, "radiance", *radiance, Property::Sky),
        Environment::Gradient { zenith, horizon, ground } => {
            one_color(ui, asked, "zenith", *zenith, Property::Zenith);
            one_color(ui, asked, "horizon", *horizon, Property::Horizon);
            one_color(ui, asked, "ground", *ground, Property::Ground);
        }
        Environment::Image { scale, rotation, .. } => {
            if let EnvironmentSource::Sky { ground, .. } = &environment.part {
                for property in SkyProperty::ALL {
                    let value = property.get(&environment.part).map(DVec3::splat);
                    property_row(ui, 0, Property::ClearSky(*property), property.info(), value, asked);
                }
                sun_rows(ui, sun, &environment.part, asked);
                strength_row(ui, asked, *scale);
                return color_row(ui, asked, "ground", ground.0, Property::Ground, None);
            }
            let (file, angle_deg) = match &environment.part {
                EnvironmentSource::Image { file, rotate, .. } => (file.as_str(), *rotate),
                _ => ("?", f64::from(rotation.to_degrees())),
            };
            // The name, which is at the end of a path, is what tells images apart.
            let name = Path::new(file).file_name().unwrap_or_default().to_string_lossy();
            row(ui, "image", |ui| {
                ui.add(egui::Label::new(&*printable::name(&name)).truncate()).on_hover_text(printable::name(file))
            });
            strength_row(ui, asked, *scale);
            row(ui, "rotation", |ui| {
                if let Some(angle_deg) = number(ui, angle_deg, 0.5, -360.0..=360.0, "°") {
                    set_sky(asked, Property::SkyRotation, DVec3::splat(angle_deg));
                }
            });
        }
    });
    ui.horizontal(|ui| {
        let is_clear = matches!(environment.part, EnvironmentSource::Sky { .. });
        let is_even = matches!(environment.light, Environment::Black | Environment::Constant(_));
        if !is_even && ui.button("one colour").on_hover_text("the same light from everywhere").clicked() {
            let strength = sky_strength(&environment.light).min(1.0);
            set_sky(asked, Property::Sky, DVec3::splat(f64::from(strength)));
        }
        let is_gradient = matches!(environment.light, Environment::Gradient { .. });
        let hint = "from zenith to horizon, and another colour below";
        if !is_gradient && ui.button("gradient").on_hover_text(hint).clicked() {
            set_sky(asked, Property::Zenith, GRADIENT[0].as_dvec3());
        }
        if !is_clear && ui.button("clear sky").on_hover_text("sun and sky, as they are outside").clicked() {
            let status = session.status();
            set_sky(asked, Property::ClearSky(SkyProperty::Elevation), DVec3::splat(45.0));
            let azimuth = SkyProperty::Azimuth;
            set_sky(asked, Property::ClearSky(azimuth), DVec3::splat(azimuth_of(status.rig.view.right())));
            let strength = IN_THE_SUN / f64::from(status.display.exposure_stops).exp2();
            set_sky(asked, Property::SkyStrength, DVec3::splat(strength));
        }
        if ui.button("image …").on_hover_text("light from a panorama (.hdr, .exr, .png, .jpg)").clicked() {
            asked.dialog = Some(DialogPurpose::Environment);
        }
    });
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn azimuths_go_clockwise_from_north() {
        let of = |x: f64, z: f64| azimuth_of(DVec3::new(x, 0.3, z));
        assert_eq!([of(0.0, -1.0), of(1.0, 0.0), of(0.0, 1.0), of(-2.0, 0.0)], [0.0, 90.0, 180.0, -90.0]);
    }
}
