//! Motion capture and real detections for tests of postures.
//!
//! Needs the recordings. Four walks at 20-24 Hz; the camera
//! is 1.2 m high, f = 1920 px.

use glam::{DMat3, DVec2, DVec3};
use memo_core::model::PELVIS_ON_TRUNK;
use memo_core::posture::lift::JointRays;
use memo_core::synth::Random;
use memo_core::{Camera, Joint, PerJoint, SegmentLengths, StickFigure};

use crate::recordings;

const WALKS: [&str; 4] = ["BTK_ANTO_M_hole", "BTK_BELT_C", "CMU_02_01", "CMU_12_01"];
pub struct Walk {
    pub name: &'static str,
    pub rate_hz: f64,
    pub figures: Vec<StickFigure>,
    pub lengths: SegmentLengths,
    pub forward: DVec3,
}

pub fn walks() -> Vec<Walk> {
    let walk = |name| walk(name, &recordings::text(&format!("mocap/joints/{name}.csv")));
    WALKS.into_iter().map(walk).collect()
}

/// Every 5th raw frame; the neck 3.77 cm before the middle of the shoulders, the pelvis 10 cm above that of
/// the hips.
fn walk(name: &'static str, csv: &str) -> Walk {
    let mut lines = csv.lines();
    let rate = lines.next().unwrap().split(',').find_map(|f| f.trim().strip_suffix(" Hz")).unwrap();
    let header: Vec<&str> = lines.next().unwrap().split(',').collect();
    let skip = if name == "CMU_12_01" { 10 } else { 0 };
    let rows: Vec<Vec<f64>> = lines
        .skip(skip)
        .step_by(5)
        .map(|line| line.split(',').map(|c| c.parse().unwrap_or(f64::NAN)).collect())
        .collect();
    let column = |name: &str| header.iter().position(|h| *h == name).unwrap();
    let point = |row: &[f64], joint: &str| {
        let [x, y, z] = ["x", "y", "z"].map(|axis| row[column(&format!("{joint}_{axis}"))]);
        DVec3::new(x, y, z)
    };
    let middle = |row: &[f64], joint: &str| {
        0.5 * (point(row, &format!("R{joint}")) + point(row, &format!("L{joint}")))
    };
    let (first, last) = (rows.first().unwrap(), rows.last().unwrap());
    let forward = (middle(last, "HP") - middle(first, "HP")).with_z(0.0).normalize();
    let names = [
        (Joint::RightShoulder, "SH"),
        (Joint::RightHip, "HP"),
        (Joint::RightElbow, "EL"),
        (Joint::RightWrist, "WR"),
        (Joint::RightKnee, "KN"),
        (Joint::RightAnkle, "AN"),
    ];
    let figure = |row: &Vec<f64>| {
        let mut figure = StickFigure::UNKNOWN;
        for (right, code) in names {
            figure[right] = point(row, &format!("R{code}"));
            figure[right.mirrored()] = point(row, &format!("L{code}"));
        }
        let (shoulders, hips) = (middle(row, "SH"), middle(row, "HP"));
        figure[Joint::Neck] = shoulders + 0.0377 * forward;
        figure[Joint::Pelvis] = hips + 0.1 * (shoulders - hips).normalize();
        figure
    };
    let figures: Vec<StickFigure> = rows.iter().map(figure).collect();
    let lengths = SegmentLengths::from_figures(&figures).unwrap();
    Walk { name, rate_hz: rate.parse::<f64>().unwrap() / 5.0, figures, lengths, forward }
}

/// A level camera 1.2 m above the ground that looks at a point from an azimuth off the walking direction.
pub fn camera(target: DVec3, forward: DVec3, azimuth_deg: f64, distance_m: f64) -> Camera {
    let towards = DMat3::from_rotation_z(azimuth_deg.to_radians()) * forward;
    let position = target.with_z(1.2) + distance_m * towards;
    let right = (-towards).cross(DVec3::Z);
    let rotation = DMat3::from_cols(right, -DVec3::Z, -towards).transpose();
    Camera {
        translation: rotation * -position,
        rotation,
        ..Camera::level([1920, 1920], 0.9273, 1.2, 4.0).unwrap()
    }
}

/// What the camera sees, and the true distance of the neck.
pub fn view(camera: &Camera, figure: &StickFigure, noise_px: f64, random: &mut Random) -> (JointRays, f64) {
    let mut pixels = PerJoint([DVec2::NAN; 14]);
    for joint in Joint::ALL {
        let [a, b] = random.normal_pair().map(f64::from);
        pixels[joint] = camera.project_ideal(figure[joint]).unwrap() + noise_px * DVec2::new(a, b);
    }
    let rays = JointRays::from_pixels(camera, &pixels, &PerJoint([1.0; 14]), noise_px).unwrap();
    (rays, camera.camera_from_world(figure[Joint::Neck]).length())
}

/// The sections of BODY_25B (OpenPose) and of the TRC that are joints here.
const BODY_25B: [(Joint, usize, &str); 12] = [
    (Joint::RightShoulder, 6, "RShoulder"),
    (Joint::LeftShoulder, 5, "LShoulder"),
    (Joint::RightHip, 12, "RHip"),
    (Joint::LeftHip, 11, "LHip"),
    (Joint::RightElbow, 8, "RElbow"),
    (Joint::LeftElbow, 7, "LElbow"),
    (Joint::RightWrist, 10, "RWrist"),
    (Joint::LeftWrist, 9, "LWrist"),
    (Joint::RightKnee, 14, "RKnee"),
    (Joint::LeftKnee, 13, "LKnee"),
    (Joint::RightAnkle, 16, "RAnkle"),
    (Joint::LeftAnkle, 15, "LAnkle"),
];

/// The triangulated figures, world axes; neck and pelvis on the line from shoulders to hips.
pub fn triangulated(trc: &str) -> Vec<StickFigure> {
    let lines: Vec<&str> = trc.lines().collect();
    let markers: Vec<&str> = lines[3].split('\t').filter(|c| !c.trim().is_empty()).skip(2).collect();
    let figure = |line: &&str| {
        let values: Vec<f64> = line.split('\t').filter_map(|c| c.trim().parse().ok()).collect();
        let mut figure = StickFigure::UNKNOWN;
        for (joint, _, name) in BODY_25B {
            let at = 2 + 3 * markers.iter().position(|m| *m == name).unwrap();
            figure[joint] = DVec3::new(values[at + 2], values[at], values[at + 1]);
        }
        let (shoulders, hips) = (
            0.5 * (figure[Joint::RightShoulder] + figure[Joint::LeftShoulder]),
            0.5 * (figure[Joint::RightHip] + figure[Joint::LeftHip]),
        );
        figure[Joint::Neck] = shoulders;
        figure[Joint::Pelvis] = shoulders.lerp(hips, PELVIS_ON_TRUNK);
        figure
    };
    lines[5..].iter().filter(|l| !l.trim().is_empty()).map(figure).collect()
}

/// The first person's keypoints: u, v in pixels and score.
pub fn keypoints(json: &str) -> Vec<[f64; 3]> {
    let start = json.find("\"pose_keypoints_2d\": [").unwrap() + 22;
    let list = &json[start..start + json[start..].find(']').unwrap()];
    let values: Vec<f64> = list.split(',').map(|v| v.trim().parse().unwrap()).collect();
    values.chunks_exact(3).map(|point| [point[0], point[1], point[2]]).collect()
}

/// The first person's joints in pixels, score below 0.3 not seen.
pub fn detected(json: &str) -> PerJoint<DVec2> {
    let values = keypoints(json);
    let mut pixels = PerJoint([DVec2::NAN; 14]);
    for (joint, index, _) in BODY_25B {
        let [u, v, score] = values[index];
        if score > 0.3 {
            pixels[joint] = DVec2::new(u, v);
        }
    }
    let shoulders = 0.5 * (pixels[Joint::RightShoulder] + pixels[Joint::LeftShoulder]);
    let hips = 0.5 * (pixels[Joint::RightHip] + pixels[Joint::LeftHip]);
    pixels[Joint::Neck] = shoulders;
    pixels[Joint::Pelvis] = shoulders.lerp(hips, PELVIS_ON_TRUNK);
    pixels
}
