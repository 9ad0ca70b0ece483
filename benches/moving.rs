//! Images while the camera moves, against converged ones: `cargo bench -p firstlight-benches --bench moving`.
//!
//! A camera goes around the scene, towards it, turns, and stops: 40 images of 640 × 360 pixels. Each is made as in the
//! window, of one path per pixel of a film whose sides are divided by as much as fits into 25 CPU milliseconds at
//! 1280 × 720 on the processor of the first measurement, so that the result does not depend on the machine.
//!
//! `-- [SCENE[:WAY]…]…` takes other scenes and ways: `gallery:6:8+3:8+3+12` smooths a film divided by 6; then puts the light
//! of one divided by 8 on surfaces divided by 3; then mixes it with that of up to 12 images before. A way that ends with `s`
//! begins with the reference of the first image, as the window does with what it shows at rest.
//!
//! FLIP and relMSE are means over four of the images against 32 samples per pixel, denoised, both as they are displayed;
//! flicker is the mean change of a surface from image to image, in units of 1/255. With `FIRSTLIGHT_BENCH_IMAGES=FOLDER`
//! these images are saved, and references that are there already are used.

mod common;

use common::{scenes, world_of};
use firstlight::render::{
    Camera, Display, Film, MovingImage, Prepared, Relighting, RenderSettings, StillImage, advance, decode_srgb,
    denoise_film, develop_colors, gather_features, gather_guides, relight, smooth_film,
};
use firstlight::report::{cpu_seconds, flip};
use firstlight::scene::{Extraction, SceneInputs};
use glam::{Mat3, UVec2, Vec3};

const SIZE: UVec2 = UVec2::new(640, 360);
const IMAGES: usize = 40;
const COMPARED: [usize; 4] = [8, 22, 33, 39];
const REFERENCE_SAMPLES: u32 = 32;

fn main() {
    let usual = [
        "gallery:6:8+4:8+4+12:8+4+12s",
        "cornell:4:6+2:6+2+12:6+2+12s",
        "everything:8:8+6:8+6+12:8+6+12s",
        "kd-tree:6:8+4:8+4+12:8+4+12s",
        "dof-balls:3:4+3:4+3+12:4+3+12s",
    ];
    println!("| scene | divided by | FLIP | relMSE | flicker | CPU ms |");
    println!("|---|---|---:|---:|---:|---:|");
    for scene in scenes(|| usual.map(str::to_owned).to_vec()) {
        let mut parts = scene.split(':');
        let name = parts.next().expect("a split text has a part");
        rows(name, &parts.collect::<Vec<_>>());
    }
}

fn rows(name: &str, ways: &[&str]) {
    let (scene, mut world) = world_of(name);
    let still = Extraction::new(&SceneInputs::of(&mut world), &scene.trees).prepared;
    let title = std::path::Path::new(name).file_stem().map_or(name.into(), |stem| stem.to_string_lossy());
    let settings = RenderSettings::default();
    let features =
        |view: &Prepared, size| gather_features(view, &settings, size, 1, &|| false).expect("nothing stops it");
    let pivot = features(&still, UVec2::ONE).depth[0];
    let pivot = if pivot.is_finite() { pivot } else { 1.0 };
    let views: Vec<Prepared> = (0..IMAGES).map(|i| still.with_camera(camera(&still.camera, pivot, i))).collect();
    let positions: Vec<Vec<Vec3>> = views.iter().map(|view| features(view, SIZE).position).collect();
    let references: Vec<Vec<Vec3>> =
        COMPARED.iter().map(|&i| reference(&views[i], &format!("{title}-{i:02}-reference"))).collect();
    let first = reference(&views[0], &format!("{title}-00-reference"));
    for way in ways {
        let mut moving = MovingImage::default();
        if way.ends_with('s') {
            image(&mut moving, &views[0], 0, way);
            moving.settle(StillImage::new(&first, SIZE, &views[0].camera, Display::default().exposure()));
        }
        let before = cpu_seconds().unwrap_or(f64::NAN);
        let images: Vec<Vec<Vec3>> = (0..IMAGES).map(|i| image(&mut moving, &views[i], i as u32, way)).collect();
        let took = 1e3 * (cpu_seconds().unwrap_or(f64::NAN) - before) / IMAGES as f64;
        let mean = |of: &dyn Fn(&[Vec3], &[Vec3]) -> f64| {
            let all = COMPARED.iter().zip(&references).map(|(&i, reference)| of(&images[i], reference));
            all.sum::<f64>() / COMPARED.len() as f64
        };
        let flips = mean(&|image, reference| flip(reference, image, SIZE.x as usize));
        let errors = mean(&relative_mse);
        let change =
            |i: usize| change([&images[i - 1], &images[i]], [&positions[i - 1], &positions[i]], &views[i - 1].camera);
        let flicker = (1..IMAGES).map(change).sum::<f64>() / (IMAGES - 1) as f64;
        println!("| {title} | {way} | {flips:.4} | {errors:.4} | {flicker:.2} | {took:.1} |");
        for i in COMPARED {
            save(&format!("{title}-{i:02}-{way}"), &images[i]);
        }
    }
}

/// The camera of an image: 16 on an orbit, 10 forwards, 8 while it turns, and the rest at rest.
fn camera(from: &Camera, pivot: f32, image: usize) -> Camera {
    let steps = |first: usize, n: usize| image.saturating_sub(first).min(n) as f32;
    let turned = |camera: &Camera, angle: f32| {
        let turn = Mat3::from_axis_angle(camera.up, angle);
        Camera { right: turn * camera.right, forward: turn * camera.forward, ..*camera }
    };
    let center = from.eye + pivot * from.forward;
    let mut camera = turned(from, 0.02 * steps(0, 16));
    camera.eye = center - pivot * camera.forward;
    camera.eye += 0.02 * pivot * steps(16, 10) * camera.forward;
    turned(&camera, -0.02 * steps(26, 8))
}

/// An image as the window shows it.
///
/// - `number`: of the image, whose noise is its own; `way`: see the head of this file.
fn image(moving: &mut MovingImage, view: &Prepared, number: u32, way: &str) -> Vec<Vec3> {
    let numbers: Vec<u32> =
        way.trim_end_matches('s').split('+').map(|text| text.parse().expect("ways are numbers")).collect();
    let size_of = |divider: u32| UVec2::new(SIZE.x.div_ceil(divider), SIZE.y.div_ceil(divider));
    let size = size_of(numbers[0]);
    let seed = if numbers.len() == 1 { 1 } else { number };
    let settings = RenderSettings { seed, ..RenderSettings::default() };
    let mut film = Film::new(size.x, size.y);
    film.set_preview(true);
    film.note_surfaces();
    advance(view, &settings, &mut film, 1, &|| false);
    if let [_, _, images] = numbers[..] {
        moving.start_view(images as f32);
    }
    let smooth = smooth_film(&mut moving.filter, view, &settings, &film, &|| false).expect("surfaces are noted");
    let [_, surfaces, ..] = numbers[..] else { return displayed(smooth, size.into()) };
    let how =
        Relighting { surfaces: size_of(surfaces), weight: 1.0, window: SIZE, exposure: Display::default().exposure() };
    let (image, size) = relight(moving, view, &settings, &film, &how, &|| false).expect("nothing stops it");
    displayed(image, size.into())
}

/// - `title`: of its file.
fn reference(view: &Prepared, title: &str) -> Vec<Vec3> {
    if let Some(known) = path_of(title).and_then(|path| image::open(path).ok()) {
        return decoded(&known.to_rgba8());
    }
    let (mut film, settings) = (Film::new(SIZE.x, SIZE.y), RenderSettings { seed: 77, ..RenderSettings::default() });
    advance(view, &settings, &mut film, REFERENCE_SAMPLES, &|| false);
    let guides = gather_guides(view, &settings, SIZE, REFERENCE_SAMPLES, &|| false).expect("nothing stops it");
    let image = displayed(&denoise_film(&film, &guides, &|| false).expect("nothing stops it").color, SIZE.into());
    save(title, &image);
    image
}

/// Linear light of an image as the window shows it.
fn displayed(colors: &[Vec3], size: (u32, u32)) -> Vec<Vec3> {
    let mut rgba = Vec::new();
    develop_colors(colors, size, &Display::default(), SIZE.into(), &mut rgba);
    decoded(&rgba)
}

fn decoded(rgba: &[u8]) -> Vec<Vec3> {
    let table: Vec<f32> = (0..=255).map(|byte| decode_srgb(f64::from(byte) / 255.0) as f32).collect();
    let light = |pixel: &[u8]| Vec3::from([pixel[0], pixel[1], pixel[2]].map(|byte| table[usize::from(byte)]));
    rgba.chunks_exact(4).map(light).collect()
}

fn encoded(light: Vec3) -> [f32; 3] {
    light.to_array().map(|x| f32::from(firstlight::render::encode_srgb(x)))
}

fn relative_mse(image: &[Vec3], reference: &[Vec3]) -> f64 {
    let of = |(color, truth): (&Vec3, &Vec3)| {
        let off = *color - *truth;
        f64::from((off * off / (*truth * *truth + 0.01)).element_sum())
    };
    image.iter().zip(reference).map(of).sum::<f64>() / (3 * image.len()) as f64
}

/// Mean change of what is seen in two consecutive images, 0..255.
///
/// - `positions`: of the surfaces in both, zero where there is none; `camera`: of the first image.
fn change(images: [&[Vec3]; 2], positions: [&[Vec3]; 2], camera: &Camera) -> f64 {
    let size = SIZE.as_vec2();
    let (mut sum, mut n) = (0.0, 0);
    for (i, &position) in positions[1].iter().enumerate().filter(|(_, position)| **position != Vec3::ZERO) {
        let way = position - camera.eye;
        let depth = way.dot(camera.forward);
        let scale = size.y / camera.tan_half_vfov;
        let film = glam::Vec2::new(
            way.dot(camera.right) / depth * scale + size.x,
            size.y - way.dot(camera.up) / depth * scale,
        );
        let pixel = (film * 0.5).floor();
        if !(depth > 0.0 && pixel.cmpge(glam::Vec2::ZERO).all() && pixel.cmplt(size).all()) {
            continue;
        }
        let before = pixel.y as usize * SIZE.x as usize + pixel.x as usize;
        let pixel_size = 2.0 * camera.tan_half_vfov * depth / size.y;
        if positions[0][before].distance(position) > 2.0 * pixel_size {
            continue;
        }
        let (a, b) = (encoded(images[0][before]), encoded(images[1][i]));
        sum += (0..3).map(|c| f64::from((a[c] - b[c]).abs())).sum::<f64>() / 3.0;
        n += 1;
    }
    sum / f64::from(n.max(1))
}

fn path_of(title: &str) -> Option<String> {
    Some(format!("{}/{title}.png", std::env::var("FIRSTLIGHT_BENCH_IMAGES").ok()?))
}

fn save(title: &str, image: &[Vec3]) {
    let Some(path) = path_of(title) else { return };
    let rgb: Vec<u8> = image.iter().flat_map(|light| encoded(*light).map(|x| x as u8)).collect();
    let saved = image::save_buffer(&path, &rgb, SIZE.x, SIZE.y, image::ColorType::Rgb8);
    saved.unwrap_or_else(|error| panic!("{path}: {error}"));
}
