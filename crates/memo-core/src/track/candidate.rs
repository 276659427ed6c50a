//! A moving region that may be a person: its frames, and the start of a walk on them (Rohr 1994, section 6).

use super::active::Active;
use super::decisions::{
    FASTEST_MPS, GLANCE_CONTRAST, GLANCE_SHARE, MOST_APART_S, OTHER_GAIT_GAIN, SLANT_GAIN, SLOWEST_MPS,
    WALKER_CONTRAST,
};
use super::fit::views::Piece;
use super::height::{BodyHeight, GIVEN_SD_M};
use super::left_out::Reason;
use super::locate::{
    Course, Crown, LocateError, Sighting, camera_from_sightings, locate, locate_slanting, same_person,
};
use super::options::TrackerOptions;
use super::options::{shown_height, start_height};
use super::rate::{lasting, mean_interval_s};
use super::start::{StartReport, StartSearch};
use super::walk::{FrameEdges, Walk};
use crate::calibrate::TiltEstimate;
use crate::image::Rectangle;
use crate::model::{Camera, GaitStyle, Tilt, Walker, assumed_field_of_view_rad};

/// A candidate is dropped after this many consecutive frames without it.
pub(super) const MISSED_FRAMES: usize = 3;
/// A region that is lower than this share of a followed person's window is taken for a part of the person. In three drawn
/// scenes, those who came near others were 0.36 to 0.88 as high. What was left over from two people alone was 0.16 to 0.26 as
/// high; of three others it was up to 0.5, 0.8 and 0.9, so they are not told from newcomers by this.
const NEWCOMER_SHARE: f64 = 0.35;
/// A start that failed is put down to a given height that is farther from that of the rectangles, standard deviations.
const OTHER_HEIGHT_SD: f64 = 2.0;
/// A glance at a start looks at every such frame.
const GLANCE_EVERY: usize = 3;
/// A rectangle near somebody else that is lower than this share of the tallest one shows no feet. Strides and arms change
/// the height of a whole person's by a few percent. Of the two drawn people behind somebody on whom it was chosen, the share
/// was 0.81 with hidden feet and 0.89 with feet that were seen: the margin is thin.
const WHOLE_SHARE: f64 = 0.85;
/// A start in as many frames as show a path is looked for at every third attempt: at each one, a trolley took 2.2 times the
/// time without it, now 1.5 times.
const PATH_EVERY: usize = 3;
/// Gaits other than the average with which a walk can start.
const OTHER_GAITS: [GaitStyle; 2] = [GaitStyle::CROUCHED, GaitStyle::SHORT_STEPS];

/// One frame of a candidate.
#[derive(Debug, Clone)]
pub(super) struct Seen {
    pub sighting: Sighting,
    pub edges: FrameEdges,
    /// Its picture, kept only for a fit.
    pub piece: Option<Piece>,
}

/// The frames of one candidate.
#[derive(Debug, Default)]
pub(super) struct Candidate {
    pub seen: Vec<Seen>,
    /// Frames without it since the last one.
    pub missed: usize,
    /// How many starts were refused.
    pub refusals: usize,
    /// With so many frames, another start is worth looking for.
    pub least: usize,
}

/// What a walk starts from.
pub(super) struct Given<'a> {
    pub options: &'a TrackerOptions,
    /// The given camera, or the one assumed for the people who are followed already.
    pub camera: Option<&'a Camera>,
    /// How a camera that is not given is tilted.
    pub tilt: Option<TiltEstimate>,
    /// Relative standard deviation of the camera's scale, if it is that of somebody who is followed.
    pub scale_sd: f64,
    /// The given height.
    pub height_m: Option<f64>,
    /// Width and height of the frames.
    pub size: [u32; 2],
}

impl Candidate {
    /// True if a rectangle may enclose the same thing as the last one.
    pub fn is_at(&self, rectangle: &Rectangle) -> bool {
        self.last_rectangle().is_none_or(|last| same_person(&last, rectangle))
    }

    /// Where it was last seen.
    pub fn last_rectangle(&self) -> Option<Rectangle> {
        self.seen.last().map(|last| last.sighting.rectangle)
    }

    /// Overlap of a rectangle with the last one, intersection over union.
    pub fn overlap(&self, rectangle: &Rectangle) -> f64 {
        self.last_rectangle().map_or(0.0, |last| last.sides(0.0).overlap(&rectangle.sides(0.0)))
    }

    /// True if it was last seen in a part of the image.
    pub fn is_in(&self, window: &Rectangle) -> bool {
        self.last_rectangle().is_some_and(|last| last.gap(window) == [0, 0])
    }

    /// True if somebody may be about to start beside a person who is followed within a window: it was seen there in the
    /// last frame, it is not small beside that person, and no start was refused. What was refused may be a part of the
    /// person, and so may what is small.
    pub fn is_newcomer(&self, window: &Rectangle) -> bool {
        let least = NEWCOMER_SHARE * window.height() as f64;
        let is_large = self.last_rectangle().is_some_and(|last| last.height() as f64 >= least);
        self.missed == 0 && self.refusals == 0 && is_large && self.is_in(window)
    }

    pub fn add(&mut self, seen: Seen) {
        self.seen.push(seen);
        self.missed = 0;
    }

    /// Waits for more frames after a refused start.
    pub fn refuse(&mut self, options: &TrackerOptions) {
        self.refusals += 1;
        self.least = self.seen.len() + options.start_frames / 3;
    }

    /// Sets aside all but so many last frames.
    pub fn set_aside(&mut self, frames: usize) -> Vec<Seen> {
        let newer = self.seen.split_off(self.seen.len().saturating_sub(frames));
        std::mem::replace(&mut self.seen, newer)
    }

    /// Takes back frames that were set aside, as many as show a path; true if these are more than before and another start
    /// should be looked for in them.
    pub fn with_older(&mut self, mut older: Vec<Seen>, options: &TrackerOptions) -> bool {
        let newer = self.seen.len();
        older.append(&mut self.seen);
        self.seen = older;
        let shows_path = |first: &usize| shows_path(&self.seen[*first..], options);
        let Some(first) = (0..self.seen.len()).rev().find(shows_path) else { return false };
        self.seen.drain(..first.min(self.seen.len() - newer));
        // At 25 Hz, the first of these attempts is the one with 40 frames.
        self.seen.len() > newer && self.refusals % PATH_EVERY == 1
    }

    /// True if there are enough frames to look for a start that takes so many.
    pub fn can_start(&self, frames: usize) -> bool {
        self.missed == 0 && self.seen.len() >= frames.max(self.least)
    }

    /// Mean time from one of its frames to the next, seconds; NaN of fewer than two.
    fn apart_s(&self) -> f64 {
        mean_interval_s(self.seen.iter().map(|seen| seen.edges.time_s))
    }

    /// Starts a walk, or says why not: things that do not move like a walker.
    ///
    /// 1. Camera and course from the rectangles.
    /// 2. Lines of phase over the whole cycle, of several gaits; of those that look like walking the most similar one
    ///    starts ([`Self::started`]).
    /// 3. Both twins followed through the start frames.
    pub fn begin(&self, given: &Given<'_>) -> Result<Active, Reason> {
        let options = given.options;
        let apart_s = self.apart_s();
        if apart_s > MOST_APART_S {
            return Err(Reason::FramesApart { apart_s });
        }
        let mut sightings: Vec<Sighting> = self.seen.iter().map(|seen| seen.sighting).collect();
        if feet_cut_off(&sightings, given.size[1] as usize) {
            return Err(Reason::CutOff);
        }
        self.uncover_feet(&mut sightings);
        let height = start_height(options, given.height_m, given.camera, &sightings).on_scale(given.scale_sd);
        if options.treadmill == Some(true) {
            let Entered { course, .. } =
                Entered::new(&sightings, given, &height, &GaitStyle::default(), Way::Across)?;
            return Err(Reason::OverGround { speed_mps: course.speed_mps });
        }
        let shown_height = shown_height_of(&sightings, given);
        let started = self.started_any_way(&sightings, given, &height);
        let Started { camera, course, walker, start } =
            started.map_err(|reason| by_height(reason, &height, shown_height))?;
        let walk = Walk::new(walker, start.path, start.beginning);
        let walk = walk.through(self.seen.iter().map(|seen| &seen.edges), &camera, &options.walk);
        Ok(Active {
            tilt: given.tilt,
            depth_sd_m: course.depth_sd_m,
            shown_height_m: shown_height.map(|shown| shown.height_m),
            kept: self.seen.iter().map(|seen| (Some(seen.sighting), seen.edges.clone())).collect(),
            pieces: self.seen.iter().filter_map(|seen| seen.piece.clone()).collect(),
            ..Active::new(walk, start, camera, height)
        })
    }

    /// The height that a calibrated camera shows, whatever was given.
    pub fn seen_height(&self, options: &TrackerOptions, camera: &Camera) -> BodyHeight {
        let mut sightings: Vec<Sighting> = self.seen.iter().map(|seen| seen.sighting).collect();
        self.uncover_feet(&mut sightings);
        start_height(options, None, Some(camera), &sightings)
    }

    /// Gives the sightings whose feet somebody nearer may hide the lowest row of the tallest one: what ends above its feet
    /// would seem to stand farther away.
    fn uncover_feet(&self, sightings: &mut [Sighting]) {
        let Some(tallest) = sightings.iter().map(|s| s.rectangle).max_by_key(Rectangle::height) else {
            return;
        };
        for (sighting, seen) in sightings.iter_mut().zip(&self.seen) {
            let is_short = (sighting.rectangle.height() as f64) < WHOLE_SHARE * tallest.height() as f64;
            if seen.edges.shared && is_short {
                sighting.rectangle.bottom = tallest.bottom;
            }
        }
    }

    /// The start along the image plane or, of sightings that last as long as a path needs to be settled, along an oblique
    /// path, if the contours fit it better.
    fn started_any_way(
        &self,
        sightings: &[Sighting],
        given: &Given<'_>,
        height: &BodyHeight,
    ) -> Result<Started, Reason> {
        let across = self.started(sightings, given, height, Way::Across);
        let is_long = shows_path(&self.seen, given.options);
        let oblique = is_long.then(|| self.started(sightings, given, height, Way::Oblique).ok()).flatten();
        let similarity = |started: &Started| started.start.lines.best.similarity;
        match (across, oblique) {
            (across, None) => across,
            (Ok(across), Some(oblique))
                if similarity(&oblique) <= (1.0 + SLANT_GAIN) * similarity(&across) =>
            {
                Ok(across)
            }
            (_, Some(oblique)) => Ok(oblique),
        }
    }

    /// The gait with which a walk starts, or why none does.
    ///
    /// 1. A glance at every third frame, with every gait.
    /// 2. All frames with the gaits that may be of somebody who walks, and with the average one if there is any.
    /// 3. Of those that look like walking the most similar one, if it is clearly more similar than the average one.
    fn started(
        &self,
        sightings: &[Sighting],
        given: &Given<'_>,
        height: &BodyHeight,
        way: Way,
    ) -> Result<Started, Reason> {
        let options = given.options;
        let entered = |style: &GaitStyle| Entered::new(sightings, given, height, style, way);
        let average = entered(&GaitStyle::default())?;
        let gaits = if options.fit.is_some() { &OTHER_GAITS[..] } else { &[] };
        let others: Vec<Entered> = gaits.iter().filter_map(|style| entered(style).ok()).collect();

        let edges: Vec<&FrameEdges> = self.seen.iter().map(|seen| &seen.edges).collect();
        let mut of_average = average.search(&edges, options);
        let every = lasting(GLANCE_EVERY, self.apart_s());
        let first = of_average.glance(every).ok_or(Reason::NotWalking)?;
        let promising = |entered: Entered| {
            let mut search = entered.search(&edges, options).after(&of_average);
            let glance = search.glance(every)?;
            let is_similar = glance.similarity >= GLANCE_SHARE * first.similarity;
            (is_similar && glance.contrast >= GLANCE_CONTRAST)
                .then(|| search.finish())?
                .map(|start| (entered, start))
        };
        let others: Vec<(Entered, StartReport)> = others.into_iter().filter_map(promising).collect();
        if first.contrast < GLANCE_CONTRAST && others.is_empty() {
            return Err(Reason::NotWalking);
        }

        let start = of_average.finish().ok_or(Reason::NotWalking)?;
        let average = Started::new(average, start);
        let similarity = |started: &Started| started.start.lines.best.similarity;
        let other = others
            .into_iter()
            .map(|(entered, start)| Started::new(entered, start))
            .filter(Started::walks)
            .filter(|other| similarity(other) > OTHER_GAIT_GAIN * similarity(&average))
            .max_by(|a, b| similarity(a).total_cmp(&similarity(b)));
        other.or_else(|| average.walks().then_some(average)).ok_or(Reason::NotWalking)
    }
}

/// The height that the rectangles of somebody show in a calibrated camera, whatever height was given.
fn shown_height_of(sightings: &[Sighting], given: &Given<'_>) -> Option<BodyHeight> {
    let camera = given.options.camera.as_ref().filter(|_| given.height_m.is_some())?;
    shown_height(given.options, camera, sightings)
}

/// Why no walk fits, if it is that the rectangles show another height than the given one.
fn by_height(reason: Reason, given: &BodyHeight, shown: Option<BodyHeight>) -> Reason {
    match (reason, shown) {
        (Reason::WrongSize | Reason::NotWalking, Some(shown))
            if given.distance_sd(&shown) > OTHER_HEIGHT_SD =>
        {
            Reason::OtherHeight { shown_m: shown.height_m }
        }
        _ => reason,
    }
}

/// Which path is looked for.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Way {
    /// Parallel to the image plane.
    Across,
    /// The one that comes nearer or goes away.
    Oblique,
}

/// True if frames are so many or last so long that an oblique path can be looked for.
fn shows_path(seen: &[Seen], options: &TrackerOptions) -> bool {
    seen.len() >= options.path_frames || lasts_s(seen) >= options.path_s()
}

/// Time from the first frame to the last, seconds.
fn lasts_s(seen: &[Seen]) -> f64 {
    let ends = seen.first().zip(seen.last());
    ends.map_or(0.0, |(first, last)| last.edges.time_s - first.edges.time_s)
}

/// The course of a candidate as somebody of one gait.
struct Entered {
    camera: Camera,
    course: Course,
    walker: Walker,
}

impl Entered {
    /// What is no course of a person, or slower or faster than people walk, is refused.
    fn new(
        sightings: &[Sighting],
        given: &Given<'_>,
        height: &BodyHeight,
        style: &GaitStyle,
        way: Way,
    ) -> Result<Self, Reason> {
        let average = given.options.walker(height.height_m).map_err(|_| Reason::WrongSize)?;
        let walker = Walker { style: *style, ..average };
        let crown_m = walker.level_crown_height_m();
        let (camera, mut course) = course(sightings, given, crown_m, height)?;
        if way == Way::Oblique {
            let crown = Crown { height_m: crown_m, sd_m: height.sd_in_camera_m() };
            let oblique = locate_slanting(sightings, &camera, &crown).ok_or(Reason::NotWalking)?;
            course = Course { depth_sd_m: course.depth_sd_m, ..oblique };
        }
        let speed_mps = course.speed_mps;
        if speed_mps < SLOWEST_MPS {
            return Err(Reason::TooSlow { speed_mps });
        }
        if speed_mps >= FASTEST_MPS {
            return Err(Reason::TooFast { speed_mps });
        }
        Ok(Self { camera, course, walker })
    }

    fn search<'a>(&'a self, edges: &'a [&FrameEdges], options: &'a TrackerOptions) -> StartSearch<'a> {
        StartSearch::new(edges, &self.course, &self.walker, &self.camera, &options.cadence, &options.walk)
    }
}

/// A start with one gait.
struct Started {
    camera: Camera,
    course: Course,
    walker: Walker,
    start: StartReport,
}

impl Started {
    fn new(entered: Entered, start: StartReport) -> Self {
        let Entered { camera, course, walker } = entered;
        Self { camera, course, walker, start }
    }

    /// True for what walks. A thing carried along in one posture looks like a walker, but then a constant phase explains
    /// it best.
    fn walks(&self) -> bool {
        self.start.contrast() >= WALKER_CONTRAST
            && self.start.frozen.similarity < self.start.lines.best.similarity
    }
}

pub(super) fn course(
    sightings: &[Sighting],
    given: &Given<'_>,
    crown_m: f64,
    height: &BodyHeight,
) -> Result<(Camera, Course), LocateError> {
    // An assumed camera has the scale of the height, so in it the height is known.
    let (camera, sd_m) = match given.camera {
        Some(camera) => (camera.clone(), height.sd_in_camera_m()),
        None => {
            let field_of_view_rad =
                given.options.field_of_view_rad.unwrap_or_else(|| assumed_field_of_view_rad(given.size));
            let tilt = given.tilt.map_or(Tilt::default(), |estimate| estimate.tilt);
            let camera = camera_from_sightings(sightings, given.size, field_of_view_rad, crown_m, &tilt)?;
            (camera, GIVEN_SD_M)
        }
    };
    let course = locate(sightings, &camera, &Crown { height_m: crown_m, sd_m })?;
    // The error of the scale moves the walk nearer or farther with all its lengths.
    let distance_m = course.path.distance(camera.position().truncate());
    let depth_sd_m = course.depth_sd_m.hypot(height.assumed_scale_sd() * distance_m);
    Ok((camera, Course { depth_sd_m, ..course }))
}

/// True if the rectangle touches the lower border in most frames. A reflection touches it only now and then.
pub(super) fn feet_cut_off(sightings: &[Sighting], height: usize) -> bool {
    2 * sightings.iter().filter(|s| s.rectangle.bottom + 2 >= height).count() > sightings.len()
}

#[cfg(test)]
pub(super) mod tests {
    use super::super::fit::FitOptions;
    use super::super::score::EdgeLine;
    use super::super::search::tests::{camera, edges_of, walker};
    use super::super::search::{Hypothesis, Path, Scene};
    use super::*;
    use glam::DVec2;

    const PATH: Path = Path { origin: DVec2::ZERO, heading_rad: 0.0 };

    /// An upright box with its lower left corner at this position.
    fn boxed(left: usize, bottom: usize, width: usize, height: usize) -> Rectangle {
        Rectangle { left, top: bottom + 1 - height, right: left + width - 1, bottom }
    }

    #[test]
    fn rectangles_of_one_person_overlap_and_are_about_as_high() {
        let first = boxed(100, 399, 80, 200);
        for (second, is_same) in [
            (boxed(100, 399, 80, 126), true),
            (boxed(100, 399, 80, 124), false),
            (boxed(100, 399, 80, 332), true),
            (boxed(100, 399, 80, 336), false),
            (boxed(150, 399, 20, 200), true),
            (boxed(180, 399, 80, 200), true),
            (boxed(181, 399, 80, 200), false),
            (boxed(100, 199, 80, 190), true),
            (boxed(100, 198, 80, 190), false),
        ] {
            assert_eq!(same_person(&first, &second), is_same, "{second:?}");
        }
    }

    #[test]
    fn feet_are_cut_off_where_most_rectangles_reach_the_last_rows() {
        let seen = |bottoms: &[usize]| -> Vec<Sighting> {
            let sighting = |b: &usize| Sighting { time_s: 0.0, rectangle: boxed(100, *b, 80, 200) };
            bottoms.iter().map(sighting).collect()
        };
        assert!(feet_cut_off(&seen(&[478, 479, 400, 478]), 480));
        assert!(!feet_cut_off(&seen(&[478, 479, 400, 400]), 480), "a half is not most");
        assert!(!feet_cut_off(&seen(&[477, 477, 477]), 480));
    }

    /// Five sightings of a person at this speed, with the contours of a walker.
    pub fn seen_walking(speed_mps: f64) -> Vec<Seen> {
        seen_of(&walker(), speed_mps)
    }

    fn seen_of(walker: &Walker, speed_mps: f64) -> Vec<Seen> {
        seen_along(&PATH, walker, speed_mps, 5, 0.1)
    }

    pub fn seen_along(path: &Path, walker: &Walker, speed_mps: f64, count: usize, frame_s: f64) -> Vec<Seen> {
        let camera = camera();
        let scene = Scene::new(walker, &camera, path);
        let crown_m = walker.level_crown_height_m();
        let frame = |k: usize| {
            let time_s = frame_s * k as f64;
            let along_m = -0.4 + speed_mps * time_s;
            let height_m = walker.level_torso_height_m();
            let hypothesis = Hypothesis { along_m, height_m, phase: 0.2 + 0.9 * time_s };
            let [sole, crown] = [0.0, crown_m].map(|z| camera.project(path.point(along_m, z)).unwrap());
            let rectangle = Rectangle {
                left: (sole.x - 40.0).round() as usize,
                right: (sole.x + 40.0).round() as usize,
                top: (crown.y - 2.0).round() as usize,
                bottom: (sole.y).round() as usize,
            };
            let edges = edges_of(&scene, &hypothesis);
            let edges = FrameEdges::of_one_alone(k, time_s, rectangle, edges);
            Seen { sighting: Sighting { time_s, rectangle }, edges, piece: None }
        };
        (0..count).map(frame).collect()
    }

    fn begun(seen: Vec<Seen>) -> Option<Active> {
        begun_with(seen, None)
    }

    fn begun_with(seen: Vec<Seen>, fit: Option<FitOptions>) -> Option<Active> {
        let options = TrackerOptions {
            camera: Some(camera()),
            fit,
            start_frames: 5,
            ..TrackerOptions::for_height(1.75)
        };
        let camera = options.camera.as_ref();
        let given = Given {
            options: &options,
            camera,
            tilt: None,
            scale_sd: 0.0,
            height_m: Some(1.75),
            size: [640, 480],
        };
        Candidate { seen, ..Candidate::default() }.begin(&given).ok()
    }

    /// A phone held upright sees the same as one held level, turned.
    #[test]
    fn the_assumed_camera_has_its_field_of_view_across_the_longer_side() {
        let sightings: Vec<Sighting> = (0..5)
            .map(|k| Sighting { time_s: 0.1 * k as f64, rectangle: boxed(100 + 10 * k, 399, 80, 200) })
            .collect();
        let focal_px = |size: [u32; 2], field_of_view_rad: Option<f64>| {
            let options = TrackerOptions { field_of_view_rad, ..TrackerOptions::default() };
            let given = Given {
                options: &options,
                camera: None,
                tilt: None,
                scale_sd: 0.0,
                height_m: Some(1.75),
                size,
            };
            course(&sightings, &given, 1.75, &BodyHeight::given(1.75)).unwrap().0.focal_px.x
        };
        assert!((focal_px([640, 480], None) - focal_px([480, 640], None)).abs() < 1e-9);
        assert!(
            (focal_px([480, 640], Some(1.0)) - 240.0 / 0.5f64.tan()).abs() < 1e-9,
            "a given one is of the width"
        );
    }

    #[test]
    fn a_walker_is_started_with_both_twins_through_the_start_frames() {
        let seen = seen_walking(1.3);
        let active = begun(seen.clone()).expect("a walker");
        assert!((active.start.beginning.speed_mps - 1.3).abs() < 0.1 && active.start.contrast() > 1.22);
        assert_eq!((active.walk.twins[0].steps.len(), active.walk.twins[1].steps.len()), (5, 5));
        assert!(active.kept.len() == 5 && active.kept[4].0 == Some(seen[4].sighting) && !active.settled);
        let sightings: Vec<Sighting> = seen.iter().map(|seen| seen.sighting).collect();
        let crown = Crown { height_m: walker().level_crown_height_m(), sd_m: 0.02 };
        let course = locate(&sightings, &camera(), &crown).unwrap();
        assert_eq!(active.depth_sd_m, course.depth_sd_m);
    }

    #[test]
    fn feet_that_somebody_nearer_hides_move_nobody_farther_away() {
        let whole = begun(seen_walking(1.3)).expect("a walker");
        let depth_m = |is_shared: bool| {
            let mut seen = seen_walking(1.3);
            for seen in &mut seen[2..] {
                seen.sighting.rectangle.bottom -= seen.sighting.rectangle.height() / 6;
                seen.edges.shared = is_shared;
            }
            begun(seen).map(|active| active.start.path.point(0.0, 0.0).distance(active.camera.position()))
        };
        let whole_m = whole.start.path.point(0.0, 0.0).distance(whole.camera.position());
        let hidden_m = depth_m(true).expect("a walker");
        assert!((hidden_m - whole_m).abs() < 0.05, "{hidden_m} {whole_m}");
        assert!(depth_m(false).is_none_or(|cut_m| cut_m > whole_m + 0.3), "nobody hid them");
    }

    #[test]
    fn frames_that_last_long_enough_start_an_oblique_path() {
        let oblique = Path { heading_rad: 0.8, ..PATH };
        for (frame_s, heading_rad, tolerance_rad) in [(0.04, 0.0, 1e-9), (0.14, 0.8, 0.15)] {
            let started = begun(seen_along(&oblique, &walker(), 1.2, 13, frame_s)).expect("a walker");
            let off_rad = (started.start.path.heading_rad - heading_rad).abs();
            assert!(off_rad <= tolerance_rad, "{frame_s} {}", started.start.path.heading_rad);
        }
    }

    #[test]
    fn who_crouches_or_takes_short_steps_starts_with_that_gait() {
        let half = GaitStyle { leg_amplitude: 0.5, arm_amplitude: 0.5, ..GaitStyle::default() };
        for (style, speed_mps, expected) in [
            (GaitStyle::default(), 1.3, GaitStyle::default()),
            (GaitStyle::CROUCHED, 1.3, GaitStyle::CROUCHED),
            (half, 0.8, GaitStyle::SHORT_STEPS),
        ] {
            let seen = seen_of(&Walker { style, ..walker() }, speed_mps);
            let started = begun_with(seen.clone(), Some(FitOptions::default())).expect("a walker");
            assert_eq!(started.walk.walker.style, expected, "{style:?}");
            // Without the fit that measures another gait, everybody is taken to walk like the average.
            let plain = begun(seen).map(|started| started.walk.walker.style);
            assert!(plain.is_none_or(|style| style == GaitStyle::default()));
        }
    }

    #[test]
    fn nobody_walks_slower_than_a_quarter_metre_a_second_or_faster_than_three() {
        for (speed_mps, walks) in [(0.2, false), (0.3, true), (2.9, true), (3.2, false)] {
            assert_eq!(begun(seen_walking(speed_mps)).is_some(), walks, "{speed_mps} m/s");
        }
    }

    #[test]
    fn a_newcomer_is_large_beside_the_followed_person_and_was_never_refused() {
        let newcomer = || Candidate { seen: seen_walking(1.3), ..Candidate::default() };
        let body = newcomer().last_rectangle().unwrap();
        let grown = |share: f64| {
            let height = (body.height() as f64 / share) as usize;
            Rectangle { top: 0, bottom: height, ..body }
        };
        assert!(newcomer().is_newcomer(&body) && newcomer().is_newcomer(&grown(0.4)));
        assert!(!newcomer().is_newcomer(&grown(0.3)), "perhaps a part of the person");
        let beside = Rectangle { left: body.right + 10, right: body.right + 60, ..body };
        assert!(!newcomer().is_newcomer(&beside), "elsewhere");
        assert!(!Candidate { missed: 1, ..newcomer() }.is_newcomer(&body), "not seen any more");
        let mut refused = newcomer();
        refused.refuse(&TrackerOptions::default());
        assert!(!refused.is_newcomer(&body));
    }

    #[test]
    fn a_start_fails_by_its_height_if_the_rectangles_show_another_one() {
        let shown = |height_m| Some(BodyHeight { sd_m: 0.05, ..BodyHeight::given(height_m) });
        let given = BodyHeight::given(1.5);
        assert_eq!(by_height(Reason::NotWalking, &given, shown(1.65)), Reason::OtherHeight { shown_m: 1.65 });
        assert_eq!(by_height(Reason::WrongSize, &given, shown(1.3)), Reason::OtherHeight { shown_m: 1.3 });
        assert_eq!(by_height(Reason::NotWalking, &given, shown(1.55)), Reason::NotWalking);
        assert_eq!(by_height(Reason::NotWalking, &given, None), Reason::NotWalking);
        let slow = Reason::TooSlow { speed_mps: 0.1 };
        assert_eq!(by_height(slow, &given, shown(1.65)), slow);
    }

    /// After a refused start, the next one has the latest frames and, once they show a path, the older ones too.
    #[test]
    fn frames_of_a_refused_start_are_kept_for_an_oblique_one() {
        let options = TrackerOptions::default();
        let seen = seen_along(&PATH, &walker(), 1.2, 60, 0.04);
        let mut candidate = Candidate::default();
        let (mut starts, mut paths) = (Vec::new(), Vec::new());
        for seen in seen {
            let frame = seen.edges.frame;
            candidate.add(seen);
            if !candidate.can_start(options.start_frames) {
                continue;
            }
            let older = candidate.set_aside(options.start_frames);
            assert_eq!((candidate.seen.len(), candidate.seen[12].edges.frame), (13, frame));
            starts.push(frame);
            if candidate.with_older(older, &options) {
                assert_eq!(candidate.seen.len(), options.path_frames);
                paths.push(frame);
            }
            let frames: Vec<usize> = candidate.seen.iter().map(|seen| seen.edges.frame).collect();
            let last = (frame + 1 - frames.len()..=frame).collect::<Vec<_>>();
            assert_eq!(frames, last, "none twice and none missing");
            candidate.refuse(&options);
        }
        assert_eq!(starts, (0..12).map(|k| 12 + 4 * k).collect::<Vec<_>>());
        assert_eq!(paths, [40, 52]);
    }

    /// At 7 frames per second, 13 frames last long enough for a path, so no others are needed.
    #[test]
    fn frames_that_show_a_path_need_no_older_ones() {
        let options = TrackerOptions::default();
        let mut candidate =
            Candidate { seen: seen_along(&PATH, &walker(), 1.2, 17, 0.14), ..Candidate::default() };
        let older = candidate.set_aside(13);
        assert!(!candidate.with_older(older, &options) && candidate.seen.len() == 13);
    }

    #[test]
    fn what_has_no_legs_or_feet_is_not_started() {
        // Two upright lines that slide along fit all phases equally.
        let mut slides = seen_walking(1.3);
        for seen in &mut slides {
            let r = seen.sighting.rectangle;
            let upright = |x: usize| EdgeLine {
                start: [x as f32, r.top as f32],
                end: [x as f32, r.bottom as f32],
                gradient: 20.0,
                velocity: 0.0,
            };
            seen.edges.edges = vec![upright(r.left + 20), upright(r.right - 20)];
        }
        assert!(begun(slides).is_none());
        let mut cut_off = seen_walking(1.3);
        cut_off[..3].iter_mut().for_each(|seen| seen.sighting.rectangle.bottom = 479);
        let reflected = {
            let mut seen = seen_walking(1.3);
            seen[..2].iter_mut().for_each(|seen| seen.sighting.rectangle.bottom = 479);
            seen
        };
        assert!(
            begun(cut_off).is_none() && begun(reflected).is_some(),
            "most feet below the picture, or few"
        );
    }
}
