//! The denoised image of a session: displayed, saved, by another filter.

use crate::driver::{Drive, Driver};
use firstlight::frame::{Command, DenoiseFilter, Denoising, PictureSize, Target};
use firstlight::render::develop_colors;

/// The denoised image that a screenshot has, developed.
fn screenshot(driver: &Driver) -> Option<Vec<u8>> {
    let kept = driver.session.keep_film(true).recv().unwrap();
    let (size, display) = ((kept.film.width(), kept.film.height()), driver.session.status().display);
    let mut rgba = Vec::new();
    develop_colors(&kept.denoised?.colors, size, &display, size, &mut rgba);
    Some(rgba)
}

/// Samples stay, the raw image comes back byte for byte, and what is displayed is named.
#[test]
fn the_denoised_image_keeps_all_samples_and_has_an_error() {
    let mut driver = Driver::builtin("gallery");
    let (raw, restarts) = (driver.session.picture().rgba.clone(), driver.session.status().restarts);
    assert_eq!(driver.session.picture().denoising, Denoising::Raw);
    driver.session.send(Command::SetDenoising(Denoising::Denoised));
    driver.run_until(|session| session.status().denoised_error.is_some() && session.is_idle());
    let denoised = driver.session.picture().rgba.clone();
    assert_ne!(denoised, raw);
    assert_eq!([driver.session.status().denoising, driver.session.picture().denoising], [Denoising::Denoised; 2]);
    assert!(screenshot(&driver) == Some(denoised.clone()), "what is saved is what is displayed");
    driver.session.send(Command::SetDenoising(Denoising::Split));
    driver.run_until(|session| session.is_idle() && session.picture().denoising == Denoising::Split);
    let (picture, width) = (driver.session.picture(), 4 * driver.session.picture().width as usize);
    let middle = width / 8 * 4;
    for ((row, raw), denoised) in picture.rgba.chunks(width).zip(raw.chunks(width)).zip(denoised.chunks(width)) {
        assert_eq!((&row[..middle], &row[middle + 4..]), (&raw[..middle], &denoised[middle + 4..]));
    }
    driver.session.send(Command::NextDenoising);
    driver.run_until(|session| session.is_idle() && session.picture().denoising == Denoising::Raw);
    assert_eq!((&driver.session.picture().rgba, driver.session.status().denoised_error), (&raw, None));
    assert_eq!(screenshot(&driver), None);
    assert_eq!((driver.session.status().restarts, driver.session.status().spp), (restarts, 2));
    // A moving camera: the coarse image is smoothed, and named so.
    driver.session.send(Command::SetDenoising(Denoising::Denoised));
    driver.session.send(Command::Turn { yaw_deg: 5.0, pitch_deg: 0.0 });
    driver.run_until(|session| session.status().restarts > restarts && session.status().denoised_error.is_some());
}

/// As when the panel is opened and closed, also while rendering is paused.
#[test]
fn an_image_of_the_size_before_has_its_samples_and_is_denoised() {
    let mut driver = Driver::builtin("gallery");
    driver.session.send(Command::SetDenoising(Denoising::Denoised));
    driver.run_until(|session| session.status().denoised_error.is_some() && session.is_idle());
    let of = |driver: &Driver| (driver.session.picture().rgba.clone(), driver.session.status().clone());
    let (rgba, status) = of(&driver);
    let PictureSize { width, height } = *driver.session.world().resource::<PictureSize>();
    let resize = |driver: &mut Driver, width| {
        let restarts = driver.session.status().restarts;
        driver.session.send(Command::Resize { width, height });
        driver.run_until(|session| session.status().restarts > restarts && session.is_idle());
    };
    driver.session.send(Command::SetTarget(Target { spp: Some(1), ..Target::default() }));
    for narrower in [width - 7, width - 5] {
        resize(&mut driver, narrower);
        assert_eq!((driver.session.status().spp, driver.session.picture().width), (1, narrower));
    }
    driver.session.send(Command::Pause);
    resize(&mut driver, width);
    let (rgba_after, after) = of(&driver);
    assert!(rgba_after == rgba, "the same image, denoised");
    assert_eq!((after.spp, after.rays, after.denoised_spp), (status.spp, status.rays, status.denoised_spp));
    // Another view has samples of its own, in any size.
    driver.session.send(Command::Resume);
    driver.session.send(Command::Turn { yaw_deg: 5.0, pitch_deg: 0.0 });
    resize(&mut driver, width - 7);
    resize(&mut driver, width);
    assert_eq!(driver.session.status().spp, 1);
}

/// Where the other filter is not installed, firstlight's own is used, and named.
#[test]
fn another_filter_denoises_the_same_samples() {
    let mut driver = Driver::builtin("gallery");
    let (raw, restarts) = (driver.session.picture().rgba.clone(), driver.session.status().restarts);
    driver.session.send(Command::SetDenoising(Denoising::Denoised));
    driver.run_until(|session| session.status().denoised_error.is_some() && session.is_idle());
    let own = driver.session.picture().rgba.clone();
    assert_eq!(driver.session.status().denoised_by, DenoiseFilter::Own);
    let is_installed = DenoiseFilter::Oidn.check().is_ok();
    let number = driver.session.picture().number;
    driver.session.send(Command::SetDenoiseFilter(DenoiseFilter::Oidn));
    driver.run_until(|session| {
        session.picture().number > number && session.status().denoised_error.is_some() && session.is_idle()
    });
    let (other, by) = (driver.session.picture().rgba.clone(), driver.session.status().denoised_by);
    assert_eq!((other != own, by == DenoiseFilter::Oidn), (is_installed, is_installed));
    driver.session.send(Command::SetDenoising(Denoising::Raw));
    driver.run_until(|session| session.is_idle() && session.picture().denoising == Denoising::Raw);
    assert_eq!((&driver.session.picture().rgba, driver.session.status().restarts), (&raw, restarts));
}
