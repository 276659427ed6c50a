//! How a person deviates from the average, found from the walk itself.
//!
//! Rohr's conclusion (section 7) proposes to continue with adaptively estimated motion curves and additional
//! parameters for the body. Average curves are off by up to 9 degrees at the hip and 12 at the knee for some
//! people, and table proportions by several centimetres at shoulder and hip; both drag the position along.
//! Four constants are fitted by similarity over many frames: offsets of hip and knee angle, heights of
//! shoulder and hip joints.
//!
//! Similarity also rises a little for wrong constants (up to 9 % on an average-like walker, 15 % and more on
//! ones who really deviate), so the fit is kept only when it gains more than [`PersonOptions::min_gain`];
//! else the person counts as average.

use super::score::SimilarityOptions;
use super::search::{Axis, Grid, HiddenLines, Hypothesis, PHASE_STEP, POSITION_STEP_M, Path, Scene, search};
use super::walk::FrameEdges;
use crate::model::{Camera, Walker};
use rayon::prelude::*;

/// Options of the fit.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PersonOptions {
    /// Standard deviation over people of the angle offsets, radians: 10 degrees.
    pub angle_sd_rad: f64,
    /// Standard deviation over people of shoulder and hip height, fractions of body height.
    pub height_sd: f64,
    /// Relative loss of similarity that one standard deviation costs. 0.01 holds back what the frames do not
    /// show.
    pub loss_per_sd: f64,
    /// Relative gain of similarity below which the person counts as average.
    pub min_gain: f64,
    /// Standard deviation of the distance that rectangles give, metres.
    pub distance_sd_m: f64,
    /// Frames looked at, evenly chosen.
    pub frames: usize,
}

impl Default for PersonOptions {
    fn default() -> Self {
        Self {
            angle_sd_rad: 10f64.to_radians(),
            height_sd: 0.03,
            loss_per_sd: 0.01,
            min_gain: 0.12,
            distance_sd_m: 0.2,
            frames: 16,
        }
    }
}

/// The fitted constants: deviations from the average.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Deviation {
    /// Added to the hip curve, radians.
    pub hip_rad: f64,
    /// Added to the knee curve, radians.
    pub knee_rad: f64,
    /// Added to the height of the shoulder joints, fraction of body height.
    pub shoulder_height: f64,
    /// Added to the height of the hip joints, fraction of body height; the knees move with them.
    pub hip_height: f64,
}

impl Deviation {
    /// An average walker made into this person.
    pub fn apply(&self, average: &Walker) -> Walker {
        let mut walker = average.clone();
        walker.style.hip_offset += self.hip_rad;
        walker.style.knee_offset += self.knee_rad;
        let p = &mut walker.body.proportions;
        let leg = |hip: f64| hip - p.ankle_height;
        let stretch = leg(p.hip_height + self.hip_height) / leg(p.hip_height);
        p.knee_height = p.ankle_height + stretch * (p.knee_height - p.ankle_height);
        p.hip_height += self.hip_height;
        p.shoulder_height += self.shoulder_height;
        walker
    }

    /// Moved along a direction of the four constants.
    fn moved(&self, direction: &[f64; 4], by: f64) -> Self {
        Self {
            hip_rad: self.hip_rad + by * direction[0],
            knee_rad: self.knee_rad + by * direction[1],
            shoulder_height: self.shoulder_height + by * direction[2],
            hip_height: self.hip_height + by * direction[3],
        }
    }
}

/// What the fit found, kept or not.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PersonFit {
    /// The best deviation.
    pub deviation: Deviation,
    /// Mean similarity of the average walker.
    pub similarity_before: f64,
    /// Mean similarity with the deviation.
    pub similarity_after: f64,
    /// Whether the gain suffices to believe it.
    pub is_believed: bool,
}

/// Fits a person's deviation to frames with approximately known hypotheses.
pub fn fit_person(
    frames: &[(&FrameEdges, Hypothesis)],
    average: &Walker,
    camera: &Camera,
    path: &Path,
    similarity: &SimilarityOptions,
    options: &PersonOptions,
) -> PersonFit {
    let mean = |deviation: &Deviation| {
        let walker = deviation.apply(average);
        let scene = Scene { walker: &walker, camera, path };
        mean_similarity(&scene, frames.iter().copied(), similarity, options.frames)
    };
    let held_back = |d: &Deviation| mean(d) * (1.0 - options.loss_per_sd * sd_sq(d, options));
    let mut best = (held_back(&Deviation::default()), Deviation::default());
    for level in [1.0, 0.5, 0.25] {
        best = climb(best, level, &held_back);
    }
    let (similarity_before, similarity_after) = (mean(&Deviation::default()), mean(&best.1));
    let is_believed = similarity_after > similarity_before * (1.0 + options.min_gain);
    PersonFit { deviation: best.1, similarity_before, similarity_after, is_believed }
}

/// A path moved towards or away from the camera.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Distance {
    /// The moved path.
    pub path: Path,
    /// New distance from the camera over the old one.
    pub factor: f64,
    /// Place on the path nearest to the camera, metres.
    along_camera_m: f64,
    /// Height of the camera, metres.
    camera_height_m: f64,
}

impl Distance {
    /// The path of a scene moved `by_m` away from the camera, heading kept.
    fn new(scene: &Scene<'_>, by_m: f64) -> Self {
        let camera = scene.camera.position();
        let along_camera_m = scene.path.along(camera.truncate());
        let nearest = scene.path.point(along_camera_m, 0.0).truncate();
        let away = nearest - camera.truncate();
        let factor = 1.0 + by_m / away.length();
        let path = Path { origin: scene.path.origin + away * (factor - 1.0), ..*scene.path };
        Self { path, factor, along_camera_m, camera_height_m: camera.z }
    }

    /// The place on the moved path that is seen in the same direction.
    pub fn along(&self, along_m: f64) -> f64 {
        self.along_camera_m + self.factor * (along_m - self.along_camera_m)
    }

    /// The hypothesis on the moved path that is seen at the same place in the image.
    fn moved(&self, h: &Hypothesis) -> Hypothesis {
        let height_m = self.camera_height_m + self.factor * (h.height_m - self.camera_height_m);
        Hypothesis { along_m: self.along(h.along_m), height_m, phase: h.phase }
    }
}

/// Fits the distance of the path from the camera, held to the rectangles' by their standard deviation.
pub fn fit_distance(
    frames: &[(&FrameEdges, Hypothesis)],
    scene: &Scene<'_>,
    similarity: &SimilarityOptions,
    options: &PersonOptions,
) -> Distance {
    let held_back = |by_m: f64| {
        let distance = Distance::new(scene, by_m);
        let moved = Scene { path: &distance.path, ..*scene };
        let frames = frames.iter().map(|(edges, h)| (*edges, distance.moved(h)));
        let mean = mean_similarity(&moved, frames, similarity, options.frames);
        mean * (1.0 - options.loss_per_sd * (by_m / options.distance_sd_m).powi(2))
    };
    let mut best = (held_back(0.0), 0.0);
    for step in [0.1, 0.05, 0.025, 0.0125] {
        for _ in 0..6 {
            let next = [best.1 - step, best.1 + step].map(|by| (held_back(by), by));
            let better = if next[1].0 > next[0].0 { next[1] } else { next[0] };
            if better.0 <= best.0 {
                break;
            }
            best = better;
        }
    }
    Distance::new(scene, best.1)
}

/// Mean over evenly chosen frames of the best similarity near each frame's hypothesis.
fn mean_similarity<'a>(
    scene: &Scene<'_>,
    frames: impl ExactSizeIterator<Item = (&'a FrameEdges, Hypothesis)>,
    similarity: &SimilarityOptions,
    count: usize,
) -> f64 {
    let stride = frames.len().div_ceil(count.max(1)).max(1);
    let best = |(edges, around): (&FrameEdges, Hypothesis)| {
        f64::from(
            search(&edges.edges, scene, &near(&around), similarity, HiddenLines::PerColumn).best_score(),
        )
    };
    let chosen: Vec<_> = frames.step_by(stride).collect();
    let scores: Vec<f64> = chosen.into_par_iter().map(best).collect();
    scores.iter().sum::<f64>() / scores.len().max(1) as f64
}

/// Squared distance from the average in standard deviations.
fn sd_sq(d: &Deviation, options: &PersonOptions) -> f64 {
    let angles = (d.hip_rad.powi(2) + d.knee_rad.powi(2)) / options.angle_sd_rad.powi(2);
    angles + (d.shoulder_height.powi(2) + d.hip_height.powi(2)) / options.height_sd.powi(2)
}

/// Directions of the search with the steps of the coarsest level: 4 degrees, 2 % of body height. Hip and knee
/// are also moved together, as a person's thigh hides in the pair, and shoulder and hip, as the trunk slides
/// along the body.
const DIRECTIONS: [[f64; 4]; 6] = [
    [0.07, 0.0, 0.0, 0.0],
    [0.0, 0.07, 0.0, 0.0],
    [0.07, 0.07, 0.0, 0.0],
    [0.0, 0.0, 0.02, 0.0],
    [0.0, 0.0, 0.0, 0.02],
    [0.0, 0.0, 0.02, 0.02],
];

/// Moves along one direction at a time while that improves.
fn climb(mut best: (f64, Deviation), level: f64, value: &impl Fn(&Deviation) -> f64) -> (f64, Deviation) {
    for _ in 0..6 {
        let before = best.0;
        for direction in &DIRECTIONS {
            for by in [-level, level] {
                let next = best.1.moved(direction, by);
                let gained = value(&next);
                if gained > best.0 {
                    best = (gained, next);
                    break;
                }
            }
        }
        if best.0 <= before {
            break;
        }
    }
    best
}

/// A small grid around a hypothesis: the position gives way a little when the body changes.
fn near(around: &Hypothesis) -> Grid {
    Grid {
        along: Axis::around(around.along_m, 3.0 * POSITION_STEP_M, POSITION_STEP_M),
        height: Axis::around(around.height_m, 3.0 * POSITION_STEP_M, POSITION_STEP_M),
        phase: Axis::around(around.phase, 2.0 * PHASE_STEP, PHASE_STEP),
    }
}
