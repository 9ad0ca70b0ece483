//! Pixel filters seen from outside: an even picture stays even, an edge is as soft as the filter is wide.

use crate::common::{camera, emissive, picture_mean, quad, render, scene};
use firstlight::render::{Environment, Integrator, PixelFilter, RenderSettings};
use glam::Vec3;

const POSITIVE: [PixelFilter; 4] =
    [PixelFilter::Box, PixelFilter::Tent, PixelFilter::Gaussian, PixelFilter::BlackmanHarris];

#[test]
fn an_even_picture_stays_exactly_even() {
    let view = camera(Vec3::ZERO, Vec3::NEG_Z, 40.0);
    let even = scene(Vec::new(), Vec::new(), Environment::Constant(Vec3::splat(0.7)), view);
    for filter in POSITIVE {
        for integrator in [Integrator::Path, Integrator::Phong] {
            let settings = RenderSettings { filter, integrator, ..RenderSettings::default() };
            let (film, _) = render(&even, &settings, 9, 7, 3);
            assert!(film.means().iter().all(|mean| *mean == Vec3::splat(0.7)), "{filter:?}");
        }
    }
    let settings = RenderSettings { filter: PixelFilter::Mitchell, ..RenderSettings::default() };
    let (film, _) = render(&even, &settings, 9, 7, 1024);
    // Samples of the rim count negatively: what is left is how evenly 1,024 points of a net fall on both signs.
    for mean in film.means() {
        assert!((mean.x - 0.7).abs() < 0.015, "{mean}");
    }
    let mean = picture_mean(&film).0;
    assert!((mean - 0.7).abs() < 1e-3, "{mean}");
}

#[test]
fn an_edge_is_as_soft_as_the_filter_says() {
    // The right half glows: each column of pixels tells the filter's share on that side of the middle.
    let glow = quad(Vec3::new(0.0, -50.0, -1.0), Vec3::X * 50.0, Vec3::Y * 100.0);
    let half = scene(vec![(glow, 0)], vec![emissive(1.0)], Environment::Black, camera(Vec3::ZERO, Vec3::NEG_Z, 20.0));
    for filter in [PixelFilter::Tent, PixelFilter::Gaussian, PixelFilter::BlackmanHarris, PixelFilter::Mitchell] {
        let settings = RenderSettings { filter, ..RenderSettings::default() };
        let (film, _) = render(&half, &settings, 8, 4, 4096);
        for x in 0..8 {
            let center = f64::from(x) + 0.5 - 4.0;
            let n = 20_000;
            let places = (0..n).map(|i| 2.0 * (2.0 * (f64::from(i) + 0.5) / f64::from(n) - 1.0));
            let (mut lit, mut whole) = (0.0, 0.0);
            for place in places {
                whole += filter.weight(place);
                lit += if center + place > 0.0 { filter.weight(place) } else { 0.0 };
            }
            let found = f64::from(film.mean(x, 1).x);
            assert!((found - lit / whole).abs() < 5e-3, "{filter:?}, column {x}: {found} for {}", lit / whole);
        }
    }
    assert!(picture_mean(&render(&half, &RenderSettings::default(), 8, 4, 16).0).0 == 0.5);
}
