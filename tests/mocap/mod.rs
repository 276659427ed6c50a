//! Real joints in space and views of them, for tests of postures.
//!
//! Needs the recordings. Joint centres carry neither neck nor pelvis: the neck is put
//! 3.77 cm before the middle of the shoulders, where the trunk of Table A.1 (Lee and Chen 1985) has it, and
//! the pelvis 10 cm from the middle of the hips towards the shoulders.

pub mod stride;

use glam::{DMat3, DVec2, DVec3};
use memo_core::model::{Distortion, JOINT_COUNT};
use memo_core::posture::lift::JointRays;
use memo_core::synth::Random;
use memo_core::{Camera, Joint, PerJoint, StickFigure};

use crate::recordings;

/// The walks; two systems of measurement, four people.
pub const WALKS: [&str; 4] = ["BTK_ANTO_M_hole", "BTK_BELT_C", "CMU_02_01", "CMU_12_01"];

/// One recorded motion.
pub struct Motion {
    /// Its name.
    pub name: String,
    /// Time of each figure, seconds.
    pub times_s: Vec<f64>,
    /// Joints in the world, Z up, metres.
    pub figures: Vec<StickFigure>,
    /// Level unit vector the walker moves in; where nobody walks, the mean of the trunk's forward axis.
    pub heading: DVec3,
}

/// Columns of the joint files, limb by limb from the trunk.
pub const JOINTS: [&str; 12] =
    ["RSH", "REL", "RWR", "LSH", "LEL", "LWR", "RHP", "RKN", "RAN", "LHP", "LKN", "LAN"];

/// The joints of every frame of a recorded motion, metres in the world, NaN where missing; and its rate.
pub fn joints(name: &str) -> (f64, Vec<[DVec3; 12]>) {
    let text = recordings::text(&format!("mocap/joints/{name}.csv"));
    let mut lines = text.lines();
    let rate_hz = rate_hz(lines.next().unwrap());
    let columns: Vec<&str> = lines.next().unwrap().split(',').collect();
    let at = JOINTS.map(|joint| columns.iter().position(|c| *c == format!("{joint}_x")).unwrap());
    let row = |line: &str| {
        let values: Vec<f64> = line.split(',').map(|v| v.parse().unwrap_or(f64::NAN)).collect();
        at.map(|c| DVec3::new(values[c], values[c + 1], values[c + 2]))
    };
    // The first frames of this walk are a calibration posture.
    let skipped = if name == "CMU_12_01" { 10 } else { 0 };
    (rate_hz, lines.skip(skipped).map(row).collect())
}

/// A recorded motion, every fifth frame (20-24 a second).
pub fn load(name: &str) -> Motion {
    let (rate_hz, frames) = joints(name);
    let skipped = if name == "CMU_12_01" { 10 } else { 0 };
    let taken = || frames.iter().enumerate().step_by(5);
    let times_s = taken().map(|(frame, _)| (frame + skipped) as f64 / rate_hz).collect();
    let figures: Vec<StickFigure> = taken()
        .map(|(_, row)| figure(|joint| row[JOINTS.iter().position(|j| *j == joint).unwrap()]))
        .collect();
    let heading = heading(&figures);
    Motion { name: name.to_owned(), times_s, figures, heading }
}

fn rate_hz(header: &str) -> f64 {
    let words: Vec<&str> = header.split([' ', ',']).collect();
    words[words.iter().position(|w| *w == "Hz").unwrap() - 1].parse().unwrap()
}

fn figure(at: impl Fn(&str) -> DVec3) -> StickFigure {
    let mut figure = StickFigure::UNKNOWN;
    let named = [
        (Joint::RightShoulder, "RSH"),
        (Joint::RightElbow, "REL"),
        (Joint::RightWrist, "RWR"),
        (Joint::LeftShoulder, "LSH"),
        (Joint::LeftElbow, "LEL"),
        (Joint::LeftWrist, "LWR"),
        (Joint::RightHip, "RHP"),
        (Joint::RightKnee, "RKN"),
        (Joint::RightAnkle, "RAN"),
        (Joint::LeftHip, "LHP"),
        (Joint::LeftKnee, "LKN"),
        (Joint::LeftAnkle, "LAN"),
    ];
    for (joint, name) in named {
        figure[joint] = at(name);
    }
    let shoulders = 0.5 * (figure[Joint::RightShoulder] + figure[Joint::LeftShoulder]);
    let hips = 0.5 * (figure[Joint::RightHip] + figure[Joint::LeftHip]);
    let across = figure[Joint::LeftShoulder] - figure[Joint::RightShoulder];
    let forward = (hips - shoulders).cross(across).normalize();
    figure[Joint::Neck] = shoulders + 0.0377 * forward;
    figure[Joint::Pelvis] = hips + 0.10 * (shoulders - hips).normalize();
    figure
}

fn heading(figures: &[StickFigure]) -> DVec3 {
    let level = |v: DVec3| DVec3::new(v.x, v.y, 0.0);
    let [first, last] = [figures[0], figures[figures.len() - 1]].map(|figure| figure[Joint::Pelvis]);
    let travelled = level(last - first);
    if travelled.length() > 1.0 {
        return travelled.normalize();
    }
    let forward = |figure: &StickFigure| {
        figure
            .segment(Joint::Pelvis)
            .cross(figure[Joint::LeftShoulder] - figure[Joint::RightShoulder])
            .normalize()
    };
    level(figures.iter().map(forward).sum()).normalize()
}

/// What a camera sees of a figure.
pub struct Seen {
    /// Rays of the noisy joints.
    pub rays: JointRays,
    /// The true joints in camera axes, metres.
    pub figure_in_camera: StickFigure,
    /// Up in camera axes.
    pub up: DVec3,
    /// The walker's heading in camera axes.
    pub heading: DVec3,
}

/// A level camera that follows the walker: 4 m away, 1.2 m high, f = 1920 px (480 px/m), looking at the middle
/// of the body. Azimuth 0 sees the walker from the front, 90 degrees from the walker's right side.
pub fn view(figure: &StickFigure, heading: DVec3, azimuth_deg: f64, noise_px: f64, seed: u64) -> Seen {
    let (sine, cosine) = (-azimuth_deg.to_radians()).sin_cos();
    let towards =
        DVec3::new(cosine * heading.x - sine * heading.y, sine * heading.x + cosine * heading.y, 0.0);
    let pelvis = figure[Joint::Pelvis];
    let position = DVec3::new(pelvis.x, pelvis.y, 1.2) + 4.0 * towards;
    let (forward, down) = (-towards, -DVec3::Z);
    let rotation = DMat3::from_cols(down.cross(forward), down, forward).transpose();
    let camera = Camera {
        size: [1920, 1920],
        focal_px: DVec2::splat(1920.0),
        centre_px: DVec2::splat(959.5),
        distortion: Distortion::default(),
        rotation,
        translation: -(rotation * position),
    };
    let mut random = Random::new(seed);
    let mut pixels = PerJoint([DVec2::NAN; JOINT_COUNT]);
    for joint in Joint::ALL {
        let [a, b] = random.normal_pair().map(f64::from);
        if let Some(pixel) = camera.project(figure[joint]) {
            pixels[joint] = pixel + noise_px * DVec2::new(a, b);
        }
    }
    let weight = PerJoint([1.0; JOINT_COUNT]);
    let rays = JointRays::from_pixels(&camera, &pixels, &weight, noise_px).unwrap();
    Seen {
        rays,
        figure_in_camera: PerJoint(figure.0.map(|point| camera.camera_from_world(point))),
        up: rotation * DVec3::Z,
        heading: rotation * heading,
    }
}
