//! A part of the picture that gets all samples: the others keep theirs, and every pixel has the samples that it would
//! have in a whole picture of as many.

use crate::common::*;
use crate::program::{does, fails};
use firstlight::frame::{Command, Session, SessionOptions, StopAt, Target, read_film_file};
use firstlight::kdtree::Shape;
use firstlight::render::{Environment, Film, Material, Prepared, Region, RenderSettings, advance, advance_region};
use firstlight::scene::SceneSource;
use glam::{UVec2, Vec3};
use std::time::{Duration, Instant};

const NEVER: fn() -> bool = || false;

/// A light over a floor; with `glass`, caustics on it.
fn room(glass: bool) -> Prepared {
    let lamp: Shape = quad(Vec3::new(-0.3, 2.6, -0.3), Vec3::X * 0.6, Vec3::Z * 0.6);
    let ball = (sphere(Vec3::new(0.0, 0.5, 0.0), 0.5), if glass { 2 } else { 0 });
    let materials =
        vec![diffuse(0.6), emissive(20.0), Material::Glass { ior: 1.5, absorption: Vec3::ZERO, dispersion: 0.0 }];
    let eye = camera(Vec3::new(0.3, 1.6, 4.0), Vec3::new(0.0, 0.4, 0.0), 40.0);
    scene(vec![(plane(Vec3::ZERO, Vec3::Y), 0), (lamp, 1), ball], materials, Environment::Black, eye)
}

const SIZE: UVec2 = UVec2::new(61, 47);

fn film() -> Film {
    Film::with_tile_size(SIZE.x, SIZE.y, 8)
}

/// What camera paths have found; traced light falls anywhere.
fn from_the_eye(film: &Film, x: u32, y: u32) -> [u32; 3] {
    (film.mean(x, y).as_dvec3() - film.light_traced(x, y)).as_vec3().to_array().map(f32::to_bits)
}

fn same_picture(a: &Film, b: &Film) -> bool {
    a.means().iter().zip(b.means()).all(|(a, b)| a.to_array().map(f32::to_bits) == b.to_array().map(f32::to_bits))
}

#[test]
fn a_rectangle_grows_to_whole_tiles_within_the_film() {
    let film = film();
    let region = |start: [u32; 2], end: [u32; 2]| film.region(UVec2::from(start), UVec2::from(end));
    let expected = |start: [u32; 2], end: [u32; 2]| Some(Region { start: UVec2::from(start), end: UVec2::from(end) });
    assert_eq!(region([9, 0], [10, 1]), expected([8, 0], [16, 8]));
    assert_eq!(region([8, 8], [16, 16]), expected([8, 8], [16, 16]));
    assert_eq!(region([59, 40], [900, 900]), expected([56, 40], [61, 47]));
    assert_eq!(region([61, 0], [70, 9]), None);
    assert_eq!(region([9, 9], [9, 12]), None);
    assert_eq!(film.region_of([0.0, 0.0, 1.0, 1.0]).map(|region| region.n_pixels()), Some(61 * 47));
    assert_eq!(film.region_of([0.5, 0.5, 0.5, 0.5001]), film.region(UVec2::new(30, 23), UVec2::new(31, 24)));
    for nonsense in [[0.6, 0.0, 0.5, 1.0], [f64::NAN; 4], [2.0, 0.0, 3.0, 1.0]] {
        assert_eq!(film.region_of(nonsense), None, "{nonsense:?}");
    }
}

#[test]
fn only_the_region_gets_samples_and_they_are_those_of_a_whole_picture() {
    for glass in [false, true] {
        let (scene, settings) = (room(glass), RenderSettings::default());
        let whole = |spp| {
            let mut film = film();
            assert!(advance(&scene, &settings, &mut film, spp, &NEVER).completed);
            film
        };
        let (few, many) = (whole(4), whole(32));
        let mut film = few.clone();
        let region = film.region(UVec2::new(20, 12), UVec2::new(37, 30)).unwrap();
        assert!(advance_region(&scene, &settings, &mut film, Some(&region), 32, &NEVER).completed);
        assert_eq!((film.spp(), film.spp_in(Some(&region)), film.max_spp()), (4, 32, 32));
        for (x, y) in (0..SIZE.y).flat_map(|y| (0..SIZE.x).map(move |x| (x, y))) {
            let like = if region.contains(x, y) { &many } else { &few };
            assert_eq!(film.samples(x, y), like.samples(x, y));
            if glass {
                let [a, b] = [&film, like].map(|film| film.mean(x, y).as_dvec3() - film.light_traced(x, y));
                assert!((a - b).abs().max_element() <= 1e-6 * (1.0 + b.max_element()), "{x},{y}: {a} {b}");
            } else {
                assert_eq!(from_the_eye(&film, x, y), from_the_eye(like, x, y), "{x},{y}");
            }
        }
        // The region's error is that of a film with as many samples; in the whole film's each block counts with its own.
        let told = |film: &Film, region| film.error_estimate_in(region).unwrap().relative;
        assert_eq!(told(&film, Some(&region)), told(&many, Some(&region)), "glass {glass}");
        if !glass {
            assert!(told(&film, None) < told(&few, None) && told(&film, None) > told(&many, None));
        }
        // The rest catches up, and nothing tells that there was a region.
        assert!(advance(&scene, &settings, &mut film, 32, &NEVER).completed);
        assert!(same_picture(&film, &many), "glass {glass}");
        assert_eq!((film.spp(), film.max_spp()), (32, 32));
        if !glass {
            assert_eq!(told(&film, None), told(&many, None));
        }
    }
}

#[test]
fn a_region_that_is_stopped_keeps_whole_samples() {
    let (scene, settings) = (room(false), RenderSettings::default());
    let mut film = film();
    advance(&scene, &settings, &mut film, 1, &NEVER);
    let region = film.region(UVec2::ZERO, UVec2::new(32, 32)).unwrap();
    let asked = std::sync::atomic::AtomicU32::new(0);
    let soon = || asked.fetch_add(1, std::sync::atomic::Ordering::Relaxed) > 40;
    assert!(!advance_region(&scene, &settings, &mut film, Some(&region), 1000, &soon).completed);
    let goal = film.max_spp().next_power_of_two();
    advance(&scene, &settings, &mut film, goal, &NEVER);
    let mut whole = self::film();
    advance(&scene, &settings, &mut whole, goal, &NEVER);
    assert!(same_picture(&film, &whole));
}

#[test]
fn a_session_gives_its_samples_to_the_region_until_it_is_cleared() {
    let spp = |spp| Target { spp: Some(spp), ..Target::default() };
    let options =
        SessionOptions { width: 96, height: 96, threads: Some(2), target: spp(8), ..SessionOptions::default() };
    let mut session = Session::new(options).unwrap();
    session.open(SceneSource::Builtin("cornell".to_owned()));
    let start = Instant::now();
    let run_until = |session: &mut Session, done: &dyn Fn(&Session) -> bool| {
        session.update(start.elapsed());
        while !done(session) {
            assert!(start.elapsed() < Duration::from_secs(120), "nothing came: {:?}", session.status());
            std::thread::sleep(Duration::from_millis(2));
            session.update(start.elapsed());
        }
    };
    let finished = |session: &Session| session.status().done && session.is_idle();
    run_until(&mut session, &finished);
    let (few, restarts) = (session.film_snapshot().unwrap(), session.status().restarts);
    session.send(Command::SetRegion { region: Some([0.4, 0.4, 0.5, 0.6]) });
    session.world_mut().resource_mut::<StopAt>().0 = spp(64);
    run_until(&mut session, &|session| finished(session) && session.status().region.is_some_and(|(_, spp)| spp == 64));
    let region = Region { start: UVec2::new(32, 32), end: UVec2::new(64, 64) };
    assert_eq!((session.status().region, session.status().spp), (Some((region, 64)), 8));
    assert_eq!(session.status().restarts, restarts, "no sample is lost");
    let film = session.film_snapshot().unwrap();
    for (x, y) in (0..96).flat_map(|y| (0..96).map(move |x| (x, y))) {
        let expected = if region.contains(x, y) { 64 } else { 8 };
        assert_eq!(film.samples(x, y), expected, "{x},{y}");
        assert!(region.contains(x, y) || film.mean(x, y) == few.mean(x, y), "{x},{y}");
    }
    // A picture that is kept now does not wait for the rest.
    let kept = session.keep_film(false).recv_timeout(Duration::from_secs(60)).unwrap().film;
    assert_eq!((kept.spp(), kept.max_spp()), (8, 64));
    // It stays over a restart, once every pixel has a sample.
    session.send(Command::Restart);
    run_until(&mut session, &|session| {
        finished(session) && session.status().restarts > restarts && session.status().region.is_some()
    });
    assert_eq!((session.status().spp, session.status().region), (1, Some((region, 64))));
    session.send(Command::SetRegion { region: None });
    run_until(&mut session, &|session| finished(session) && session.status().spp == 64);
    assert_eq!(session.status().region, None);
    let whole = session.film_snapshot().unwrap();
    assert_eq!((whole.spp(), whole.max_spp()), (64, 64));
    assert!(region.contains(40, 40) && whole.mean(40, 40) == film.mean(40, 40));
}

#[test]
fn the_program_goes_on_with_a_part_of_a_film() {
    let folder = tempfile::tempdir().unwrap();
    let done = |line: &str| drop(does(folder.path(), line));
    done("render cornell -o a.png --film a.exr --size 96x64 --spp 8 --uniform");
    done("render cornell -o a.png --film a.exr --size 96x64 --spp 24 --resume --region 40,10,10,10");
    let film = read_film_file(&folder.path().join("a.exr")).unwrap().film;
    assert_eq!([film.samples(45, 15), film.samples(31, 15), film.samples(45, 33)], [24, 8, 8]);
    done("render cornell -o a.png --film a.exr --size 96x64 --spp 24 --resume");
    done("render cornell -o b.png --film b.exr --size 96x64 --spp 24 --uniform");
    let films = ["a.exr", "b.exr"].map(|name| read_film_file(&folder.path().join(name)).unwrap().film);
    assert!(same_picture(&films[0], &films[1]));
    done("render cornell -o c.png --film c.exr --size 96x64 --spp 4 --region 0,0,1,1");
    let film = read_film_file(&folder.path().join("c.exr")).unwrap().film;
    assert_eq!([film.samples(31, 31), film.samples(32, 31)], [4, 1]);
    for (line, expected) in [
        ("render cornell -o d.png --size 96x64 --region 96,0,10,10", "--region"),
        ("render cornell -o d.png --region 1,2,3", "X,Y,W,H"),
    ] {
        let said = fails(folder.path(), line, 2);
        assert!(said.contains(expected), "{said}");
    }
}
