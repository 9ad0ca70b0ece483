//! Inspections: views of the scene and the film in colours, such as normals, depth, cost and error. Neither is changed.
//!
//! Views of the scene need one ray per pixel, through the centre of the pixel and of the lens, and stay the same while
//! samples are added; views of the film are computed from its sums. Start reading at [`inspect`].

use crate::core::color::luminance;
use crate::core::material::MaterialId;
use crate::core::settings::RenderSettings;
use crate::driver::single::mean_bounces;
use crate::film::develop::encode_srgb;
use crate::film::tiles::Film;
use crate::integrators::visible_albedo::surface_albedo;
use crate::prepare::prepared::Prepared;
use crate::shading::vertex::{Vertex, material_of};
use firstlight_kdtree::geometry::Ray;
use firstlight_kdtree::{Hit, HitBatch, RayBatch, RayClass};
use glam::{UVec2, Vec2, Vec3};
use rayon::prelude::*;
use serde::{Deserialize, Serialize};

/// What is displayed in place of the image.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, Serialize, Deserialize)]
pub enum Inspection {
    /// The image itself.
    #[default]
    Picture,
    /// Shading normals in camera space: red is right, green up, blue towards the viewer; half intensity is zero.
    Normals,
    /// Depth along the view axis, metres.
    Depth,
    /// Albedo, without lighting.
    Albedo,
    /// Relative error per pixel, from its last doubling of samples.
    Error,
    /// Samples per pixel.
    Samples,
    /// Kd-tree nodes visited to find the closest hit.
    TreeSteps,
    /// Blocks of triangles tested to find the closest hit.
    TriangleTests,
    /// Bounces of one path, mean over 4 × 4 pixels.
    Bounces,
    /// Luminance in stops (factors of two).
    Luminance,
}

impl Inspection {
    /// All views, in the order of menus.
    pub const ALL: [Self; 10] = [
        Self::Picture,
        Self::Normals,
        Self::Depth,
        Self::Albedo,
        Self::Error,
        Self::Samples,
        Self::TreeSteps,
        Self::TriangleTests,
        Self::Bounces,
        Self::Luminance,
    ];

    /// Name for the user, lower case.
    pub fn label(self) -> &'static str {
        match self {
            Self::Picture => "image",
            Self::Normals => "normals",
            Self::Depth => "depth",
            Self::Albedo => "albedo",
            Self::Error => "relative error",
            Self::Samples => "samples",
            Self::TreeSteps => "kd-tree steps",
            Self::TriangleTests => "triangle tests",
            Self::Bounces => "bounces",
            Self::Luminance => "false colour",
        }
    }

    /// Whether the view changes with every sample.
    pub fn is_of_film(self) -> bool {
        matches!(self, Self::Picture | Self::Error | Self::Samples | Self::Luminance)
    }
}

/// Values at the ends of the colour scale.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Legend {
    /// Value of dark blue.
    pub low: f32,
    /// Value of red.
    pub high: f32,
    /// Unit of both values, as displayed beside the scale.
    pub unit: &'static str,
}

/// An inspection as bytes, in the size of its film.
#[derive(Clone, Debug, Default)]
pub struct Inspected {
    /// Width in pixels.
    pub width: u32,
    /// Height in pixels.
    pub height: u32,
    /// sRGB-encoded pixels, row by row from the top.
    pub rgb: Vec<[u8; 3]>,
    /// `None` for views without a colour scale.
    pub legend: Option<Legend>,
}

/// Computes a view, on the current rayon pool; `None` if `stop`, which is called once per row, returned true.
pub fn inspect(
    kind: Inspection,
    snapshot: &Prepared,
    settings: &RenderSettings,
    film: &Film,
    stop: &(dyn Fn() -> bool + Sync),
) -> Option<Inspected> {
    let (width, height) = (film.width(), film.height());
    let size = UVec2::new(width, height);
    let scaled = |values: Vec<f32>, range: (f32, f32), unit| {
        let (low, high) = range;
        let rgb = values.par_iter().map(|&value| scale_color((value - low) / (high - low))).collect();
        Inspected { width, height, rgb, legend: Some(Legend { low, high, unit }) }
    };
    let plain = |rgb| Inspected { width, height, rgb, legend: None };
    Some(match kind {
        // This is developed from radiance instead.
        Inspection::Picture => plain(Vec::new()),
        Inspection::Normals => plain(first_hits(snapshot, size, stop, |seen| match seen {
            Some((vertex, _)) => {
                let camera = &snapshot.camera;
                let of = |axis: Vec3| vertex.normal.dot(axis);
                let local = Vec3::new(of(camera.right), of(camera.up), -of(camera.forward));
                (local * 127.5 + 127.5).to_array().map(|c| c.round() as u8)
            }
            None => [0; 3],
        })?),
        Inspection::Albedo => plain(first_hits(snapshot, size, stop, |seen| match seen {
            Some((vertex, material)) => surface_albedo(snapshot, &vertex, material).to_array().map(encode_srgb),
            None => [0; 3],
        })?),
        Inspection::Depth => {
            let depths = depths(snapshot, size, stop)?;
            // Logarithmic, because relative differences of depth matter.
            let values: Vec<f32> = depths.iter().map(|depth| depth.log2()).collect();
            let (low, high) = range_of(&values, 0.005);
            let view = scaled(values, (low, high), "");
            Inspected { legend: Some(Legend { low: low.exp2(), high: high.exp2(), unit: "m" }), ..view }
        }
        Inspection::Error => {
            let errors = smoothed(&film_values(film, |film, x, y| film.doubling_step(x, y)), size);
            let values: Vec<f32> = errors.iter().map(|error| error.sqrt().max(1e-4).log10()).collect();
            let view = scaled(values, (-3.0, 0.0), "");
            Inspected { legend: Some(Legend { low: 0.1, high: 100.0, unit: "%" }), ..view }
        }
        Inspection::Samples => {
            let values = film_values(film, |film, x, y| film.samples(x, y) as f32);
            let high = values.iter().copied().fold(1.0, f32::max);
            scaled(values, (0.0, high), "spp")
        }
        Inspection::TreeSteps | Inspection::TriangleTests => {
            let values = camera_rays(snapshot, size, stop, |ray| {
                let visits = snapshot.geometry.tree.count_visits(ray);
                let count = if kind == Inspection::TreeSteps { visits.inner + visits.leaves } else { visits.blocks };
                count as f32
            })?;
            let (_, high) = range_of(&values, 0.002);
            scaled(values, (0.0, high.max(1.0)), if kind == Inspection::TreeSteps { "nodes" } else { "blocks" })
        }
        Inspection::Bounces => {
            let values = mean_bounces(snapshot, settings, size, stop)?;
            let (_, high) = range_of(&values, 0.01);
            scaled(values, (0.0, high.max(1.0)), "")
        }
        Inspection::Luminance => {
            let values = film_values(film, |film, x, y| luminance(film.mean(x, y)).max(1e-9).log2());
            scaled(values, (-8.0, 6.0), "stops")
        }
    })
}

/// Returns the relative error of each pixel, row by row from the top, from its last doubling of samples: the mean over
/// 5 × 5 pixels, scaled so that the root mean square over the image is the estimated error of the whole image. `None`
/// while that is unknown.
pub fn relative_errors(film: &Film) -> Option<Vec<f32>> {
    let told = film.error_estimate()?.relative;
    let size = UVec2::new(film.width(), film.height());
    let steps = smoothed(&film_values(film, |film, x, y| film.doubling_step(x, y)), size);
    let mean = steps.iter().map(|&step| f64::from(step)).sum::<f64>() / steps.len() as f64;
    // Without any change the error is 0.
    let scale = if mean > 0.0 { told * told / mean } else { 0.0 };
    Some(steps.iter().map(|&step| (scale * f64::from(step)).sqrt() as f32).collect())
}

/// Returns the depth along the view axis of each pixel in metres, row by row from the top; infinite for a miss. `None`
/// if `stop` returned true.
pub fn depths(snapshot: &Prepared, size: UVec2, stop: &(dyn Fn() -> bool + Sync)) -> Option<Vec<f32>> {
    let forward = snapshot.camera.forward;
    hits_by_row(snapshot, size, stop, |ray, hit| hit.map_or(f32::INFINITY, |hit| hit.t * ray.dir.dot(forward)))
}

/// A surface as a pixel shows it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SeenSurface {
    /// Index of the object in the snapshot.
    pub object: u32,
    /// Its material at this point.
    pub material: MaterialId,
    /// Whether its front is seen: the outside of a closed surface.
    pub front: bool,
    /// In the snapshot's frame, metres.
    pub position: Vec3,
    /// Shading normal on the side that is seen, unit.
    pub normal: Vec3,
    /// From the camera, metres.
    pub distance: f32,
}

/// Returns the surface in the middle of a pixel, seen from the middle of the lens; `None` for the environment.
pub fn seen_surface(snapshot: &Prepared, size: UVec2, pixel: UVec2) -> Option<SeenSurface> {
    let (mut rays, mut hits) = (RayBatch::default(), HitBatch::default());
    rays.push(&middle_ray(snapshot, pixel.x, pixel.y, size));
    snapshot.closest_hits(&rays, RayClass::Coherent, &mut hits);
    let (ray, hit) = (rays.get(0), hits.get(0)?);
    let material = material_of(snapshot, &hit);
    let vertex = Vertex::new(snapshot, &ray, &hit, material);
    let distance = (vertex.position - ray.origin).length();
    let Vertex { front, position, normal, .. } = vertex;
    Some(SeenSurface { object: hit.object, material, front, position, normal, distance })
}

fn first_hits<T: Send>(
    snapshot: &Prepared,
    size: UVec2,
    stop: &(dyn Fn() -> bool + Sync),
    see: impl Fn(Option<(Vertex, MaterialId)>) -> T + Sync,
) -> Option<Vec<T>> {
    hits_by_row(snapshot, size, stop, |ray, hit| {
        see(hit.map(|hit| {
            let material = material_of(snapshot, &hit);
            (Vertex::new(snapshot, ray, &hit, material), material)
        }))
    })
}

/// Traces the rays through the pixel centres and applies `see` to their closest hits, row by row from the top.
fn hits_by_row<T: Send>(
    snapshot: &Prepared,
    size: UVec2,
    stop: &(dyn Fn() -> bool + Sync),
    see: impl Fn(&Ray, Option<Hit>) -> T + Sync,
) -> Option<Vec<T>> {
    let rows: Option<Vec<Vec<T>>> = (0..size.y)
        .into_par_iter()
        .map_init(Default::default, |(rays, hits): &mut (RayBatch, HitBatch), y| {
            if stop() {
                return None;
            }
            rays.clear();
            (0..size.x).for_each(|x| rays.push(&middle_ray(snapshot, x, y, size)));
            snapshot.closest_hits(rays, RayClass::Coherent, hits);
            Some((0..rays.len()).map(|i| see(&rays.get(i), hits.get(i))).collect())
        })
        .collect();
    Some(rows?.into_iter().flatten().collect())
}

fn camera_rays<T: Send>(
    snapshot: &Prepared,
    size: UVec2,
    stop: &(dyn Fn() -> bool + Sync),
    see: impl Fn(&Ray) -> T + Sync,
) -> Option<Vec<T>> {
    let rows: Option<Vec<Vec<T>>> = (0..size.y)
        .into_par_iter()
        .map(|y| (!stop()).then(|| (0..size.x).map(|x| see(&middle_ray(snapshot, x, y, size))).collect()))
        .collect();
    Some(rows?.into_iter().flatten().collect())
}

fn middle_ray(snapshot: &Prepared, x: u32, y: u32, size: UVec2) -> Ray {
    let film = Vec2::new(x as f32 + 0.5, y as f32 + 0.5);
    snapshot.camera.middle_ray(film, size.as_vec2())
}

fn film_values(film: &Film, value: impl Fn(&Film, u32, u32) -> f32 + Sync) -> Vec<f32> {
    let (width, height) = (film.width(), film.height());
    (0..width * height).into_par_iter().map(|i| value(film, i % width, i / width)).collect()
}

/// Mean over 5 × 5 pixels: the variance estimate of a single pixel would be mostly noise.
fn smoothed(values: &[f32], size: UVec2) -> Vec<f32> {
    let [width, height] = size.to_array().map(|n| n as usize);
    let rows: Vec<f32> = (0..width * height)
        .into_par_iter()
        .map(|i| {
            let (x, y) = (i % width, i / width);
            let around = &values[y * width..][x.saturating_sub(2)..(x + 3).min(width)];
            around.iter().sum::<f32>() / around.len() as f32
        })
        .collect();
    (0..width * height)
        .into_par_iter()
        .map(|i| {
            let (x, y) = (i % width, i / width);
            let around = y.saturating_sub(2)..(y + 3).min(height);
            let n = around.len() as f32;
            around.map(|y| rows[y * width + x]).sum::<f32>() / n
        })
        .collect()
}

/// Returns the range of the finite values after removing this share at either end.
fn range_of(values: &[f32], share: f32) -> (f32, f32) {
    let mut sorted: Vec<f32> = values.iter().copied().filter(|value| value.is_finite()).collect();
    if sorted.is_empty() {
        return (0.0, 1.0);
    }
    sorted.sort_unstable_by(f32::total_cmp);
    let off = (share * sorted.len() as f32) as usize;
    let (low, high) = (sorted[off.min(sorted.len() - 1)], sorted[(sorted.len() - 1).saturating_sub(off)]);
    // A constant image still needs two distinct ends.
    if high > low { (low, high) } else { (low, low + 1.0) }
}

/// Colour scale from dark blue at 0 over green to red at 1, each step brighter or warmer than the one before; grey for
/// NaN and infinities.
pub fn scale_color(value: f32) -> [u8; 3] {
    const STOPS: [[f32; 3]; 7] = [
        [20.0, 16.0, 70.0],
        [38.0, 70.0, 160.0],
        [32.0, 140.0, 170.0],
        [70.0, 185.0, 110.0],
        [205.0, 210.0, 70.0],
        [245.0, 140.0, 45.0],
        [215.0, 40.0, 40.0],
    ];
    if !value.is_finite() {
        return [30, 30, 32];
    }
    let place = value.clamp(0.0, 1.0) * (STOPS.len() - 1) as f32;
    let i = (place as usize).min(STOPS.len() - 2);
    let (a, b) = (Vec3::from(STOPS[i]), Vec3::from(STOPS[i + 1]));
    a.lerp(b, place - i as f32).to_array().map(|c| c.round() as u8)
}

/// Tints the pixels in focus and draws the focal plane as a line, over a developed image.
///
/// - `depths`: of a film of `film_size`, see [`depths`]; `zone`: near and far limit of acceptable sharpness; `focus`:
///   focal distance; all in metres along the view axis.
pub fn tint_sharp_zone(rgba: &mut [u8], size: UVec2, depths: &[f32], film_size: UVec2, zone: (f32, f32), focus: f32) {
    const SHARP: Vec3 = Vec3::new(70.0, 220.0, 120.0);
    const PLANE: [u8; 3] = [255, 225, 90];
    let row_bytes = 4 * size.x as usize;
    let depth_at = |x: u32, y: u32| {
        let [x, y] = [x * film_size.x / size.x, y * film_size.y / size.y];
        depths[(y.min(film_size.y - 1) * film_size.x + x.min(film_size.x - 1)) as usize]
    };
    rgba.par_chunks_exact_mut(row_bytes).enumerate().for_each(|(y, row)| {
        for (x, pixel) in row.chunks_exact_mut(4).enumerate() {
            let (x, y) = (x as u32, y as u32);
            let here = depth_at(x, y);
            // The focal plane passes between this pixel and the next one on the same surface.
            let crosses = |other: f32| {
                (here - focus).signum() != (other - focus).signum() && (here - other).abs() < 0.1 * here.min(other)
            };
            if crosses(depth_at((x + 1).min(size.x - 1), y)) || crosses(depth_at(x, (y + 1).min(size.y - 1))) {
                pixel[..3].copy_from_slice(&PLANE);
            } else if here >= zone.0 && here <= zone.1 {
                for (channel, tint) in pixel.iter_mut().zip(SHARP.to_array()) {
                    *channel = (0.72 * f32::from(*channel) + 0.28 * tint) as u8;
                }
            }
        }
    });
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_scale_grows_and_knows_no_number() {
        assert_eq!((scale_color(0.0), scale_color(1.0)), ([20, 16, 70], [215, 40, 40]));
        assert_eq!((scale_color(-3.0), scale_color(9.0)), (scale_color(0.0), scale_color(1.0)));
        assert_eq!(scale_color(f32::NAN), scale_color(f32::INFINITY));
        let all: std::collections::HashSet<_> = (0..=60).map(|i| scale_color(i as f32 / 60.0)).collect();
        assert_eq!(all.len(), 61, "no two values look alike");
    }

    #[test]
    fn ranges_leave_out_the_ends() {
        let mut values: Vec<f32> = (0..1000).map(|i| i as f32).collect();
        values.push(f32::INFINITY);
        assert_eq!(range_of(&values, 0.01), (10.0, 989.0));
        assert_eq!(range_of(&[3.0, 3.0], 0.1), (3.0, 4.0));
        assert_eq!(range_of(&[f32::NAN], 0.1), (0.0, 1.0));
    }

    #[test]
    fn smoothing_keeps_the_mean_of_what_is_even() {
        let size = UVec2::new(9, 7);
        assert!(smoothed(&[0.5; 63], size).iter().all(|value| (value - 0.5).abs() < 1e-6));
        let mut one = [0.0; 63];
        one[3 * 9 + 4] = 25.0;
        let spread = smoothed(&one, size);
        assert_eq!((spread[3 * 9 + 4], spread[2 * 9 + 2], spread[0]), (1.0, 1.0, 0.0));
    }

    #[test]
    fn the_sharp_zone_is_tinted_and_the_plane_is_a_line() {
        // A receding floor: one depth per row.
        let (size, depths) = (UVec2::new(4, 8), (0..32).map(|i| 10.0 - (i / 4) as f32).collect::<Vec<_>>());
        let mut rgba = vec![0; 4 * 32];
        // Rows lie at 10, 9, … 3 m; steps of 1 m exceed a tenth of any depth below 10 m.
        tint_sharp_zone(&mut rgba, size, &depths, size, (5.5, 8.5), 9.5);
        let row = |y: usize| [rgba[16 * y], rgba[16 * y + 1]];
        assert_eq!(row(1), [0, 0], "in front of the far limit only from 8.5 m on");
        assert!((2..=4).all(|y| row(y)[1] > 50), "8, 7 and 6 m are sharp");
        assert_eq!([row(0), row(5), row(7)], [[0, 0]; 3]);
        let fine: Vec<f32> = (0..32).map(|i| 10.0 - 0.1 * (i / 4) as f32).collect();
        tint_sharp_zone(&mut rgba, size, &fine, size, (0.0, 0.0), 9.75);
        assert_eq!(rgba[16 * 2..16 * 2 + 3], [255, 225, 90], "between 9.8 and 9.7 m");
    }
}
