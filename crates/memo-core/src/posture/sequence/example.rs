//! A known walk for tests of sequences.

use glam::{DVec2, DVec3};

use super::{KeypointSequence, PostureSequence, SequenceError, SequenceOptions, postures};
use crate::model::camera::Camera;
use crate::model::skeleton::{JOINT_COUNT, Joint, PerJoint, SegmentLengths, StickFigure};
use crate::posture::head::HeadModel;
use crate::reproduce::stick_walker::{StickWalker, world_from_head};
use crate::synth::Random;

const RATE_HZ: f64 = 25.0;

/// Keypoints of a known walk.
pub(super) struct Walk {
    pub camera: Camera,
    pub times_s: Vec<f64>,
    pub points_px: Vec<PerJoint<DVec2>>,
    pub weights: Vec<PerJoint<f64>>,
    /// Head points, if they were drawn.
    pub head_points_px: Option<Vec<[DVec2; 6]>>,
    pub truth: Vec<StickFigure>,
    /// The direction of the walk in the world.
    pub forward: DVec3,
}

impl Walk {
    pub fn sequence(&self) -> KeypointSequence<'_> {
        let Self { times_s, points_px, weights, .. } = self;
        let head_points_px = self.head_points_px.as_deref();
        KeypointSequence { times_s, points_px, weights, head_points_px, foot_points_px: None }
    }

    /// The head of a frame as the camera would see it without noise: Table A.2, facing the walking direction.
    pub fn head_px(&self, t: usize) -> [DVec2; 6] {
        let points = HeadModel::lee_chen().points_m;
        let right = self.forward.cross(DVec3::Z);
        points.map(|point| {
            let [ahead, up, aside] = (point - points[0]).to_array();
            let place = self.truth[t][Joint::Neck] + ahead * self.forward + up * DVec3::Z + aside * right;
            self.camera.project(place).unwrap()
        })
    }

    pub fn postures(&self, options: &SequenceOptions) -> Result<PostureSequence, SequenceError> {
        postures(&self.sequence(), &self.camera, options)
    }
}

/// The paper's walker at 1.2 m/s past a level camera, at `azimuth_deg` from the direction towards it.
pub(super) fn walk(azimuth_deg: f64, frames: usize, noise_px: f64) -> Walk {
    let camera = Camera::level([1920, 1920], 0.9273, 1.2, 5.0).unwrap();
    let walker = StickWalker::lee_chen();
    let mut random = Random::new(5);
    let forward = glam::DMat3::from_rotation_z((azimuth_deg - 90.0).to_radians()) * DVec3::X;
    let turn = glam::DMat3::from_rotation_z(forward.y.atan2(forward.x));
    let posed = |t: usize| {
        let figure = walker.posed(t as f64 / RATE_HZ, DVec3::ZERO);
        PerJoint(figure.0.map(world_from_head))
    };
    let lowest = |figure: &StickFigure| figure[Joint::RightAnkle].z.min(figure[Joint::LeftAnkle].z);
    let figures: Vec<StickFigure> = (0..frames).map(posed).collect();
    let low = figures.iter().map(lowest).fold(f64::INFINITY, f64::min);
    let height = 0.17 * walker.lengths().to[Joint::RightAnkle] - low;
    let mut found = Walk {
        camera,
        times_s: vec![],
        points_px: vec![],
        weights: vec![],
        head_points_px: None,
        truth: vec![],
        forward,
    };
    for (t, figure) in figures.iter().enumerate() {
        let way_m = 1.2 * (t as f64 - 0.5 * frames as f64) / RATE_HZ;
        let figure = PerJoint(figure.0.map(|p| turn * p + way_m * forward + height * DVec3::Z));
        let pixel = |p: DVec3| {
            let [a, b] = random.normal_pair().map(f64::from);
            found.camera.project(p).unwrap() + noise_px * DVec2::new(a, b)
        };
        found.points_px.push(PerJoint(figure.0.map(pixel)));
        found.times_s.push(t as f64 / RATE_HZ);
        found.weights.push(PerJoint([1.0; JOINT_COUNT]));
        found.truth.push(figure);
    }
    found
}

pub(super) fn with_lengths() -> SequenceOptions {
    SequenceOptions { lengths: Some(SegmentLengths::lee_chen()), noise_px: 1.0, ..SequenceOptions::default() }
}
