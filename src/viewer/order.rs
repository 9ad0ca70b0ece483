//! An image that is rendered to a file apart from the window: what is asked for, and rendering it.
//!
//! The same functions as the command `render` uses: a target, the denoiser, and metadata with which the image opens again.

use crate::format::check_film_size;
use crate::frame::{DenoiseFilter, PictureFormat, Print, Progress, Target, render_measured_until, render_region_until};
use crate::render::{DenoiseSource, Film, GuideGatherer, Prepared, RenderSettings};
use crate::scene::whole_file::Replace;
use crate::scene::{ImageMetadata, ImageSamples, MetadataDraft};
use crate::viewer::saver::file_stem;
use crate::viewer::status::{percent, samples};
use crate::viewer::trend::{Outlook, Trend};
use glam::Vec3;
use std::cell::RefCell;
use std::ops::RangeInclusive;
use std::path::PathBuf;

/// What is to be rendered, and where it goes.
#[derive(Clone, Debug, PartialEq)]
pub struct Order {
    /// Width and height, pixels.
    pub size: (u32, u32),
    /// When an image is done; the error is that of the denoised image where it is denoised.
    pub target: Target,
    /// `None` for raw images.
    pub denoiser: Option<DenoiseFilter>,
    pub format: PictureFormat,
    /// The file of the image, or the folder of the frames.
    pub path: PathBuf,
    /// Somebody has chosen this file, and agreed that another of this name is replaced.
    pub may_replace: bool,
    /// The frames of the animation; `None` for the image as it is seen now.
    pub frames: Option<RangeInclusive<u32>>,
    /// They are those of a turn of the camera.
    pub is_turntable: bool,
}

/// The scene of one image.
pub struct Subject {
    pub scene: Prepared,
    pub settings: RenderSettings,
    pub draft: MetadataDraft,
}

/// How far an image is.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Advance {
    /// Estimated, 0..1.
    pub share: f64,
    pub spp: u32,
    /// Relative error, once it is known: of the denoised image where that is the goal, else of the samples.
    pub error: Option<f64>,
    /// The error has all but stopped to fall: the goal may be out of reach.
    pub is_flat: bool,
    /// The samples are done, and the image is being denoised.
    pub is_sampled: bool,
}

/// A finished image.
#[derive(Clone, Debug, PartialEq)]
pub struct Finished {
    /// Where it was written: if its name was taken meanwhile, under another one.
    pub path: PathBuf,
    pub spp: u32,
    /// Relative error of what was written, once it is known.
    pub error: Option<f64>,
    /// Whether the target was reached.
    pub is_complete: bool,
}

impl Finished {
    /// In words: `1920 × 1080, noise 1.9 %, 64 samples per pixel`.
    pub fn describe(&self, size: (u32, u32)) -> String {
        let noise = self.error.map(|error| format!(", noise {}", percent(error))).unwrap_or_default();
        let short = if self.is_complete { "" } else { ", ended early" };
        format!("{} × {}{noise}, {}{short}", size.0, size.1, samples(self.spp))
    }
}

impl Order {
    /// Checks the values.
    ///
    /// # Errors
    /// If the size is out of range, or there is no limit.
    pub fn check(&self) -> Result<(), String> {
        check_film_size(self.size.0, self.size.1).map_err(|error| error.to_string())?;
        self.target.check().map_err(|error| error.to_string())?;
        if self.frames.as_ref().is_some_and(RangeInclusive::is_empty) {
            return Err("there are no frames: the last one is before the first".to_owned());
        }
        Ok(())
    }

    /// The file of a frame: `NAME-0007.png` in the folder.
    pub fn frame_path(&self, stem: &str, number: u32) -> PathBuf {
        let last = self.frames.as_ref().map_or(0, |frames| *frames.end());
        let digits = last.to_string().len().max(4);
        self.path.join(format!("{stem}-{number:0digits$}.{}", self.format.extension()))
    }

    /// Renders an image, on the current pool, and writes it to the path of the order; `None` if it was cancelled, or
    /// ended before every pixel had a sample.
    ///
    /// - `cancelled`: nothing is to be written.
    /// - `stop`: ends the samples early; what there is by then is written unless it is cancelled.
    ///
    /// # Errors
    /// If there is not enough memory, or the file cannot be written.
    pub fn render_unless(
        &self,
        cancelled: &(dyn Fn() -> bool + Sync),
        subject: &Subject,
        stop: &(dyn Fn() -> bool + Sync),
        mut tell: impl FnMut(Advance),
    ) -> Result<Option<Finished>, String> {
        let Subject { scene, settings, draft } = subject;
        let mut film = Film::try_new(self.size.0, self.size.1).map_err(|error| error.to_string())?;
        if scene.features().caustics {
            film.reserve_light().map_err(|error| error.to_string())?;
        }
        let trend = RefCell::new(Trend::default());
        let told = |now: Progress| {
            tell(self.advance(&now, &trend.borrow()));
            true
        };
        let mut guides = GuideGatherer::default();
        let mut denoised: Option<(u32, Denoised)> = None;
        if let Some(filter) = self.denoiser.filter(|_| self.target.error.is_some()) {
            let mut error_of = |film: &Film| {
                let found = denoise(filter, scene, settings, film, &mut guides, stop)?;
                trend.borrow_mut().add(film.spp(), found.error);
                Some(denoised.insert((film.spp(), found)).1.error)
            };
            render_measured_until(scene, settings, &mut film, self.target, &mut error_of, stop, told);
        } else {
            render_region_until(scene, settings, &mut film, None, self.target, stop, told);
        }
        // Rendering ends by the target, or by `stop`.
        let is_complete = !stop();
        let mut denoised = denoised.filter(|(spp, _)| *spp == film.spp()).map(|(_, found)| found);
        if let Some(filter) = self.denoiser.filter(|_| denoised.is_none() && film.spp() > 0) {
            let error = film.error_estimate().map(|error| error.relative);
            tell(Advance { share: 1.0, spp: film.spp(), error, is_flat: false, is_sampled: true });
            denoised = denoise(filter, scene, settings, &film, &mut guides, cancelled);
        }
        if film.spp() == 0 || cancelled() {
            return Ok(None);
        }
        let error = denoised.as_ref().map(|found| found.error).or(film.error_estimate().map(|error| error.relative));
        let mut finished = Finished { path: self.path.clone(), spp: film.spp(), error, is_complete };
        let samples = ImageSamples { first: film.first_sample(), spp: film.spp(), uneven: film.is_uneven() };
        let display = draft.display();
        let mut note = draft.note(&self.path, self.size, samples, display);
        if let Ok(raw) = ImageMetadata::from_note(&note) {
            let by = denoised.as_ref().map(|denoised| denoised.by.name().to_owned());
            let ended_early = (!is_complete).then(|| self.shortfall(&finished));
            note = ImageMetadata { ended_early, ..raw.denoised_by(by, false) }.to_note();
        }
        let colors = denoised.as_ref().map(|denoised| &denoised.color[..]);
        let print = Print { film: &film, display: &display, size: self.size, note: Some(&note), denoised: colors };
        if self.may_replace {
            print.write(&self.path, Replace::AllButFilms).map_err(|error| error.to_string())?;
        } else {
            let stem = file_stem(&self.path.to_string_lossy());
            finished.path = print.write_unused(&self.path, &stem).map_err(|error| error.to_string())?;
        }
        Ok(Some(finished))
    }

    /// What an image that ended early has, and what was asked for, for its metadata.
    fn shortfall(&self, finished: &Finished) -> String {
        let noise = finished.error.map_or("unknown noise".to_owned(), |error| format!("noise {}", percent(error)));
        let Target { spp, seconds, error } = self.target;
        let asked = [
            error.map(|error| format!("noise {}", percent(error))),
            spp.map(samples),
            seconds.map(|seconds| format!("{seconds} s")),
        ];
        let asked: Vec<String> = asked.into_iter().flatten().collect();
        format!("at {noise}, {}; asked for: {}", samples(finished.spp), asked.join(" or "))
    }

    /// - `trend`: of the error of the denoised image.
    fn advance(&self, now: &Progress, trend: &Trend) -> Advance {
        let by_spp = self.target.spp.map_or(0.0, |spp| f64::from(now.spp) / f64::from(spp.max(1)));
        let by_time = self.target.seconds.map_or(0.0, |seconds| now.seconds / seconds);
        let of_samples = now.error.map(|error| error.relative);
        let (error, outlook) = match (self.target.error, self.denoiser) {
            // Until the first is known, that of the samples would be another figure.
            (Some(goal), Some(_)) => (trend.error(), trend.to(goal)),
            (Some(goal), None) => (of_samples, now.error.map(|error| Outlook::Samples(f64::from(error.spp_for(goal))))),
            (None, _) => (of_samples, None),
        };
        let by_error = match outlook {
            Some(Outlook::Samples(needed)) => f64::from(now.spp) / needed.max(1.0),
            Some(Outlook::Flat) | None => 0.0,
        };
        let share = by_spp.max(by_time).max(by_error).min(1.0);
        Advance { share, spp: now.spp, error, is_flat: outlook == Some(Outlook::Flat), is_sampled: false }
    }
}

/// A denoised film.
struct Denoised {
    color: Vec<Vec3>,
    /// Relative, of the whole image.
    error: f64,
    by: DenoiseFilter,
}

fn denoise(
    filter: DenoiseFilter,
    scene: &Prepared,
    settings: &RenderSettings,
    film: &Film,
    guides: &mut GuideGatherer,
    stop: &(dyn Fn() -> bool + Sync),
) -> Option<Denoised> {
    if !guides.gather_for(scene, settings, film, stop) {
        return None;
    }
    let (by, denoised) = filter.denoise(&DenoiseSource::of(film), guides.guides(), stop)?;
    Some(Denoised { color: denoised.color, error: denoised.error, by })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::{Extraction, LoadOptions, Rendering, SceneInputs, SceneSource, load};
    use std::path::Path;

    fn subject() -> Subject {
        let loaded = load(&SceneSource::Builtin("cornell".to_owned()), &LoadOptions::default()).unwrap();
        let mut world = bevy_ecs::world::World::new();
        loaded.spawn(&mut world);
        let scene = Extraction::new(&SceneInputs::of(&mut world), &loaded.trees).prepared;
        let settings = world.resource::<Rendering>().0;
        Subject { scene, settings, draft: MetadataDraft::of(&mut world, Some(&loaded)) }
    }

    fn order(folder: &Path, target: Target) -> Order {
        let path = folder.join("a.png");
        Order {
            size: (24, 18),
            target,
            denoiser: None,
            format: PictureFormat::Png,
            path,
            may_replace: true,
            frames: None,
            is_turntable: false,
        }
    }

    #[test]
    fn an_image_is_rendered_to_its_target_and_opens_again() {
        let (folder, subject) = (tempfile::tempdir().unwrap(), subject());
        let mut order = order(folder.path(), Target { error: Some(0.2), ..Target::default() });
        let mut shares = Vec::new();
        let raw = order.render_unless(&|| false, &subject, &|| false, |now| shares.push(now.share)).unwrap().unwrap();
        assert!(raw.is_complete && raw.error.unwrap() <= 0.2 && !shares.is_empty(), "{raw:?}");
        assert_eq!(image::image_dimensions(&order.path).unwrap(), (24, 18));
        assert_eq!(ImageMetadata::read(&order.path).unwrap().spp, raw.spp);
        // The error of the denoised image is reached with fewer samples.
        order.denoiser = Some(DenoiseFilter::Own);
        let denoised = order.render_unless(&|| false, &subject, &|| false, |_| ()).unwrap().unwrap();
        assert!(denoised.error.unwrap() <= 0.2 && denoised.spp < raw.spp, "{denoised:?}");
        assert_eq!(ImageMetadata::read(&order.path).unwrap().denoised.as_deref(), Some("own"));
        // Denoising that follows the samples is told.
        let (mut told, target) = (Vec::new(), Target { spp: Some(2), ..Target::default() });
        let order = Order { target, ..order };
        order.render_unless(&|| false, &subject, &|| false, |now| told.push((now.spp, now.is_sampled))).unwrap();
        assert_eq!(told.last(), Some(&(2, true)));
        assert!(told[..told.len() - 1].iter().all(|(_, is_sampled)| !is_sampled), "{told:?}");
    }

    #[test]
    fn a_file_that_nobody_has_chosen_is_never_replaced() {
        let (folder, subject) = (tempfile::tempdir().unwrap(), subject());
        let order = order(folder.path(), Target { spp: Some(2), ..Target::default() });
        let write = |order: &Order| {
            let finished = order.render_unless(&|| false, &subject, &|| false, |_| ()).unwrap().unwrap();
            finished.path.file_name().unwrap().to_string_lossy().into_owned()
        };
        // A screenshot that took the proposed name while the form was open.
        std::fs::write(&order.path, "another").unwrap();
        let proposed = Order { may_replace: false, ..order.clone() };
        assert_eq!((write(&proposed), write(&proposed)), ("a-0001.png".to_owned(), "a-0002.png".to_owned()));
        assert_eq!(std::fs::read_to_string(&order.path).unwrap(), "another");
        assert_eq!(write(&order), "a.png");
        std::fs::remove_file(&order.path).unwrap();
        assert_eq!(write(&proposed), "a.png");
    }

    #[test]
    fn what_is_kept_as_it_stands_says_so() {
        use std::sync::atomic::{AtomicBool, Ordering};
        let (folder, subject) = (tempfile::tempdir().unwrap(), subject());
        let order = order(folder.path(), Target { error: Some(1e-6), ..Target::default() });
        let kept = AtomicBool::new(false);
        let tell = |now: Advance| kept.store(now.error.is_some(), Ordering::Relaxed);
        let stop = || kept.load(Ordering::Relaxed);
        let finished = order.render_unless(&|| false, &subject, &stop, tell).unwrap().unwrap();
        assert!(!finished.is_complete && finished.describe(order.size).ends_with(", ended early"), "{finished:?}");
        let early = ImageMetadata::read(&order.path).unwrap().ended_early.unwrap();
        let samples = format!("{} samples per pixel; asked for: noise 0.00 %", finished.spp);
        assert!(early.starts_with("at noise ") && early.ends_with(&samples), "{early}");
        // One that is done has nothing to say.
        let done = Order { target: Target { spp: Some(2), ..Target::default() }, ..order };
        done.render_unless(&|| false, &subject, &|| false, |_| ()).unwrap().unwrap();
        assert_eq!(ImageMetadata::read(&done.path).unwrap().ended_early, None);
    }

    #[test]
    fn what_is_cancelled_at_once_writes_nothing_and_values_are_checked() {
        let (folder, subject) = (tempfile::tempdir().unwrap(), subject());
        let order = order(folder.path(), Target { spp: Some(4), ..Target::default() });
        assert_eq!(order.render_unless(&|| true, &subject, &|| true, |_| ()).unwrap(), None);
        assert!(!order.path.exists() && order.check().is_ok());
        assert!(Order { size: (0, 4), ..order.clone() }.check().is_err());
        #[allow(clippy::reversed_empty_ranges)]
        let backwards = Order { frames: Some(5..=4), ..order.clone() };
        assert!(backwards.check().is_err());
        let frames = Order { frames: Some(0..=20_000), path: folder.path().to_owned(), ..order };
        assert_eq!(frames.frame_path("fox", 7), folder.path().join("fox-00007.png"));
    }
}
