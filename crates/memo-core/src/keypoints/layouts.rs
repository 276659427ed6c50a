//! The orders in which detectors list their points, each with its source, and how to recognise an order.

use glam::DVec2;

use crate::estimate::median::median;

use super::names::{DetectorError, STICK_JOINTS, nearest, plain};

/// The order of a detector's points.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Layout {
    /// The name used by its makers.
    pub name: &'static str,
    /// Names of its points in order, in this project's spelling.
    pub joints: &'static [&'static str],
    /// The source of the order.
    pub source: &'static str,
}

/// All known layouts.
pub static LAYOUTS: [Layout; 8] = [
    Layout {
        name: "BODY_25",
        joints: &[
            "nose",
            "neck",
            "right_shoulder",
            "right_elbow",
            "right_wrist",
            "left_shoulder",
            "left_elbow",
            "left_wrist",
            "mid_hip",
            "right_hip",
            "right_knee",
            "right_ankle",
            "left_hip",
            "left_knee",
            "left_ankle",
            "right_eye",
            "left_eye",
            "right_ear",
            "left_ear",
            "left_big_toe",
            "left_small_toe",
            "left_heel",
            "right_big_toe",
            "right_small_toe",
            "right_heel",
        ],
        source: "CMU-Perceptual-Computing-Lab/openpose src/openpose/pose/poseParameters.cpp, \
                 POSE_BODY_25_BODY_PARTS",
    },
    Layout {
        name: "BODY_25B",
        joints: &[
            "nose",
            "left_eye",
            "right_eye",
            "left_ear",
            "right_ear",
            "left_shoulder",
            "right_shoulder",
            "left_elbow",
            "right_elbow",
            "left_wrist",
            "right_wrist",
            "left_hip",
            "right_hip",
            "left_knee",
            "right_knee",
            "left_ankle",
            "right_ankle",
            "upper_neck",
            "head_top",
            "left_big_toe",
            "left_small_toe",
            "left_heel",
            "right_big_toe",
            "right_small_toe",
            "right_heel",
        ],
        source: "openpose poseParameters.cpp, POSE_BODY_25B_BODY_PARTS; perfanalytics/pose2sim \
                 Pose2Sim/skeletons.py, BODY_25B",
    },
    Layout {
        name: "COCO_18",
        joints: &[
            "nose",
            "neck",
            "right_shoulder",
            "right_elbow",
            "right_wrist",
            "left_shoulder",
            "left_elbow",
            "left_wrist",
            "right_hip",
            "right_knee",
            "right_ankle",
            "left_hip",
            "left_knee",
            "left_ankle",
            "right_eye",
            "left_eye",
            "right_ear",
            "left_ear",
        ],
        source: "CMU-Perceptual-Computing-Lab/openpose src/openpose/pose/poseParameters.cpp, \
                 POSE_COCO_BODY_PARTS",
    },
    Layout {
        name: "COCO_17",
        joints: &[
            "nose",
            "left_eye",
            "right_eye",
            "left_ear",
            "right_ear",
            "left_shoulder",
            "right_shoulder",
            "left_elbow",
            "right_elbow",
            "left_wrist",
            "right_wrist",
            "left_hip",
            "right_hip",
            "left_knee",
            "right_knee",
            "left_ankle",
            "right_ankle",
        ],
        source: "COCO person_keypoints_val2017.json, categories[0].keypoints; AlphaPose docs/output.md, COCO",
    },
    Layout {
        name: "HALPE_26",
        joints: &[
            "nose",
            "left_eye",
            "right_eye",
            "left_ear",
            "right_ear",
            "left_shoulder",
            "right_shoulder",
            "left_elbow",
            "right_elbow",
            "left_wrist",
            "right_wrist",
            "left_hip",
            "right_hip",
            "left_knee",
            "right_knee",
            "left_ankle",
            "right_ankle",
            "head_top",
            "neck",
            "mid_hip",
            "left_big_toe",
            "right_big_toe",
            "left_small_toe",
            "right_small_toe",
            "left_heel",
            "right_heel",
        ],
        source: "Fang-Haoshu/Halpe-FullBody README.md, Keypoints format, body",
    },
    Layout {
        name: "MEDIAPIPE_33",
        joints: &[
            "nose",
            "left_eye_inner",
            "left_eye",
            "left_eye_outer",
            "right_eye_inner",
            "right_eye",
            "right_eye_outer",
            "left_ear",
            "right_ear",
            "left_mouth",
            "right_mouth",
            "left_shoulder",
            "right_shoulder",
            "left_elbow",
            "right_elbow",
            "left_wrist",
            "right_wrist",
            "left_pinky",
            "right_pinky",
            "left_index",
            "right_index",
            "left_thumb",
            "right_thumb",
            "left_hip",
            "right_hip",
            "left_knee",
            "right_knee",
            "left_ankle",
            "right_ankle",
            "left_heel",
            "right_heel",
            "left_big_toe",
            "right_big_toe",
        ],
        source: "google-ai-edge/mediapipe mediapipe/python/solutions/pose.py, PoseLandmark \
                 (its FOOT_INDEX is the big toe)",
    },
    Layout {
        name: "STICK_14",
        joints: &STICK_JOINTS,
        source: "Lee and Chen 1985, figure 1, in the order of the interpretation tree",
    },
    Layout {
        name: "MOCAP_12",
        joints: &[
            "right_shoulder",
            "right_elbow",
            "right_wrist",
            "left_shoulder",
            "left_elbow",
            "left_wrist",
            "right_hip",
            "right_knee",
            "right_ankle",
            "left_hip",
            "left_knee",
            "left_ankle",
        ],
        source: "joint tables of motion capture: RSH REL RWR LSH LEL LWR RHP RKN RAN LHP LKN LAN",
    },
];

fn layout_names() -> Vec<&'static str> {
    LAYOUTS.iter().map(|layout| layout.name).collect()
}

fn layout_counts() -> Vec<String> {
    LAYOUTS.iter().map(|layout| format!("{} ({})", layout.joints.len(), layout.name)).collect()
}

impl Layout {
    /// The layout called `name`, whatever its case and separators.
    ///
    /// # Errors
    ///
    /// There is no layout with this name.
    pub fn by_name(name: &str) -> Result<&'static Self, DetectorError> {
        let wanted = plain(name);
        let same = |layout: &&'static Self| plain(layout.name) == wanted;
        LAYOUTS.iter().find(same).ok_or_else(|| DetectorError::UnknownLayout {
            name: name.to_owned(),
            nearest: nearest(&wanted, layout_names()),
            known: layout_names(),
        })
    }

    /// The layout with `joint_count` points that fits `points_px`, given frame after frame, NaN where
    /// missing.
    ///
    /// BODY_25 and BODY_25B both have 25 points. The **middle test** distinguishes them: only BODY_25 has a
    /// neck and a mid-hip, which were trained as midpoints of the shoulders and of the hips. In published
    /// BODY_25 files those points lie within 0.01 of the figure's size (the diagonal of its bounding box) of
    /// the midpoints. A BODY_25B file has other points at those indices, at a distance of 0.24 to 0.45 for
    /// the hips and 0.02 to 0.16 for the neck. The larger of the two medians over the frames decides: up to
    /// [`MIDDLE_NEAR`] the layout is BODY_25, from [`MIDDLE_FAR`] on it is not, and between them the result
    /// is an error.
    ///
    /// # Errors
    ///
    /// No layout has this number of points, or the middle test does not determine the layout.
    pub fn from_points(joint_count: usize, points_px: &[DVec2]) -> Result<&'static Self, DetectorError> {
        let fitting: Vec<&'static Self> = LAYOUTS.iter().filter(|l| l.joints.len() == joint_count).collect();
        let (with_middles, without) = match fitting[..] {
            [] => return Err(DetectorError::UnknownCount { count: joint_count, known: layout_counts() }),
            [only] => return Ok(only),
            [first, second, ..] => (first, second),
        };
        let distance = with_middles.distance_from_middles(points_px);
        match distance {
            Some(distance) if distance <= MIDDLE_NEAR => Ok(with_middles),
            Some(distance) if distance >= MIDDLE_FAR => Ok(without),
            _ => Err(DetectorError::UnclearLayout {
                count: joint_count,
                names: [with_middles.name, without.name],
                distance,
            }),
        }
    }

    /// Distance of the neck and the mid-hip from the midpoints of shoulders and hips, as a fraction of the
    /// figure's size: the larger of the medians over the frames. `None` if no frame has the points.
    fn distance_from_middles(&self, points_px: &[DVec2]) -> Option<f64> {
        let place = |name: &str| self.joints.iter().position(|joint| *joint == name);
        let middles = [["neck", "right_shoulder", "left_shoulder"], ["mid_hip", "right_hip", "left_hip"]];
        let farthest = |[middle, right, left]: [&str; 3]| {
            let (middle, right, left) = (place(middle)?, place(right)?, place(left)?);
            let mut distances: Vec<f64> = points_px
                .chunks_exact(self.joints.len())
                .map(|frame| frame[middle].distance(frame[right].midpoint(frame[left])) / size_px(frame))
                .filter(|distance| distance.is_finite())
                .collect();
            median(&mut distances)
        };
        middles.into_iter().filter_map(farthest).max_by(f64::total_cmp)
    }
}

/// Diagonal of the bounding box of the points that are not missing.
pub(super) fn size_px(points_px: &[DVec2]) -> f64 {
    let seen = || points_px.iter().filter(|point| point.is_finite());
    let low = seen().fold(DVec2::INFINITY, |low, point| low.min(*point));
    let high = seen().fold(DVec2::NEG_INFINITY, |high, point| high.max(*point));
    if seen().next().is_none() { 0.0 } else { (high - low).length() }
}

/// Up to this distance points count as midpoints; see [`Layout::from_points`].
pub const MIDDLE_NEAR: f64 = 0.04;

/// From this distance on points do not count as midpoints.
pub const MIDDLE_FAR: f64 = 0.06;
