//! A walker in front of a wall, rendered from the 2½-D description of the model, with complete ground truth.
//!
//! The person is the model itself (the paper's synthetic sequence, Figs. 23, 26 and 27, is of this kind), so
//! tracking errors here are those of the method alone, not of the differences between people and the average.
//! If such differences are needed, [`SceneOptions::uneven`] lets steps differ from each other and the feet
//! differ between the sides. Frames are rendered one by one and in any order; the same seed gives the same
//! pixels.

use super::random::Random;
use crate::OptionError;
use crate::image::{Image, Window};
use crate::model::body::Part;
use crate::model::surface::{NO_PART, SurfaceMap, surface_map};
use crate::model::{Body, Camera, Gait, GaitStyle, PosedBody, Walker};
use crate::track::search::{Hypothesis, Path, Scene};
use glam::{DVec2, DVec3, Vec3};
use std::f64::consts::TAU;
use thiserror::Error;

/// Longest side of a frame, pixels: a scene stores its background.
const MOST_SIDE_PX: u32 = 16_384;

/// Why a scene was not made.
#[derive(Debug, Clone, Copy, PartialEq, Error)]
#[non_exhaustive]
pub enum SceneError {
    /// A frame has no pixels, or too many.
    #[error("frames must have sides of 1 to {MOST_SIDE_PX} pixels, got {}x{}", size[0], size[1])]
    Size {
        /// Width and height, pixels.
        size: [u32; 2],
    },
    /// An option is outside its range.
    #[error(transparent)]
    Option(#[from] OptionError),
}

/// Largest number of steps drawn separately, some fifteen hours; later steps equal the last one.
const MOST_STEPS: usize = 100_000;
/// Correlation between duration and length of a step: on four motion-captured walks (11 degrees of freedom)
/// durations vary by 3.3 %, lengths by 3.6 % and their ratio by 3.4 %.
const LONGER_WITH_TIME: f64 = 0.5;

/// How steps differ from the average step of the same walker.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Uneven {
    /// Standard deviation of the duration of a step, as a fraction of the average, 0 to 0.2.
    pub step_time_sd: f64,
    /// Standard deviation of the distance the trunk travels in a step, as a fraction of the average, 0 to
    /// 0.2.
    pub step_length_sd: f64,
    /// How much farther ahead of the trunk the right foot lands than the left, metres, -0.2 to 0.2.
    pub right_reach_m: f64,
}

/// Options of a scene.
#[derive(Debug, Clone, PartialEq)]
pub struct SceneOptions {
    /// Seed; determines everything that is not fixed by the other options.
    pub seed: u64,
    /// Number of frames.
    pub frames: usize,
    /// Number of frames before the walker appears.
    pub empty_frames: usize,
    /// Frames per second, 1 to 10,000. Default 25, as in the paper.
    pub rate_hz: f64,
    /// Width and height, pixels.
    pub size: [u32; 2],
    /// Standard deviation of the sensor noise, grey levels, 0 to 255.
    pub noise_sd: f32,
    /// Whether the walker goes to the left; `None` means that the seed decides.
    pub leftward: Option<bool>,
    /// Delay of the left heel strike, as a fraction of the cycle, -0.1 to 0.1: the left step takes 0.5 plus
    /// this fraction of the cycle, the right step the rest, at constant speed. Default 0, the symmetric gait.
    pub late_left: f64,
    /// How the steps differ. By default they are all equal.
    pub uneven: Uneven,
    /// Angle of the path out of the image plane, radians, -1 to 1. Default 0.
    pub slant_rad: f64,
    /// Horizontal field of view, radians, 0.2 to 2. The distance of the camera is such that the walker has
    /// the same size in the image. Default 0.9.
    pub field_of_view_rad: f64,
}

impl Default for SceneOptions {
    fn default() -> Self {
        Self {
            seed: 0,
            frames: 80,
            empty_frames: 4,
            rate_hz: 25.0,
            size: [640, 480],
            noise_sd: 5.0,
            leftward: None,
            late_left: 0.0,
            uneven: Uneven::default(),
            slant_rad: 0.0,
            field_of_view_rad: 0.9,
        }
    }
}

impl SceneOptions {
    fn check(&self) -> Result<(), SceneError> {
        check_size(self.size)?;
        check_ranges(&[
            ("rate_hz", self.rate_hz, 1.0..=1e4, "1 to 10000 frames a second"),
            ("noise_sd", f64::from(self.noise_sd), 0.0..=255.0, "0 to 255 grey levels"),
            ("late_left", self.late_left, -0.1..=0.1, "-0.1 to 0.1 of a cycle"),
            ("step_time_sd", self.uneven.step_time_sd, 0.0..=0.2, "0 to 0.2 of a step"),
            ("step_length_sd", self.uneven.step_length_sd, 0.0..=0.2, "0 to 0.2 of a step"),
            ("right_reach_m", self.uneven.right_reach_m, -0.2..=0.2, "-0.2 to 0.2 m"),
            ("slant_rad", self.slant_rad, -1.0..=1.0, "-1 to 1 rad"),
            ("field_of_view_rad", self.field_of_view_rad, 0.2..=2.0, "0.2 to 2 rad"),
        ])
    }
}

pub(super) fn check_size(size: [u32; 2]) -> Result<(), SceneError> {
    let is_drawn = size.iter().all(|side| (1..=MOST_SIDE_PX).contains(side));
    if is_drawn { Ok(()) } else { Err(SceneError::Size { size }) }
}

/// An option with its value, its allowed range, and that range in words.
pub(super) type Ranged = (&'static str, f64, std::ops::RangeInclusive<f64>, &'static str);

pub(super) fn check_ranges(options: &[Ranged]) -> Result<(), SceneError> {
    for (name, got, range, wanted) in options {
        OptionError::unless(range.contains(got), name, wanted, *got)?;
    }
    Ok(())
}

/// The ground truth of one frame with a walker.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Truth {
    /// Number of the frame.
    pub frame: usize,
    /// Time, seconds.
    pub time_s: f64,
    /// Position along the path, level height and gait phase.
    pub hypothesis: Hypothesis,
    /// The body as posed: torso centre, joints and cylinders.
    pub posed: PosedBody,
}

/// A scene: camera, walker and path, with frames on demand.
///
/// The fields are to be read. The wall, the start and the steps were made from them and do not follow if one is changed:
/// another view is a scene of other [`SceneOptions`], another body that of [`SynthScene::with_walker`].
#[derive(Debug, Clone)]
pub struct SynthScene {
    /// The camera.
    pub camera: Camera,
    /// The walker.
    pub walker: Walker,
    /// The path of the walk.
    pub path: Path,
    /// Speed, metres per second.
    pub speed_mps: f64,
    /// Gait cycles per second.
    pub cycle_hz: f64,
    options: SceneOptions,
    start: Hypothesis,
    steps: Vec<DrawnStep>,
    background: Image<f32>,
    /// Grey level of each part.
    grey: [f32; 14],
}

impl SynthScene {
    /// A scene in which the seed determines everything that the options leave open.
    ///
    /// # Errors
    ///
    /// A size or an option out of range.
    pub fn new(options: SceneOptions) -> Result<Self, SceneError> {
        options.check()?;
        let mut random = Random::new(options.seed);
        let height_m = random.uniform(1.6, 1.9);
        let body = Body::from_height(height_m).expect("heights between 1.6 and 1.9 m are plausible");
        let walker = Walker { body, gait: Gait::dense(), style: GaitStyle::default() };
        let farther = (0.5 * 0.9f64).tan() / (0.5 * options.field_of_view_rad).tan();
        let (camera_height_m, distance_m) = (random.uniform(0.9, 1.5), random.uniform(5.5, 7.0));
        let camera =
            Camera::level(options.size, options.field_of_view_rad, camera_height_m, farther * distance_m)
                .expect("a level camera about 1.2 m above the ground is valid");
        let drawn_left = random.uniform(0.0, 1.0) < 0.5;
        let across_rad = if options.leftward.unwrap_or(drawn_left) { std::f64::consts::PI } else { 0.0 };
        let speed_mps = random.uniform(1.1, 1.4);
        let walked_m = speed_mps * options.frames as f64 / options.rate_hz;
        let start = Hypothesis {
            along_m: -0.5 * walked_m,
            height_m: walker.level_torso_height_m(),
            phase: random.uniform(0.0, 1.0),
        };
        let cycle_hz = speed_mps / stride_length_m(&walker);
        let grey = part_greys(&mut random);
        let background = wall_and_floor(&camera, &mut random);
        let path = Path { origin: DVec2::ZERO, heading_rad: across_rad + options.slant_rad };
        let steps = drawn_steps(&options, start.phase, cycle_hz, speed_mps);
        Ok(Self { camera, walker, path, speed_mps, cycle_hz, options, start, steps, background, grey })
    }

    /// The same scene with another walker, who has the same speed and whose trunk height and stride follow
    /// from body and style.
    ///
    /// # Errors
    ///
    /// A body and style whose feet hardly move: strides of less than 0.1 m.
    pub fn with_walker(mut self, walker: Walker) -> Result<Self, SceneError> {
        let stride_m = stride_length_m(&walker);
        let is_a_walk = (0.1..=10.0).contains(&stride_m);
        OptionError::unless(is_a_walk, "the walker's stride", "0.1 to 10 m", stride_m)?;
        self.cycle_hz = self.speed_mps / stride_m;
        self.start.height_m = walker.level_torso_height_m();
        self.steps = drawn_steps(&self.options, self.start.phase, self.cycle_hz, self.speed_mps);
        Ok(Self { walker, ..self })
    }

    /// Number of frames.
    pub fn len(&self) -> usize {
        self.options.frames
    }

    /// Whether the scene has no frame.
    pub fn is_empty(&self) -> bool {
        self.options.frames == 0
    }

    /// Time of a frame, seconds.
    pub fn time_s(&self, frame: usize) -> f64 {
        frame as f64 / self.options.rate_hz
    }

    /// The ground truth of a frame; `None` before the walker appears.
    pub fn truth(&self, frame: usize) -> Option<Truth> {
        if frame < self.options.empty_frames {
            return None;
        }
        let time_s = self.time_s(frame);
        let (cycles, walked_m) = self.walked(time_s);
        let hypothesis = Hypothesis {
            along_m: self.start.along_m + walked_m,
            height_m: self.start.height_m,
            phase: self.phase(cycles),
        };
        Some(Truth { frame, time_s, hypothesis, posed: self.posed(&hypothesis) })
    }

    /// Cycles and distance walked until a time, linear within a step.
    fn walked(&self, time_s: f64) -> (f64, f64) {
        let step = self.steps[self.steps.partition_point(|step| step.time_s <= time_s).max(1) - 1];
        let since_s = time_s - step.time_s;
        (
            step.cycles + since_s * 0.5 / step.duration_s,
            step.along_m + since_s * step.length_m / step.duration_s,
        )
    }

    /// The posed body. A foot that lands farther ahead swings about a hip angle with a constant offset.
    fn posed(&self, hypothesis: &Hypothesis) -> PosedBody {
        let scene = Scene::new(&self.walker, &self.camera, &self.path);
        let sizes = &self.walker.body.proportions;
        let leg_m = (sizes.hip_height - sizes.ankle_height) * self.walker.body.height_m;
        let turn_rad = 0.5 * self.options.uneven.right_reach_m / leg_m;
        if turn_rad == 0.0 {
            return scene.pose(hypothesis);
        }
        let [mut posed, left] = [turn_rad, -turn_rad].map(|turn_rad| {
            let mut walker = self.walker.clone();
            walker.style.hip_offset += turn_rad;
            Scene { walker: &walker, ..scene }.pose(hypothesis)
        });
        posed.left = left.left;
        let left_leg = Part::LeftThigh as usize;
        posed.cylinders[left_leg..].copy_from_slice(&left.cylinders[left_leg..]);
        posed
    }

    /// The gait phase after a number of cycles walked. phi(u) = u + c (cos 2 pi u - 1), which is 0 at 0, and 1/2
    /// at u = 1/2 + late_left for c = late_left / (1 + cos 2 pi late_left).
    fn phase(&self, cycles: f64) -> f64 {
        let late = self.options.late_left;
        let c = late / (1.0 + (TAU * late).cos());
        (cycles + c * ((TAU * cycles).cos() - 1.0)).rem_euclid(1.0)
    }

    /// The rendered grey frame.
    pub fn frame(&self, frame: usize) -> Image<u8> {
        self.frame_of(frame, self.truth(frame).map(|truth| truth.posed).as_ref())
    }

    /// The frame with another body, or without one.
    pub(crate) fn frame_of(&self, frame: usize, posed: Option<&PosedBody>) -> Image<u8> {
        let mut levels = self.background.clone();
        if let Some(posed) = posed {
            self.draw(posed, &mut levels);
        }
        let random = Random::new(
            self.options.seed ^ (frame as u64).wrapping_add(1).wrapping_mul(0x9E37_79B9_7F4A_7C15),
        );
        with_noise(&levels, self.options.noise_sd, random)
    }

    /// Renders the body with 2x2 samples per pixel.
    fn draw(&self, posed: &PosedBody, levels: &mut Image<f32>) {
        let fine = self.camera.scaled(2.0).expect("doubling a valid camera keeps it valid");
        let Some(window) = window_of(posed, &fine) else { return };
        let map = surface_map(&posed.cylinders, &fine, Some(window)).expect("fourteen parts fit into a byte");
        let window = map.window;
        for y in (0..window.height).step_by(2) {
            for x in (0..window.width).step_by(2) {
                let (column, row) = ((window.x + x) / 2, (window.y + y) / 2);
                let behind = levels.at(column, row);
                let samples = [(x, y), (x + 1, y), (x, y + 1), (x + 1, y + 1)];
                let sum: f32 =
                    samples.into_iter().map(|(x, y)| self.sample(&map, x, y).unwrap_or(behind)).sum();
                levels.set(column, row, 0.25 * sum);
            }
        }
    }

    /// Lambert shading of a sample; `None` where no part is visible.
    fn sample(&self, map: &SurfaceMap, x: usize, y: usize) -> Option<f32> {
        if x >= map.window.width || y >= map.window.height || map.part.at(x, y) == NO_PART {
            return None;
        }
        let light = Vec3::new(-0.4, -0.75, -0.53);
        let lit = Vec3::from(map.normal.at(x, y)).dot(light).max(0.0);
        Some(self.grey[map.part.at(x, y) as usize] * (0.7 + 0.3 * lit))
    }
}

/// Grey values with added sensor noise, rounded.
pub(super) fn with_noise(levels: &Image<f32>, noise_sd: f32, mut random: Random) -> Image<u8> {
    let mut grey = Image::filled(levels.width(), levels.height(), 0u8);
    for (out, level) in grey.pixels_mut().chunks_mut(2).zip(levels.pixels().chunks(2)) {
        let noise = random.normal_pair();
        for ((out, level), noise) in out.iter_mut().zip(level).zip(noise) {
            *out = (level + noise_sd * noise).round().clamp(0.0, 255.0) as u8;
        }
    }
    grey
}

/// A drawn step: its start, duration and length.
#[derive(Debug, Clone, Copy)]
struct DrawnStep {
    time_s: f64,
    /// Cycles and distance at its start.
    cycles: f64,
    along_m: f64,
    duration_s: f64,
    length_m: f64,
}

/// The steps of the whole scene, each half a cycle long; the first has already begun when the scene begins.
fn drawn_steps(options: &SceneOptions, phase0: f64, cycle_hz: f64, speed_mps: f64) -> Vec<DrawnStep> {
    let mut random = Random::new(options.seed ^ 0x5EED_0F57_E950);
    let Uneven { step_time_sd, step_length_sd, .. } = options.uneven;
    let (average_s, average_m) = (0.5 / cycle_hz, 0.5 * speed_mps / cycle_hz);
    let end_s = options.frames as f64 / options.rate_hz;
    // Deviations beyond three standard deviations do not occur in a walk.
    let share = |sd: f64, normal: f64| 1.0 + sd * normal.clamp(-3.0, 3.0);
    let mut steps: Vec<DrawnStep> = Vec::new();
    let mut cycles = (2.0 * phase0).floor() / 2.0;
    let (mut time_s, mut along_m) = (0.0, 0.0);
    while steps.is_empty() || (time_s < end_s && steps.len() < MOST_STEPS) {
        let [longer, own] = random.normal_pair().map(f64::from);
        let duration_s = average_s * share(step_time_sd, longer);
        let alike = LONGER_WITH_TIME * longer + (1.0 - LONGER_WITH_TIME.powi(2)).sqrt() * own;
        let length_m = average_m * share(step_length_sd, alike);
        if steps.is_empty() {
            let gone = 2.0 * (phase0 - cycles);
            (time_s, along_m) = (-gone * duration_s, -gone * length_m);
        }
        steps.push(DrawnStep { time_s, cycles, along_m, duration_s, length_m });
        (time_s, along_m, cycles) = (time_s + duration_s, along_m + length_m, cycles + 0.5);
    }
    steps
}

/// Stride length at which the stance foot does not slide: from the backward motion of the ankle relative to
/// the body over mid-stance.
pub(super) fn stride_length_m(walker: &Walker) -> f64 {
    let ankle = |phase: f64| walker.pose(DVec3::ZERO, 0.0, phase).right.ankle.x;
    (ankle(0.1) - ankle(0.4)) / 0.3
}

/// Grey levels: light skin; shirt and trousers different from each other and from the wall (150 to 180).
fn part_greys(random: &mut Random) -> [f32; 14] {
    let skin = random.uniform(205.0, 235.0) as f32;
    let shirt = random.uniform(70.0, 115.0) as f32;
    let trousers = random.uniform(25.0, 55.0) as f32;
    let shoes = random.uniform(10.0, 20.0) as f32;
    let arm = [shirt, skin, skin];
    let leg = [trousers, trousers, shoes];
    let mut grey = [skin; 14];
    grey[1] = shirt;
    grey[2..5].copy_from_slice(&arm);
    grey[5..8].copy_from_slice(&arm);
    grey[8..11].copy_from_slice(&leg);
    grey[11..14].copy_from_slice(&leg);
    grey
}

/// Smooth random texture on a wall 2 m behind the walk and on the floor in front of it.
fn wall_and_floor(camera: &Camera, random: &mut Random) -> Image<f32> {
    let [width, height] = camera.size.map(|side| side as usize);
    let foot = camera.project_ideal(DVec3::new(0.0, 2.0, 0.0)).map_or(height as f64, |p| p.y);
    let (columns, rows) = (width / 24 + 2, height / 24 + 2);
    let lattice: Vec<f32> = (0..columns * rows).map(|_| random.uniform(-12.0, 12.0) as f32).collect();
    let mut image = Image::filled(width, height, 0.0);
    for y in 0..height {
        let base = if (y as f64) < foot { 165.0 } else { 130.0 };
        for x in 0..width {
            let (i, j) = (x / 24, y / 24);
            let (s, t) = ((x % 24) as f32 / 24.0, (y % 24) as f32 / 24.0);
            let at = |i: usize, j: usize| lattice[j * columns + i];
            let top = at(i, j) * (1.0 - s) + at(i + 1, j) * s;
            let bottom = at(i, j + 1) * (1.0 - s) + at(i + 1, j + 1) * s;
            image.set(x, y, base + top * (1.0 - t) + bottom * t);
        }
    }
    image
}

/// The pixels that can show the body, starting at even columns and rows.
fn window_of(posed: &PosedBody, camera: &Camera) -> Option<Window> {
    let mut bounds = (DVec2::INFINITY, DVec2::NEG_INFINITY);
    for cylinder in &posed.cylinders {
        let reach = cylinder.half_length + cylinder.semi_axes.max_element();
        let centre = camera.camera_from_world(cylinder.centre());
        let pixel = camera.project_ideal(cylinder.centre())?;
        let radius = camera.focal_px * reach / (centre.z - reach);
        bounds = (bounds.0.min(pixel - radius), bounds.1.max(pixel + radius));
    }
    let size = DVec2::new(f64::from(camera.size[0]), f64::from(camera.size[1]));
    let low = bounds.0.max(DVec2::ZERO).min(size);
    let high = bounds.1.max(DVec2::ZERO).min(size);
    let even = |v: f64| v as usize / 2 * 2;
    let (x, y) = (even(low.x), even(low.y));
    let (width, height) = ((high.x - x as f64).ceil() as usize, (high.y - y as f64).ceil() as usize);
    (width > 0 && height > 0).then_some(Window { x, y, width, height })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn scene(options: SceneOptions) -> SynthScene {
        SynthScene::new(options).unwrap()
    }

    #[test]
    fn what_cannot_be_drawn_is_refused() {
        let refused = |options| SynthScene::new(options).unwrap_err().to_string();
        let base = SceneOptions::default;
        for size in [[0, 480], [640, 0], [u32::MAX, 1]] {
            assert!(refused(SceneOptions { size, ..base() }).contains(&format!("{}x{}", size[0], size[1])));
        }
        for rate_hz in [0.0, -25.0, f64::NAN, f64::INFINITY] {
            assert!(refused(SceneOptions { rate_hz, ..base() }).starts_with("rate_hz must be 1 to 10000"));
        }
        assert!(refused(SceneOptions { noise_sd: f32::NAN, ..base() }).ends_with("got NaN"));
        assert!(refused(SceneOptions { late_left: 0.5, ..base() }).ends_with("got 0.5"));
        let slanted = refused(SceneOptions { slant_rad: f64::NAN, ..SceneOptions::default() });
        assert_eq!(slanted, "slant_rad must be -1 to 1 rad, got NaN");
        let uneven = Uneven { step_time_sd: 0.5, ..Uneven::default() };
        let jumpy = refused(SceneOptions { uneven, ..SceneOptions::default() });
        assert_eq!(jumpy, "step_time_sd must be 0 to 0.2 of a step, got 0.5");
        let scene = SynthScene::new(SceneOptions::default()).unwrap();
        let mut still = scene.walker.clone();
        still.style.leg_amplitude = 0.0;
        let error = scene.with_walker(still).unwrap_err().to_string();
        assert!(error.starts_with("the walker's stride must be 0.1 to 10 m, got"), "{error}");
    }

    #[test]
    fn scenes_of_one_pixel_of_no_frames_and_beyond_the_last_frame_can_be_drawn() {
        for (size, frames) in [([1, 1], 80), ([1, 2000], 80), ([2000, 3], 0), ([9, 9], usize::MAX)] {
            let scene = scene(SceneOptions { size, frames, ..SceneOptions::default() });
            for frame in [0, 40, 10_000, usize::MAX] {
                let drawn = scene.frame(frame);
                assert_eq!([drawn.width() as u32, drawn.height() as u32], size);
            }
        }
    }

    #[test]
    fn a_seed_gives_the_same_pixels_in_any_order_and_seeds_differ() {
        let (a, b) = (scene(SceneOptions::default()), scene(SceneOptions::default()));
        let later = b.frame(20);
        assert_eq!(a.frame(5), b.frame(5));
        assert_eq!(a.frame(20), later);
        assert_ne!(a.frame(5), scene(SceneOptions { seed: 1, ..SceneOptions::default() }).frame(5));
    }

    #[test]
    fn without_noise_only_the_body_differs_from_the_empty_scene() {
        let scene = scene(SceneOptions { noise_sd: 0.0, ..SceneOptions::default() });
        let (empty, walked) = (scene.frame(0), scene.frame(30));
        let truth = scene.truth(30).unwrap();
        assert!(scene.truth(0).is_none());
        let map = surface_map(&truth.posed.cylinders, &scene.camera, None).unwrap();
        let (mut inside, mut missed) = (0, 0);
        for y in 0..empty.height() {
            for x in 0..empty.width() {
                let differs = empty.at(x, y) != walked.at(x, y);
                let near = (y.saturating_sub(1)..=(y + 1).min(empty.height() - 1)).any(|v| {
                    (x.saturating_sub(1)..=(x + 1).min(empty.width() - 1))
                        .any(|u| map.part.at(u, v) != NO_PART)
                });
                assert!(!differs || near, "pixel {x}, {y} changed away from the body");
                if map.part.at(x, y) != NO_PART {
                    inside += 1;
                    missed += usize::from(!differs);
                }
            }
        }
        assert!(inside > 3000 && missed * 50 < inside, "{missed} of {inside} body pixels look like the wall");
    }

    #[test]
    fn uneven_steps_are_as_uneven_as_asked_and_the_right_foot_lands_farther_ahead() {
        let uneven = Uneven { step_time_sd: 0.03, step_length_sd: 0.04, right_reach_m: 0.03 };
        let scene = scene(SceneOptions { frames: 40_000, uneven, ..SceneOptions::default() });
        let spread = |share: fn(&DrawnStep) -> f64, average: f64| {
            let sum_sq: f64 = scene.steps.iter().map(|s| (share(s) / average - 1.0).powi(2)).sum();
            (sum_sq / scene.steps.len() as f64).sqrt()
        };
        assert!((spread(|s| s.duration_s, 0.5 / scene.cycle_hz) - 0.03).abs() < 0.002);
        assert!((spread(|s| s.length_m, 0.5 * scene.speed_mps / scene.cycle_hz) - 0.04).abs() < 0.002);
        let last = scene.truth(scene.len() - 1).unwrap();
        let (walked_m, expected_m) =
            (last.hypothesis.along_m - scene.start.along_m, scene.speed_mps * last.time_s);
        assert!((walked_m / expected_m - 1.0).abs() < 0.005);
        let at = |phase| scene.posed(&Hypothesis { phase, ..scene.start });
        let reach = |posed: PosedBody, ankle: DVec3| {
            (ankle - posed.torso_centre).truncate().dot(scene.path.direction())
        };
        let (right, left) = (at(0.0), at(0.5));
        let farther_m = reach(right, right.right.ankle) - reach(left, left.left.ankle);
        assert!((farther_m - 0.03).abs() < 0.004, "{farther_m}");
        let (knee, ankle) = (left.left.knee, left.left.ankle);
        let shank = &left.cylinders[Part::LeftShank as usize];
        assert!((shank.centre() - 0.5 * (knee + ankle)).length() < 0.02, "drawn where the joints are");
    }

    #[test]
    fn the_noise_is_as_strong_as_asked() {
        let scene = scene(SceneOptions::default());
        let (a, b) = (scene.frame(0), scene.frame(1));
        let differences = a.pixels().iter().zip(b.pixels()).map(|(a, b)| f64::from(*a) - f64::from(*b));
        let variance = differences.map(|d| d * d).sum::<f64>() / a.pixels().len() as f64 / 2.0;
        assert!((variance.sqrt() - 5.0).abs() < 0.1, "{}", variance.sqrt());
    }

    #[test]
    fn the_walker_is_fully_visible_and_its_stance_foot_hardly_slides() {
        for seed in 0..20 {
            let scene = scene(SceneOptions { seed, ..SceneOptions::default() });
            let truths: Vec<Truth> = (4..80).filter_map(|k| scene.truth(k)).collect();
            for truth in &truths {
                for cylinder in &truth.posed.cylinders {
                    let pixel = scene.camera.project(cylinder.centre()).unwrap();
                    assert!((15.0..625.0).contains(&pixel.x) && (5.0..475.0).contains(&pixel.y), "{pixel}");
                }
            }
            let in_stance = |t: &&Truth| (0.12..0.38).contains(&t.hypothesis.phase);
            let stance: Vec<f64> = truths
                .iter()
                .skip_while(|t| in_stance(t))
                .skip_while(|t| !in_stance(t))
                .take_while(in_stance)
                .map(|t| t.posed.right.ankle.x)
                .collect();
            assert!(stance.len() >= 4);
            let slide = stance.iter().fold(f64::MIN, |a, b| a.max(*b))
                - stance.iter().fold(f64::MAX, |a, b| a.min(*b));
            assert!(slide < 0.08, "seed {seed}: the stance foot slides {slide} m");
        }
    }
}
