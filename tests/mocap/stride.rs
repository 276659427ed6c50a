//! Strides of recorded walks as orthographic views, for the tests of planar motion.

use glam::{DVec2, DVec3};
use memo_core::synth::Random;

use super::{WALKS, joints};

/// The four limbs, joint by joint from the trunk.
pub const LIMBS: [[usize; 3]; 4] = [[0, 1, 2], [3, 4, 5], [6, 7, 8], [9, 10, 11]];

/// A walk on the spot: the mean forward motion is taken out.
#[derive(Debug, Clone)]
pub struct Walk {
    rate_hz: f64,
    frames: Vec<[DVec3; 12]>,
    /// Horizontal unit vector of progression.
    forward: DVec3,
    /// Frames a stride.
    stride: f64,
}

/// Joints of one stride: image positions and depths away from the camera, metres, `[joint][view]`.
pub struct Views {
    pub image: Vec<Vec<DVec2>>,
    pub depth: Vec<Vec<f64>>,
}

/// The four level walks.
pub fn walks() -> Vec<Walk> {
    WALKS.into_iter().map(Walk::read).collect()
}

impl Walk {
    fn read(name: &'static str) -> Self {
        let (rate_hz, mut frames) = joints(name);
        if name == "CMU_12_01" {
            // What is left of its calibration posture.
            frames.drain(..40);
        }
        frames.retain(|frame| frame.iter().all(|j| j.is_finite()));
        let hips = |frame: &[DVec3; 12]| 0.5 * (frame[6] + frame[9]);
        let (first, last) = (hips(&frames[0]), hips(frames.last().unwrap()));
        let drift = ((last - first) / (frames.len() - 1) as f64).with_z(0.0);
        for (i, frame) in frames.iter_mut().enumerate() {
            frame.iter_mut().for_each(|joint| *joint -= first.with_z(0.0) + i as f64 * drift);
        }
        let forward = drift.normalize();
        // A stride is the lag at which ankles and knees best repeat.
        let miss = |lag: usize| {
            let far = |i: usize| [7, 8, 10, 11].map(|j| frames[i][j].distance_squared(frames[i + lag][j]));
            (0..frames.len() - lag).map(|i| far(i).iter().sum::<f64>()).sum::<f64>()
                / (frames.len() - lag) as f64
        };
        let lags = (0.85 * rate_hz) as usize..((1.6 * rate_hz) as usize).min(frames.len() - 10);
        let stride = lags.min_by(|&a, &b| miss(a).total_cmp(&miss(b))).unwrap() as f64;
        Self { rate_hz, frames, forward, stride }
    }

    /// One stride in `count` views, started at `start` in [0, 1] of what the walk allows, seen orthographically
    /// `azimuth_deg` off the right side.
    pub fn views(&self, start: f64, count: usize, azimuth_deg: f64) -> Views {
        let first = start * (self.frames.len() as f64 - 1.0 - self.stride).max(0.0);
        let (sin, cos) = azimuth_deg.to_radians().sin_cos();
        let side = self.forward.cross(DVec3::Z);
        let (right, away) = (cos * self.forward + sin * side, sin * self.forward - cos * side);
        let mut views = Views { image: vec![Vec::new(); 12], depth: vec![Vec::new(); 12] };
        for view in 0..count {
            let frame = first + self.stride * view as f64 / count as f64;
            let (whole, part) = (frame as usize, frame.fract());
            let next = (whole + 1).min(self.frames.len() - 1);
            for joint in 0..12 {
                let point = self.frames[whole][joint].lerp(self.frames[next][joint], part);
                views.image[joint].push(DVec2::new(right.dot(point), -point.z));
                views.depth[joint].push(away.dot(point));
            }
        }
        views
    }

    /// Mean length of a bone over the walk, metres.
    pub fn length_m(&self, joints: [usize; 2]) -> f64 {
        self.frames.iter().map(|f| f[joints[0]].distance(f[joints[1]])).sum::<f64>()
            / self.frames.len() as f64
    }

    /// Seconds a stride.
    pub fn stride_s(&self) -> f64 {
        self.stride / self.rate_hz
    }
}

/// An azimuth 15 to 60 degrees off either side, seen from either side.
pub fn azimuth_deg(random: &mut Random) -> f64 {
    let off = random.uniform(15.0, 60.0) * if random.uniform(0.0, 1.0) < 0.5 { 1.0 } else { -1.0 };
    off + if random.uniform(0.0, 1.0) < 0.5 { 180.0 } else { 0.0 }
}

/// Adds noise of a standard deviation to every coordinate.
pub fn noisy(points: &[DVec2], sd: f64, random: &mut Random) -> Vec<DVec2> {
    points.iter().map(|p| *p + sd * DVec2::from_array(random.normal_pair().map(f64::from))).collect()
}

/// The quantile of a sample, sorted in place.
pub fn quantile(values: &mut [f64], fraction: f64) -> f64 {
    values.sort_by(f64::total_cmp);
    values[((values.len() - 1) as f64 * fraction).round() as usize]
}
