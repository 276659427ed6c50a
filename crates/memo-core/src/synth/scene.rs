//! A walker before a wall, drawn from the 2.5D description of the model, with everything known.
//!
//! The person is the model itself (the paper's synthetic sequence, Figs. 23, 26 and 27, is of this kind):
//! what tracking reaches here is bounded by the method alone, not by how people differ from the average.
//! Frames are drawn one by one and in any order; the same seed gives the same pixels.

use super::random::Random;
use crate::image::{Image, Window};
use crate::model::surface::{NO_PART, SurfaceMap, surface_map};
use crate::model::{Body, Camera, Gait, GaitStyle, PosedBody, Walker};
use crate::track::search::{Hypothesis, Path, Scene};
use glam::{DVec2, DVec3, Vec3};
use std::f64::consts::TAU;
use thiserror::Error;

/// Longest side of a frame, pixels: a scene holds its background.
const MOST_SIDE_PX: u32 = 16_384;

/// Why a scene cannot be drawn.
#[derive(Debug, Clone, Copy, PartialEq, Error)]
#[non_exhaustive]
pub enum SceneError {
    /// A frame has no pixels, or too many.
    #[error("frames must have sides of 1 to {MOST_SIDE_PX} pixels, got {}x{}", size[0], size[1])]
    Size {
        /// Width and height, pixels.
        size: [u32; 2],
    },
    /// An option makes no sense.
    #[error("{name} must be {wanted}, got {got}")]
    Option {
        /// Its name.
        name: &'static str,
        /// What is accepted.
        wanted: &'static str,
        /// What was given.
        got: f64,
    },
}

/// What is drawn.
#[derive(Debug, Clone, PartialEq)]
pub struct SceneOptions {
    /// Everything not fixed here follows from the seed.
    pub seed: u64,
    /// Number of frames.
    pub frames: usize,
    /// Frames before the walker is there.
    pub empty_frames: usize,
    /// Frames a second, 1 to 10,000. 25, as in the paper.
    pub rate_hz: f64,
    /// Width and height, pixels.
    pub size: [u32; 2],
    /// Standard deviation of the sensor noise, grey levels, 0 to 255.
    pub noise_sd: f32,
    /// Whether the walker goes to the left; `None` lets the seed decide.
    pub leftward: Option<bool>,
    /// By how much of a cycle the left heel strikes late, -0.1 to 0.1: the left step takes 0.5 + this of the
    /// cycle, the right one the rest, at constant speed. 0, the symmetric gait.
    pub late_left: f64,
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
        }
    }
}

impl SceneOptions {
    fn check(&self) -> Result<(), SceneError> {
        if !self.size.iter().all(|side| (1..=MOST_SIDE_PX).contains(side)) {
            return Err(SceneError::Size { size: self.size });
        }
        let noise_sd = f64::from(self.noise_sd);
        for (name, got, range, wanted) in [
            ("rate_hz", self.rate_hz, 1.0..=1e4, "1 to 10000 frames a second"),
            ("noise_sd", noise_sd, 0.0..=255.0, "0 to 255 grey levels"),
            ("late_left", self.late_left, -0.1..=0.1, "-0.1 to 0.1 of a cycle"),
        ] {
            if !range.contains(&got) {
                return Err(SceneError::Option { name, wanted, got });
            }
        }
        Ok(())
    }
}

/// The truth of one frame with a walker.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Truth {
    /// Number of the frame.
    pub frame: usize,
    /// Time, seconds.
    pub time_s: f64,
    /// Place, level height and phase.
    pub hypothesis: Hypothesis,
    /// The body as posed: torso centre, joints and cylinders.
    pub posed: PosedBody,
}

/// A scene: camera, walker, path, and frames on demand.
#[derive(Debug, Clone)]
pub struct SynthScene {
    /// The camera.
    pub camera: Camera,
    /// The walker.
    pub walker: Walker,
    /// The line walked.
    pub path: Path,
    /// Speed, metres a second.
    pub speed_mps: f64,
    /// Gait cycles a second.
    pub cycle_hz: f64,
    options: SceneOptions,
    start: Hypothesis,
    background: Image<f32>,
    /// Grey level of each part.
    grey: [f32; 14],
}

impl SynthScene {
    /// Draws lots for everything the options leave open.
    ///
    /// # Errors
    ///
    /// A size, a rate, a noise or a lateness that cannot be drawn.
    pub fn new(options: SceneOptions) -> Result<Self, SceneError> {
        options.check()?;
        let mut random = Random::new(options.seed);
        let height_m = random.uniform(1.6, 1.9);
        let body = Body::from_height(height_m).expect("heights between 1.6 and 1.9 m are plausible");
        let walker = Walker { body, gait: Gait::dense(), style: GaitStyle::default() };
        let camera = Camera::level(options.size, 0.9, random.uniform(0.9, 1.5), random.uniform(5.5, 7.0))
            .expect("a level camera about 1.2 m above the ground is valid");
        let drawn_left = random.uniform(0.0, 1.0) < 0.5;
        let heading_rad = if options.leftward.unwrap_or(drawn_left) { std::f64::consts::PI } else { 0.0 };
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
        let path = Path { origin: DVec2::ZERO, heading_rad };
        Ok(Self { camera, walker, path, speed_mps, cycle_hz, options, start, background, grey })
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

    /// The truth of a frame, `None` before the walker is there.
    pub fn truth(&self, frame: usize) -> Option<Truth> {
        if frame < self.options.empty_frames {
            return None;
        }
        let time_s = self.time_s(frame);
        let hypothesis = Hypothesis {
            along_m: self.start.along_m + self.speed_mps * time_s,
            height_m: self.start.height_m,
            phase: self.phase(self.start.phase + self.cycle_hz * time_s),
        };
        let scene = Scene { walker: &self.walker, camera: &self.camera, path: &self.path };
        Some(Truth { frame, time_s, hypothesis, posed: scene.pose(&hypothesis) })
    }

    /// The gait phase after a number of cycles walked. phi(u) = u + c (cos 2 pi u - 1), which is 0 at 0, and 1/2
    /// at u = 1/2 + late_left for c = late_left / (1 + cos 2 pi late_left).
    fn phase(&self, cycles: f64) -> f64 {
        let late = self.options.late_left;
        let c = late / (1.0 + (TAU * late).cos());
        (cycles + c * ((TAU * cycles).cos() - 1.0)).rem_euclid(1.0)
    }

    /// The grey frame.
    pub fn frame(&self, frame: usize) -> Image<u8> {
        let mut levels = self.background.clone();
        if let Some(truth) = self.truth(frame) {
            self.draw(&truth.posed, &mut levels);
        }
        let mut random = Random::new(
            self.options.seed ^ (frame as u64).wrapping_add(1).wrapping_mul(0x9E37_79B9_7F4A_7C15),
        );
        let mut grey = Image::filled(levels.width(), levels.height(), 0u8);
        for (out, level) in grey.pixels_mut().chunks_mut(2).zip(levels.pixels().chunks(2)) {
            let noise = random.normal_pair();
            for ((out, level), noise) in out.iter_mut().zip(level).zip(noise) {
                *out = (level + self.options.noise_sd * noise).round().clamp(0.0, 255.0) as u8;
            }
        }
        grey
    }

    /// Draws the body with 2x2 samples a pixel.
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

    /// Lambert shading of a sample, `None` where no part is seen.
    fn sample(&self, map: &SurfaceMap, x: usize, y: usize) -> Option<f32> {
        if x >= map.window.width || y >= map.window.height || map.part.at(x, y) == NO_PART {
            return None;
        }
        let light = Vec3::new(-0.4, -0.75, -0.53);
        let lit = Vec3::from(map.normal.at(x, y)).dot(light).max(0.0);
        Some(self.grey[map.part.at(x, y) as usize] * (0.7 + 0.3 * lit))
    }
}

/// Stride length at which the stance foot does not slide: the ankle's way back in the body over mid-stance.
pub(super) fn stride_length_m(walker: &Walker) -> f64 {
    let ankle = |phase: f64| walker.pose(DVec3::ZERO, 0.0, phase).right.ankle.x;
    (ankle(0.1) - ankle(0.4)) / 0.3
}

/// Skin light, shirt and trousers apart from each other and from the wall (150 to 180).
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

/// Smooth random texture on a wall 2 m behind the walk and on the floor before it.
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
