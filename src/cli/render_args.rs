//! What `firstlight render` is asked for.

use super::args::{FilterArg, IntegratorArg, OverwriteArgs, SceneArgs};
use super::number::{parse_positive, parse_share, parse_size, parse_stops};
use clap::Args;
use firstlight::render::Film;
use std::ops::Range;
use std::path::PathBuf;

/// Samples per pixel when neither a number, a time nor an error is given.
pub const DEFAULT_SPP: u32 = 256;

#[derive(Args, Clone, Debug)]
pub struct RenderArgs {
    #[command(flatten)]
    pub scene: SceneArgs,
    /// The picture: .png is developed, .exr is linear light.
    #[arg(short, long, value_name = "FILE")]
    pub output: PathBuf,
    /// Width and height in pixels; the scene's own when not given.
    #[arg(long, value_name = "WxH", value_parser = parse_size)]
    pub size: Option<(u32, u32)>,
    /// So many times as wide and as high.
    #[arg(long, value_name = "FACTOR", allow_negative_numbers = true, value_parser = parse_positive)]
    pub scale: Option<f64>,
    /// Samples per pixel; 256 unless a time or an error is given.
    #[arg(long, value_name = "N", allow_negative_numbers = true, value_parser = clap::value_parser!(u32).range(1..=i64::from(Film::MAX_SAMPLES)))]
    pub spp: Option<u32>,
    /// Samples A to B-1 of each pixel: ranges that do not overlap can be added up with `firstlight merge`.
    #[arg(long, value_name = "A..B", value_parser = parse_range, conflicts_with_all = ["spp", "resume"])]
    pub samples: Option<Range<u32>>,
    /// Keep the film as well, an .exr to go on from.
    #[arg(long, value_name = "FILE.exr")]
    pub film: Option<PathBuf>,
    /// The relative error of each pixel as well, as the picture itself tells it: an .exr in which 0.05 is 5 %, the mean over
    /// 5 x 5 pixels. The root of the mean of its squares is the error of the whole picture.
    #[arg(long, value_name = "FILE.exr", conflicts_with_all = ["turntable", "bookmarks", "region"])]
    pub error_picture: Option<PathBuf>,
    /// Once around what the camera looks at, in so many pictures: FILE-0001.png and so on.
    #[arg(long, value_name = "FRAMES", allow_negative_numbers = true, value_parser = clap::value_parser!(u32).range(1..=100_000), conflicts_with_all = ["film", "resume", "samples", "json"])]
    pub turntable: Option<u32>,
    /// Left, top, width and height of a part of the picture, pixels: it gets all samples but the first, with whole tiles
    /// of 32 pixels around it, and what is left is as it was, with --resume too.
    #[arg(long, value_name = "X,Y,W,H", value_parser = parse_region, conflicts_with_all = ["turntable", "bookmarks", "samples"])]
    pub region: Option<[u32; 4]>,
    /// From bookmark to bookmark of the scene, by their numbers: 1,2,3.
    #[arg(long, value_name = "NUMBERS", value_delimiter = ',', requires = "frames", conflicts_with_all = ["turntable", "film", "resume", "samples", "json"])]
    pub bookmarks: Option<Vec<u8>>,
    /// In how many pictures.
    #[arg(long, value_name = "FRAMES", allow_negative_numbers = true, value_parser = clap::value_parser!(u32).range(1..=100_000), requires = "bookmarks")]
    pub frames: Option<u32>,
    /// Go on with the film that is there: with --film, or with the film that is named as the scene.
    #[arg(long)]
    pub resume: bool,
    #[command(flatten)]
    pub overwrite: OverwriteArgs,
    /// Stop after so many seconds of rendering.
    #[arg(long, value_name = "SECONDS", allow_negative_numbers = true, value_parser = parse_positive)]
    pub time: Option<f64>,
    /// Stop when the picture's relative error, by its own estimate, is down to this: 0.01 or 1% is one per cent.
    #[arg(long, value_name = "SHARE", allow_negative_numbers = true, value_parser = parse_share)]
    pub error: Option<f64>,
    /// Worker threads; all cores when not given. The picture does not depend on it.
    #[arg(long, value_name = "N", allow_negative_numbers = true, value_parser = clap::value_parser!(u16).range(1..=1024))]
    pub threads: Option<u16>,
    /// Another seed gives other noise; 0 when not given.
    #[arg(long, value_name = "N", allow_negative_numbers = true)]
    pub seed: Option<u32>,
    /// The light model; the scene's own when not given.
    #[arg(long, value_enum)]
    pub integrator: Option<IntegratorArg>,
    /// How the light around a pixel is weighted; the scene's own when not given.
    #[arg(long, value_enum)]
    pub filter: Option<FilterArg>,
    /// Longest path in segments; 1 shows lights alone.
    #[arg(long, value_name = "N", allow_negative_numbers = true, value_parser = clap::value_parser!(u32).range(1..))]
    pub max_depth: Option<u32>,
    /// Brighter or darker by factors of two, on top of the scene's own exposure; .exr keeps the linear light.
    #[arg(long, value_name = "STOPS", allow_negative_numbers = true, default_value_t = 0.0, value_parser = parse_stops)]
    pub exposure: f32,
    /// Print one JSON object with times and counts as the last line.
    #[arg(long)]
    pub json: bool,
    /// Said once the scene has been read.
    #[arg(skip)]
    pub announcement: Option<String>,
}

/// `64..128` as sample numbers.
fn parse_range(text: &str) -> Result<Range<u32>, String> {
    let (start, end) =
        text.split_once("..").ok_or("write it as A..B, such as 64..128: from A up to, not including, B")?;
    let number = |text: &str| text.trim().parse::<u32>().map_err(|_| format!("`{text}` is not the number of a sample"));
    let range = number(start)?..number(end)?;
    if range.is_empty() {
        Err(format!("there is no sample from {} up to {}", range.start, range.end))
    } else if range.end > Film::MAX_SAMPLES {
        Err(format!("samples are numbered below {}", Film::MAX_SAMPLES))
    } else {
        Ok(range)
    }
}

/// `X,Y,W,H` as four numbers of pixels.
fn parse_region(text: &str) -> Result<[u32; 4], String> {
    let wrong = || format!("`{text}` is not a rectangle: write it as X,Y,W,H in pixels, such as 640,360,200,100");
    let numbers: Option<Vec<u32>> = text.split(',').map(|part| part.trim().parse().ok()).collect();
    let region = numbers.and_then(|numbers| <[u32; 4]>::try_from(numbers).ok()).ok_or_else(wrong)?;
    if region[2] == 0 || region[3] == 0 { Err(wrong()) } else { Ok(region) }
}
