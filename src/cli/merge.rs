//! `firstlight merge A.exr B.exr -o C.exr`: films of the same picture with different samples, added up.

use super::args::{OverwriteArgs, replaced};
use super::console::{inform, print, remark};
use super::failure::Failure;
use super::layers::LayerArgs;
use super::number::percent;
use clap::Args;
use firstlight::frame::{
    FeatureLayers, FilmFile, LayeredPicture, PictureFormat, Print, check_replaced_film, read_film_file,
    write_film_with_features,
};
use firstlight::render::SampleAllocation;
use firstlight::scene::ImageMetadata;
use firstlight::scene::whole_file::Replace;
use std::path::{Path, PathBuf};

#[derive(Args, Clone, Debug)]
pub struct MergeArgs {
    /// Films of one picture with disjoint samples (`render --film FILE --samples A..B`).
    #[arg(value_name = "FILM.exr", required = true, num_args = 2..)]
    films: Vec<PathBuf>,
    /// Merged film; `render --resume` continues it.
    #[arg(short, long, value_name = "FILM.exr")]
    output: PathBuf,
    /// Also save the picture: .png is tone-mapped, .exr holds linear light (HDR).
    #[arg(long, value_name = "FILE")]
    picture: Option<PathBuf>,
    #[command(flatten)]
    layers: LayerArgs,
    #[command(flatten)]
    overwrite: OverwriteArgs,
    /// Print the result as one line of JSON.
    #[arg(long)]
    json: bool,
}

pub fn run(args: &MergeArgs) -> Result<(), Failure> {
    if !matches!(PictureFormat::of(&args.output), Ok(PictureFormat::Exr)) {
        let message = "the name of a film must end in .exr (use --picture for a .png)";
        return Err(Failure::Usage(format!("{}: {message}", args.output.display())));
    }
    let mut files = args.overwrite.files();
    files.read_all(args.films.iter().cloned())?;
    // It may take the place of a film of which it has all samples, which is known only when it is there.
    let claim = files.claim(&args.output, Replace::Anything)?;
    if let Some(picture) = &args.picture {
        let format = PictureFormat::of(picture).map_err(|error| Failure::Usage(error.into()))?;
        if !args.layers.is_empty() && format != PictureFormat::Exr {
            return Err(Failure::Usage(format!(
                "{}: with --layers, choose a name that ends in .exr",
                picture.display()
            )));
        }
        files.write(picture)?;
    } else if !args.layers.is_empty() {
        return Err(Failure::Usage("--layers belong to a picture: name it with --picture FILE.exr".to_owned()));
    }
    args.layers.check()?;
    // In the order of their samples, so that the result does not depend on how they were named.
    let mut films: Vec<&PathBuf> = args.films.iter().collect();
    films.sort_by_cached_key(|path| ImageMetadata::read(path).map(|shot| (shot.first_sample, shot.to_note())).ok());
    let (first, others) = films.split_first().expect("two films at least");
    let FilmFile { mut film, mut shot, mut features, warning } = read_film_file(first)?;
    let warn = |warning: Option<String>| warning.iter().for_each(|text| remark(format_args!("warning: {text}")));
    warn(warning);
    for path in others {
        let mut other = read_film_file(path)?;
        warn(other.warning.take());
        let failed = |reason: String| {
            Failure::Failed(format!("{} and {} cannot be merged: {reason}", first.display(), path.display()))
        };
        // Samples add up however they were allocated; what is gone on with is as adaptive as any part.
        let is_adaptive = |shot: &ImageMetadata| shot.allocation != SampleAllocation::Uniform;
        if !is_adaptive(&shot) || !is_adaptive(&other.shot) {
            let of_both = if is_adaptive(&shot) { shot.allocation } else { other.shot.allocation };
            (shot.allocation, other.shot.allocation) = (of_both, of_both);
        }
        if let Some(what) = shot.differs_from(&other.shot) {
            return Err(failed(format!("they have a different {what}")));
        }
        film.merge(&other.film).map_err(|error| failed(error.to_string()))?;
        features = FeatureLayers::of_parts(features, other.features);
    }
    args.layers.check_kept(features.as_ref())?;
    let note = |path: &Path| {
        let samples = (film.first_sample(), film.spp(), film.is_uneven());
        ImageMetadata { first_sample: samples.0, spp: samples.1, uneven: samples.2, ..shot.clone() }
            .moved(first, path)
            .to_note()
    };
    let note_of_film = note(&args.output);
    if !args.overwrite.overwrite {
        check_replaced_film(&film, &note_of_film, &args.output)?;
    }
    write_film_with_features(&film, features.as_ref(), &note_of_film, claim)?;
    if let Some(path) = &args.picture {
        let (size, note) = ((film.width(), film.height()), note(path));
        let display = shot.display.into();
        if args.layers.is_empty() {
            Print { film: &film, display: &display, size, note: Some(&note) }.write(path, files.replace())?;
        } else {
            let layers = args.layers.of(&film);
            let features = features.as_ref();
            LayeredPicture { film: &film, features, layers: &layers, note: Some(&note) }
                .write(path, files.replace())?;
        }
    }
    let error = film.error_estimate().map(|error| error.relative);
    let (least, mean, most) = film.sample_counts();
    if args.json {
        return print(serde_json::json!({
            "output": args.output.to_string_lossy(),
            "films": args.films.len(),
            "spp": film.spp(),
            "max_spp": film.max_spp(),
            "samples": { "least": least, "mean": mean, "most": most },
            "first_sample": film.first_sample(),
            "estimated_error": error,
        }));
    }
    let error = error.map_or_else(String::new, |error| format!(", estimated error {}", percent(error)));
    let replaced = replaced(files.replaced(), &args.output);
    inform(format_args!("{}: {} samples per pixel{error}{replaced}", args.output.display(), film.spp()));
    Ok(())
}
