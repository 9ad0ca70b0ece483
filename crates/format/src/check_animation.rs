//! Checks of the section `animation`.

use crate::animation::TrackPart;
use crate::bad_value::BadValue;
use crate::bounds;
use crate::bounds::{
    MOST_KEYS, check_fps, check_moment, check_shutter_seconds, check_shutter_share, check_span, coordinate_rule,
    is_coordinate, number, triple,
};
use crate::check::Check;
use crate::key::{Curve, Interpolation, Key, KeyValue};
use crate::light::LightKind;
use crate::material_property::MaterialProperty;
use crate::parts::ObjectPart;
use crate::placement::Placement;
use crate::property::{LightProperty, ObjectProperty};
use crate::quantity::Quantity;
use crate::view::unit_direction;
use std::collections::{BTreeMap, HashMap, HashSet};

/// Paths, properties and curves of the tracks of one entity.
type MovedTracks<'a, P> = Vec<(String, P, Curve)>;

impl Check<'_> {
    pub(crate) fn animation(&mut self) {
        let file = self.file;
        let animation = &file.animation;
        let shutter = match (animation.shutter, animation.shutter_seconds) {
            (Some(_), Some(_)) => {
                Err(BadValue::unfit("shutter", "`shutter` and `shutter_seconds` exclude each other: set one of them"))
            }
            (share, seconds) => {
                share.map_or(Ok(()), check_shutter_share).and(seconds.map_or(Ok(()), check_shutter_seconds))
            }
        };
        let checks = [
            check_moment("at", animation.at),
            check_fps(animation.fps),
            animation.duration.map_or(Ok(()), |duration| check_span("duration", duration)),
            shutter,
        ];
        for bad in checks.into_iter().filter_map(Result::err) {
            self.wrong(&format!("animation/{}", bad.field()), bad);
        }
        let keys: usize = animation.tracks.iter().map(|track| track.keys().len()).sum();
        if keys > MOST_KEYS {
            return self.wrong("animation/tracks", format!("there are {keys} keys: use at most {MOST_KEYS}"));
        }
        self.tracks();
        self.model();
        self.edited();
    }

    /// What a glTF file moves is there, each once.
    fn model(&mut self) {
        let file = self.file;
        let Some(model) = &file.animation.model else { return };
        let objects = by_name(file.objects.iter().map(ObjectPart::name));
        let lights = by_name(file.lights.iter().map(|light| light.name()));
        for (what, list, known) in [("object", &model.objects, &objects), ("light", &model.lights, &lights)] {
            let mut seen = HashSet::new();
            for (i, (name, _)) in list.iter().enumerate() {
                let path = format!("animation/model/{what}s/{i}");
                if !seen.insert(name) {
                    self.wrong(&path, format!("{what} `{name}` is listed twice"));
                } else {
                    self.named(&path, what, name, known);
                }
            }
        }
    }

    /// What was edited has a track, or moves with a glTF file, which the edit overrides.
    fn edited(&mut self) {
        let tracks = &self.file.animation.tracks;
        let edited = &self.file.animation.edited;
        let model = self.file.animation.model.as_ref();
        if let Some(camera) = &edited.camera {
            let path = "animation/edited/camera";
            let is_moved = tracks.iter().any(|track| matches!(track, TrackPart::Camera { .. }))
                || model.is_some_and(|model| model.camera.is_some());
            if !is_moved {
                self.wrong(path, "the camera has no track: this one belongs into `camera` of the scene");
            }
            self.camera(path, camera);
        }
        type NameOf = fn(&TrackPart) -> Option<&str>;
        let of_object: NameOf = |track| match track {
            TrackPart::Object { name, .. } => Some(name),
            _ => None,
        };
        let of_light: NameOf = |track| match track {
            TrackPart::Light { name, .. } => Some(name),
            _ => None,
        };
        let of_material: NameOf = |track| match track {
            TrackPart::Material { name, .. } => Some(name),
            _ => None,
        };
        let kinds = [
            ("object", &edited.objects, of_object),
            ("light", &edited.lights, of_light),
            ("material", &edited.materials, of_material),
        ];
        for (what, names, name_of) in kinds {
            let of_model = match (what, model) {
                ("object", Some(model)) => &model.objects[..],
                ("light", Some(model)) => &model.lights[..],
                _ => &[],
            };
            let of_model = of_model.iter().map(|(name, _)| name.as_str());
            let known: HashSet<&str> = tracks.iter().filter_map(name_of).chain(of_model).collect();
            for (i, name) in names.iter().enumerate().filter(|(_, name)| !known.contains(name.as_str())) {
                let message = format!("{what} `{name}` has no track");
                self.misnamed(&format!("animation/edited/{what}s/{i}"), message, name, known.iter().copied());
            }
        }
    }

    fn tracks(&mut self) {
        let file = self.file;
        let objects = by_name(file.objects.iter().map(ObjectPart::name));
        let lights = by_name(file.lights.iter().map(|light| light.name()));
        let mut seen: HashMap<(&str, Option<&str>, &str), usize> = HashMap::new();
        let mut camera = MovedTracks::new();
        let mut moved_lights: BTreeMap<usize, MovedTracks<LightProperty>> = BTreeMap::new();
        for (i, track) in file.animation.tracks.iter().enumerate() {
            let path = format!("animation/tracks/{i}");
            let (what, name, property, quantity) = match track {
                TrackPart::Camera { property, .. } => ("camera", None, property.name(), property.quantity()),
                TrackPart::Object { name, property, .. } => {
                    ("object", Some(name.as_str()), property.name(), property.quantity())
                }
                TrackPart::Light { name, property, .. } => {
                    ("light", Some(name.as_str()), property.name(), property.quantity())
                }
                TrackPart::Material { name, property, .. } => {
                    ("material", Some(name.as_str()), property.name(), property.quantity())
                }
            };
            if let Some(first) = seen.insert((what, name, property), i) {
                let of = name.map_or_else(|| "the camera".to_owned(), |name| format!("{what} `{name}`"));
                let message =
                    format!("`{property}` of {of} has two tracks (the other one is number {}): join them", first + 1);
                self.wrong(&path, message);
                continue;
            }
            if !self.keys(&path, property, quantity, track) {
                continue;
            }
            let curve = Curve { interpolation: track.interpolation(), keys: track.keys().to_vec() };
            match track {
                TrackPart::Camera { property, .. } => camera.push((path, *property, curve)),
                TrackPart::Object { name, property, .. } => {
                    if let Some(index) = self.named(&path, what, name, &objects) {
                        self.object_track(&path, &file.objects[index], *property, track);
                    }
                }
                TrackPart::Light { name, property, .. } => {
                    if let Some(index) = self.named(&path, what, name, &lights) {
                        moved_lights.entry(index).or_default().push((path, *property, curve));
                    }
                }
                TrackPart::Material { name, property, .. } => self.material_track(&path, name, *property, track),
            }
        }
        // A camera that is invalid without animation is reported elsewhere.
        if file.camera.components().is_ok() {
            self.at_all_keys(&camera, |seconds| {
                let mut part = file.camera.clone();
                for (_, property, curve) in &camera {
                    property.set(&mut part, curve.at(property.quantity(), seconds));
                }
                part.components().err().and_then(|bad| bad.into_iter().next())
            });
        }
        for (index, moved) in moved_lights {
            self.light_tracks(index, &moved);
        }
    }

    /// Checks times and values; returns whether they are valid for the property.
    fn keys(&mut self, path: &str, property: &str, quantity: Quantity, track: &TrackPart) -> bool {
        let keys = track.keys();
        let path = format!("{path}/keys");
        if keys.is_empty() {
            self.wrong(&path, "there are no keys: add at least one pair of seconds and a value");
            return false;
        }
        let mut good = true;
        let mut wrong = |path: String, message: String| {
            self.wrong(&path, message);
            good = false;
        };
        for (i, (time, value)) in keys.iter().enumerate() {
            if let Err(bad) = check_moment("time", *time) {
                wrong(format!("{path}/{i}/0"), bad.to_string());
            } else if i > 0 && keys[i - 1].0 >= *time {
                let (before, time) = (number(keys[i - 1].0), number(*time));
                wrong(
                    format!("{path}/{i}/0"),
                    format!("the key at {time} s follows one at {before} s: keys go forwards in time"),
                );
            }
            let at = format!("{path}/{i}/1");
            match (quantity, value) {
                (Quantity::Number, KeyValue::Three(_)) => {
                    wrong(at, format!("`{property}` is a number, not three"));
                }
                (Quantity::Position | Quantity::Direction | Quantity::Rotation, KeyValue::Number(_)) => {
                    wrong(at, format!("`{property}` has three numbers: (x, y, z)"));
                }
                _ if !value.three().is_finite() => wrong(at, "the value of a key must be finite".to_owned()),
                (Quantity::Position, KeyValue::Three(point)) if !is_coordinate(*point) => {
                    wrong(at, format!("{} must {}", triple(*point), coordinate_rule()));
                }
                (Quantity::Direction, KeyValue::Three(way)) => {
                    let Some(unit) = unit_direction(*way) else {
                        wrong(at, format!("`{property}` must have a length"));
                        continue;
                    };
                    let before = i.checked_sub(1).and_then(|i| unit_direction(keys[i].1.three()));
                    if track.interpolation() != Interpolation::Held
                        && before.is_some_and(|old| old.dot(unit) < -1.0 + 1e-9)
                    {
                        wrong(at, format!("`{property}` is opposite to the key before: add a key between them"));
                    }
                }
                _ => {}
            }
        }
        good
    }

    /// The index of the only entity with this name.
    fn named(&mut self, path: &str, what: &str, name: &str, known: &HashMap<&str, Vec<usize>>) -> Option<usize> {
        let path = format!("{path}/name");
        match known.get(name).map(Vec::as_slice) {
            Some(&[index]) => Some(index),
            Some(all) => {
                let n = all.len();
                self.wrong(
                    &path,
                    format!("{n} {what}s are called `{name}`: give the one that moves a name of its own"),
                );
                None
            }
            None => {
                self.misnamed(&path, format!("there is no {what} `{name}`"), name, known.keys().copied());
                None
            }
        }
    }

    fn object_track(&mut self, path: &str, object: &ObjectPart, property: ObjectProperty, track: &TrackPart) {
        if property.get(&Placement::from_part(object.transform())).is_none() {
            let message = format!("`{}` needs a transform without shear; this `matrix` has some", property.name());
            return self.wrong(&format!("{path}/property"), message);
        }
        if property != ObjectProperty::Scale {
            return;
        }
        let is_round =
            matches!(object, ObjectPart::Sphere { .. } | ObjectPart::BallGrid { .. } | ObjectPart::Spheres { .. });
        for (i, (_, value)) in track.keys().iter().enumerate() {
            let at = format!("{path}/keys/{i}/1");
            let scale = value.three();
            let size = scale.abs();
            let before = i.checked_sub(1).map_or(scale, |i| track.keys()[i].1.three());
            if size.min_element() < bounds::MIN_SIZE || size.max_element() > bounds::MAX_COORDINATE {
                self.wrong(&at, "the scale flattens the object or makes it too large: no factor may be 0");
            } else if is_round && !(size.x == size.y && size.y == size.z) {
                self.wrong(&at, "spheres need a uniform scale: use one factor, or a mesh for an ellipsoid");
            } else if track.interpolation() != Interpolation::Held && (before * scale).min_element() < 0.0 {
                self.wrong(&at, "the scale passes 0 on its way from the key before: use `held`, or keep its sign");
            }
        }
    }

    fn material_track(&mut self, path: &str, name: &str, property: MaterialProperty, track: &TrackPart) {
        let Some(&material) = self.materials.get(name) else {
            return self.material_name(&format!("{path}/name"), name);
        };
        let properties = material.kind().properties();
        let known: Vec<&str> = MaterialProperty::animatable(material).map(MaterialProperty::name).collect();
        let description = properties.iter().find(|it| it.name == property.name() && known.contains(&it.name));
        let Some(description) = description else {
            let what = format!("material `{name}` is {} and has no `{}`", material.kind().name(), property.name());
            return self.misnamed(&format!("{path}/property"), what, property.name(), known.into_iter());
        };
        for (i, (_, value)) in track.keys().iter().enumerate() {
            let channels = value.three().as_vec3().to_array();
            let n = if property.quantity() == Quantity::Color { 3 } else { 1 };
            self.value(&format!("{path}/keys/{i}/1"), description, &channels[..n]);
        }
    }

    fn light_tracks(&mut self, index: usize, moved: &MovedTracks<LightProperty>) {
        let (light, placement) = LightKind::from_part(&self.file.lights[index]);
        for (path, property, curve) in moved {
            if property.set(&mut light.clone(), &mut placement.clone(), curve.keys[0].1.three()).is_none() {
                let what = format!("a {} has no `{}` that could change", light.name(), property.name());
                let known: Vec<&str> = LightProperty::of(&light).map(LightProperty::name).collect();
                return self.misnamed(&format!("{path}/property"), what, property.name(), known.into_iter());
            }
        }
        if light.check(&placement).is_err() {
            return;
        }
        self.at_all_keys(moved, |seconds| {
            let (mut light, mut placement) = (light, placement);
            for (_, property, curve) in moved {
                property.set(&mut light, &mut placement, curve.at(property.quantity(), seconds));
            }
            light.check(&placement).err()
        });
    }

    /// Checks an entity at the times of all keys of its tracks, and reports the first problem.
    fn at_all_keys<P: Property>(&mut self, moved: &MovedTracks<P>, problem: impl Fn(f64) -> Option<BadValue>) {
        let mut times: Vec<(f64, usize, usize)> = (moved.iter().enumerate())
            .flat_map(|(track, (.., curve))| {
                curve.keys.iter().enumerate().map(move |(key, &(time, _))| (time, track, key))
            })
            .collect();
        times.sort_by(|a, b| a.0.total_cmp(&b.0));
        for (time, track, key) in times {
            let Some(bad) = problem(time) else { continue };
            // The invalid value may belong to another track, with an earlier key.
            let own = moved.iter().find(|(_, property, _)| property.word() == bad.field());
            let place = own.map(|(path, _, curve): &(String, P, Curve)| {
                let key = curve.keys.partition_point(|&(start, _): &Key| start <= time).saturating_sub(1);
                format!("{path}/keys/{key}/1")
            });
            let place = place.unwrap_or_else(|| format!("{}/keys/{key}/1", moved[track].0));
            return self.wrong(&place, format!("{bad} (at {} s)", number(time)));
        }
    }
}

/// Anything with a name in scene files.
trait Property {
    fn word(&self) -> &'static str;
}

impl Property for crate::property::CameraProperty {
    fn word(&self) -> &'static str {
        self.name()
    }
}

impl Property for LightProperty {
    fn word(&self) -> &'static str {
        self.name()
    }
}

fn by_name<'a>(names: impl Iterator<Item = Option<&'a str>>) -> HashMap<&'a str, Vec<usize>> {
    let mut known: HashMap<&str, Vec<usize>> = HashMap::new();
    for (i, name) in names.enumerate() {
        if let Some(name) = name {
            known.entry(name).or_default().push(i);
        }
    }
    known
}
