//! Images of a moving camera: light of a few paths on surfaces of a finer resolution, mixed with that of the images before.
//!
//! A film is smoothed ([`crate::denoise::MovingFilter`]), its light is put on surfaces ([`finer`]), and kept for the next
//! image ([`past`]); what that gives is mixed with the images before ([`antialias`]). The film stays as it is. Start reading at [`relight`].

mod antialias;
mod finer;
mod past;

use crate::core::filter::{FilterSampler, PixelFilter};
use crate::core::settings::RenderSettings;
use crate::denoise::MovingFilter;
use crate::driver::features::{BAND, Look, Part, PartTracer};
use crate::driver::relight::antialias::{Antialiased, Rays};
use crate::driver::relight::finer::{Coarse, FinePlace, FineRow, relight_row};
use crate::driver::relight::past::Past;
use crate::driver::smooth::set_of;
use crate::film::tiles::Film;
use crate::integrators::common::seen::Seen;
use crate::integrators::features::FeatureUse;
use crate::prepare::prepared::Prepared;
use crate::sampling::Sampler;
use firstlight_simd::InstructionSet;
use glam::{UVec2, Vec2, Vec3};
use rayon::prelude::*;

pub use crate::driver::relight::antialias::StillImage;

/// The middle of a pixel.
const MIDDLE: Vec2 = Vec2::splat(0.5);

/// An image of a moving camera, and what the next one takes over of it.
#[derive(Default)]
pub struct MovingImage {
    /// Smooths the film.
    pub filter: MovingFilter,
    /// The light of the film on surfaces.
    finer: Vec<Vec3>,
    /// The light of that image.
    present: Past,
    /// The light of the one before.
    past: Past,
    /// That counts as at most so many images.
    most: f32,
    antialiased: Antialiased,
    /// Number of the image, from which follows where in pixels its rays go through.
    number: u32,
}

impl MovingImage {
    /// Begins with another view, or with other samples of the same one: the latest image becomes the one before.
    ///
    /// - `most`: that counts as at most so many images, as when the light of the scene has changed.
    pub fn start_view(&mut self, most: f32) {
        self.number = self.number.wrapping_add(1);
        self.antialiased.start();
        if self.present.is_there() {
            std::mem::swap(&mut self.past, &mut self.present);
            self.present.forget();
            self.most = most;
        } else {
            self.most = self.most.min(most);
        }
        self.filter.keep_narrow(self.past.is_there() && self.most > 0.0);
    }

    /// Frees memory: of all but what the next image takes over, and the image itself.
    pub fn forget_image(&mut self) {
        let (present, past) = (std::mem::take(&mut self.present), std::mem::take(&mut self.past));
        let antialiased = std::mem::take(&mut self.antialiased);
        *self = Self { present, past, antialiased, most: self.most, number: self.number, ..Self::default() };
    }

    /// Takes over an image of the present view: those of the next views begin with it.
    pub fn settle(&mut self, still: StillImage) {
        self.antialiased.settle(still);
    }

    /// Where in pixels the rays of the present image go through: those of consecutive images fill the pixel evenly.
    fn place(&self) -> Vec2 {
        Sampler::new(0, 0, 0, self.number).pair(0)
    }

    /// The image that was made last, radiance, and its size.
    pub fn latest(&self) -> (&[Vec3], UVec2) {
        self.antialiased.latest()
    }

    /// Takes the memory for an image of this size, pixels: its colors, and what remains of it.
    fn take_finer(&mut self, size: UVec2, at: Vec2) -> (Vec<Vec3>, Past) {
        let (mut colors, mut present) = (std::mem::take(&mut self.finer), std::mem::take(&mut self.present));
        colors.resize(size.x as usize * size.y as usize, Vec3::ZERO);
        present.start(size, at);
        (colors, present)
    }

    /// Radiance of some pixels of a row, with the light of the film.
    ///
    /// - `surfaces`: what they show; `to`: their radiance; `to_past`: the whole row that is kept.
    fn relight_row(
        &self,
        set: InstructionSet,
        place: FinePlace,
        surfaces: &FineRow,
        to: &mut [Vec3],
        to_past: &mut [f32],
    ) {
        let (width, height) = self.filter.size();
        // Both images have the same vertical field of view, and the middle in the middle.
        let scale = height as f32 / place.size.y as f32;
        let v = ((place.first.y as f32 + place.at.y) * scale - 0.5).clamp(0.0, (height - 1) as f32);
        let top = v as usize;
        let coarse = Coarse {
            rows: [top.saturating_sub(1), top, top + 1, top + 2].map(|y| self.filter.row(y.min(height - 1))),
            below: v - top as f32,
            scale,
            offset: 0.5 * (width as f32 - place.size.x as f32 * scale),
            width,
            pixel: place.camera.pixel_size(Vec2::new(width as f32, height as f32)),
            past: self.past.seen(self.most),
        };
        relight_row(set, place, &coarse, surfaces, to, to_past);
    }
}

/// How an image is made of the light of a film.
#[derive(Clone, Copy, Debug)]
pub struct Relighting {
    /// Size of the surfaces that light is put on, pixels, at least 1 each. If it is not that of the film, one ray per pixel
    /// finds its surface, through mirrors and glass too.
    pub surfaces: UVec2,
    /// Number of images before that this one counts as.
    pub weight: f32,
    /// Size of the window, pixels: the image is not larger, and has up to twice as many rows as surfaces.
    pub window: UVec2,
    /// What radiance is multiplied by for the display.
    pub exposure: f32,
}

/// Puts the light of the smoothed film, mixed with that of the images before, on surfaces, and mixes the result with those
/// images, on the current rayon pool. `None` if `stop`, which is called often, returned true.
///
/// - `image`: whose filter has smoothed the film; keeps the result for the next one ([`MovingImage::start_view`]).
/// - `snapshot`, `settings`: those of the film.
///
/// Returns radiance, row by row from the top, and the size of the image.
///
/// # Panics
/// If a size is 0, or [`RenderSettings::check`] or [`Camera::check`](crate::core::camera::Camera::check) fails.
pub fn relight<'a>(
    image: &'a mut MovingImage,
    snapshot: &Prepared,
    settings: &RenderSettings,
    film: &Film,
    how: &Relighting,
    stop: &(dyn Fn() -> bool + Sync),
) -> Option<(&'a [Vec3], UVec2)> {
    let Relighting { surfaces: size, weight, window, exposure } = *how;
    let is_film = size == UVec2::new(film.width(), film.height());
    let at = if is_film { MIDDLE } else { image.place() };
    let (mut colors, mut present) = image.take_finer(size, at);
    let bands = Bands { light: image, snapshot, settings, size, at, weight, row_length: present.row_length() };
    let (colors_now, past_now) = (&mut colors[..], present.rows_mut());
    let done = if is_film {
        bands.of_film(film, colors_now, past_now, stop)
    } else {
        bands.of_rays(colors_now, past_now, stop)
    };
    if done {
        present.finish(&snapshot.camera);
    }
    (image.finer, image.present) = (colors, present);
    if !done {
        return None;
    }
    let (colors, past, camera) = (&image.finer, &image.present, &snapshot.camera);
    let rays = Rays { colors, past, camera, set: set_of(settings), exposure, weight, most: image.most };
    // Places in the pixels of a film differ, and are not known.
    let size = if is_film { size } else { (2 * size).min(window) };
    image.antialiased.mix(&rays, size, stop)?;
    Some(image.antialiased.latest())
}

/// What all rows of a relit image have in common.
struct Bands<'a> {
    light: &'a MovingImage,
    snapshot: &'a Prepared,
    settings: &'a RenderSettings,
    size: UVec2,
    at: Vec2,
    weight: f32,
    /// Of what is kept for the next image.
    row_length: usize,
}

impl Bands<'_> {
    fn of_rays(&self, colors: &mut [Vec3], past: &mut [f32], stop: &(dyn Fn() -> bool + Sync)) -> bool {
        let Self { snapshot, settings, size, row_length, .. } = *self;
        let positions = FilterSampler::new(PixelFilter::Box);
        let look = Look::new(snapshot, settings, &positions, size).at(self.at);
        let (media, eye) = (snapshot.camera_media(), snapshot.camera.eye);
        let start = || (PartTracer::begin(snapshot, &media, FeatureUse::Relighting), FineRow::default());
        let bands = colors.par_chunks_mut((size.x * BAND) as usize);
        let bands = bands.zip(past.par_chunks_mut(row_length * BAND as usize)).enumerate();
        let done = bands.map_init(start, |(tracer, fine), (number, (colors, past))| {
            let first_row = number as u32 * BAND;
            Part::of_band(first_row, size).all(|part| {
                tracer.trace(&look, &part.pixels(), 0..1, stop, |seen| {
                    let rows = part.rows_in_band(size.x).zip(seen.chunks_exact(part.n_columns()));
                    for (((row, seen), y), past) in rows.zip(first_row..).zip(past.chunks_exact_mut(row_length)) {
                        fine.fill(seen, eye);
                        let first = UVec2::new(row.start as u32 % size.x, y);
                        self.relight(first, fine, &mut colors[row], past);
                    }
                })
            })
        });
        done.all(|done| done)
    }

    fn of_film(&self, film: &Film, colors: &mut [Vec3], past: &mut [f32], stop: &(dyn Fn() -> bool + Sync)) -> bool {
        let (width, camera) = (self.size.x as usize, &self.snapshot.camera);
        let nothing = Seen { albedo: Vec3::ZERO, ..Seen::NOTHING };
        let start = || (vec![nothing; width], FineRow::default());
        let rows = colors.par_chunks_exact_mut(width).zip(past.par_chunks_exact_mut(self.row_length)).enumerate();
        let done = rows.map_init(start, |(surfaces, fine), (y, (colors, past))| {
            film.for_each_in_row(y as u32, |x, radiance| surfaces[x].emitted = radiance);
            film.for_each_surface_in_row(y as u32, |x, seen| {
                let emitted = surfaces[x].emitted;
                surfaces[x] = match self.light.filter.takes_part(x, y) {
                    true => Seen {
                        albedo: seen.albedo.max(Vec3::splat(f32::MIN_POSITIVE)),
                        normal: seen.normal,
                        position: seen.position,
                        depth: (seen.position - camera.eye).dot(camera.forward),
                        ..nothing
                    },
                    false => Seen { emitted, ..nothing },
                };
            });
            fine.fill(surfaces, camera.eye);
            self.relight(UVec2::new(0, y as u32), fine, colors, past);
            !stop()
        });
        done.all(|done| done)
    }

    fn relight(&self, first: UVec2, surfaces: &FineRow, to: &mut [Vec3], to_past: &mut [f32]) {
        let place =
            FinePlace { camera: &self.snapshot.camera, first, at: self.at, size: self.size, weight: self.weight };
        self.light.relight_row(set_of(self.settings), place, surfaces, to, to_past);
    }
}
