//! Finds the postures in a CSV of keypoints, or of a synthetic walker, and prints them as rows.
//!
//! `cargo run --release -p memo-core --example posture_keypoints -- KEYPOINTS.csv CAMERA [HEIGHT_M]`
//! `cargo run --release -p memo-core --example posture_keypoints -- --walker FRAMES`
//!
//! The CSV has a header and rows of time_s, then u, v in pixels of the 14 joints from neck to left ankle; an
//! empty field is missing. Rows of the output: frame, survivors, groups, then x, y, z in metres (world, Z up)
//! of the linked joints.

use memo_core::glam::DVec2;
use memo_core::model::{CameraFileOptions, JOINT_COUNT};
use memo_core::synth::{Random, SampledWalkOptions};
use memo_core::{
    Camera, Detector, Joint, KeypointSequence, PerJoint, PostureSequence, SequenceOptions, TrackerOptions,
    postures, sampled_walk,
};
use std::error::Error;
use std::time::Instant;

/// Height of the synthetic walker, metres.
const HEIGHT_M: f64 = 1.75;

fn main() -> Result<(), Box<dyn Error>> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let start = Instant::now();
    let found = found(&arguments)?;
    eprintln!("{} frames in {:.2} s", found.frames.len(), start.elapsed().as_secs_f64());
    print(&found);
    Ok(())
}

fn found(arguments: &[String]) -> Result<PostureSequence, Box<dyn Error>> {
    let mut options = SequenceOptions::default();
    let ((times_s, points_px), camera) = match arguments {
        [walker, frames] if walker == "--walker" => {
            options.height_m = Some(HEIGHT_M);
            synthetic(frames.parse()?)?
        }
        [csv, camera, height_m @ ..] if height_m.len() < 2 => {
            options.height_m = height_m.first().map(|height_m| height_m.parse()).transpose()?;
            let camera = Camera::from_file(camera.as_ref(), &CameraFileOptions::default())?;
            (read(&std::fs::read_to_string(csv)?)?, camera)
        }
        _ => {
            return Err("usage: posture_keypoints KEYPOINTS.csv CAMERA [HEIGHT_M] | --walker FRAMES".into());
        }
    };
    let weights = vec![PerJoint([1.0; JOINT_COUNT]); times_s.len()];
    let sequence = KeypointSequence {
        times_s: &times_s,
        points_px: &points_px,
        weights: &weights,
        head_points_px: None,
        foot_points_px: None,
    };
    Ok(postures(&sequence, &camera, &options)?)
}

fn print(found: &PostureSequence) {
    found.warnings.iter().for_each(|warning| eprintln!("{warning}"));
    eprintln!("moving direction: {}, scale: {}", found.heading.from.name(), found.lengths.scale_name());
    let axes = |joint: Joint| ["x", "y", "z"].map(|axis| format!("{}_{axis}_m", joint.name()));
    println!("frame,survivors,groups,{}", Joint::ALL.map(axes).concat().join(","));
    for (t, (frame, figure)) in found.frames.iter().zip(&found.linked.figures).enumerate() {
        let (survivors, groups) = frame.as_ref().map_or((0, 0), |f| (f.survivors(), f.groups.len()));
        let values = figure.0.map(|p| format!("{:.4},{:.4},{:.4}", p.x, p.y, p.z));
        println!("{t},{survivors},{groups},{}", values.join(","));
    }
}

type Keypoints = (Vec<f64>, Vec<PerJoint<DVec2>>);

fn read(csv: &str) -> Result<Keypoints, Box<dyn Error>> {
    let (mut times_s, mut points_px) = (vec![], vec![]);
    for (row, line) in csv.lines().enumerate().skip(1) {
        let parse = |field: &str| match field.trim() {
            "" => Ok(f64::NAN),
            number => number.parse(),
        };
        let fields: Vec<f64> =
            line.split(',').map(parse).collect::<Result<_, _>>().map_err(|e| format!("row {row}: {e}"))?;
        let [time_s, pixels @ ..] = fields.as_slice() else { continue };
        if pixels.len() != 2 * JOINT_COUNT {
            return Err(
                format!("row {row}: wanted {} fields, got {}", 2 * JOINT_COUNT + 1, fields.len()).into()
            );
        }
        times_s.push(*time_s);
        points_px.push(PerJoint(std::array::from_fn(|j| DVec2::new(pixels[2 * j], pixels[2 * j + 1]))));
    }
    Ok((times_s, points_px))
}

/// A walker at 25 Hz and 1 px of noise, seen from the side by a level camera 6 m away.
fn synthetic(frames: usize) -> Result<(Keypoints, Camera), Box<dyn Error>> {
    let camera = Camera::level([1920, 1080], 0.9273, 1.2, 6.0)?;
    let walker = TrackerOptions::default().walker(HEIGHT_M)?;
    let walk = sampled_walk(
        &walker,
        &SampledWalkOptions { frames, rate_hz: 25.0, ..SampledWalkOptions::default() },
    )?;
    let detector = Detector::from_names(walk.names())?;
    let mut random = Random::new(1);
    let mut points_px = vec![];
    for frame in 0..walk.frames() {
        let mut seen = vec![];
        for point in 0..walk.points() {
            let noise_px = DVec2::from(random.normal_pair().map(f64::from));
            let pixel = walk.at(frame, point).and_then(|place| camera.project(place));
            seen.push(pixel.map_or(DVec2::NAN, |pixel| pixel + noise_px));
        }
        points_px.push(PerJoint(detector.stick_joints(&seen, &vec![1.0; seen.len()])?.points_px));
    }
    Ok(((walk.times_s().to_vec(), points_px), camera))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_synthetic_walk_has_a_posture_in_every_frame() -> Result<(), Box<dyn Error>> {
        let found = found(&["--walker".to_owned(), "8".to_owned()])?;
        assert_eq!(found.linked.figures.len(), 8);
        assert!(found.linked.figures.iter().all(|figure| figure[Joint::RightAnkle].is_finite()));
        Ok(())
    }

    #[test]
    fn an_empty_field_is_a_missing_joint_and_a_short_row_is_named() -> Result<(), Box<dyn Error>> {
        let full = vec!["1.5"; 2 * JOINT_COUNT].join(",");
        let (times_s, points_px) = read(&format!("header\n0,{full}\n0.04,{}\n", &full[3..]))?;
        assert_eq!(times_s, [0.0, 0.04]);
        assert!(points_px[0].0.iter().all(|p| p.is_finite()));
        assert!(points_px[1][Joint::Neck].x.is_nan() && points_px[1][Joint::LeftAnkle].is_finite());
        assert!(read("header\n0,1,2\n").unwrap_err().to_string().starts_with("row 1"));
        Ok(())
    }
}
