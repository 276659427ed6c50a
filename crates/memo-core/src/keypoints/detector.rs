//! The output of keypoint detectors: the names and the order of the points, and how the fourteen joints of
//! the stick figure and the six head points of Lee and Chen (1985) are computed from them.
//!
//! Every point has one name here (`right_knee`); [`joint_name`] maps the spellings of detectors, motion
//! capture and tables to it. A [`Layout`] is the order of a detector's points, with its source. Two layouts
//! have 25 points, so [`Layout::from_points`] examines the points themselves.
//!
//! The joints of the stick figure (section 2, figure 1, in the order of the paper's tree) are obtained as
//! follows:
//!
//! * shoulders, elbows, wrists, hips, knees and ankles are the detector's own points;
//! * the neck is the detector's point `neck` if its layout has one, otherwise the midpoint of the shoulders.
//!   In BODY_25 and COCO_18 the neck was trained as that midpoint. `upper_neck` of BODY_25B is a different
//!   point, about 4 cm above the line of the shoulders (median of 100 frames measured in space), and is used
//!   for the head only;
//! * the pelvis is a point on the axis of the trunk above the line of the hips. The lengths of table A.1 fit
//!   only one rigid trunk, with the pelvis joint 10.09 cm above the line of the hips and 45.98 cm below that
//!   of the shoulders, hence `pelvis = m_hip + 10.09 / (10.09 + 45.98) (m_shoulder - m_hip)` with the
//!   midpoints m in the image.
//!
//! The source of a joint depends on the layout and not on the frame, so its meaning does not change within a
//! track. A joint with a missing source is missing (NaN, weight 0); no joint is interpolated.
//!
//! Limits: the midpoint of two image points is the image of the midpoint only if both are equally far away;
//! at 4 m with one shoulder 0.4 m nearer it is off by 1 cm. The paper's neck lies 3.77 cm in front of the
//! line of the shoulders, which a midpoint of two points does not reproduce. Detectors place hips and
//! shoulders by learned convention, not by anatomy.

use glam::DVec2;

use super::layouts::{LAYOUTS, Layout};
use super::names::{DetectorError, SIDE_PARTS, STICK_JOINTS, SwapGroup, joint_name};
use crate::model::skeleton::PELVIS_ON_TRUNK;

/// Names of the head points in the order of table A.2.
pub const HEAD_POINTS: [&str; 6] = ["neck", "nose", "right_eye", "left_eye", "right_ear", "left_ear"];

/// Names of the points of the feet that show which way a person faces.
pub const FOOT_POINTS: [&str; 4] = ["right_big_toe", "left_big_toe", "right_heel", "left_heel"];

/// A right and a left point of the same kind.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct SidePair {
    /// The group with which it is swapped.
    pub group: SwapGroup,
    /// The part without its side, such as `knee`.
    pub part: &'static str,
    /// Index of the right point.
    pub right: usize,
    /// Index of the left point.
    pub left: usize,
}

/// N image points with weights.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct WeightedPoints<const N: usize> {
    /// Image coordinates (u, v), pixels; NaN where missing.
    pub points_px: [DVec2; N],
    /// The smallest score among a point's sources; 0 where missing, or where a score is negative or not
    /// finite.
    pub weights: [f64; N],
}

/// The source of a point, as indices in a frame.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Source {
    Own(usize),
    Middle([usize; 2]),
    /// Indices of the hips, then of the shoulders.
    OnTrunk([[usize; 2]; 2]),
    Absent,
}

/// The named points of a detector, from which joints of the stick figure are computed.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Detector {
    names: Vec<&'static str>,
    stick: [Source; 14],
    head: [Source; 6],
    feet: [Source; 4],
}

impl Detector {
    /// A detector from the names of a frame's points in order, each in any known spelling.
    ///
    /// # Errors
    ///
    /// An unknown name, or two names of the same point.
    pub fn from_names<S: AsRef<str>>(names: &[S]) -> Result<Self, DetectorError> {
        let mut known: Vec<&'static str> = Vec::with_capacity(names.len().min(LAYOUTS.len() * 33));
        for name in names {
            let name = joint_name(name.as_ref())?;
            if let Some(first) = known.iter().position(|other| *other == name) {
                return Err(DetectorError::RepeatedJoint { name, first, second: known.len() });
            }
            known.push(name);
        }
        Ok(Self::from_known(known))
    }

    /// A detector with the given layout.
    pub fn from_layout(layout: &'static Layout) -> Self {
        Self::from_known(layout.joints.to_vec())
    }

    fn from_known(names: Vec<&'static str>) -> Self {
        let place = |name: &str| names.iter().position(|other| *other == name);
        let both = |right: &str, left: &str| Some([place(right)?, place(left)?]);
        let shoulders = both("right_shoulder", "left_shoulder");
        let hips = both("right_hip", "left_hip");
        let own = |name: &str| place(name).map(Source::Own);
        let neck = own("neck").or(shoulders.map(Source::Middle));
        let stick = STICK_JOINTS.map(|name| match name {
            "neck" => neck,
            "pelvis" => {
                own(name).or_else(|| hips.zip(shoulders).map(|(hips, tops)| Source::OnTrunk([hips, tops])))
            }
            _ => own(name),
        });
        // In table A.2 the neck is 9.5 cm below the tip of the nose: the upper neck, if there is one.
        let head =
            HEAD_POINTS.map(|name| if name == "neck" { own("upper_neck").or(neck) } else { own(name) });
        let or_absent = |source: Option<Source>| source.unwrap_or(Source::Absent);
        let feet = FOOT_POINTS.map(|name| or_absent(own(name)));
        Self { stick: stick.map(or_absent), head: head.map(or_absent), feet, names }
    }

    /// The names of the detector's points in order.
    pub fn names(&self) -> &[&'static str] {
        &self.names
    }

    /// The joints of the stick figure in one frame, in the order of [`STICK_JOINTS`].
    ///
    /// # Errors
    ///
    /// The number of points or scores differs from the number of names.
    pub fn stick_joints(
        &self,
        points_px: &[DVec2],
        scores: &[f64],
    ) -> Result<WeightedPoints<14>, DetectorError> {
        self.collect(&self.stick, points_px, scores)
    }

    /// The head points in one frame, in the order of [`HEAD_POINTS`]. The neck is the upper neck of BODY_25B
    /// if there is one, otherwise the neck of the stick figure.
    ///
    /// # Errors
    ///
    /// The number of points or scores differs from the number of names.
    pub fn head_points(
        &self,
        points_px: &[DVec2],
        scores: &[f64],
    ) -> Result<WeightedPoints<6>, DetectorError> {
        self.collect(&self.head, points_px, scores)
    }

    /// The points of the feet in one frame, in the order of [`FOOT_POINTS`].
    ///
    /// # Errors
    ///
    /// The number of points or scores differs from the number of names.
    pub fn foot_points(
        &self,
        points_px: &[DVec2],
        scores: &[f64],
    ) -> Result<WeightedPoints<4>, DetectorError> {
        self.collect(&self.feet, points_px, scores)
    }

    /// Which of [`HEAD_POINTS`] the detector can provide.
    pub fn available_head_points(&self) -> [bool; 6] {
        self.head.map(|source| source != Source::Absent)
    }

    /// The pairs of right and left points: legs from hip to toes, then arms, then head.
    pub fn side_pairs(&self) -> Vec<SidePair> {
        let place = |name: &str| self.names.iter().position(|other| *other == name);
        let pair = |&(group, right, left, _): &(SwapGroup, &'static str, &str, _)| {
            let part = right.trim_start_matches("right_");
            Some(SidePair { group, part, right: place(right)?, left: place(left)? })
        };
        SIDE_PARTS.iter().filter_map(pair).collect()
    }

    fn collect<const N: usize>(
        &self,
        sources: &[Source; N],
        points_px: &[DVec2],
        scores: &[f64],
    ) -> Result<WeightedPoints<N>, DetectorError> {
        let expected = self.names.len();
        for (what, got) in [("points", points_px.len()), ("scores", scores.len())] {
            if got != expected {
                return Err(DetectorError::Count { what, expected, got });
            }
        }
        let middle = |[a, b]: [usize; 2]| points_px[a].midpoint(points_px[b]);
        let points_px = sources.map(|source| match source {
            Source::Own(at) => points_px[at],
            Source::Middle(ends) => middle(ends),
            Source::OnTrunk([hips, shoulders]) => middle(shoulders).lerp(middle(hips), PELVIS_ON_TRUNK),
            Source::Absent => DVec2::NAN,
        });
        let least =
            |places: &[usize]| places.iter().map(|&at| usable_score(scores[at])).fold(f64::MAX, f64::min);
        let weights = sources.map(|source| match source {
            Source::Own(at) => least(&[at]),
            Source::Middle(ends) => least(&ends),
            Source::OnTrunk(places) => least(places.as_flattened()),
            Source::Absent => 0.0,
        });
        let mut found = WeightedPoints { points_px, weights };
        for (point, weight) in found.points_px.iter_mut().zip(&mut found.weights) {
            if !point.is_finite() {
                (*point, *weight) = (DVec2::NAN, 0.0);
            }
        }
        Ok(found)
    }
}

fn usable_score(score: f64) -> f64 {
    if score.is_finite() { score.max(0.0) } else { 0.0 }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::keypoints::names::joint_names;
    use crate::synth::random::Random;
    use proptest::prelude::*;

    /// Indices copied by hand from the makers' own documents, for the points where a mistake would do most
    /// harm.
    #[test]
    fn places_are_those_the_makers_document() {
        let at = |layout: &str, place: usize| Layout::by_name(layout).unwrap().joints[place];
        assert_eq!(
            [at("body_25", 8), at("body_25", 11), at("body_25", 22)],
            ["mid_hip", "right_ankle", "right_big_toe"]
        );
        assert_eq!(
            [at("BODY25B", 6), at("body-25b", 15), at("BODY_25B", 21)],
            ["right_shoulder", "left_ankle", "left_heel"]
        );
        assert_eq!([at("COCO_18", 8), at("COCO_18", 13)], ["right_hip", "left_ankle"]);
        assert_eq!([at("COCO_17", 5), at("COCO_17", 16)], ["left_shoulder", "right_ankle"]);
        assert_eq!([at("HALPE_26", 19), at("HALPE_26", 25)], ["mid_hip", "right_heel"]);
        assert_eq!([at("MEDIAPIPE_33", 24), at("MEDIAPIPE_33", 31)], ["right_hip", "left_big_toe"]);
        let counts = LAYOUTS.each_ref().map(|layout| layout.joints.len());
        assert_eq!(counts, [25, 25, 18, 17, 26, 33, 14, 12]);
    }

    #[test]
    fn every_layout_holds_known_names_once_and_its_sides_in_pairs() {
        for layout in &LAYOUTS {
            let detector = Detector::from_names(layout.joints).unwrap();
            assert_eq!(detector, Detector::from_layout(layout));
            let sided = layout.joints.iter().filter(|name| name.contains("right_") || name.contains("left_"));
            assert_eq!(2 * detector.side_pairs().len(), sided.count(), "{}", layout.name);
            for pair in detector.side_pairs() {
                let other_side = layout.joints[pair.right].replace("right", "left");
                assert_eq!(layout.joints[pair.left], other_side);
            }
        }
    }

    #[test]
    fn spellings_of_all_origins_lead_to_one_name() {
        for (name, spellings) in [
            ("right_knee", ["RKnee", "Rknee", "RIGHT_KNEE", "right knee", "RKN", "knee_right"].as_slice()),
            ("left_shoulder", &["LSH", "LShoulder", "left-shoulder"]),
            ("right_elbow", &["REL", "relbow"]),
            ("left_wrist", &["LWR"]),
            ("right_hip", &["RHP", "RHip"]),
            ("left_ankle", &["LAN", "LAnkle"]),
            ("right_ear", &["REar"]),
            ("left_eye", &["LEye"]),
            ("left_big_toe", &["LBigToe", "LEFT_FOOT_INDEX"]),
            ("right_index", &["RIGHT_INDEX"]),
            ("left_mouth", &["MOUTH_LEFT"]),
            ("mid_hip", &["MidHip", "Hip", "CHip"]),
            ("head_top", &["Head", "HeadTop"]),
            ("upper_neck", &["UpperNeck"]),
        ] {
            for spelling in spellings {
                assert_eq!(joint_name(spelling).unwrap(), name, "{spelling}");
            }
        }
        for name in joint_names() {
            assert_eq!(joint_name(name).unwrap(), name);
        }
    }

    #[test]
    fn refusals_name_what_is_known_and_what_is_nearest() {
        let message = joint_name("right_nkee").unwrap_err().to_string();
        assert!(
            message.contains("did you mean `right_knee`?") && message.contains("left_ankle"),
            "{message}"
        );
        let message = joint_name("sternum").unwrap_err().to_string();
        assert!(!message.contains("did you mean") && message.contains("known are"), "{message}");
        let message = Layout::by_name("BODY_26").unwrap_err().to_string();
        assert!(message.contains("did you mean `BODY_25`?") && message.contains("HALPE_26"), "{message}");
        let message = Layout::from_points(19, &[]).unwrap_err().to_string();
        assert!(message.contains("19 points") && message.contains("18 (COCO_18)"), "{message}");
        let message = Detector::from_names(&["RKnee", "nose", "RKN"]).unwrap_err().to_string();
        assert_eq!(message, "joint `right_knee` is named twice, at places 0 and 2");
        let detector = Detector::from_names(&["nose"]).unwrap();
        let message = detector.stick_joints(&[DVec2::ZERO; 2], &[1.0]).unwrap_err().to_string();
        assert_eq!(message, "expected 1 points, got 2");
        for name in ["", "_", &"x".repeat(100_000)] {
            assert!(joint_name(name).is_err() && Layout::by_name(name).is_err());
        }
    }

    #[test]
    fn the_trunk_lengths_of_table_a1_place_the_pelvis() {
        // Shoulders 56.07 above the hips, drawn at 1 px/cm, leaning: the pelvis is 10.09 up that axis and its
        // distance from the neck is 45.98.
        let names = ["right_shoulder", "left_shoulder", "right_hip", "left_hip"];
        let axis = DVec2::from_angle(-1.4);
        let (hips, across) = (DVec2::new(300.0, 500.0), 16.1 * axis.perp());
        let shoulders = hips + 56.07 * axis;
        let points = [shoulders - across, shoulders + across, hips - across, hips + across];
        let found =
            Detector::from_names(&names).unwrap().stick_joints(&points, &[0.9, 0.8, 0.7, 0.6]).unwrap();
        let (neck, pelvis) = (found.points_px[0], found.points_px[3]);
        assert!(
            ((pelvis - hips).length() - 10.09).abs() < 1e-9
                && ((neck - pelvis).length() - 45.98).abs() < 1e-9
        );
        assert_eq!((found.weights[0], found.weights[3]), (0.8, 0.6));
        assert!(found.points_px[8].is_nan() && found.weights[8] == 0.0, "no wrist was given");
    }

    #[test]
    fn the_neck_is_the_detectors_own_or_the_middle_of_the_shoulders() {
        let marked = |layout: &str| {
            let layout = Layout::by_name(layout).unwrap();
            let points: Vec<DVec2> = (0..layout.joints.len()).map(|k| DVec2::new(k as f64, 100.0)).collect();
            let detector = Detector::from_layout(layout);
            let scores = vec![1.0; points.len()];
            let stick = detector.stick_joints(&points, &scores).unwrap();
            (stick.points_px[0].x, detector.head_points(&points, &scores).unwrap().points_px[0].x)
        };
        assert_eq!(marked("BODY_25"), (1.0, 1.0));
        assert_eq!(marked("HALPE_26"), (18.0, 18.0));
        assert_eq!(marked("COCO_17"), (5.5, 5.5));
        assert_eq!(marked("BODY_25B"), (5.5, 17.0));
        let body_only = Detector::from_layout(Layout::by_name("MOCAP_12").unwrap());
        assert_eq!(body_only.available_head_points(), [true, false, false, false, false, false]);
    }

    /// A standing figure in some layout, seen from the front or the side, with noise of some pixels.
    fn standing(layout: &Layout, random: &mut Random, noise_px: f64, width: f64) -> Vec<DVec2> {
        let height = |name: &str| match name.split_once('_').map_or(name, |(_, part)| part) {
            "ankle" | "heel" | "big_toe" | "small_toe" => 0.05,
            "knee" => 0.28,
            "hip" | "wrist" => 0.52,
            "elbow" => 0.65,
            "shoulder" | "neck" => 0.82,
            _ => 0.93,
        };
        let side =
            |name: &str| if name.starts_with("right") { -1.0 } else { f64::from(name.starts_with("left")) };
        let place = |name: &&str| DVec2::new(300.0 + width * side(name), 400.0 - 300.0 * height(name));
        let noise = |random: &mut Random| DVec2::from(random.normal_pair().map(f64::from)) * noise_px;
        layout.joints.iter().map(|name| place(name) + noise(random)).collect()
    }

    #[test]
    fn twenty_five_points_are_told_apart_by_the_middle_test() {
        let mut random = Random::new(3);
        for layout in &LAYOUTS[..2] {
            for (width, noise_px) in [(30.0, 0.0), (30.0, 4.0), (0.0, 0.0), (5.0, 4.0)] {
                let points: Vec<DVec2> =
                    (0..20).flat_map(|_| standing(layout, &mut random, noise_px, width)).collect();
                assert_eq!(Layout::from_points(25, &points).unwrap().name, layout.name, "{width} {noise_px}");
            }
        }
        let on_the_edge =
            |k: usize| DVec2::new(if k == 1 { 5.0 } else { 0.0 }, if k == 0 { 100.0 } else { 0.0 });
        let edge: Vec<DVec2> = (0..25).map(on_the_edge).collect();
        for unclear in
            [edge.as_slice(), &[], &[DVec2::NAN; 25], &[DVec2::splat(1e308); 25], &[DVec2::ONE; 24]]
        {
            let error = Layout::from_points(25, unclear).unwrap_err();
            assert!(error.to_string().contains("name the layout"), "{error}");
        }
    }

    /// Points 1, 2, 5, 8, 9, 12 of two real BODY_25 frames, with the nose and a heel: figures that published
    /// software contains as examples.
    #[test]
    fn real_body_25_frames_are_recognised() {
        let frames = [
            [
                (0, 378.929, 123.152),
                (1, 378.89, 155.758),
                (2, 350.195, 153.183),
                (5, 402.429, 155.77),
                (8, 378.881, 234.069),
                (9, 360.64, 234.067),
                (12, 392.025, 234.092),
                (24, 369.755, 341.068),
            ],
            [
                (0, 789.327, 185.923),
                (1, 736.197, 294.809),
                (2, 645.14, 297.87),
                (5, 821.695, 291.873),
                (8, 742.157, 577.328),
                (9, 692.05, 577.387),
                (12, 792.319, 574.466),
                (24, 709.862, 998.327),
            ],
        ];
        for frame in frames {
            let mut points = [DVec2::NAN; 25];
            for (place, u, v) in frame {
                points[place] = DVec2::new(u, v);
            }
            assert_eq!(Layout::from_points(25, &points).unwrap().name, "BODY_25");
        }
    }

    proptest! {
        /// Whatever is missing or invalid in a frame, a joint is missing exactly when one of its sources is.
        #[test]
        fn a_joint_is_missing_exactly_when_a_source_is(
            which in 0..LAYOUTS.len(),
            missing in prop::collection::vec(any::<bool>(), 33),
            scores in prop::collection::vec(prop_oneof![0.0..1.0f64, Just(f64::NAN), Just(-1.0)], 33),
        ) {
            let layout = &LAYOUTS[which];
            let count = layout.joints.len();
            let point = |k: usize| if missing[k] { DVec2::NAN } else { DVec2::new(k as f64, 2.0 * k as f64) };
            let points: Vec<DVec2> = (0..count).map(point).collect();
            let found = Detector::from_layout(layout).stick_joints(&points, &scores[..count]).unwrap();
            let seen = |name: &str| {
                layout.joints.iter().position(|joint| *joint == name).is_some_and(|k| !missing[k])
            };
            for (k, name) in STICK_JOINTS.into_iter().enumerate() {
                let both = |part: &str| seen(&format!("right_{part}")) && seen(&format!("left_{part}"));
                let expected = match name {
                    "neck" if layout.joints.contains(&"neck") => seen("neck"),
                    "neck" => both("shoulder"),
                    "pelvis" if layout.joints.contains(&"pelvis") => seen("pelvis"),
                    "pelvis" => both("shoulder") && both("hip"),
                    _ => seen(name),
                };
                prop_assert_eq!(found.points_px[k].is_finite(), expected, "{}", name);
                prop_assert!(found.weights[k] >= 0.0 && found.weights[k] <= 1.0);
                prop_assert!(expected || found.weights[k] == 0.0);
            }
        }

        #[test]
        fn no_text_breaks_the_names(text in any::<String>()) {
            let _ = joint_name(&text);
            let _ = Layout::by_name(&text);
        }
    }
}
