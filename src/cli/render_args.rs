//! Arguments of `firstlight render`.

use crate::cli::args::{FilterArg, IntegratorArg, OverwriteArgs, SceneArgs, ScenesArgs};
use crate::cli::console::remark;
use crate::cli::denoising::DenoiseArgs;
use crate::cli::failure::Failure;
use crate::cli::frames::{FramesArg, parse_frames};
use crate::cli::layers::LayerArgs;
use crate::cli::number::{
    at_least_one, between, parse_fps, parse_interval, parse_positive, parse_share, parse_size, parse_stops,
};
use clap::{Arg, Args, ValueEnum};
use firstlight::frame::PictureFormat;
use firstlight::render::Film;
use firstlight::scene::{ImageMetadata, SceneSource};
use std::ffi::{OsStr, OsString};
use std::ops::Range;
use std::path::{Path, PathBuf};

/// Samples per pixel when neither a number, a time nor an error is given.
pub const DEFAULT_SPP: u32 = 256;

pub const EXAMPLES: &str = "\
Examples:
  firstlight render cornell -o cornell.png --spp 64
  firstlight render model.obj --env sky.hdr -o model.exr --error 1%
  firstlight render scene.ron -o scene.png --film scene.exr --time 60
  firstlight render scene.ron -o scene.png --film scene.exr --resume --time 60
  firstlight render scene.ron -o scene.exr --layers albedo,normal,depth,object
  firstlight render image.png -o larger.png --scale 2

`firstlight scenes` lists the built-in scenes.";

/// Options with a heading of their own that `-h` lists too; the others are for `--help`.
const OFTEN_ASKED: [&str; 6] = ["camera", "at", "scale", "layers", "frames", "film"];

/// Leaves an option that few people need out of the short help.
pub fn brief(arg: Arg) -> Arg {
    let is_rare = arg.get_help_heading().is_some() && !OFTEN_ASKED.contains(&arg.get_id().as_str());
    arg.hide_short_help(is_rare)
}

/// What is to be rendered, and where to.
#[derive(Args, Clone, Debug)]
pub struct RenderCommand {
    #[command(flatten)]
    scenes: ScenesArgs,
    /// Image file, replaced if it exists; a folder for several scenes; - for standard output.
    ///
    /// .png and .jpg are tone-mapped, .exr holds linear light (HDR). Missing folders are created. By default a new file
    /// firstlight-NAME.png in the current folder.
    #[arg(short, long, value_name = "FILE")]
    output: Option<PathBuf>,
    #[command(flatten)]
    render: RenderArgs,
}

/// How one scene is rendered.
#[derive(Args, Clone, Debug)]
pub struct RenderArgs {
    #[arg(skip)]
    pub scene: SceneArgs,
    /// The image; [`STDOUT`] for standard output.
    #[arg(skip)]
    pub output: PathBuf,
    /// Image format [default: from the name of the output, else png].
    #[arg(long, value_enum, help_heading = "Output")]
    pub format: Option<FormatArg>,
    /// Width and height in pixels [default: from the scene].
    #[arg(long, value_name = "WxH", value_parser = parse_size)]
    pub size: Option<(u32, u32)>,
    /// Scale width and height.
    #[arg(help_heading = "Output", long, value_name = "FACTOR", allow_negative_numbers = true, value_parser = parse_positive)]
    pub scale: Option<f64>,
    /// Samples per pixel, the mean over the image [default: 256, unless --time or --error is given].
    #[arg(long, value_name = "N", allow_negative_numbers = true, value_parser = between::<u32>(1, Film::MAX_SAMPLES))]
    pub spp: Option<u32>,
    /// Stop after this many seconds of rendering.
    #[arg(long, value_name = "SECONDS", allow_negative_numbers = true, value_parser = parse_positive)]
    pub time: Option<f64>,
    /// Stop when the estimated relative error of the image is at most this: 1% or 0.01.
    #[arg(long, value_name = "ERROR", allow_negative_numbers = true, value_parser = parse_share)]
    pub error: Option<f64>,
    /// Save the estimated relative error of each pixel as an .exr in which 0.05 is 5 %
    ///
    /// Values are averaged over 5 x 5 pixels; their root mean square is the error estimate of the whole image.
    #[arg(help_heading = "Output", long, value_name = "FILE.exr", conflicts_with_all = ["turntable", "bookmarks", "region"])]
    pub error_image: Option<PathBuf>,
    #[command(flatten)]
    pub layers: LayerArgs,
    /// Samples per pixel of the layers albedo, normal, depth, position, object and material [default: 16].
    #[arg(long, value_name = "N", requires = "layers", help_heading = "Output", allow_negative_numbers = true, value_parser = between::<u32>(1, 65_536))]
    pub layer_samples: Option<u32>,
    #[command(flatten)]
    pub denoise: DenoiseArgs,
    /// Orbit the camera once around its target in N frames: FILE-0001.png, FILE-0002.png, ….
    #[arg(help_heading = "Animation", long, value_name = "FRAMES", allow_negative_numbers = true, value_parser = between::<u32>(1, 100_000), conflicts_with_all = ["film", "resume", "samples", "json"])]
    pub turntable: Option<u32>,
    /// Move the camera through bookmarks of the scene, such as 1,2,3.
    #[arg(help_heading = "Animation", long, value_name = "NUMBERS", value_delimiter = ',', requires = "frames", conflicts_with_all = ["turntable", "film", "resume", "samples", "json"])]
    pub bookmarks: Option<Vec<u8>>,
    /// Render frames A to B-1 of the animation as FILE-0000.png, FILE-0001.png, …: frame i is at i / fps seconds
    ///
    /// N is 0..N; with --bookmarks it is the number of frames. --film saves the film of each frame.
    #[arg(help_heading = "Animation", long, value_name = "A..B|N", allow_negative_numbers = true, value_parser = parse_frames, conflicts_with_all = ["turntable", "resume", "samples", "json", "error_image", "region", "at"])]
    pub frames: Option<FramesArg>,
    /// Frames per second [default: from the scene file, else 24].
    #[arg(help_heading = "Animation", long, value_name = "N", allow_negative_numbers = true, value_parser = parse_fps)]
    pub fps: Option<f64>,
    /// Make a video of the frames with ffmpeg, where it is installed; the extension selects the format.
    #[arg(help_heading = "Animation", long, value_name = "FILE.mp4", conflicts_with = "part")]
    pub video: Option<PathBuf>,
    /// Save the render state (film) as well, for --resume and `firstlight merge`.
    #[arg(help_heading = "Films and parts", long, value_name = "FILE.exr")]
    pub film: Option<PathBuf>,
    /// Render samples A to B-1 of each pixel; `firstlight merge` combines films of disjoint ranges.
    #[arg(help_heading = "Films and parts", long, value_name = "A..B", value_parser = parse_range, conflicts_with_all = ["spp", "resume"])]
    pub samples: Option<Range<u32>>,
    /// Render only a rectangle: left, top, width and height in pixels, enlarged to whole tiles of 32 pixels
    ///
    /// Pixels outside of it get one sample, or keep their samples with --resume.
    #[arg(help_heading = "Films and parts", long, value_name = "X,Y,W,H", value_parser = parse_region, conflicts_with_all = ["turntable", "bookmarks", "samples"])]
    pub region: Option<[u32; 4]>,
    /// Render one of N equal parts into --film: I/N, such as 3/64, or auto for the task of an array job
    ///
    /// A complete part is skipped, an interrupted one is resumed. {part} in --film is replaced by the number of the part.
    /// Exit status: 0 done, 75 try again, 2 wrong input.
    #[arg(help_heading = "Films and parts", long, value_name = "I/N", conflicts_with_all = ["resume", "region", "time", "error", "json", "error_image", "error_metric"])]
    pub part: Option<String>,
    /// What is divided into parts [default: samples; the frames of a sequence].
    #[arg(help_heading = "Films and parts", long, value_name = "WHAT", value_enum, requires = "part")]
    pub part_by: Option<PartBy>,
    /// Seconds between two saves of the film of a part.
    #[arg(help_heading = "Films and parts", long, value_name = "SECONDS", allow_negative_numbers = true, value_parser = parse_interval, default_value_t = 60.0, requires = "part")]
    pub save_every: f64,
    /// Resume the film given by --film, or a film given as the scene.
    #[arg(long, help_heading = "Films and parts")]
    pub resume: bool,
    #[command(flatten)]
    pub overwrite: OverwriteArgs,
    /// Take the same number of samples in every pixel [default: more where the error is larger, except with --samples]
    ///
    /// Without this option --spp is the mean over the image.
    #[arg(help_heading = "Rendering", long, conflicts_with = "error_metric")]
    pub uniform: bool,
    /// The error that the allocation of samples minimises [default: relmse].
    #[arg(help_heading = "Rendering", long, value_enum, value_name = "METRIC", conflicts_with = "samples")]
    pub error_metric: Option<MetricArg>,
    /// Number of worker threads [default: all cores]; the image does not depend on it.
    #[arg(help_heading = "Rendering", long, value_name = "N", allow_negative_numbers = true, value_parser = between::<u16>(1, 1024))]
    pub threads: Option<u16>,
    /// Random seed [default: from the scene, else 0].
    #[arg(help_heading = "Rendering", long, value_name = "N", allow_negative_numbers = true, value_parser = between::<u32>(0, u32::MAX))]
    pub seed: Option<u32>,
    /// Light transport [default: from the scene].
    #[arg(help_heading = "Rendering", long, value_enum)]
    pub integrator: Option<IntegratorArg>,
    /// Pixel reconstruction filter [default: from the scene].
    #[arg(help_heading = "Rendering", long, value_enum)]
    pub filter: Option<FilterArg>,
    /// Maximum path length in segments; 1 shows only emitters.
    #[arg(help_heading = "Rendering", long, value_name = "N", allow_negative_numbers = true, value_parser = at_least_one)]
    pub max_depth: Option<u32>,
    /// Exposure in stops, added to that of the scene; does not affect .exr.
    #[arg(help_heading = "Output", long, value_name = "STOPS", allow_negative_numbers = true, default_value_t = 0.0, value_parser = parse_stops)]
    pub exposure: f32,
    /// Print times and counts as one line of JSON.
    #[arg(long)]
    pub json: bool,
    /// Printed once the scene has been read.
    #[arg(skip)]
    pub announcement: Option<String>,
    /// Other scenes are rendered after this one.
    #[arg(skip)]
    pub has_next: bool,
}

/// The name of standard output.
pub const STDOUT: &str = "-";

#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum FormatArg {
    /// 8 bits, tone-mapped.
    Png,
    /// As png, smaller and with loss; firstlight cannot open a scene from it.
    #[value(alias = "jpeg")]
    Jpg,
    /// Linear light (HDR).
    Exr,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum MetricArg {
    /// Of linear light, relative to its level.
    Relmse,
    /// Of the image as it is displayed.
    Display,
}

/// What is divided into parts.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum PartBy {
    /// Ranges of samples of the whole image.
    Samples,
    /// Rectangles of tiles with all samples.
    Tiles,
    /// Frames of a sequence.
    Frames,
}

impl RenderCommand {
    /// The only job, if it is a part of an image or a sequence; `None` without --part.
    pub fn part(&self) -> Result<Option<RenderArgs>, Failure> {
        let render = &self.render;
        if render.part.is_none() {
            return Ok(None);
        }
        let mut scenes = self.scenes.each();
        let scene = scenes.next().unwrap_or_default();
        if scenes.next().is_some() {
            return Err(Failure::Usage("--part works with one scene only".to_owned()));
        }
        let output = match (&self.output, render.part_by()) {
            (Some(_), PartBy::Samples | PartBy::Tiles) => {
                let message =
                    "a part has no image of its own: omit -o, and use `firstlight merge --image` for all parts";
                return Err(Failure::Usage(message.to_owned()));
            }
            (None, PartBy::Frames) => {
                return Err(Failure::Usage(
                    "--part-by frames needs -o FILE: all parts write to the same names".to_owned(),
                ));
            }
            // A placeholder: a part has a film, but no image.
            (None, _) => PathBuf::from("part.png"),
            (Some(output), PartBy::Frames) => output.clone(),
        };
        // The film of a part is never denoised, and says so.
        let render = match render.part_by() {
            PartBy::Frames => render.with_denoised_layer(),
            PartBy::Samples | PartBy::Tiles => render.clone(),
        };
        Ok(Some(RenderArgs { scene, output, ..render }))
    }

    /// One job per scene.
    pub fn jobs(&self) -> Result<Vec<RenderArgs>, Failure> {
        let scenes: Vec<SceneArgs> = self.scenes.each().collect();
        let several = scenes.len() > 1;
        let one_only = [
            ("-o -", several && self.output.as_deref() == Some(Path::new(STDOUT))),
            ("--film", self.render.film.is_some()),
            ("--resume", self.render.resume),
            ("--error-image", self.render.error_image.is_some()),
        ];
        if let Some((option, _)) = one_only.iter().find(|(_, is_given)| several && *is_given) {
            return Err(Failure::Usage(format!("{option} works with one scene only, but {} are given", scenes.len())));
        }
        let n = scenes.len();
        let mut jobs: Vec<RenderArgs> = Vec::new();
        for (i, scene) in scenes.into_iter().enumerate() {
            let output = match &self.output {
                Some(folder) if several => self.in_folder(folder, &scene)?,
                Some(output) => output.clone(),
                None => free_name(&scene.scene, self.render.default_format().extension(), &jobs),
            };
            if several && jobs.iter().any(|other| other.output == output) {
                let name = output.display();
                return Err(Failure::Usage(format!("{name}: two scenes would be rendered to the same file")));
            }
            jobs.push(RenderArgs { scene, output, has_next: i + 1 < n, ..self.render.with_denoised_layer() });
        }
        Ok(jobs)
    }

    /// Image file of one of several scenes.
    fn in_folder(&self, folder: &Path, scene: &SceneArgs) -> Result<PathBuf, Failure> {
        // The name of an image for several scenes is a mistake; any other name is a new folder.
        if folder.is_file() || PictureFormat::of(folder).is_ok() && !folder.is_dir() {
            let (name, n) = (folder.display(), self.scenes.scenes.len());
            let message = format!("{name}: is not a folder: for {n} scenes, -o is the folder of their images");
            return Err(Failure::Usage(message));
        }
        let mut name = file_stem(&scene.scene);
        name.push(".");
        name.push(self.render.default_format().extension());
        Ok(folder.join(name))
    }
}

impl RenderArgs {
    /// These, where `--denoise` adds a layer to an image with layers.
    fn with_denoised_layer(&self) -> Self {
        let mut args = self.clone();
        args.layers.denoise(&mut args.denoise.denoise);
        args
    }

    /// These, where a scene that is a denoised image makes another one.
    pub fn of_image(&self) -> Result<Self, Failure> {
        if self.wants_denoised() || self.denoise.no_denoise {
            return Ok(self.clone());
        }
        let SceneSource::Picture(path) = self.scene.source()? else { return Ok(self.clone()) };
        // What is wrong with it is told when it is opened.
        let Some(filter) = ImageMetadata::read(&path).ok().and_then(|image| image.denoised) else {
            return Ok(self.clone());
        };
        if self.region.is_some() {
            remark(format_args!("warning: {} is denoised: with --region, the new image is raw", path.display()));
            return Ok(self.clone());
        }
        let mut args = self.clone();
        args.denoise.like(&filter);
        Ok(args.with_denoised_layer())
    }

    /// Whether the image, or a layer of it, is denoised.
    pub fn wants_denoised(&self) -> bool {
        self.denoise.denoise || self.layers.has_denoised()
    }

    /// Whether the image goes to standard output.
    pub fn to_stdout(&self) -> bool {
        self.output == Path::new(STDOUT)
    }

    /// Whether several images of the scene are rendered.
    pub fn is_sequence(&self) -> bool {
        self.turntable.is_some() || self.bookmarks.is_some() || self.frames.is_some()
    }

    /// What is divided into parts.
    pub fn part_by(&self) -> PartBy {
        self.part_by.unwrap_or(if self.is_sequence() { PartBy::Frames } else { PartBy::Samples })
    }

    /// Name of the output for messages.
    pub fn output_name(&self) -> String {
        if self.to_stdout() { "standard output".to_owned() } else { self.output.display().to_string() }
    }

    /// Image format: as requested, and matching the extension of the output.
    pub fn picture_format(&self) -> Result<PictureFormat, Failure> {
        if self.to_stdout() {
            return self.check_layers(self.default_format());
        }
        let of_name = PictureFormat::of(&self.output).map_err(|error| Failure::Usage(error.into()))?;
        if self.format.is_some() && of_name != self.default_format() {
            let (name, extension) = (self.output.display(), self.default_format().extension());
            return Err(Failure::Usage(format!("{name}: --format {extension} needs a name that ends in .{extension}")));
        }
        self.check_layers(of_name)
    }

    /// Checks that the format supports the requested layers.
    fn check_layers(&self, format: PictureFormat) -> Result<PictureFormat, Failure> {
        self.layers.check()?;
        self.denoise.check(self.wants_denoised())?;
        if !self.layers.is_empty() && format != PictureFormat::Exr {
            let message = "only an .exr has layers: with --layers, choose a name that ends in .exr";
            return Err(Failure::Usage(format!("{}: {message}", self.output_name())));
        }
        Ok(format)
    }

    /// Format if no file name determines it.
    fn default_format(&self) -> PictureFormat {
        match self.format {
            Some(FormatArg::Exr) => PictureFormat::Exr,
            Some(FormatArg::Jpg) => PictureFormat::Jpeg,
            None if !self.layers.is_empty() => PictureFormat::Exr,
            _ => PictureFormat::Png,
        }
    }
}

pub fn file_stem(scene: &OsStr) -> OsString {
    Path::new(scene).file_stem().unwrap_or(OsStr::new("scene")).to_owned()
}

/// Returns `firstlight-NAME.png` in the current folder, with a number if that exists or is used by one of the `others`.
pub fn free_name(scene: &OsStr, extension: &str, others: &[RenderArgs]) -> PathBuf {
    let name = |end: String| {
        let mut name = OsString::from("firstlight-");
        name.push(file_stem(scene));
        name.push(end);
        PathBuf::from(name)
    };
    let ends = std::iter::once(format!(".{extension}")).chain((2_u64..).map(|number| format!("-{number}.{extension}")));
    let is_free = |path: &PathBuf| !path.exists() && others.iter().all(|other| other.output != *path);
    ends.map(name).find(is_free).expect("numbers do not end")
}

/// Parses `64..128` as sample numbers.
pub fn parse_range(text: &str) -> Result<Range<u32>, String> {
    let (start, end) = text.split_once("..").ok_or("expected A..B, such as 64..128: from A up to, not including, B")?;
    let number = |text: &str| text.trim().parse::<u32>().map_err(|_| format!("`{text}` is not a sample number"));
    let range = number(start)?..number(end)?;
    if range.is_empty() {
        Err(format!("the range {}..{} is empty", range.start, range.end))
    } else if range.end > Film::MAX_SAMPLES {
        Err(format!("sample numbers must be below {}", Film::MAX_SAMPLES))
    } else {
        Ok(range)
    }
}

/// Parses `X,Y,W,H` as four numbers of pixels.
fn parse_region(text: &str) -> Result<[u32; 4], String> {
    let wrong = || format!("`{text}` is not a rectangle: expected X,Y,W,H in pixels, such as 640,360,200,100");
    let numbers: Option<Vec<u32>> = text.split(',').map(|part| part.trim().parse().ok()).collect();
    let region = numbers.and_then(|numbers| <[u32; 4]>::try_from(numbers).ok()).ok_or_else(wrong)?;
    if region[2] == 0 || region[3] == 0 { Err(wrong()) } else { Ok(region) }
}
