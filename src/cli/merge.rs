//! `firstlight merge A.exr B.exr -o C.exr`: films of the same picture with different samples, added up.

use super::Failure;
use super::console::{print, remark};
use clap::Args;
use firstlight::frame::{FilmFile, PictureFormat, Print, read_film_file, write_film_file};
use firstlight::scene::Shot;
use firstlight::scene::whole_file::check_writable;
use std::path::{Path, PathBuf};

#[derive(Args, Clone, Debug)]
pub struct MergeArgs {
    /// Films of one picture, each with samples of its own (render --film FILE --samples A..B).
    #[arg(value_name = "FILM.exr", required = true, num_args = 2..)]
    films: Vec<PathBuf>,
    /// The film that has all samples; go on with it by render --resume.
    #[arg(short, long, value_name = "FILM.exr")]
    output: PathBuf,
    /// Also a picture of it: .png is developed, .exr is linear light.
    #[arg(long, value_name = "FILE")]
    picture: Option<PathBuf>,
    /// Print one JSON object.
    #[arg(long)]
    json: bool,
}

pub fn run(args: &MergeArgs) -> Result<(), Failure> {
    if !matches!(PictureFormat::of(&args.output), Ok(PictureFormat::Exr)) {
        let message = "films are OpenEXR pictures: end the name in .exr (--picture writes a .png of it)";
        return Err(Failure::Usage(format!("{}: {message}", args.output.display())));
    }
    check_writable(&args.output).map_err(Failure::Failed)?;
    if let Some(picture) = &args.picture {
        PictureFormat::of(picture).map_err(Failure::Usage)?;
        check_writable(picture).map_err(Failure::Failed)?;
    }
    let (first, others) = args.films.split_first().expect("two films at least");
    let FilmFile { mut film, shot } = read_film_file(first).map_err(Failure::Failed)?;
    for path in others {
        let other = read_film_file(path).map_err(Failure::Failed)?;
        let failed = |reason: String| {
            Failure::Failed(format!("{} and {} cannot be added up: {reason}", first.display(), path.display()))
        };
        if let Some(what) = shot.differs_from(&other.shot) {
            return Err(failed(format!("the second is a film of another {what}")));
        }
        film.merge(&other.film).map_err(failed)?;
    }
    let note = |path: &Path| {
        let samples = (film.first_sample(), film.spp(), film.max_spp() > film.spp());
        Shot { first_sample: samples.0, spp: samples.1, uneven: samples.2, ..shot.clone() }.moved(first, path).to_note()
    };
    write_film_file(&film, &note(&args.output), &args.output).map_err(Failure::Failed)?;
    if let Some(path) = &args.picture {
        let (size, note) = ((film.width(), film.height()), note(path));
        let display = shot.display.into();
        Print { film: &film, display: &display, size, note: Some(&note) }.write(path).map_err(Failure::Failed)?;
    }
    let error = film.error_estimate().map(|error| error.relative);
    if args.json {
        return print(serde_json::json!({
            "output": args.output.to_string_lossy(),
            "films": args.films.len(),
            "spp": film.spp(),
            "max_spp": film.max_spp(),
            "first_sample": film.first_sample(),
            "estimated_error": error,
        }));
    }
    let error = error.map_or_else(String::new, |error| format!(", {:.2} % error", 100.0 * error));
    remark(format_args!("{}: {} samples per pixel{error}", args.output.display(), film.spp()));
    Ok(())
}
