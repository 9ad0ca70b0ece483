//! Saves images on separate threads, so that the window stays responsive.

use crate::frame::{
    DenoiseFilter, FeatureLayers, FeatureNames, KeptFilm, LayeredPicture, PictureFormat, PictureLayer, Print, Waker,
    numbered,
};
use crate::render::{
    DenoiseSource, Display, FEATURE_SAMPLES, Film, Prepared, RenderSettings, gather_guides, guide_samples,
    worker_threads,
};
use crate::scene::{ImageMetadata, ImageSamples, MetadataDraft};
use glam::{UVec2, Vec3};
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{Receiver, Sender, channel};
use std::thread::JoinHandle;

/// A saved image, or the reason why it was not saved.
pub type Saved = Result<Kept, String>;

/// A saved image.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Kept {
    pub path: PathBuf,
    /// Whether the view changed before there was a film of full resolution.
    pub coarse: bool,
}

/// The scene that a film shows, from which layers are gathered.
pub struct Shown {
    pub prepared: Prepared,
    pub names: FeatureNames,
    pub settings: RenderSettings,
    /// Of the layer with the denoised image.
    pub filter: DenoiseFilter,
    pub threads: usize,
    /// Pixels of the requested image.
    pub size: (u32, u32),
}

/// How an image is denoised before it is saved.
pub struct DenoiseWith {
    /// The scene that the film shows.
    pub prepared: Prepared,
    pub settings: RenderSettings,
    pub filter: DenoiseFilter,
    pub threads: usize,
}

impl DenoiseWith {
    /// Returns the colours and the filter that was used. `None` if the window was closed meanwhile, or the system has no
    /// threads: then the image is saved raw.
    fn denoise(&self, film: &Film, ending: &AtomicBool) -> Option<(Vec<Vec3>, DenoiseFilter)> {
        let stop = || ending.load(Ordering::Relaxed);
        let pool = worker_threads().num_threads(self.threads).build().ok()?;
        let size = UVec2::new(film.width(), film.height());
        pool.install(|| {
            let samples = guide_samples(film.spp());
            let guides = gather_guides(&self.prepared, &self.settings, size, samples, &stop)?;
            let (by, denoised) = self.filter.denoise(&DenoiseSource::of(film), &guides, &stop)?;
            Some((denoised.color, by))
        })
    }
}

pub struct Saver {
    /// Whether the window is closed: long renders end early.
    ending: Arc<AtomicBool>,
    folder: PathBuf,
    /// Absolute paths that others are going to write.
    taken: Vec<PathBuf>,
    waker: Waker,
    sender: Sender<Saved>,
    receiver: Receiver<Saved>,
    threads: Vec<JoinHandle<()>>,
}

impl Saver {
    /// Creates a saver for `folder`; `waker` is called when an image is done.
    pub fn new(folder: &Path, waker: Waker) -> Self {
        let (sender, receiver) = channel();
        let (ending, folder) = (Arc::default(), folder.to_owned());
        Self { ending, folder, taken: Vec::new(), waker, sender, receiver, threads: Vec::new() }
    }

    /// Leaves names free that others have announced, absolute paths.
    pub fn leave_free(&mut self, taken: Vec<PathBuf>) {
        self.taken = taken;
    }

    /// Saves the film that will arrive, with the metadata of `draft`, under the name of `scene` and the next free number;
    /// a PNG with `size` pixels.
    ///
    /// - `denoise`: for an image that is displayed denoised, but has not been yet; raw without it.
    pub fn save(
        &mut self,
        (film, denoise): (Receiver<KeptFilm>, Option<DenoiseWith>),
        draft: Option<MetadataDraft>,
        display: Display,
        size: (u32, u32),
        scene: &str,
        format: PictureFormat,
    ) {
        let (folder, stem, ending) = (self.folder.clone(), file_stem(scene), self.ending.clone());
        let taken = self.taken.clone();
        self.spawn(move || {
            let KeptFilm { film, denoised } = film.recv().map_err(|_| "there was no image to save".to_owned())?;
            let shown = denoised.map(|shown| (shown.colors, shown.by));
            let denoised = denoise.and_then(|with| shown.or_else(|| with.denoise(&film, &ending)));
            let denoised = denoised.as_ref().map(|(colors, filter)| (&colors[..], *filter));
            print((&folder, &stem, &taken), (&film, denoised), draft, &display, size, format)
        });
    }

    /// Saves the film that will come as a linear image with layers of what it shows.
    pub fn save_layers(
        &mut self,
        film: Receiver<KeptFilm>,
        shown: Shown,
        draft: Option<MetadataDraft>,
        display: Display,
        scene: &str,
    ) {
        let (folder, stem, ending) = (self.folder.clone(), file_stem(scene), self.ending.clone());
        let taken = self.taken.clone();
        self.spawn(move || {
            let KeptFilm { film, .. } = film.recv().map_err(|_| "there was no image to save".to_owned())?;
            let Shown { prepared, names, settings, filter, threads, size } = shown;
            let failed = |reason: &dyn std::fmt::Display| format!("the image was not saved: {reason}");
            let pool = worker_threads().num_threads(threads).build();
            let pool = pool.map_err(|error| failed(&format!("cannot start threads: {error}")))?;
            let of_film = (film.width(), film.height());
            let stop = || ending.load(Ordering::Relaxed);
            let gather = || FeatureLayers::gather(&prepared, names, &settings, of_film, FEATURE_SAMPLES, &stop);
            let features = pool.install(gather).ok_or_else(|| failed(&"the window was closed"))?;
            let knows_error = film.error_estimate().is_some();
            let with = DenoiseWith { prepared: prepared.clone(), settings, filter, threads };
            let (denoised, by) = with.denoise(&film, &ending).ok_or_else(|| failed(&"the window was closed"))?;
            let is_known = |layer: &PictureLayer| knows_error || *layer != PictureLayer::Error;
            let layers: Vec<PictureLayer> = PictureLayer::ALL.into_iter().filter(is_known).collect();
            let (coarse, note) = metadata_of(&folder, &stem, &film, draft, &display, size);
            let note = note.map(|note| with_filter(note, by, true));
            let picture = LayeredPicture {
                film: &film,
                features: Some(&features),
                denoised: Some(&denoised),
                layers: &layers,
                note: note.as_deref(),
            };
            Ok(picture.write_new(&folder, &stem, &taken).map(|path| Kept { path, coarse })?)
        });
    }

    fn spawn(&mut self, work: impl FnOnce() -> Saved + Send + 'static) {
        let (sender, waker) = (self.sender.clone(), self.waker.clone());
        let work = move || {
            // If the window is gone, the result is not needed.
            let _ = sender.send(work());
            waker();
        };
        match std::thread::Builder::new().name("save".to_owned()).spawn(work) {
            Ok(thread) => self.threads.push(thread),
            Err(error) => {
                let _ = self.sender.send(Err(format!("the image was not saved: cannot start a thread: {error}")));
            }
        }
        self.threads.retain(|thread| !thread.is_finished());
    }

    /// The results since the last call.
    pub fn finished(&self) -> Vec<Saved> {
        self.receiver.try_iter().collect()
    }

    /// Waits for the images that are still being written.
    pub fn finish(&mut self) -> Vec<Saved> {
        self.ending.store(true, Ordering::Relaxed);
        for thread in self.threads.drain(..) {
            // A panic has been printed by the thread itself.
            let _ = thread.join();
        }
        self.finished()
    }
}

/// The metadata of an image with the name of its filter; see [`ImageMetadata::denoised_by`].
fn with_filter(note: String, filter: DenoiseFilter, in_layer: bool) -> String {
    let Ok(raw) = ImageMetadata::from_note(&note) else { return note };
    raw.denoised_by(Some(filter.name().to_owned()), in_layer).to_note()
}

/// Writes a film with its metadata, under the next free number.
fn print(
    (folder, stem, taken): (&Path, &str, &[PathBuf]),
    (film, denoised): (&Film, Option<(&[Vec3], DenoiseFilter)>),
    draft: Option<MetadataDraft>,
    display: &Display,
    size: (u32, u32),
    format: PictureFormat,
) -> Saved {
    let (coarse, mut note) = metadata_of(folder, stem, film, draft, display, size);
    if let Some((_, filter)) = denoised {
        note = note.map(|note| with_filter(note, filter, false));
    }
    let denoised = denoised.map(|(colors, _)| colors);
    let print = Print { film, display, size, note: note.as_deref(), denoised };
    Ok(print.write_new(folder, stem, format, taken).map(|path| Kept { path, coarse })?)
}

/// Whether a film is coarser than the requested image, and the metadata of the image.
fn metadata_of(
    folder: &Path,
    stem: &str,
    film: &Film,
    draft: Option<MetadataDraft>,
    display: &Display,
    size: (u32, u32),
) -> (bool, Option<String>) {
    let coarse = (film.width(), film.height()) != size;
    let uneven = coarse || film.is_uneven();
    let samples = ImageSamples { first: film.first_sample(), spp: film.spp(), uneven };
    // Paths in the metadata are relative to the folder, whatever the name of the image will be.
    (coarse, draft.map(|draft| draft.note(&folder.join(stem), size, samples, *display)))
}

/// Returns an unused name of a file in `folder` for the open scene: `NAME-0001.ron`.
///
/// - `taken`: absolute paths that others are going to write.
pub fn new_file(folder: &Path, scene: &str, extension: &str, taken: &[PathBuf]) -> PathBuf {
    let stem = file_stem(scene);
    let mut free = numbered(folder, &stem, extension, taken).filter(|path| !path.exists());
    free.next().unwrap_or_else(|| folder.join(format!("{stem}.{extension}")))
}

/// Returns an unused folder in `folder` for frames of the open scene: `NAME-frames`, `NAME-frames-2`.
pub fn new_folder(folder: &Path, scene: &str) -> PathBuf {
    let name = format!("{}-frames", file_stem(scene));
    let numbered = (2..=u32::MAX).map(|number| folder.join(format!("{name}-{number}")));
    let mut names = std::iter::once(folder.join(&name)).chain(numbered);
    names.find(|path| !path.exists()).unwrap_or_else(|| folder.join(&name))
}

/// File stem for images of this scene: its own name without folder, extension, and the number of a file that was saved
/// here before.
pub fn file_stem(scene: &str) -> String {
    let stem = Path::new(scene).file_stem().map_or_else(String::new, |stem| stem.to_string_lossy().into_owned());
    let stem = without_number(&stem);
    let plain: String = stem.chars().map(|c| if c.is_alphanumeric() || "-_ .".contains(c) { c } else { '-' }).collect();
    if plain.trim_matches(['.', ' ']).is_empty() { "image".to_owned() } else { plain }
}

/// `room` of `room-0001` and of `room-0001-0002`. Numbers that do not begin with 0, such as years, are part of a name.
fn without_number(mut stem: &str) -> &str {
    while let Some((base, number)) = stem.rsplit_once('-')
        && !base.is_empty()
        && number.len() == 4
        && number.starts_with('0')
        && number.bytes().all(|byte| byte.is_ascii_digit())
    {
        stem = base;
    }
    stem
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::frame::KeptDenoised;
    use crate::render::advance;
    use crate::scene::{Extraction, LoadOptions, SceneInputs, SceneSource, load};
    use std::sync::Arc;
    use std::sync::atomic::{AtomicUsize, Ordering};

    fn ready(film: Film) -> Receiver<KeptFilm> {
        ready_denoised(film, None)
    }

    fn ready_denoised(film: Film, denoised: Option<KeptDenoised>) -> Receiver<KeptFilm> {
        let (sender, receiver) = channel();
        sender.send(KeptFilm { film, denoised }).unwrap();
        receiver
    }

    fn cornell() -> (SceneInputs, Extraction) {
        let loaded = load(&SceneSource::Builtin("cornell".to_owned()), &LoadOptions::default()).unwrap();
        let mut world = bevy_ecs::world::World::new();
        loaded.spawn(&mut world);
        let inputs = SceneInputs::of(&mut world);
        let extraction = Extraction::new(&inputs, &loaded.trees);
        (inputs, extraction)
    }

    #[test]
    fn pictures_of_one_moment_get_names_of_their_own() {
        let folder = tempfile::tempdir().unwrap();
        let woken = Arc::new(AtomicUsize::new(0));
        let counter = woken.clone();
        let mut saver = Saver::new(
            folder.path(),
            Arc::new(move || {
                counter.fetch_add(1, Ordering::SeqCst);
            }),
        );
        for _ in 0..8 {
            let film = ready(Film::new(3, 2));
            saver.save((film, None), None, Display::default(), (3, 2), "scenes/my room.ron", PictureFormat::Png);
        }
        let saved = saver.finish().into_iter().map(|saved| saved.unwrap());
        let mut saved: Vec<PathBuf> = saved.inspect(|kept| assert!(!kept.coarse)).map(|kept| kept.path).collect();
        saved.sort();
        let expected: Vec<PathBuf> = (1..=8).map(|i| folder.path().join(format!("my room-{i:04}.png"))).collect();
        assert_eq!(saved, expected);
        assert_eq!(woken.load(Ordering::SeqCst), 8);
    }

    #[test]
    fn a_picture_with_layers_has_all_that_are_known() {
        let folder = tempfile::tempdir().unwrap();
        let (inputs, extraction) = cornell();
        let mut saver = Saver::new(folder.path(), Arc::new(|| ()));
        // The error is known from the second sample on.
        for (spp, n_layers) in [(1, 10), (4, 11)] {
            let settings = RenderSettings::default();
            let (prepared, names) = (extraction.prepared.clone(), FeatureNames::of(&extraction, &inputs));
            let mut film = Film::new(9, 7);
            advance(&prepared, &settings, &mut film, spp, &|| false);
            let shown = Shown { prepared, names, settings, filter: DenoiseFilter::Own, threads: 1, size: (9, 7) };
            saver.save_layers(ready(film), shown, None, Display::default(), "cornell");
            saver.threads.drain(..).for_each(|thread| thread.join().unwrap());
            let [Ok(Kept { path, coarse: false })] = &saver.finished()[..] else { panic!("it cannot be saved") };
            assert_eq!(PictureLayer::in_file(path).len(), n_layers, "{spp} samples");
        }
    }

    /// A denoised image that is displayed is saved as it is, in a moment; linear light is raw.
    #[test]
    fn what_is_displayed_is_saved() {
        let folder = tempfile::tempdir().unwrap();
        let mut saver = Saver::new(folder.path(), Arc::new(|| ()));
        let with = || DenoiseWith {
            prepared: cornell().1.prepared,
            settings: RenderSettings::default(),
            filter: DenoiseFilter::Own,
            threads: 1,
        };
        let displayed = || KeptDenoised { colors: vec![Vec3::ONE; 12], by: DenoiseFilter::Own };
        let mut save = |denoise, format| {
            let film = ready_denoised(Film::new(4, 3), Some(displayed()));
            saver.save((film, denoise), None, Display::default(), (4, 3), "gallery", format);
            let [Ok(Kept { path, .. })] = &saver.finish()[..] else { panic!("it cannot be saved") };
            image::open(path).unwrap().to_rgb8().into_raw()
        };
        assert!(save(Some(with()), PictureFormat::Png).iter().all(|value| *value > 200));
        assert_eq!(save(None, PictureFormat::Png), [0; 36], "the film has no light");
    }

    #[test]
    fn a_failure_is_told() {
        let file = tempfile::NamedTempFile::new().unwrap();
        let folder = file.path().join("below a file");
        let mut saver = Saver::new(&folder, Arc::new(|| ()));
        saver.save((ready(Film::new(1, 1)), None), None, Display::default(), (1, 1), "gallery", PictureFormat::Exr);
        let [Err(error)] = &saver.finish()[..] else { panic!("it cannot have been saved") };
        assert!(error.contains("below a file"), "{error}");

        let (_, never) = channel();
        saver.save((never, None), None, Display::default(), (1, 1), "gallery", PictureFormat::Png);
        assert_eq!(saver.finish(), [Err("there was no image to save".to_owned())]);
    }

    #[test]
    fn every_scene_has_a_file_name() {
        assert_eq!(file_stem("gallery"), "gallery");
        assert_eq!(file_stem("/a/b.c/bunny.obj"), "bunny");
        assert_eq!(file_stem(""), "image");
        assert_eq!(file_stem(".."), "image");
        assert_eq!(file_stem("a:b"), "a-b");
    }

    #[test]
    fn numbers_count_from_the_base_name() {
        assert_eq!(file_stem("out/model-0001.png"), "model");
        assert_eq!(file_stem("model-0001-0001.ron"), "model");
        for name in ["shot-2024", "model-12", "-0001", "model-01a2", "model-00001"] {
            assert_eq!(file_stem(&format!("{name}.ron")), name);
        }
        let folder = tempfile::tempdir().unwrap();
        let first = new_file(folder.path(), "model.obj", "ron", &[]);
        assert_eq!(first, folder.path().join("model-0001.ron"));
        std::fs::write(&first, "").unwrap();
        assert_eq!(new_file(folder.path(), &first.to_string_lossy(), "ron", &[]), folder.path().join("model-0002.ron"));
    }
}
