//! Decides what to render next, without threads and without a clock: timings are passed in.
//!
//! A restart is followed by a coarse image within a frame, then by finer ones, then by samples at full resolution in
//! slices: up to twenty images per second at first, and two per second after a few seconds, until the target is
//! reached. If displaying an image is slow, it happens less often. The resolution during motion follows from the
//! measured speed, with hysteresis.
//!
//! The caller asks [`Scheduler::next`], executes the step, reports to [`Scheduler::finished`], and repeats.

use crate::frame::core::offline::Target;
use std::time::Duration;

/// Divisors of the film's sides.
const DIVIDERS: [u32; 10] = [1, 2, 3, 4, 6, 8, 12, 16, 24, 32];

/// Maximum latency of new pixels in seconds: two frames of a 60 Hz screen.
const REACTION: f64 = 1.0 / 30.0;
/// Maximum render time of a coarse image in seconds, if displaying it takes almost no time.
const SLOWEST: f64 = 1.0 / 80.0;
/// Lower limit of that maximum, however long displaying takes.
const QUICKEST: f64 = 1.0 / 200.0;
/// Part of the time from a frame of an animation to the next that its image may take to be rendered and displayed; the rest is
/// for what moves.
const OF_FRAME: f64 = 0.8;
/// Where images of that time are coarser than this divider, each may take the time of two frames: every second one is shown.
const POOR: u32 = 8;
/// Frames that are further apart, in seconds, are rendered as if they were not: the camera is to follow the hand.
pub const SLOWEST_FRAME: f64 = 1.0 / 15.0;
/// A finer resolution is tried if it would take less than this part of the maximum.
const FASTEST: f64 = 0.5;
/// Part of the maximum that a new choice aims at: inside the hysteresis band, so that it does not change again at once.
const AIM: f64 = 0.7;

/// Seconds that smoothing a coarse image may add to the time of rendering it; what takes longer is paid by a coarser
/// resolution.
const SMOOTHING: f64 = 0.002;

/// Part of the aimed time that finding surfaces at a finer resolution may take: edges and textures are as sharp as they are,
/// and the light on them as fine as the rest allows.
const SURFACES: f64 = 0.5;
/// Assumed time for a surface over that for a path before the first measurement, and the most that is assumed, in seconds:
/// where paths take long, it is for their bounces.
const GUESSED_SURFACE: f64 = 0.35;
const SLOWEST_SURFACE: f64 = 2e-7;

/// Time after the last restart at which motion is considered to have ended, and the image gets finer. Shorter, and the
/// resolution would jump between two events of a slow mouse.
const QUIET: Duration = Duration::from_millis(120);

/// Seconds between images at full resolution: short at first, then longer, since less changes.
const FIRST_SLICE: f64 = 0.05;
/// Reached after four and a half seconds, when half a second changes the error by a twentieth. Drawing an image takes
/// ten milliseconds or more on a processor without a GPU.
const LAST_SLICE: f64 = 0.5;
/// Minimum ratio of the slice to the time of displaying an image. Where the processors draw the window too, developing
/// and drawing take about one and a half times that time, which should be below a tenth of theirs.
const SLICE_OVER_SHOWING: f64 = 20.0;
/// An image at full resolution within this part of a slice after the previous one is not displayed: it is the rest of a
/// slice that was cut short by time.
const TOO_SOON: f64 = 0.5;
/// Seconds between coarse images of one view, except the first: more would delay the next input.
const COARSE_SLICE: f64 = 0.05;

/// Render time in seconds below which an image at full resolution needs no coarser ones before it.
const QUICK: f64 = 0.1;

/// From `EVEN_UNTIL` samples on, `AT_ONCE` samples are taken of a tile at a time: single ones leave the workers with
/// small batches of rays, and a few tiles that are slightly ahead are not visible.
const EVEN_UNTIL: u32 = 16;
const AT_ONCE: u32 = 4;

/// A speed that drops below 1 / `ANOTHER_SCENE` of the known one replaces it at once.
const ANOTHER_SCENE: f64 = 4.0;

/// Assumed camera paths per second before the first measurement.
const GUESSED_RATE: f64 = 1e6;

/// The next thing to do.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum RenderStep {
    /// Take samples of a film whose sides are divided by `divider`; 1 is full resolution.
    ///
    /// The film starts empty if the divider differs from the previous one, or after a restart.
    Render {
        /// Divisor of the film's sides.
        divider: u32,
        /// Stop when every pixel has this many samples…
        target_spp: u32,
        /// …or after this time.
        at_most: Option<Duration>,
    },
    /// Nothing to do until something changes.
    Sleep,
}

/// Result of a step.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct StepReport {
    /// Camera paths traced.
    pub paths: u64,
    /// Duration of the step in seconds.
    pub seconds: f64,
    /// Minimum samples per pixel of the film or of its region now.
    pub spp: u32,
    /// Relative error of the image, if it is known.
    pub error: Option<f64>,
}

/// Decides what to render next; see the head of this file.
#[derive(Clone, Debug)]
pub struct Scheduler {
    width: u32,
    height: u32,
    target: Target,
    paused: bool,
    /// Camera paths per second.
    rate: Option<f64>,
    /// Seconds from a finished image until it is displayed, running average.
    showing: f64,
    /// Seconds per pixel of smoothing a coarse image; 0 if they are raw.
    smoothing: f64,
    /// Seconds per pixel of finding surfaces and putting light on them, once it is known.
    relighting: Option<f64>,
    /// Seconds from a frame of the animation to the next, while it plays.
    pace: Option<f64>,
    /// Divider of coarse images; kept across restarts.
    coarse: u32,
    /// Divider of the surfaces that their light is put on; the same where finer ones do not fit.
    surfaces: u32,
    phase: Phase,
    restarted_at: Duration,
    /// Render time at full resolution since the restart, seconds.
    spent: f64,
    /// When the last image at full resolution was worth displaying, since the restart.
    pictured_at: Option<Duration>,
    /// Minimum samples per pixel of the current film or of its region.
    spp: u32,
    /// Relative error of the current film or of its region.
    error: Option<f64>,
    /// Number of pixels of the region that gets all samples.
    region: Option<u64>,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Phase {
    /// During or just after motion, at this divider above 1.
    Coarse(u32),
    /// On the way to full resolution, at this divider.
    Sharpening(u32),
    Full,
}

impl Scheduler {
    /// Creates a scheduler for an image of `width` × `height` pixels, at least 1 each.
    pub fn new(width: u32, height: u32, target: Target) -> Self {
        let mut scheduler = Self {
            width,
            height,
            target,
            paused: false,
            rate: None,
            showing: 0.0,
            smoothing: 0.0,
            relighting: None,
            pace: None,
            coarse: 1,
            surfaces: 1,
            phase: Phase::Full,
            restarted_at: Duration::ZERO,
            spent: 0.0,
            pictured_at: None,
            spp: 0,
            error: None,
            region: None,
        };
        scheduler.restart(Duration::ZERO);
        scheduler
    }

    /// Restarts at the time `now`: all samples are discarded.
    pub fn restart(&mut self, now: Duration) {
        self.choose_coarse();
        self.phase = if self.coarse == 1 { Phase::Full } else { Phase::Coarse(self.coarse) };
        self.restarted_at = now;
        (self.spent, self.pictured_at, self.spp, self.error) = (0.0, None, 0, None);
    }

    /// Restarts with another image size.
    pub fn resize(&mut self, width: u32, height: u32, now: Duration) {
        (self.width, self.height) = (width, height);
        self.restart(now);
    }

    /// Goes on at full resolution after a restart, with `spp` samples per pixel for which `spent` seconds were spent.
    pub fn go_on(&mut self, spp: u32, spent: f64) {
        self.phase = Phase::Full;
        (self.spp, self.spent) = (spp, spent);
    }

    /// Changes the target; keeps all samples.
    pub fn set_target(&mut self, target: Target) {
        self.target = target;
    }

    /// Pauses or resumes; keeps all samples.
    pub fn set_paused(&mut self, paused: bool) {
        self.paused = paused;
    }

    /// Restricts sampling to a region of this many pixels of the full film, with `spp` samples per pixel and this error
    /// so far, or lifts the restriction. Keeps all samples.
    pub fn set_region(&mut self, n_pixels: Option<u64>, spp: u32, error: Option<f64>) {
        self.region = n_pixels;
        if self.phase == Phase::Full {
            (self.spp, self.error) = (spp, error);
        }
    }

    /// Tells the seconds from a frame of the animation to the next while it plays: an image of one need not be there sooner
    /// than the next one is due.
    pub fn set_pace(&mut self, pace: Option<f64>) {
        self.pace = pace;
    }

    /// Discards the measured speed, because the number of threads has changed.
    pub fn forget_speed(&mut self) {
        self.rate = None;
    }

    /// Reports the time from a finished image until it was displayed.
    pub fn shown_after(&mut self, wait: Duration) {
        self.showing += 0.05 * (wait.as_secs_f64() - self.showing);
    }

    /// Reports for how many seconds a coarse image of this divider was smoothed before it was displayed; 0 if it was not.
    pub fn smoothed(&mut self, divider: u32, seconds: f64) {
        let measured = seconds / self.pixels(divider);
        let is_known = self.smoothing > 0.0 && measured > 0.0;
        self.smoothing = if is_known { self.smoothing + 0.2 * (measured - self.smoothing) } else { measured };
    }

    /// Reports how many seconds it took to put the light of a coarse image on surfaces of this divider.
    pub fn relit(&mut self, divider: u32, seconds: f64) {
        let measured = seconds / self.pixels(divider);
        self.relighting = Some(self.relighting.map_or(measured, |known| known + 0.2 * (measured - known)));
    }

    /// Divider of the surfaces that the light of an image of this divider is to be put on; `divider` for its own.
    pub fn surfaces(&self, divider: u32) -> u32 {
        if divider == 1 { 1 } else { self.surfaces.min(divider) }
    }

    /// Number of coarse images that one of this divider counts as: it is finer, but has as few samples per pixel.
    pub fn weight(&self, divider: u32) -> f32 {
        self.coarse as f32 / divider as f32
    }

    /// Render time at full resolution since the last restart, seconds.
    pub fn spent(&self) -> f64 {
        self.spent
    }

    /// Returns the next step at the time `now`; all times are on the caller's clock.
    pub fn next(&mut self, now: Duration) -> RenderStep {
        // During a pause, changes are still displayed, at full resolution.
        if self.paused && self.phase == Phase::Full && self.spp > 0 {
            return RenderStep::Sleep;
        }
        if let Phase::Coarse(divider) = self.phase
            && self.spp > 0
            && now.saturating_sub(self.restarted_at) >= QUIET
        {
            self.sharpen(divider);
        }
        match self.phase {
            Phase::Coarse(divider) | Phase::Sharpening(divider) if self.spp == 0 => {
                RenderStep::Render { divider, target_spp: 1, at_most: None }
            }
            Phase::Coarse(divider) | Phase::Sharpening(divider) => {
                let passes = (COARSE_SLICE * self.speed() / self.pixels(divider)).clamp(1.0, 65_536.0) as u32;
                let at_most = Duration::from_secs_f64(1.5 * COARSE_SLICE);
                RenderStep::Render { divider, target_spp: self.spp.saturating_add(passes), at_most: Some(at_most) }
            }
            Phase::Full if self.reached() => RenderStep::Sleep,
            // An image needs a sample in every pixel.
            Phase::Full if self.spp == 0 => RenderStep::Render { divider: 1, target_spp: 1, at_most: None },
            Phase::Full => {
                let n_pixels = self.region.map_or(self.pixels(1), |n| n.max(1) as f64);
                let left = self.target.seconds.map_or(f64::INFINITY, |seconds| seconds - self.spent);
                let slice = self.slice().min(left);
                let least = if self.spp < EVEN_UNTIL { 1 } else { AT_ONCE };
                let passes = (slice * self.speed() / n_pixels).clamp(f64::from(least), 65_536.0) as u32;
                let goal = self.target.spp.unwrap_or(u32::MAX);
                // A pass that takes longer than a slice is displayed unfinished.
                let at_most = Duration::from_secs_f64(1.5 * slice);
                RenderStep::Render {
                    divider: 1,
                    target_spp: self.spp.saturating_add(passes).min(goal),
                    at_most: Some(at_most),
                }
            }
        }
    }

    /// Records the result of a step that was not cut short by a restart; returns whether its image should be displayed,
    /// which at full resolution excludes images that follow another one too soon.
    pub fn finished(&mut self, step: RenderStep, report: StepReport, now: Duration) -> bool {
        let RenderStep::Render { divider, .. } = step else { return false };
        // Very short steps measure the start of the threads rather than the speed of the rays.
        if report.paths >= 256 && report.seconds > 0.0 {
            let measured = report.paths as f64 / report.seconds;
            // A much lower speed indicates another scene rather than a worker that had to wait.
            let known = self.rate.filter(|rate| measured > rate / ANOTHER_SCENE);
            self.rate = Some(known.map_or(measured, |rate| 0.5 * rate + 0.5 * measured));
        }
        (self.spp, self.error) = (report.spp, report.error);
        if divider == 1 {
            self.spent += report.seconds;
        }
        match self.phase {
            Phase::Coarse(divider) if report.spp > 0 && now.saturating_sub(self.restarted_at) >= QUIET => {
                self.sharpen(divider);
            }
            Phase::Sharpening(divider) if report.spp > 0 => self.sharpen(divider),
            _ => {}
        }
        let too_soon = Duration::from_secs_f64(TOO_SOON * self.slice());
        if divider == 1 && self.pictured_at.is_some_and(|before| now.saturating_sub(before) < too_soon) {
            return false;
        }
        self.pictured_at = (divider == 1 && report.spp > 0).then_some(now);
        true
    }

    /// Seconds between images at full resolution.
    fn slice(&self) -> f64 {
        (FIRST_SLICE + 0.1 * self.spent).max(SLICE_OVER_SHOWING * self.showing).min(LAST_SLICE)
    }

    /// Whether the target is reached at full resolution.
    pub fn reached(&self) -> bool {
        self.phase == Phase::Full && self.spp > 0 && self.target.reached(self.spp, self.spent, self.error)
    }

    /// Switches to half the divider, or to full resolution if that is next or fast enough.
    fn sharpen(&mut self, divider: u32) {
        let quick = self.seconds_for(1) <= QUICK;
        self.phase = if divider <= 2 || quick { Phase::Full } else { Phase::Sharpening(divider / 2) };
        (self.spp, self.error) = (0, None);
    }

    /// Keeps the coarse dividers while their time lies in the hysteresis band, otherwise chooses the finest that fit.
    fn choose_coarse(&mut self) {
        let slowest = self.slowest();
        let finer = |divider: u32| DIVIDERS.iter().rev().find(|&&finer| finer < divider).copied();
        let before = (self.coarse, self.surfaces);
        let too_slow = self.seconds_until_shown(before) > slowest;
        let finer_fits = finer(self.coarse)
            .is_some_and(|coarse| self.seconds_until_shown((coarse, self.surfaces.min(coarse))) < FASTEST * slowest);
        let finer_surfaces_fit = self.smoothing > 0.0
            && finer(self.surfaces)
                .is_some_and(|finer| self.seconds_for_surfaces(finer) < SURFACES * FASTEST * slowest);
        let are_raw = self.smoothing == 0.0 && self.surfaces < self.coarse;
        if too_slow || finer_fits || finer_surfaces_fit || are_raw {
            (self.coarse, self.surfaces) = self.finest_within(AIM * slowest);
        }
    }

    /// Dividers of coarse images and of their surfaces that take this many seconds.
    fn finest_within(&self, seconds: f64) -> (u32, u32) {
        let finest = |fits: &dyn Fn(u32) -> bool| {
            DIVIDERS.into_iter().find(|&divider| fits(divider)).unwrap_or(DIVIDERS[DIVIDERS.len() - 1])
        };
        let alone = finest(&|divider| self.seconds_until_shown((divider, divider)) <= seconds);
        let surfaces = finest(&|divider| self.seconds_for_surfaces(divider) <= SURFACES * seconds);
        if self.smoothing == 0.0 || surfaces >= alone {
            return (alone, alone);
        }
        let coarse = finest(&|divider| self.seconds_until_shown((divider, surfaces.min(divider))) <= seconds);
        (coarse, surfaces.min(coarse))
    }

    /// Maximum render time of a coarse image in seconds: an input may arrive while the previous image is being
    /// displayed, and its own image has to be displayed too.
    fn slowest(&self) -> f64 {
        let of_input = (REACTION - 2.0 * self.showing).clamp(QUICKEST, SLOWEST);
        let Some(pace) = self.pace else { return of_input };
        let within = |frames: f64| (frames * OF_FRAME * pace.min(SLOWEST_FRAME) - self.showing).max(of_input);
        let is_poor = self.finest_within(AIM * within(1.0)).0 > POOR;
        within(if is_poor { 2.0 } else { 1.0 })
    }

    fn speed(&self) -> f64 {
        self.rate.unwrap_or(GUESSED_RATE)
    }

    /// Seconds for one sample per pixel.
    fn seconds_for(&self, divider: u32) -> f64 {
        self.pixels(divider) / self.speed()
    }

    /// Seconds for one sample per pixel, for what smoothing takes beyond [`SMOOTHING`], and for finer surfaces.
    fn seconds_until_shown(&self, (divider, surfaces): (u32, u32)) -> f64 {
        let smoothing = (self.smoothing * self.pixels(divider) - SMOOTHING).max(0.0);
        let relighting = if surfaces < divider { self.seconds_for_surfaces(surfaces) } else { 0.0 };
        self.seconds_for(divider) + smoothing + relighting
    }

    /// Seconds to find surfaces and to put light on them.
    fn seconds_for_surfaces(&self, divider: u32) -> f64 {
        self.pixels(divider) * self.relighting.unwrap_or((GUESSED_SURFACE / self.speed()).min(SLOWEST_SURFACE))
    }

    fn pixels(&self, divider: u32) -> f64 {
        f64::from(self.width.div_ceil(divider)) * f64::from(self.height.div_ceil(divider))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A renderer that takes `1 / rate` seconds per path and has no other cost.
    struct Machine {
        scheduler: Scheduler,
        rate: f64,
        now: f64,
        spp: u32,
        /// Number of paths in the film.
        paths: f64,
        film: Option<u32>,
        /// Divider and end time of each step.
        shown: Vec<(u32, f64)>,
    }

    impl Machine {
        fn new(width: u32, height: u32, rate: f64, target: Target) -> Self {
            let scheduler = Scheduler::new(width, height, target);
            Self { scheduler, rate, now: 0.0, spp: 0, paths: 0.0, film: None, shown: Vec::new() }
        }

        fn restart(&mut self) {
            self.scheduler.restart(Duration::from_secs_f64(self.now));
            self.film = None;
        }

        /// Executes one step; false if there is nothing to do.
        fn step(&mut self) -> bool {
            let step = self.scheduler.next(Duration::from_secs_f64(self.now));
            let RenderStep::Render { divider, target_spp, at_most } = step else { return false };
            if self.film != Some(divider) {
                (self.film, self.paths) = (Some(divider), 0.0);
            }
            let pixels = self.scheduler.pixels(divider);
            let wanted = (f64::from(target_spp) * pixels - self.paths) / self.rate;
            let seconds = wanted.min(at_most.map_or(f64::INFINITY, |limit| limit.as_secs_f64()));
            self.now += seconds;
            self.paths += seconds * self.rate;
            self.spp = (self.paths / pixels + 1e-6).floor() as u32;
            let paths = (seconds * self.rate) as u64;
            // Independent samples of standard deviation 1.
            let error = (self.spp > 0).then(|| 1.0 / f64::from(self.spp).sqrt());
            let report = StepReport { paths, seconds, spp: self.spp, error };
            if self.scheduler.finished(step, report, Duration::from_secs_f64(self.now)) {
                self.shown.push((divider, self.now));
            }
            true
        }
    }

    #[test]
    fn while_moving_pictures_come_within_a_frame_or_two_and_keep_their_resolution() {
        for rate in [3e5, 1e6, 4e6, 3e7] {
            let mut machine = Machine::new(1280, 720, rate, Target::default());
            // Waits for the end of motion first, so that the speed is known.
            while machine.now < 2.0 {
                machine.step();
            }
            let mut dividers = Vec::new();
            for event in 0..60 {
                let at = machine.now.max(2.0 + f64::from(event) * 0.02);
                machine.now = at;
                machine.restart();
                machine.shown.clear();
                while machine.shown.is_empty() {
                    assert!(machine.step());
                }
                let (divider, shown) = machine.shown[0];
                assert!(shown - at <= SLOWEST * 1.001, "{rate:e}: {} s", shown - at);
                dividers.push(divider);
            }
            assert!(dividers.iter().all(|divider| *divider == dividers[0]), "{rate:e}: {dividers:?}");
        }
    }

    #[test]
    fn a_slow_window_leaves_less_time_for_the_picture() {
        for (showing, slowest) in [(0.001, SLOWEST), (0.012, REACTION - 0.024), (0.05, QUICKEST)] {
            let mut machine = Machine::new(1280, 720, 4e6, Target::default());
            (0..100).for_each(|_| machine.scheduler.shown_after(Duration::from_secs_f64(showing)));
            while machine.now < 2.0 {
                machine.step();
            }
            machine.restart();
            machine.shown.clear();
            let at = machine.now;
            machine.step();
            let (divider, shown) = machine.shown[0];
            let took = shown - at;
            assert!(took <= slowest * 1.001, "{showing}: {took} s at 1/{divider}");
            // As fine as possible.
            let finer = DIVIDERS.iter().rev().find(|&&finer| finer < divider).expect("a coarse one");
            assert!(machine.scheduler.seconds_for(*finer) > AIM * slowest, "{showing}: {took} s at 1/{divider}");
        }
    }

    #[test]
    fn an_image_of_an_animation_may_take_until_the_next_frame() {
        let took = |showing: f64, pace: Option<f64>| {
            let mut machine = Machine::new(1280, 720, 4e6, Target::default());
            (0..100).for_each(|_| machine.scheduler.shown_after(Duration::from_secs_f64(showing)));
            while machine.now < 2.0 {
                machine.step();
            }
            machine.scheduler.set_pace(pace);
            machine.restart();
            machine.shown.clear();
            let at = machine.now;
            machine.step();
            machine.shown[0].1 - at
        };
        for showing in [0.001, 0.02] {
            let (still, played, slow) =
                (took(showing, None), took(showing, Some(1.0 / 24.0)), took(showing, Some(1.0)));
            assert!(played > 2.0 * still && played + showing <= OF_FRAME / 24.0, "{showing}: {still}, {played}");
            assert!((played..OF_FRAME * SLOWEST_FRAME - showing).contains(&slow), "{showing}: {slow}");
            // Of a fast one, as much as of a moving camera.
            assert_eq!(took(showing, Some(1.0 / 120.0)), still);
        }
    }

    #[test]
    fn smoothing_that_takes_long_makes_coarse_images_coarser() {
        let choice = |seconds_per_pixel: f64| {
            let mut machine = Machine::new(1280, 720, 4e7, Target::default());
            while machine.now < 2.0 {
                machine.step();
            }
            for _ in 0..10 {
                let divider = machine.scheduler.coarse;
                let seconds = seconds_per_pixel * machine.scheduler.pixels(divider);
                machine.scheduler.smoothed(divider, seconds);
                machine.restart();
            }
            machine.scheduler.coarse
        };
        // 640 × 360 pixels take 6 ms to render; the second smoothing takes 2 ms more, the third one 12 ms.
        assert_eq!((choice(0.0), choice(8e-9), choice(50e-9)), (2, 2, 3));
    }

    #[test]
    fn light_is_coarser_than_the_surfaces_that_it_is_put_on() {
        let mut scheduler = Scheduler::new(1280, 720, Target::default());
        let mut choice = |rate: f64, smoothing: f64, surfaces_per_second: f64| {
            scheduler.rate = Some(rate);
            (scheduler.smoothing, scheduler.relighting) = (smoothing, Some(1.0 / surfaces_per_second));
            // Inside the band, the choice before would stay.
            (scheduler.coarse, scheduler.surfaces) = (32, 32);
            scheduler.restart(Duration::ZERO);
            let chosen = (scheduler.coarse, scheduler.surfaces);
            assert!(scheduler.seconds_until_shown(chosen) <= AIM * SLOWEST, "{chosen:?}");
            chosen
        };
        // Raw images, and surfaces that are no faster than paths, have the resolution of their film.
        assert_eq!((choice(4e6, 0.0, 14e6), choice(4e6, 1e-9, 4e6)), ((6, 6), (6, 6)));
        assert_eq!(choice(4e6, 1e-9, 14e6), (8, 4));
        assert_eq!(choice(4e5, 1e-9, 14e6), (24, 4));
        // With many processors, the surfaces have the full resolution.
        assert_eq!(choice(8e7, 1e-9, 3e8), (2, 1));
    }

    #[test]
    fn a_little_more_or_less_speed_does_not_change_the_resolution() {
        let mut machine = Machine::new(1280, 720, 2e6, Target::default());
        while machine.now < 2.0 {
            machine.step();
        }
        let mut first = None;
        for i in 0..200 {
            // The render time of a divider may vary by a third without leaving the band,
            machine.rate = 2e6 * (1.0 + 0.3 * (f64::from(i) * 0.7).sin());
            // and so may the display time.
            let showing = 0.01 * (1.0 + 0.3 * (f64::from(i) * 1.9).sin());
            machine.scheduler.shown_after(Duration::from_secs_f64(showing));
            machine.restart();
            machine.step();
            // The first choices were made at a guessed speed.
            if i >= 60 {
                let first = *first.get_or_insert(machine.scheduler.coarse);
                assert_eq!(machine.scheduler.coarse, first, "event {i}");
            }
        }
        let first = first.expect("a resolution");
        machine.rate = 2e5;
        machine.step();
        machine.restart();
        machine.shown.clear();
        let at = machine.now;
        machine.step();
        assert!(machine.scheduler.coarse > first, "ten times slower is not a little");
        assert!(machine.shown[0].1 - at <= SLOWEST, "and believed at once");
    }

    #[test]
    fn at_rest_the_picture_sharpens_to_full_resolution_and_never_back() {
        let mut machine = Machine::new(1920, 1080, 1e6, Target::default());
        while machine.now < 6.0 {
            assert!(machine.step());
        }
        let dividers: Vec<u32> = machine.shown.iter().map(|(divider, _)| *divider).collect();
        assert!(dividers[0] > 4, "{dividers:?}");
        assert!(dividers.is_sorted_by(|a, b| a >= b), "{dividers:?}");
        assert_eq!(*dividers.last().unwrap(), 1);
        // Reaching full resolution costs less than one more pass.
        let first_full = machine.shown.iter().find(|(divider, _)| *divider == 1).unwrap().1;
        assert!(first_full < 0.15 + 2.0 * 1920.0 * 1080.0 / 1e6, "{first_full}");
    }

    #[test]
    fn converging_pictures_are_shown_often_at_first_and_twice_a_second_later() {
        for (rate, width, showing) in [(3e6, 1280, 0.002), (2e7, 320, 0.002), (2e7, 320, 0.012), (4e6, 1280, 0.012)] {
            let mut machine = Machine::new(width, 720, rate, Target::default());
            (0..100).for_each(|_| machine.scheduler.shown_after(Duration::from_secs_f64(showing)));
            while machine.now < 10.0 {
                let before = machine.shown.len();
                machine.step();
                // Never the rest of a slice.
                if let [.., (1, last), (1, now)] = machine.shown[..]
                    && machine.shown.len() > before
                {
                    assert!(now - last >= 0.5 * machine.scheduler.slice() - 1e-9, "{rate:e}, {showing}: {last}, {now}");
                }
            }
            let per_second = |from: f64, until: f64| {
                let shown = machine.shown.iter().filter(|(_, at)| (from..until).contains(at)).count();
                shown as f64 / (until - from)
            };
            let (first, later) = (per_second(0.5, 1.0), per_second(5.0, 10.0));
            // Drawing takes 1.6 times the display time: less than a tenth of the total.
            let most = 20.0_f64.min(0.1 / (1.6 * showing) + 1.0);
            assert!((2.0..=most).contains(&first), "{rate:e}, {showing}: {first} pictures a second");
            assert!((1.2..=2.3).contains(&later), "{rate:e}: {later} pictures a second");
        }
    }

    #[test]
    fn it_stops_exactly_at_the_target_and_sleeps() {
        let mut machine = Machine::new(64, 64, 1e7, Target { spp: Some(1000), ..Target::default() });
        while machine.step() {}
        assert_eq!((machine.spp, machine.film), (1000, Some(1)));
        assert!(machine.scheduler.reached());
        // With a higher target, all samples stay.
        machine.scheduler.set_target(Target { spp: Some(1500), ..Target::default() });
        while machine.step() {}
        assert_eq!(machine.spp, 1500);
        let mut machine = Machine::new(64, 64, 1e6, Target { seconds: Some(3.0), ..Target::default() });
        while machine.step() {}
        assert!((3.0..3.2).contains(&machine.scheduler.spent()), "{}", machine.scheduler.spent());
        let mut machine = Machine::new(64, 64, 1e6, Target { error: Some(0.05), ..Target::default() });
        while machine.step() {}
        assert!((400..450).contains(&machine.spp), "{}", machine.spp);
    }

    #[test]
    fn a_pause_still_shows_what_changed_and_then_rests() {
        let mut machine = Machine::new(1280, 720, 1e6, Target::default());
        machine.scheduler.set_paused(true);
        while machine.step() {}
        assert_eq!((machine.film, machine.spp), (Some(1), 1), "one picture at full resolution after a restart");
        assert!(machine.now < 1.5, "{}", machine.now);
        machine.scheduler.set_paused(false);
        assert!(machine.step());
    }
}
