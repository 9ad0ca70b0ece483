//! A row in the table of materials is enough: its property is read, checked, written, edited, undone and animated.

use crate::driver::{Drive, Driver};
use firstlight::frame::{Command, Edit, Property as EditProperty, SessionOptions};
use firstlight::render::{MaterialKind, Property, Value, ValueType};
use firstlight::scene::file::SceneFile;
use firstlight::scene::{MaterialProperty, SceneSource};
use glam::DVec3;

/// A value that is not the default, as in a scene file.
fn example(property: &Property) -> &'static str {
    match property.value {
        ValueType::Color | ValueType::Rgb => "(0.25, 0.5, 0.75)",
        ValueType::Scalar | ValueType::Number | ValueType::Cutoff => "0.25",
        ValueType::Flag => match property.default {
            Some(Value::Flag(true)) => "false",
            _ => "true",
        },
        ValueType::Fresnel => "schlick",
        ValueType::Part => "\"part\"",
    }
}

/// A value that it cannot have.
fn wrong(property: &Property) -> &'static str {
    match property.value {
        ValueType::Color | ValueType::Rgb => "(-1, NaN, 0)",
        ValueType::Scalar | ValueType::Cutoff => "-1",
        // Some may have any finite value.
        ValueType::Number => "NaN",
        ValueType::Flag | ValueType::Fresnel | ValueType::Part => "7",
    }
}

/// A scene with one material, of which this property has a value.
fn scene(kind: MaterialKind, property: &Property, value: &str, more: &str) -> String {
    let required = kind.properties().iter().filter(|it| it.default.is_none() && it.name != property.name);
    let mut fields: Vec<String> = required.map(|it| format!("{}: {}", it.name, example(it))).collect();
    fields.push(format!("{}: {value}", property.name));
    format!(
        "(camera: (eye: (0, 0, 4), look_at: (0, 0, 0)), film: (width: 16, height: 9), materials: {{ \
         \"m\": {}({}), \"part\": diffuse(albedo: 0.5) }}, \
         objects: [sphere(name: \"ball\", radius: 1, material: \"m\")]{more})",
        kind.name(),
        fields.join(", ")
    )
}

fn all() -> impl Iterator<Item = (MaterialKind, &'static Property)> {
    MaterialKind::ALL.iter().flat_map(|&kind| kind.properties().iter().map(move |property| (kind, property)))
}

#[test]
fn every_property_is_read_checked_and_written() {
    for (kind, property) in all() {
        let about = format!("{} of {}", property.name, kind.name());
        let file = SceneFile::parse(&scene(kind, property, example(property), ""), "scene.ron")
            .unwrap_or_else(|error| panic!("{about}: {error}"));
        let written = file.to_ron();
        assert!(written.contains(&format!("{}: ", property.name)), "{about} is not in {written}");
        assert!(SceneFile::parse(&written, "again.ron").unwrap() == file, "{about} changed in {written}");
        let error = SceneFile::parse(&scene(kind, property, wrong(property), ""), "scene.ron").expect_err(&about);
        let error = error.to_string();
        assert!(error.contains(property.name), "{about}: {error}");
    }
}

#[test]
fn every_property_is_animated_if_its_values_can_change_gradually() {
    for (kind, property) in all() {
        let track = |value: &str| {
            let keys = format!("keys: [(0, {value}), (1, {value})]");
            let track = format!("material(name: \"m\", property: {}, {keys})", property.name);
            let more = format!(", animation: (tracks: [{track}])");
            SceneFile::parse(&scene(kind, property, example(property), &more), "scene.ron").map(drop)
        };
        let is_number = |value: &str| !value.contains(|c: char| c.is_alphabetic());
        let can = property.domain.is_animatable();
        let found = track(if is_number(example(property)) { example(property) } else { "1" });
        assert_eq!(found.is_ok(), can, "{} of {}: {found:?}", property.name, kind.name());
    }
}

#[test]
fn every_property_is_edited_and_undone() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("scene.ron");
    for (kind, property) in all() {
        let Some(name) = MaterialProperty::named(property.name) else { continue };
        std::fs::write(&path, scene(kind, property, example(property), "")).unwrap();
        let mut driver = Driver::new(SessionOptions::default(), SceneSource::parse(&path).unwrap());
        driver.run_until(|session| !session.inputs().materials.is_empty());
        let material = |driver: &Driver| {
            let materials = &driver.session.inputs().materials;
            materials.iter().find(|material| material.name.as_deref() == Some("m")).unwrap().clone()
        };
        let before = material(&driver);
        let value = match (property.value, firstlight::scene::material_value(name, &before.material)) {
            (ValueType::Flag | ValueType::Fresnel, Some(old)) => 1.0 - old.x,
            _ => 0.875,
        };
        let about = format!("{} of {}", property.name, kind.name());
        let (id, property) = (before.entity.to_bits(), EditProperty::Material(name));
        driver.session.send(Command::Edit(Edit::Set { id, property, value: DVec3::splat(value) }));
        driver.frame();
        assert_eq!(
            firstlight::scene::material_value(name, &material(&driver).material),
            Some(DVec3::splat(value)),
            "{about}"
        );
        driver.session.send(Command::Edit(Edit::Undo));
        driver.frame();
        assert_eq!(material(&driver), before, "{about}");
    }
}
