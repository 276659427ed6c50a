//! The synthetic walker of Lee and Chen (1985, section 4 and appendix), rebuilt as a stick figure.
//!
//! From the paper: the 17 lengths (Table A.1), the head (Table A.2), the cameras, 0.2 s per frame. Their joint
//! coordinates are not printed, and the program that generated them (Cutting 1978) is not public. So the joint
//! angles are this project's average gait curves, and the rotations of shoulders and pelvis are those stated at
//! [`StickWalker`]. Numbers printed for single frames can therefore be approximated, but not reproduced exactly.
//!
//! Axes are the paper's head-centred ones, in metres: x the moving direction, y up, z to the right of the walker.
//! The trunk is upright, and limbs swing in planes parallel to the moving direction. The head does not nod, turn
//! or bob.

use glam::{DMat3, DVec2, DVec3};
use std::f64::consts::TAU;
use thiserror::Error;

use crate::model::camera::Camera;
use crate::model::distortion::Distortion;
use crate::model::gait::{Gait, GaitStyle, SideAngles};
use crate::model::skeleton::{Joint, RigidDistance, SegmentLengths, Side, StickFigure};
use crate::posture::head::HeadModel;
use crate::posture::lift::JointRays;

/// Seconds between two frames of the paper.
pub const FRAME_S: f64 = 0.2;

/// Distance from the lens to the image plane in the paper, centimetres.
pub const FOCAL_CM: f64 = 5.0;

/// Why no walker has the given segment lengths.
#[derive(Debug, Clone, Copy, PartialEq, Error)]
#[non_exhaustive]
pub enum StickWalkerError {
    /// No rigid torso has these distances between neck, pelvis and shoulders.
    #[error(
        "no torso has neck to pelvis {neck_pelvis_m} m, neck to shoulder {neck_shoulder_m:?} m, shoulder to pelvis {shoulder_pelvis_m:?} m and shoulder to shoulder {shoulders_m} m (right, left)"
    )]
    Torso {
        /// Neck to pelvis, metres.
        neck_pelvis_m: f64,
        /// Neck to the right and the left shoulder, metres.
        neck_shoulder_m: [f64; 2],
        /// Right and left shoulder to the pelvis, metres.
        shoulder_pelvis_m: [f64; 2],
        /// Shoulder to shoulder, metres.
        shoulders_m: f64,
    },
    /// No triangle has these distances between pelvis and hips.
    #[error("no hip part has pelvis to hip {pelvis_hip_m:?} m (right, left) and hip to hip {hips_m} m")]
    Hips {
        /// Pelvis to the right and the left hip, metres.
        pelvis_hip_m: [f64; 2],
        /// Hip to hip, metres.
        hips_m: f64,
    },
}

/// A walker with given segment lengths. If a field is not finite, joints are NaN.
#[derive(Debug, Clone, PartialEq)]
pub struct StickWalker {
    /// Joint curves.
    pub gait: Gait,
    /// Deviations of the walk from the average.
    pub style: GaitStyle,
    /// Amplitude of the shoulders' rotation about the line from neck to pelvis, radians: the right shoulder is
    /// farthest forward at the left heel strike, with the right arm. 4 degrees.
    pub shoulder_turn_rad: f64,
    /// Amplitude of the pelvis' rotation about the same line, radians: the right hip is farthest forward at the
    /// right heel strike, with the right leg. 6 degrees.
    pub pelvis_turn_rad: f64,
    /// Gait phase of frame 0.
    pub phase0: f64,
    /// Gait cycles per second. 1: the paper does not state it.
    pub cadence_hz: f64,
    /// Speed relative to the camera, m/s. 0, as on a treadmill: the paper gives the camera of a whole sequence in
    /// the axes of the head.
    pub speed_mps: f64,
    lengths: SegmentLengths,
    trunk: Trunk,
}

/// The joints of torso and hip part without rotation, pelvis below the neck, relative to the neck.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Trunk {
    shoulders: [DVec3; 2],
    pelvis: DVec3,
    hips: [DVec3; 2],
}

impl StickWalker {
    /// The paper's walker: Table A.1, the dense gait curves, phase 0 in frame 0.
    pub fn lee_chen() -> Self {
        Self::new(&SegmentLengths::lee_chen()).expect("Table A.1 is a body: tested below")
    }

    /// An average walker of the given lengths.
    ///
    /// An error if torso or hip part are not possible.
    pub fn new(lengths: &SegmentLengths) -> Result<Self, StickWalkerError> {
        Ok(Self {
            gait: Gait::dense(),
            style: GaitStyle::default(),
            shoulder_turn_rad: 4_f64.to_radians(),
            pelvis_turn_rad: 6_f64.to_radians(),
            phase0: 0.0,
            cadence_hz: 1.0,
            speed_mps: 0.0,
            lengths: *lengths,
            trunk: Trunk::new(lengths)?,
        })
    }

    /// The same walker with another phase in frame 0 and another cadence, cycles per second.
    #[must_use]
    pub fn in_rhythm(self, phase0: f64, cadence_hz: f64) -> Self {
        Self { phase0, cadence_hz, ..self }
    }

    /// The lengths.
    pub fn lengths(&self) -> &SegmentLengths {
        &self.lengths
    }

    /// Gait phase of a frame, counted from 0: phase0 + frame · 0.2 s · cadence. The paper counts from 1.
    pub fn phase(&self, frame: usize) -> f64 {
        (self.phase0 + frame as f64 * FRAME_S * self.cadence_hz).rem_euclid(1.0)
    }

    /// Position of the neck in a frame, head axes of frame 0.
    fn neck(&self, frame: usize) -> DVec3 {
        HeadModel::lee_chen().points_m[0] + self.speed_mps * FRAME_S * frame as f64 * DVec3::X
    }

    /// The six head points in a frame, head axes of frame 0, in the order of
    /// [`HeadPoint::ALL`](crate::posture::head::HeadPoint::ALL).
    pub fn head(&self, frame: usize) -> [DVec3; 6] {
        let points = HeadModel::lee_chen().points_m;
        points.map(|point| point - points[0] + self.neck(frame))
    }

    /// The joints in a frame, head axes of frame 0.
    pub fn figure(&self, frame: usize) -> StickFigure {
        self.posed(self.phase(frame), self.neck(frame))
    }

    /// The joints at a gait phase, with the neck at a position.
    pub fn posed(&self, phase: f64, neck: DVec3) -> StickFigure {
        // A rotation to the left, about y up, moves the right side (z) forward (x).
        let ahead = (TAU * phase).cos();
        let torso = DMat3::from_rotation_y(-self.shoulder_turn_rad * ahead);
        let hip_part = DMat3::from_rotation_y(self.pelvis_turn_rad * ahead);
        let angles = self.gait.posture(phase, &self.style);

        let mut figure = StickFigure::UNKNOWN;
        figure[Joint::Neck] = neck;
        figure[Joint::Pelvis] = neck + self.trunk.pelvis;
        for (i, (side, angles)) in Side::BOTH.into_iter().zip([angles.right, angles.left]).enumerate() {
            figure[side.shoulder()] = neck + torso * self.trunk.shoulders[i];
            let hip_offset = self.trunk.hips[i] - self.trunk.pelvis;
            figure[side.hip()] = figure[Joint::Pelvis] + hip_part * hip_offset;
            self.hang_limbs(&mut figure, side, &angles);
        }
        figure
    }

    fn hang_limbs(&self, figure: &mut StickFigure, side: Side, angles: &SideAngles) {
        let mut hang = |end: Joint, start: Joint, swing_rad: f64| {
            figure[end] =
                figure[start] + self.lengths.to[end] * DVec3::new(swing_rad.sin(), -swing_rad.cos(), 0.0);
        };
        hang(side.elbow(), side.shoulder(), angles.shoulder);
        hang(side.wrist(), side.elbow(), angles.shoulder + angles.elbow);
        hang(side.knee(), side.hip(), angles.hip);
        hang(side.ankle(), side.knee(), angles.hip - angles.knee);
    }
}

impl Trunk {
    /// Shoulders from three distances each (to neck, pelvis and each other), behind the neck; hips from their
    /// distances, below the pelvis and level.
    ///
    /// For Table A.1: shoulders 3.74 cm behind and 0.47 cm below the neck, hips 10.09 cm below the pelvis.
    fn new(lengths: &SegmentLengths) -> Result<Self, StickWalkerError> {
        let to = |joint: Joint| lengths.to[joint];
        let rigid = |distance: RigidDistance| lengths.rigid[distance as usize];
        let neck_pelvis_m = to(Joint::Pelvis);
        let neck_shoulder_m = Side::BOTH.map(|side| to(side.shoulder()));
        let shoulder_pelvis_m =
            [RigidDistance::RightShoulderPelvis, RigidDistance::LeftShoulderPelvis].map(rigid);
        let shoulders_m = rigid(RigidDistance::Shoulders);
        let impossible =
            StickWalkerError::Torso { neck_pelvis_m, neck_shoulder_m, shoulder_pelvis_m, shoulders_m };

        // A shoulder is on a circle about the line from neck to pelvis, given by depth below the neck and radius.
        let circle = |a: f64, b: f64| {
            let below = (a * a + neck_pelvis_m * neck_pelvis_m - b * b) / (2.0 * neck_pelvis_m);
            (below, ((a - below) * (a + below)).sqrt())
        };
        let (right_below, right_radius) = circle(neck_shoulder_m[0], shoulder_pelvis_m[0]);
        let (left_below, left_radius) = circle(neck_shoulder_m[1], shoulder_pelvis_m[1]);
        let apart_sq = shoulders_m * shoulders_m - (right_below - left_below).powi(2);
        // Half the angle between the two radii: the angle of each from straight behind.
        let cosine = (right_radius * right_radius + left_radius * left_radius - apart_sq)
            / (2.0 * right_radius * left_radius);
        let half = 0.5 * cosine.acos();
        if !half.is_finite() {
            return Err(impossible);
        }
        let shoulder = |below: f64, radius: f64, half: f64| {
            DVec3::new(-radius * half.cos(), -below, radius * half.sin())
        };

        let pelvis_hip_m = Side::BOTH.map(|side| to(side.hip()));
        let hips_m = rigid(RigidDistance::Hips);
        let [a, b] = pelvis_hip_m;
        let right_aside = (hips_m * hips_m + (a - b) * (a + b)) / (2.0 * hips_m);
        let below = ((a - right_aside) * (a + right_aside)).sqrt();
        if !below.is_finite() {
            return Err(StickWalkerError::Hips { pelvis_hip_m, hips_m });
        }
        let pelvis = -neck_pelvis_m * DVec3::Y;
        Ok(Self {
            shoulders: [shoulder(right_below, right_radius, half), shoulder(left_below, left_radius, -half)],
            pelvis,
            hips: [right_aside, right_aside - hips_m].map(|aside| pelvis + DVec3::new(0.0, -below, aside)),
        })
    }
}

/// A camera of the paper: level, aiming at the axis of the head's coordinates.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct StickCamera {
    /// Position of the lens, head axes, metres. The paper's camera position is that of the image plane,
    /// [`FOCAL_CM`] in front of it.
    pub lens_in_head: DVec3,
    /// Rotation from head axes to the camera's (OpenCV: x right, y down, z forward).
    pub rotation: DMat3,
}

/// The view of the walker in a frame.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct StickView {
    /// The joints, camera axes, metres: the truth.
    pub figure: StickFigure,
    /// Rays to the joints, exact.
    pub rays: JointRays,
    /// The six head points, camera axes, metres.
    pub head: [DVec3; 6],
    /// Projections of the head points as in Table A.2 (b): image plane coordinates, x to the right and y up,
    /// centimetres.
    pub head_image_cm: [DVec2; 6],
}

impl StickCamera {
    /// The camera of the first sequence, (400, 0, 0) cm: straight ahead.
    pub fn seq1() -> Self {
        Self::aimed_from(4.0, 0.0)
    }

    /// The camera of the second sequence, (300, 0, 300) cm: ahead and to the walker's right.
    pub fn seq2() -> Self {
        Self::aimed_from(3.0, 3.0)
    }

    /// A camera with its image plane at (x, 0, z) in head axes, metres, looking at their origin.
    fn aimed_from(x: f64, z: f64) -> Self {
        let plane = DVec3::new(x, 0.0, z);
        let back = plane.normalize_or(DVec3::X);
        let (forward, down) = (-back, -DVec3::Y);
        let rotation = DMat3::from_cols(down.cross(forward), down, forward).transpose();
        Self { lens_in_head: plane + 0.01 * FOCAL_CM * back, rotation }
    }

    /// A point of head axes in camera axes.
    pub fn camera_from_head(&self, point_in_head: DVec3) -> DVec3 {
        self.rotation * (point_in_head - self.lens_in_head)
    }

    /// The view of a walker in a frame, counted from 0.
    pub fn view(&self, walker: &StickWalker, frame: usize) -> StickView {
        let in_camera = |point| self.camera_from_head(point);
        let figure = crate::model::skeleton::PerJoint(walker.figure(frame).0.map(in_camera));
        let head = walker.head(frame).map(in_camera);
        StickView {
            figure,
            rays: JointRays::from_points(&figure),
            head,
            head_image_cm: head.map(|p| FOCAL_CM * DVec2::new(p.x, -p.y) / p.z),
        }
    }

    /// The same view as a pixel camera in world axes: x the moving direction, y to the left, z up
    /// ([`world_from_head`]).
    pub fn pixel_camera(&self, size: [u32; 2], focal_px: f64) -> Camera {
        let head_from_world = world_rotation().transpose();
        let rotation = self.rotation * head_from_world;
        Camera {
            size,
            focal_px: DVec2::splat(focal_px),
            centre_px: DVec2::new(0.5 * f64::from(size[0]) - 0.5, 0.5 * f64::from(size[1]) - 0.5),
            distortion: Distortion::None,
            rotation,
            translation: -(self.rotation * self.lens_in_head),
        }
    }
}

/// A point of head axes in world axes with z up: (x, y, z) becomes (x, -z, y). Same origin.
pub fn world_from_head(point_in_head: DVec3) -> DVec3 {
    world_rotation() * point_in_head
}

fn world_rotation() -> DMat3 {
    DMat3::from_cols(DVec3::X, DVec3::Z, -DVec3::Y)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::model::angles::{elbow_rad, hip_axes, knee_rad, swing_rad, trunk_axes};
    use proptest::prelude::*;

    fn worst_length(figure: &StickFigure, lengths: &SegmentLengths) -> f64 {
        let segments =
            Joint::ALL.into_iter().skip(1).map(|joint| figure.segment(joint).length() - lengths.to[joint]);
        let rigid = RigidDistance::ALL.into_iter().map(|distance| {
            let [a, b] = distance.joints();
            figure[a].distance(figure[b]) - lengths.rigid[distance as usize]
        });
        segments.chain(rigid).map(f64::abs).fold(0.0, f64::max)
    }

    #[test]
    fn all_seventeen_lengths_are_exact() {
        let walker = StickWalker::lee_chen();
        for k in 0..100 {
            let figure = walker.posed(f64::from(k) / 100.0, DVec3::ZERO);
            assert!(worst_length(&figure, walker.lengths()) < 1e-12);
        }
    }

    #[test]
    fn half_a_cycle_later_the_walker_is_its_own_mirror_image() {
        let walker = StickWalker::lee_chen();
        let across = DVec3::new(1.0, 1.0, -1.0);
        for k in 0..50 {
            let phase = f64::from(k) / 50.0;
            let now = walker.posed(phase, DVec3::ZERO);
            let later = walker.posed(phase + 0.5, DVec3::ZERO);
            for joint in Joint::ALL {
                assert!((now[joint] * across).distance(later[joint.mirrored()]) < 1e-12, "{joint:?}");
            }
        }
    }

    /// Angles measured in the trunk's axes are those of the gait curves: elbow and knee to rounding, because they
    /// are between two segments; the swing up to the effect of the trunk's rotation.
    #[test]
    fn the_angles_read_back_are_those_of_the_gait() {
        let walker = StickWalker::lee_chen();
        // From the paper's axes (y up, z right) to anatomical axes (x forward, y down, z left).
        for k in 0..100 {
            let phase = f64::from(k) / 100.0;
            let figure = walker.posed(phase, DVec3::ONE);
            let axes = trunk_axes(&figure).unwrap();
            assert!(axes.x_axis.x > 0.99 && axes.y_axis.y < -0.999 && axes.z_axis.z < -0.99);
            let gait = walker.gait.posture(phase, &walker.style);
            for (side, wanted) in Side::BOTH.into_iter().zip([gait.right, gait.left]) {
                let [upper_arm, forearm, thigh, shank] =
                    [side.elbow(), side.wrist(), side.knee(), side.ankle()].map(|end| figure.segment(end));
                assert!((elbow_rad(&axes, upper_arm, forearm) - wanted.elbow).abs() < 1e-9);
                assert!((knee_rad(&axes, thigh, shank) - wanted.knee).abs() < 1e-9);
                let tangent = 1.0 - walker.shoulder_turn_rad.cos();
                assert!((swing_rad(&axes, upper_arm) - wanted.shoulder).abs() <= tangent);
                assert!((swing_rad(&axes, thigh) - wanted.hip).abs() <= tangent);
            }
        }
    }

    #[test]
    fn shoulders_turn_with_the_arms_and_hips_with_the_legs() {
        let walker = StickWalker::lee_chen();
        let ahead = |phase: f64, side: Side| {
            let figure = walker.posed(phase, DVec3::ZERO);
            let [shoulder, hip] = [side.shoulder(), side.hip()].map(|joint| figure[joint].x);
            (shoulder, hip)
        };
        let (right, left) = (ahead(0.0, Side::Right), ahead(0.0, Side::Left));
        assert!(right.0 < left.0 && right.1 > left.1);
        // The shoulders are always behind the neck, as required by the lengths of Table A.1.
        assert!((0..100).all(|k| ahead(f64::from(k) / 100.0, Side::Right).0 < -0.02));
        let at_mean = walker.posed(0.25, DVec3::ZERO);
        assert!((at_mean[Joint::RightShoulder] - DVec3::new(-0.0374, -0.0047, 0.2015)).length() < 1e-4);
        assert!(hip_axes(&at_mean).unwrap().x_axis.distance(DVec3::X) < 1e-12);
    }

    /// Table 2 (d) and Table A.2 (b): camera axes and image points of the head as printed.
    #[test]
    fn the_first_camera_sees_the_head_as_printed() {
        let view = StickCamera::seq1().view(&StickWalker::lee_chen(), 0);
        let printed_cm = [
            (-0.00499, 52.12662, 434.17551),
            (-0.00485, 61.62641, 429.17581),
            (-5.50490, 65.12637, 431.17560),
            (5.49510, 65.12647, 431.17633),
            (-8.50501, 60.12647, 435.17526),
            (8.49499, 60.12663, 435.17639),
        ];
        // The table results from a fit: its camera differs by 0.03 cm from (400, 0, 0).
        for (point, (x, y, z)) in view.head.into_iter().zip(printed_cm) {
            let paper_cm = DVec3::new(100.0 * point.x, -100.0 * point.y, 100.0 * point.z - FOCAL_CM);
            assert!(paper_cm.distance(DVec3::new(x, y, z)) < 0.03, "{paper_cm}");
        }
        let printed_image = [
            (-0.00024, 0.59320),
            (-0.00025, 0.70944),
            (-0.06329, 0.74631),
            (0.06280, 0.74631),
            (-0.09680, 0.68273),
            (0.09631, 0.68273),
        ];
        // x' is printed with a common offset of 0.00025, that of the fitted camera.
        for (point, (x, y)) in view.head_image_cm.into_iter().zip(printed_image) {
            assert!((point - DVec2::new(x + 0.00025, y)).abs().max_element() < 1.5e-5, "{point}");
        }
    }

    #[test]
    fn both_cameras_see_the_whole_walker_right_side_up_and_in_pixels_alike() {
        let walker = StickWalker { speed_mps: 0.5, ..StickWalker::lee_chen() };
        for camera in [StickCamera::seq1(), StickCamera::seq2()] {
            let pixels = camera.pixel_camera([1920, 1080], 1000.0).validated().unwrap();
            for frame in 0..5 {
                let view = camera.view(&walker, frame);
                assert!(view.figure[Joint::Neck].y < view.figure[Joint::Pelvis].y);
                // Seen from ahead, the walker's right is on the left of the image.
                assert!(view.figure[Joint::RightHip].x < view.figure[Joint::LeftHip].x);
                for joint in Joint::ALL {
                    let world = world_from_head(walker.figure(frame)[joint]);
                    assert!(pixels.camera_from_world(world).distance(view.figure[joint]) < 1e-12);
                    let pixel = pixels.project(world).unwrap();
                    assert!(pixel.min_element() > 0.0 && pixel.x < 1920.0 && pixel.y < 1080.0);
                }
            }
        }
    }

    #[test]
    fn frames_are_a_fifth_of_a_second_apart_and_the_walker_comes_nearer_when_told_so() {
        let walker = StickWalker { phase0: 0.9, speed_mps: 1.0, ..StickWalker::lee_chen() };
        assert!((walker.phase(3) - 0.5).abs() < 1e-12);
        let nearer = walker.figure(0)[Joint::Neck] - walker.figure(4)[Joint::Neck];
        assert!(nearer.distance(-0.8 * DVec3::X) < 1e-12);
        assert_eq!(walker.head(4)[0], walker.figure(4)[Joint::Neck]);
    }

    #[test]
    fn impossible_lengths_are_refused_with_their_values() {
        let mut lengths = SegmentLengths::lee_chen();
        lengths.rigid[RigidDistance::Shoulders as usize] = 0.5;
        let error = StickWalker::new(&lengths).unwrap_err();
        assert!(error.to_string().contains("0.5"), "{error}");
        lengths = SegmentLengths::lee_chen();
        lengths.rigid[RigidDistance::Hips as usize] = f64::NAN;
        assert!(matches!(StickWalker::new(&lengths), Err(StickWalkerError::Hips { .. })));
        lengths.to[Joint::Pelvis] = 0.0;
        assert!(matches!(StickWalker::new(&lengths), Err(StickWalkerError::Torso { .. })));
    }

    proptest! {
        /// A body that is not symmetric also gets all lengths exactly.
        #[test]
        fn lengths_of_any_possible_body_are_exact(
            factors in proptest::array::uniform17(0.97..1.03_f64), phase in 0.0..1.0_f64,
        ) {
            let mut lengths = SegmentLengths::lee_chen();
            for (length, factor) in lengths.to.0[1..].iter_mut().chain(&mut lengths.rigid).zip(factors) {
                *length *= factor;
            }
            // Shoulders need some distance from the line; nearly collinear ones may not exist.
            if let Ok(walker) = StickWalker::new(&lengths) {
                prop_assert!(worst_length(&walker.posed(phase, DVec3::ONE), &lengths) < 1e-9);
            }
        }
    }
}
