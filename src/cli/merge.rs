//! `firstlight merge A.exr B.exr -o C.exr`: adds up films of the same image with different samples.
//!
//! First the metadata of all films is read: whether they belong together, and which samples are duplicate or missing.
//! Then the films are added one by one, with memory for two, however many there are.

use crate::cli::args::{OverwriteArgs, SceneArgs, replaced};
use crate::cli::console::{inform, print, remark};
use crate::cli::denoising::DenoiserArg;
use crate::cli::failure::Failure;
use crate::cli::film_denoiser::FilmDenoiser;
use crate::cli::layers::LayerArgs;
use crate::cli::number::{percent, samples_per_pixel};
use crate::cli::part::numbered;
use crate::cli::progress::RenderProgress;
use crate::cli::render_args::parse_range;
use crate::cli::stop::Stop;
use clap::Args;
use firstlight::cluster::coverage::{Coverage, Duplicate, groups, missing_in_words};
use firstlight::cluster::part::Part;
use firstlight::frame::{
    FeatureLayers, FilmFile, LayeredPicture, PictureFormat, Print, check_replaced_film, read_film_file,
    read_film_summary, write_film_with_features,
};
use firstlight::render::{Film, SampleAllocation};
use firstlight::scene::ImageMetadata;
use firstlight::scene::whole_file::Replace;
use std::ops::Range;
use std::path::{Path, PathBuf};

#[derive(Args, Clone, Debug)]
pub struct MergeArgs {
    /// Films of one image with disjoint samples (`render --film FILE --samples A..B`, or `--part I/N`).
    #[arg(value_name = "FILM.exr", required = true, num_args = 2..)]
    films: Vec<PathBuf>,
    /// Merged film; `render --resume` continues it.
    #[arg(short, long, value_name = "FILM.exr")]
    output: PathBuf,
    /// Also save the image: .png is tone-mapped, .exr holds linear light (HDR).
    #[arg(long, value_name = "FILE")]
    image: Option<PathBuf>,
    /// Samples that the films must have together [default: from the first to the last that any film has].
    #[arg(long, value_name = "A..B", value_parser = parse_range)]
    samples: Option<Range<u32>>,
    /// Merge even if samples are missing; the film records which ones it has.
    #[arg(long)]
    allow_missing: bool,
    /// Merge only the I-th of N groups of the films, or auto for the task of an array job
    ///
    /// Merging the results gives the film that merging all at once gives. {part} in the output is replaced by the number.
    #[arg(long, value_name = "I/N")]
    part: Option<String>,
    /// Save the image denoised, like `render --denoise`; opens the scene of the films.
    #[arg(long, requires = "image")]
    denoise: bool,
    /// The filter of --denoise and --layers denoised [default: own].
    #[arg(long, value_enum, value_name = "FILTER")]
    denoiser: Option<DenoiserArg>,
    #[command(flatten)]
    layers: LayerArgs,
    #[command(flatten)]
    overwrite: OverwriteArgs,
    /// Print the result as one line of JSON.
    #[arg(long)]
    json: bool,
}

pub fn run(args: &MergeArgs, stop: &Stop) -> Result<(), Failure> {
    let args = &mut args.clone();
    args.layers.denoise(&mut args.denoise);
    let part = match &args.part {
        None => None,
        Some(text) => {
            stop.is_of_part();
            Some(Part::parse(text).map_err(|error| Failure::Usage(format!("--part: {error}")))?)
        }
    };
    let result = merge(args, part);
    if part.is_some() { result.map_err(Failure::of_part) } else { result }
}

fn merge(args: &MergeArgs, part: Option<Part>) -> Result<(), Failure> {
    let output = &part.map_or_else(|| args.output.clone(), |part| numbered(&args.output, part));
    if !matches!(PictureFormat::of(output), Ok(PictureFormat::Exr)) {
        let message = "the name of a film must end in .exr (use --image for a .png)";
        return Err(Failure::Usage(format!("{}: {message}", output.display())));
    }
    let mut files = args.overwrite.files();
    files.read_all(args.films.iter().cloned())?;
    // The output may replace a film if it contains all samples of that film, which is only known at the end.
    let claim = files.claim(output, Replace::Anything)?;
    if let Some(picture) = &args.image {
        let format = PictureFormat::of(picture).map_err(|error| Failure::Usage(error.into()))?;
        if !args.layers.is_empty() && format != PictureFormat::Exr {
            return Err(Failure::Usage(format!(
                "{}: with --layers, choose a name that ends in .exr",
                picture.display()
            )));
        }
        files.write(picture)?;
    } else if !args.layers.is_empty() {
        return Err(Failure::Usage("--layers belong to an image: name it with --image FILE.exr".to_owned()));
    }
    args.layers.check()?;
    let is_denoised = args.denoise || args.layers.has_denoised();
    if args.denoiser.is_some() && !is_denoised {
        let message = "--denoiser needs an image that is denoised: add --denoise or --layers denoised";
        return Err(Failure::Usage(message.to_owned()));
    }
    let mut set = FilmSet::read(args.films.clone())?;
    let missing = set.missing(args.samples.clone());
    if !missing.is_empty() {
        let message = missing_in_words(&missing);
        if !args.allow_missing {
            let advice = "render them, or merge without them with --allow-missing";
            return Err(Failure::Failed(format!("{message}: {advice}")));
        }
        remark(format_args!("warning: {message}"));
    }
    if let Some(part) = part {
        let Some(group) = set.group(part) else {
            inform(format_args!("group {} of {}: there are no films for it", part.number(), part.count));
            return Ok(());
        };
        set = group;
    }
    let first = set.films[0].clone();
    if let Some(picture) = &args.image {
        files.read_all(SceneArgs::files_behind(&first, picture))?;
    }
    // A scene that cannot be opened is reported before films are added.
    let denoiser = match is_denoised {
        true => Some(FilmDenoiser::open(&first, &read_film_summary(&first)?.shot, args.denoiser, &mut files)?),
        false => None,
    };
    let progress = RenderProgress::new();
    let told = |done, n| progress.at(done as f64 / n as f64, format!("{done} of {n} films"));
    let FilmFile { film, shot, features, .. } = set.add_up(&told)?;
    drop(progress);
    args.layers.check_kept(features.as_ref())?;
    let note = |path: &Path| note_of(&film, shot.clone(), &first, path);
    let note_of_film = note(output);
    if !args.overwrite.overwrite {
        check_replaced_film(&film, features.as_ref(), &note_of_film, output)?;
    }
    write_film_with_features(&film, features.as_ref(), &note_of_film, claim)?;
    let denoised = denoiser.as_ref().map(|denoiser| denoiser.denoise(&film, &shot)).transpose()?;
    if let Some(path) = &args.image {
        let filter = denoiser.as_ref().map(FilmDenoiser::name);
        let shown = shot.clone().denoised_by(filter, !args.layers.is_empty());
        let (size, note) = ((film.width(), film.height()), note_of(&film, shown, &first, path));
        let display = shot.display;
        let denoised = denoised.as_ref().map(|denoised| &denoised.color[..]);
        if args.layers.is_empty() {
            Print { film: &film, display: &display, size, note: Some(&note), denoised }.write(path, files.replace())?;
        } else {
            let layers = args.layers.of(&film);
            let features = features.as_ref();
            LayeredPicture { film: &film, features, denoised, layers: &layers, note: Some(&note) }
                .write(path, files.replace())?;
        }
    }
    let error = film.error_estimate().map(|error| error.relative);
    let (least, mean, most) = film.sample_counts();
    if args.json {
        let mut told = serde_json::json!({
            "output": output.to_string_lossy(),
            "films": set.films.len(),
            "spp": film.spp(),
            "max_spp": film.max_spp(),
            "samples": { "least": least, "mean": mean, "most": most },
            "first_sample": film.first_sample(),
            "missing": missing.iter().map(|range| [range.start, range.end]).collect::<Vec<_>>(),
            "estimated_error": error,
        });
        if let Some(denoised) = denoised {
            told["estimated_error_denoised"] = denoised.error.into();
            told["estimated_error_denoised_95"] = denoised.error_95.to_vec().into();
        }
        return print(told);
    }
    let of_denoised = denoised.map_or_else(String::new, |denoised| format!(" (denoised: {})", percent(denoised.error)));
    let error = error.map_or_else(String::new, |error| format!(", estimated error {}{of_denoised}", percent(error)));
    let image = args.image.as_ref().map_or_else(String::new, |path| format!(", image saved to {}", path.display()));
    let replaced = replaced(files.replaced());
    inform(format_args!("{}: {}{error}{image}{replaced}", output.display(), samples_per_pixel(film.spp())));
    Ok(())
}

/// The metadata of `film`, or of an image of it, at `path`.
///
/// - `first`: path of the film that has the metadata `shot`.
pub fn note_of(film: &Film, shot: ImageMetadata, first: &Path, path: &Path) -> String {
    let (first_sample, spp, uneven) = (film.first_sample(), film.spp(), film.is_uneven());
    ImageMetadata { first_sample, spp, uneven, ..shot }.moved(first, path).to_note()
}

/// Films of the same image without common samples, in the order of their samples.
pub struct FilmSet {
    pub films: Vec<PathBuf>,
    /// The samples that all pixels of each film have.
    samples: Vec<Range<u32>>,
    coverage: Coverage,
    /// Whether some films are adaptive: then gaps do not mean missing samples.
    is_adaptive: bool,
}

impl FilmSet {
    /// Reads the metadata of the films.
    ///
    /// - `paths`: in any order.
    pub fn read(paths: Vec<PathBuf>) -> Result<Self, Failure> {
        let mut coverage = Coverage::default();
        let mut known: Vec<(u32, String, usize)> = Vec::new();
        let mut first: Option<(usize, ImageMetadata)> = None;
        let mut is_adaptive = false;
        for (i, path) in paths.iter().enumerate() {
            let mut summary = read_film_summary(path)?;
            let (number, shot) = first.get_or_insert_with(|| (i, summary.shot.clone()));
            is_adaptive |= summary.shot.allocation != SampleAllocation::Uniform;
            known.push((summary.shot.first_sample, summary.shot.to_note(), i));
            agree_on_allocation(shot, &mut summary.shot);
            if let Some(what) = shot.differs_from(&summary.shot) {
                return Err(refused(&paths[*number], path, format!("they have a different {what}")));
            }
            coverage.add(&summary.layout);
        }
        if let Some(Duplicate { films: [a, b], samples: Range { start, end } }) = coverage.duplicate() {
            let shared = firstlight::render::MergeError::SharedSamples { first: start, last: end - 1 };
            return Err(refused(&paths[a], &paths[b], shared.to_string()));
        }
        // The result must not depend on the names of the films.
        known.sort();
        let films = known.iter().map(|(.., i)| paths[*i].clone()).collect();
        let ends = known.iter().skip(1).map(|(first, ..)| *first).chain([coverage.hull().end]);
        let samples = known.iter().zip(ends).map(|((first, ..), end)| *first..end).collect();
        Ok(Self { films, samples, coverage, is_adaptive })
    }

    /// Samples that are missing in some pixel.
    ///
    /// - `wanted`: the complete range; `None`: from the first to the last existing sample, if all films are uniform.
    pub fn missing(&self, wanted: Option<Range<u32>>) -> Vec<Range<u32>> {
        match wanted {
            None if self.is_adaptive => Vec::new(),
            wanted => self.coverage.missing(wanted.unwrap_or_else(|| self.coverage.hull())),
        }
    }

    /// The films of one of several groups; `None` if there are fewer groups.
    fn group(&self, part: Part) -> Option<Self> {
        let group = groups(&self.samples, part.count as usize).into_iter().nth(part.index as usize)?;
        let (films, samples) = (self.films[group.clone()].to_vec(), self.samples[group].to_vec());
        Some(Self { films, samples, coverage: self.coverage.clone(), is_adaptive: self.is_adaptive })
    }

    /// Adds up the films one by one.
    ///
    /// - `progress`: called with the number of films that are added and the total number.
    pub fn add_up(&self, progress: &dyn Fn(usize, usize)) -> Result<FilmFile, Failure> {
        let (first, others) = self.films.split_first().expect("one film at least");
        let FilmFile { mut film, mut shot, mut features } = read_film_file(first)?;
        for (i, path) in others.iter().enumerate() {
            progress(i + 1, self.films.len());
            let mut other = read_film_file(path)?;
            agree_on_allocation(&mut shot, &mut other.shot);
            if let Some(what) = shot.differs_from(&other.shot) {
                return Err(refused(first, path, format!("they have a different {what}")));
            }
            film.merge(&other.film).map_err(|error| refused(first, path, error.to_string()))?;
            features = FeatureLayers::of_parts(features, other.features);
        }
        Ok(FilmFile { film, shot, features })
    }
}

/// Samples can be added however they were allocated; if one film is adaptive, so is the sum.
fn agree_on_allocation(a: &mut ImageMetadata, b: &mut ImageMetadata) {
    let is_adaptive = |shot: &ImageMetadata| shot.allocation != SampleAllocation::Uniform;
    if !is_adaptive(a) || !is_adaptive(b) {
        let of_both = if is_adaptive(a) { a.allocation } else { b.allocation };
        (a.allocation, b.allocation) = (of_both, of_both);
    }
}

fn refused(a: &Path, b: &Path, reason: String) -> Failure {
    Failure::Failed(format!("{} and {} cannot be merged: {reason}", a.display(), b.display()))
}
