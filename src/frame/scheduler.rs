//! What to render next, decided without threads and without a clock: it is told the times.
//!
//! After a restart comes a coarse picture that is there within a frame, then sharper ones, then samples at full
//! resolution in slices, so that the picture is shown up to twenty times a second at first and twice when it has
//! been converging for some seconds, until the target is reached. Where it takes long to show a picture, it is shown less
//! often.
//! The resolution while things move follows from the measured speed, with a band in which it stays as it is.
//!
//! The one who renders asks [`Scheduler::next`], does it, tells [`Scheduler::finished`], and asks again.

use super::Target;
use std::time::Duration;

/// A film side is divided by one of these.
const DIVIDERS: [u32; 10] = [1, 2, 3, 4, 6, 8, 12, 16, 24, 32];

/// New pixels come within two frames of a 60 Hz screen, seconds.
const REACTION: f64 = 1.0 / 30.0;
/// A coarse picture must take no longer than this, seconds, where it takes next to nothing to put it on the window.
const SLOWEST: f64 = 1.0 / 80.0;
/// Nor need it take less than this, however long that takes.
const QUICKEST: f64 = 1.0 / 200.0;
/// A finer one is tried when it would take less than this part of what it may.
const FASTEST: f64 = 0.5;
/// What a fresh choice aims at: between the two, so that it does not change at once.
const AIM: f64 = 0.7;

/// So long after the last restart things are taken to have come to rest, and the picture sharpens. Shorter, and the
/// resolution would jump between two events of a slow mouse.
const QUIET: Duration = Duration::from_millis(120);

/// Seconds between pictures at full resolution: lively at first, then less often, since less changes.
const FIRST_SLICE: f64 = 0.05;
/// After four and a half seconds, in which half a second changes the error by a twentieth: to draw a picture takes a
/// processor that stands in for a graphics card ten milliseconds or more.
const LAST_SLICE: f64 = 0.5;
/// At least so many times what it takes to show a picture: to develop and draw it takes the processors some one and a half
/// times as long, where they draw the window too, and that should be less than a tenth of their time.
const SLICE_OVER_SHOWING: f64 = 20.0;
/// A picture at full resolution that comes within this part of a slice after another is not shown: what a slice has left
/// over, when it was cut short by time.
const TOO_SOON: f64 = 0.5;
/// Between coarse pictures of one view, the first excepted: more would only keep the next input waiting.
const COARSE_SLICE: f64 = 0.05;

/// A picture at full resolution that takes no longer needs no coarser ones on the way, seconds.
const QUICK: f64 = 0.1;

/// From so many samples on, so many are taken of a tile at once: one at a time leaves the workers with small
/// batches of rays, and a picture of which some tiles are a little ahead looks the same.
const EVEN_UNTIL: u32 = 16;
const AT_ONCE: u32 = 4;

/// A speed that falls to less than one part in this many is believed at once.
const ANOTHER_SCENE: f64 = 4.0;

/// Camera paths per second, before anything has been measured.
const GUESSED_RATE: f64 = 1e6;

/// One thing to do.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum RenderStep {
    /// Samples for a film whose sides are divided by `divider`; 1 is full resolution.
    ///
    /// A film of another divider than the one before, or the first after a restart, begins empty.
    Render {
        /// What the sides of the film are divided by.
        divider: u32,
        /// Until every pixel has so many samples…
        target_spp: u32,
        /// …or so much time has passed.
        at_most: Option<Duration>,
    },
    /// Nothing to do until something changes.
    Sleep,
}

/// How a step went.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct StepReport {
    /// Camera paths traced.
    pub paths: u64,
    /// Seconds that the step took.
    pub seconds: f64,
    /// Samples that every pixel of the film has now, or of its region.
    pub spp: u32,
    /// Relative error of the picture, as far as it is known.
    pub error: Option<f64>,
}

/// See the head of this file.
#[derive(Clone, Debug)]
pub struct Scheduler {
    width: u32,
    height: u32,
    target: Target,
    paused: bool,
    /// Camera paths per second.
    rate: Option<f64>,
    /// Seconds from a finished picture to the moment at which it is on the window, lately.
    showing: f64,
    /// What coarse pictures use; stays from one restart to the next.
    coarse: u32,
    phase: Phase,
    restarted_at: Duration,
    /// Seconds spent at full resolution since the restart.
    spent: f64,
    /// When the last picture at full resolution was worth showing, since the restart.
    pictured_at: Option<Duration>,
    /// Samples that every pixel of the current film has, or of its region.
    spp: u32,
    /// Relative error of the current film, or of its region.
    error: Option<f64>,
    /// Pixels of the part of the full film that gets all samples.
    region: Option<u64>,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Phase {
    /// At this divider, which is above 1, since things move or have just moved.
    Coarse(u32),
    /// On the way to full resolution.
    Sharpening(u32),
    Full,
}

impl Scheduler {
    /// Width and height of the whole picture, at least 1 each.
    pub fn new(width: u32, height: u32, target: Target) -> Self {
        let mut scheduler = Self {
            width,
            height,
            target,
            paused: false,
            rate: None,
            showing: 0.0,
            coarse: 1,
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

    /// All samples are worthless from `now` on.
    pub fn restart(&mut self, now: Duration) {
        self.choose_coarse();
        self.phase = if self.coarse == 1 { Phase::Full } else { Phase::Coarse(self.coarse) };
        self.restarted_at = now;
        (self.spent, self.pictured_at, self.spp, self.error) = (0.0, None, 0, None);
    }

    /// A restart with another size.
    pub fn resize(&mut self, width: u32, height: u32, now: Duration) {
        (self.width, self.height) = (width, height);
        self.restart(now);
    }

    /// Keeps all samples.
    pub fn set_target(&mut self, target: Target) {
        self.target = target;
    }

    /// Keeps all samples.
    pub fn set_paused(&mut self, paused: bool) {
        self.paused = paused;
    }

    /// From now on only this many pixels of the full film get samples, or all of them again; they have `spp` so far,
    /// and this error. Keeps all samples.
    pub fn set_region(&mut self, n_pixels: Option<u64>, spp: u32, error: Option<f64>) {
        self.region = n_pixels;
        if self.phase == Phase::Full {
            (self.spp, self.error) = (spp, error);
        }
    }

    /// Another number of threads renders at another speed.
    pub fn forget_speed(&mut self) {
        self.rate = None;
    }

    /// A picture was on the window so long after it was finished.
    pub fn shown_after(&mut self, wait: Duration) {
        self.showing += 0.05 * (wait.as_secs_f64() - self.showing);
    }

    /// Seconds spent at full resolution since the last restart.
    pub fn spent(&self) -> f64 {
        self.spent
    }

    /// The next thing to do at the time `now`, on the clock that all times passed in are of.
    pub fn next(&mut self, now: Duration) -> RenderStep {
        // A pause still shows what has changed, as sharp as it can be.
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
            // Nothing can be shown before every pixel has a sample.
            Phase::Full if self.spp == 0 => RenderStep::Render { divider: 1, target_spp: 1, at_most: None },
            Phase::Full => {
                let n_pixels = self.region.map_or(self.pixels(1), |n| n.max(1) as f64);
                let left = self.target.seconds.map_or(f64::INFINITY, |seconds| seconds - self.spent);
                let slice = self.slice().min(left);
                let least = if self.spp < EVEN_UNTIL { 1 } else { AT_ONCE };
                let passes = (slice * self.speed() / n_pixels).clamp(f64::from(least), 65_536.0) as u32;
                let goal = self.target.spp.unwrap_or(u32::MAX);
                // A pass that takes longer than a slice is shown unfinished.
                let at_most = Duration::from_secs_f64(1.5 * slice);
                RenderStep::Render {
                    divider: 1,
                    target_spp: self.spp.saturating_add(passes).min(goal),
                    at_most: Some(at_most),
                }
            }
        }
    }

    /// Takes note of a step that was not cut short by a restart, and tells whether its picture is worth showing: at full
    /// resolution not soon after another one.
    pub fn finished(&mut self, step: RenderStep, report: StepReport, now: Duration) -> bool {
        let RenderStep::Render { divider, .. } = step else { return false };
        // Very short steps measure the start of the threads more than the speed of the rays.
        if report.paths >= 256 && report.seconds > 0.0 {
            let measured = report.paths as f64 / report.seconds;
            // What is so much slower is another scene, and not a worker that had to wait.
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

    /// Seconds between pictures at full resolution.
    fn slice(&self) -> f64 {
        (FIRST_SLICE + 0.1 * self.spent).max(SLICE_OVER_SHOWING * self.showing).min(LAST_SLICE)
    }

    /// Whether the target is reached, at full resolution.
    pub fn reached(&self) -> bool {
        self.phase == Phase::Full && self.spp > 0 && self.target.reached(self.spp, self.spent, self.error)
    }

    /// On to a film of half the divider, or to the full one when that is near or quick enough.
    fn sharpen(&mut self, divider: u32) {
        let quick = self.seconds_for(1) <= QUICK;
        self.phase = if divider <= 2 || quick { Phase::Full } else { Phase::Sharpening(divider / 2) };
        (self.spp, self.error) = (0, None);
    }

    /// Leaves the coarse divider as it is while its time lies in the band, else takes the finest that fits.
    fn choose_coarse(&mut self) {
        let slowest = self.slowest();
        let finer = DIVIDERS.iter().rev().find(|&&divider| divider < self.coarse).copied();
        let too_slow = self.seconds_for(self.coarse) > slowest;
        let finer_fits = finer.is_some_and(|divider| self.seconds_for(divider) < FASTEST * slowest);
        if too_slow || finer_fits {
            let fits = |divider: &u32| self.seconds_for(*divider) <= AIM * slowest;
            self.coarse = DIVIDERS.into_iter().find(fits).unwrap_or(DIVIDERS[DIVIDERS.len() - 1]);
        }
    }

    /// What a coarse picture may take, seconds: an input may come while the picture before is put on the window, and its own
    /// has to be put there too.
    fn slowest(&self) -> f64 {
        (REACTION - 2.0 * self.showing).clamp(QUICKEST, SLOWEST)
    }

    fn speed(&self) -> f64 {
        self.rate.unwrap_or(GUESSED_RATE)
    }

    /// Seconds for one sample of every pixel.
    fn seconds_for(&self, divider: u32) -> f64 {
        self.pixels(divider) / self.speed()
    }

    fn pixels(&self, divider: u32) -> f64 {
        f64::from(self.width.div_ceil(divider)) * f64::from(self.height.div_ceil(divider))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A renderer that takes `1 / rate` seconds a path, and nothing else.
    struct Machine {
        scheduler: Scheduler,
        rate: f64,
        now: f64,
        spp: u32,
        /// Paths that are in the film.
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

        /// Does one step; false when there is nothing to do.
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
            // Come to rest first, so that the speed is known.
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
            // As fine as it may be.
            let finer = DIVIDERS.iter().rev().find(|&&finer| finer < divider).expect("a coarse one");
            assert!(machine.scheduler.seconds_for(*finer) > AIM * slowest, "{showing}: {took} s at 1/{divider}");
        }
    }

    #[test]
    fn a_little_more_or_less_speed_does_not_change_the_resolution() {
        let mut machine = Machine::new(1280, 720, 2e6, Target::default());
        while machine.now < 2.0 {
            machine.step();
        }
        let mut first = None;
        for i in 0..200 {
            // The time a divider takes may wander by a third either way without leaving the band.
            machine.rate = 2e6 * (1.0 + 0.3 * (f64::from(i) * 0.7).sin());
            // And so may the time that the window takes.
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
        // The way there costs less than one more pass.
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
                // Never what a slice had left over.
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
            // Drawing takes 1.6 times as long as it takes to show: less than a tenth.
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
        // More is asked for: all samples stay.
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
