//! A scene that is rendered without a window, and its images.

use crate::cli::console::{inform, print_bytes, remark, tell};
use crate::cli::denoising::ImageDenoiser;
use crate::cli::failure::Failure;
use crate::cli::progress::RenderProgress;
use crate::cli::render_args::{DEFAULT_SPP, MetricArg, RenderArgs};
use crate::cli::sequence::DEFAULT_FPS;
use bevy_ecs::prelude::World;
use firstlight::frame::navigation::Rig;
use firstlight::frame::{
    FeatureLayers, FeatureNames, FilmFile, LayeredPicture, PictureFormat, Print, Target, render_region_until, scene_at,
};
use firstlight::kdtree::InstructionSet;
use firstlight::render::{
    Denoised, Display, ErrorMetric, FEATURE_SAMPLES, Film, GuideGatherer, Purpose, RenderSettings, Room,
    SampleAllocation,
};
use firstlight::scene::whole_file::Replace;
use firstlight::scene::{
    Animation, DisplaySettings, Extraction, Files, FilmSize, ImageMetadata, ImageSamples, LoadedScene, MetadataDraft,
    Moment, Rendering, SceneInputs, SnapshotPart,
};
use std::path::Path;
use std::time::Instant;

/// A scene with its render settings.
pub(super) struct RenderJob {
    pub scene: LoadedScene,
    pub world: World,
    pub extraction: Extraction,
    pub settings: RenderSettings,
    pub display: Display,
    pub size: (u32, u32),
    pub build_seconds: f64,
    pub draft: MetadataDraft,
    /// `None` if nothing is denoised.
    denoiser: Option<ImageDenoiser>,
    /// Problems of the extraction that were printed.
    told: Vec<String>,
}

impl RenderJob {
    pub fn new(
        args: &RenderArgs,
        kept: Option<&ImageMetadata>,
        files: &mut Files,
        progress: &RenderProgress,
    ) -> Result<Self, Failure> {
        let denoiser = ImageDenoiser::of(&args.denoise, args.wants_denoised())?;
        let aspect = args.size.map(|(width, height)| f64::from(width) / f64::from(height));
        let scene = args.scene.load(aspect, files, &|text| progress.stage(text.to_owned()))?;
        if let Some(announcement) = &args.announcement {
            progress.suspend(|| inform(announcement));
        }
        progress.stage("preparing the scene".to_owned());
        let mut world = bevy_ecs::world::World::new();
        scene.spawn(&mut world);
        let start = Instant::now();
        let inputs = SceneInputs::of(&mut world);
        let extraction = Extraction::of_world(&mut world, &inputs, &scene.trees);
        let build_seconds = scene.build_seconds + start.elapsed().as_secs_f64();
        tracing::info!(
            "{}: loaded in {:.3} s, kd-trees built in {build_seconds:.3} s; {} threads, {:?}",
            scene.source.title(),
            scene.load_seconds,
            rayon::current_num_threads(),
            InstructionSet::detect()
        );
        tell(&extraction.problems.iter().cloned().collect());
        // Options that are not given come from the film that is resumed, else from the scene.
        let Rendering(of_scene) = *world.resource();
        let mut display = world.resource::<DisplaySettings>().0;
        display.exposure_stops += args.exposure;
        let of_picture = kept.or(scene.shot.as_ref()).map(|shot| shot.allocation);
        let allocation = match args.error_metric {
            _ if args.uniform || args.samples.is_some() => SampleAllocation::Uniform,
            Some(MetricArg::Relmse) => SampleAllocation::Adaptive(ErrorMetric::RelativeMse),
            Some(MetricArg::Display) => {
                SampleAllocation::Adaptive(ErrorMetric::Display { exposure_stops: display.exposure_stops })
            }
            None => of_picture.unwrap_or(SampleAllocation::Adaptive(ErrorMetric::RelativeMse)),
        };
        let settings = RenderSettings {
            allocation,
            integrator: (args.integrator.map(Into::into))
                .or(kept.map(|kept| kept.integrator))
                .unwrap_or(of_scene.integrator),
            max_depth: (args.max_depth)
                .or(kept.map(|kept| kept.max_depth.unwrap_or(u32::MAX)))
                .unwrap_or(of_scene.max_depth),
            seed: args.seed.or(kept.map(|kept| kept.seed)).unwrap_or(of_scene.seed),
            filter: (args.filter.map(Into::into)).or(kept.map(|kept| kept.film.filter)).unwrap_or(of_scene.filter),
            ..of_scene
        };
        let FilmSize { width, height } = *world.resource();
        let size = args.size.or(kept.map(|kept| (kept.film.width, kept.film.height))).unwrap_or((width, height));
        let size = scaled(size, args.scale)?;
        world.insert_resource(Rendering(settings));
        let draft = MetadataDraft::of(&mut world, Some(&scene));
        let told = extraction.problems.clone();
        Ok(Self { scene, world, extraction, settings, display, size, build_seconds, draft, denoiser, told })
    }

    /// The current camera.
    pub fn rig(&mut self) -> Option<Rig> {
        let camera = SceneInputs::of(&mut self.world).camera?;
        Some(Rig { view: camera.view, projection: camera.projection, lens: camera.lens })
    }

    /// Changes the camera.
    pub fn set_rig(&mut self, rig: &Rig) {
        if let Some(camera) = SceneInputs::of(&mut self.world).camera {
            self.world.entity_mut(camera.entity).insert((rig.view, rig.projection, rig.lens));
        }
        let inputs = SceneInputs::of(&mut self.world);
        let Self { world, extraction, scene, .. } = self;
        extraction.update(SnapshotPart::Camera, &inputs, &scene.trees);
        let seconds = world.get_resource::<Moment>().copied().unwrap_or_default().0;
        extraction.expose(world.get_resource::<Animation>(), seconds, &inputs, &scene.trees);
        self.draft = MetadataDraft::of(&mut self.world, Some(&self.scene)).prepared_as(&self.draft);
    }

    /// Takes over the frames per second that are asked for.
    pub fn set_fps(&mut self, args: &RenderArgs) -> Result<(), Failure> {
        let title = self.scene.source.title();
        let Some(mut animation) = self.world.get_resource_mut::<Animation>().filter(|it| it.moves()) else {
            let message = "has no animation: add the section `animation` to the scene file, or use --turntable N";
            return Err(Failure::Failed(format!("{title} {message}")));
        };
        if let Some(fps) = args.fps {
            animation.fps = fps;
        }
        Ok(())
    }

    /// Frames per second of a sequence.
    pub fn fps(&self, args: &RenderArgs) -> f64 {
        let of_scene = || self.world.get_resource::<Animation>().map(|animation| animation.fps);
        args.fps.or_else(of_scene).unwrap_or(DEFAULT_FPS)
    }

    /// Shows a frame of the animation from now on.
    pub fn set_frame(&mut self, args: &RenderArgs, number: u32) -> Result<(), Failure> {
        self.set_moment(f64::from(number) / self.fps(args))
    }

    /// Shows a moment from now on, seconds. The image does not depend on the moments before.
    pub fn set_moment(&mut self, seconds: f64) -> Result<(), Failure> {
        let mut trees = std::mem::take(&mut self.scene.trees);
        (self.extraction, self.draft) = scene_at(&mut self.world, &self.scene, &mut trees, seconds);
        self.scene.trees = trees;
        for problem in &self.extraction.problems {
            // Of a sequence, only the first frame with this problem.
            if !self.told.contains(problem) {
                remark(format_args!("warning: at {seconds} s {problem}"));
                self.told.push(problem.clone());
            }
        }
        Ok(())
    }

    /// Renders a complete image.
    pub fn picture(&self, args: &RenderArgs, target: Target) -> Result<Film, Failure> {
        let mut film = self.new_film(&purposes(args))?;
        render_region_until(&self.extraction.prepared, &self.settings, &mut film, None, target, &|| false, |_| true);
        Ok(film)
    }

    /// An empty film, after checking that there is memory for all outputs: before any ray is traced.
    fn new_film(&self, purposes: &[Purpose]) -> Result<Film, Failure> {
        let (width, height) = self.size;
        let light_traced = self.extraction.prepared.features().caustics;
        drop(Room::for_film(width, height, light_traced, purposes)?);
        let mut film = Film::try_new(width, height)?;
        if light_traced {
            film.reserve_light()?;
        }
        Ok(film)
    }

    /// The feature buffers, if a requested layer needs them: those of the film if they have enough samples, else new
    /// ones.
    pub fn features(
        &mut self,
        args: &RenderArgs,
        kept: Option<FeatureLayers>,
    ) -> Result<Option<FeatureLayers>, Failure> {
        let samples = args.layer_samples.unwrap_or(FEATURE_SAMPLES);
        if !args.layers.have_features() || kept.as_ref().is_some_and(|kept| kept.buffers.samples >= samples) {
            return Ok(kept);
        }
        let names = FeatureNames::of(&self.extraction, &SceneInputs::of(&mut self.world));
        let Self { extraction, settings, size, .. } = self;
        Ok(FeatureLayers::gather(&extraction.prepared, names, settings, *size, samples, &|| false))
    }

    /// The denoised film; `None` if it is not requested or `stop` returned true.
    ///
    /// - `guides`: of this scene and view, gathered as far as the film's samples ask for; new at the first call.
    pub fn denoised(
        &self,
        film: &Film,
        guides: &mut GuideGatherer,
        stop: &(dyn Fn() -> bool + Sync),
    ) -> Result<Option<Denoised>, Failure> {
        let Some(denoiser) = &self.denoiser else { return Ok(None) };
        if !guides.gather_for(&self.extraction.prepared, &self.settings, film, stop) {
            return Ok(None);
        }
        denoiser.denoise(film, guides.guides(), stop)
    }

    /// Writes an image with its metadata to a file or to standard output.
    pub fn write(
        &self,
        args: &RenderArgs,
        (film, features): (&Film, Option<&FeatureLayers>),
        denoised: Option<&Denoised>,
        path: &Path,
        replace: Replace,
    ) -> Result<(), Failure> {
        let mut note = self.note(film, path);
        if denoised.is_some() {
            let raw = ImageMetadata::from_note(&note).map_err(|error| Failure::Failed(error.into()))?;
            note = raw.denoised_by(Some(args.denoise.name()), !args.layers.is_empty()).to_note();
        }
        if !args.layers.is_empty() {
            let layers = args.layers.of(film);
            let denoised = denoised.map(|denoised| &denoised.color[..]);
            let picture = LayeredPicture { film, features, denoised, layers: &layers, note: Some(&note) };
            return match args.to_stdout() {
                true => print_bytes(&picture.bytes(path)?),
                false => Ok(picture.write(path, replace)?),
            };
        }
        let denoised = denoised.map(|denoised| &denoised.color[..]);
        let picture = Print { film, display: &self.display, size: self.size, note: Some(&note), denoised };
        if !args.to_stdout() {
            return Ok(picture.write(path, replace)?);
        }
        print_bytes(&picture.bytes(args.picture_format()?)?)
    }

    /// The metadata of an image of this film at `path`.
    pub fn note(&self, film: &Film, path: &Path) -> String {
        let samples = ImageSamples { first: film.first_sample(), spp: film.spp(), uneven: film.is_uneven() };
        self.draft.note(path, self.size, samples, self.display)
    }

    /// An empty film, or the one that is resumed.
    pub fn film(&self, args: &RenderArgs, kept: Option<(FilmFile, &Path)>) -> Result<Film, Failure> {
        let shot = self.scene.shot.as_ref();
        let first = args.samples.as_ref().map(|samples| samples.start).or(shot.map(|shot| shot.first_sample));
        let Some((FilmFile { film, shot, .. }, path)) = kept else {
            return Ok(self.new_film(&purposes(args))?.starting_at(first.unwrap_or(0)));
        };
        match self.differs_from(&film, &shot, path)? {
            None => Ok(film),
            Some(what) => Err(Failure::Failed(format!(
                "{}: the film was rendered with a different {what}; resume it as it was begun, or choose a new --film",
                path.display()
            ))),
        }
    }

    /// Why samples for `film`, in the file `path`, cannot be combined with those of `shot`, if so.
    pub fn differs_from(&self, film: &Film, shot: &ImageMetadata, path: &Path) -> Result<Option<&str>, Failure> {
        let ours = ImageMetadata::from_note(&self.note(film, path)).map_err(|error| Failure::Failed(error.into()))?;
        Ok(ours.differs_from(shot))
    }

    /// When to stop rendering.
    pub fn target(&self, args: &RenderArgs) -> Target {
        let open_ended = args.time.is_none() && args.error.is_none();
        let of_picture = self.scene.shot.as_ref().filter(|_| !args.resume).map(|shot| shot.spp.max(1));
        let default = open_ended.then(|| of_picture.unwrap_or(DEFAULT_SPP));
        let of_range = args.samples.as_ref().map(|samples| samples.end - samples.start);
        Target { spp: args.spp.or(of_range).or(default), seconds: args.time, error: args.error }
    }
}

/// The outputs that are written at the end.
pub fn purposes(args: &RenderArgs) -> Vec<Purpose> {
    let film = args.film.is_some() || args.resume;
    let picture = match args.picture_format() {
        Ok(PictureFormat::Exr) => Purpose::Exr,
        _ => Purpose::Png,
    };
    let others = [
        film.then_some(Purpose::FilmFile),
        args.layers.have_features().then_some(Purpose::Layers),
        args.wants_denoised().then_some(Purpose::Denoised),
    ];
    std::iter::once(picture).chain(others.into_iter().flatten()).collect()
}

/// Reserves memory for writing the outputs, so that a long rendering is not lost at the end.
pub fn room_to_write(args: &RenderArgs, (width, height): (u32, u32)) -> Result<Room, Failure> {
    Ok(Room::for_files(width, height, &purposes(args))?)
}

/// `size` times `scale`, if that is a valid size of a film.
pub fn scaled((width, height): (u32, u32), scale: Option<f64>) -> Result<(u32, u32), Failure> {
    let Some(scale) = scale else { return Ok((width, height)) };
    // The conversion saturates, and the maximum is rejected as too large.
    let side = |side: u32| (f64::from(side) * scale).round().max(1.0) as u32;
    let (width, height) = (side(width), side(height));
    firstlight::scene::file::check_film_size(width, height)
        .map_err(|error| Failure::Usage(format!("--scale: {error}")))?;
    Ok((width, height))
}
