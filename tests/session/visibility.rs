//! Hiding objects and lights, and showing them again.

use crate::driver::{Drive, Driver};
use firstlight::frame::{Edit, History, NewThing};

#[test]
fn what_is_hidden_is_left_out_of_the_image_but_not_of_the_lists() {
    let mut driver = Driver::builtin("gallery");
    let counts = |driver: &Driver| {
        let inputs = driver.session.inputs();
        let inventory = driver.session.inventory();
        (inputs.objects.len(), inputs.lights.len(), inventory.objects.len(), inventory.lights.len())
    };
    let has_ball = |driver: &Driver| {
        driver.session.inputs().objects.iter().any(|object| object.name.as_deref() == Some("gold ball"))
    };
    driver.edit([Edit::Add(NewThing::PointLight)]);
    let light = driver.named("point light").to_bits();
    let all = counts(&driver);
    let ball = driver.select("gold ball");
    driver.edit([Edit::Hide { others: false }]);
    assert!(!has_ball(&driver) && driver.selected().0.is_empty());
    assert_eq!(counts(&driver), (all.0 - 1, all.1, all.2, all.3));
    assert_eq!(driver.session.world().resource::<History>().undo_label(), Some("hide `gold ball`"));
    driver.edit([Edit::Undo]);
    assert!(has_ball(&driver) && driver.selected().0.len() == 1);
    driver.edit([Edit::SetHidden { id: light, hidden: true }]);
    assert_eq!(counts(&driver), (all.0, all.1 - 1, all.2, all.3));
    driver.edit([Edit::Hide { others: true }]);
    assert_eq!(counts(&driver), (1, 0, all.2, all.3));
    let order: Vec<String> = driver.session.inventory().objects.into_iter().map(|entry| entry.label).collect();
    driver.edit([Edit::ShowAll]);
    assert_eq!((counts(&driver), driver.selected().0.len()), (all, all.2 - 1));
    let shown: Vec<String> = driver.session.inventory().objects.into_iter().map(|entry| entry.label).collect();
    assert_eq!(order, shown, "lists keep the order of the file");
    driver.edit([Edit::SelectNone, Edit::Hide { others: false }, Edit::Hide { others: true }, Edit::ShowAll]);
    assert_eq!(counts(&driver), all, "nothing is selected, nothing is hidden: nothing happens");
    driver.edit([Edit::SetHidden { id: ball, hidden: false }]);
    assert_eq!(counts(&driver), all);
}
