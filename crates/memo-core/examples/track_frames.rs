//! Tracks a walker through a folder of PNG frames and prints `track.csv` rows, the gait events on standard error.
//!
//! `cargo run --release -p memo-core --example track_frames -- FRAMES_DIR RATE_HZ HEIGHT_M [CAMERA.toml]`

use memo_core::model::{CameraFileOptions, SideJoints};
use memo_core::track::{Row, SeekReport};
use memo_core::{Camera, Frame, TrackedWalk, Tracker, TrackerOptions};
use std::error::Error;
use std::path::PathBuf;

fn main() -> Result<(), Box<dyn Error>> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let (walks, seek_report) = tracked(&arguments)?;
    println!("{}", header());
    for walk in &walks {
        report(walk);
        walk.rows().iter().for_each(|row| println!("{}", csv_row(row, walk)));
    }
    if walks.is_empty() {
        eprintln!("nobody followed: {seek_report:?}");
    }
    Ok(())
}

fn tracked(arguments: &[String]) -> Result<(Vec<TrackedWalk>, SeekReport), Box<dyn Error>> {
    let [frames, rate_hz, height_m, rest @ ..] = arguments else {
        return Err("usage: track_frames FRAMES_DIR RATE_HZ HEIGHT_M [CAMERA.toml]".into());
    };
    let rate_hz: f64 = rate_hz.parse()?;
    let mut options = TrackerOptions::for_height(height_m.parse()?);
    if let Some(file) = rest.first() {
        options.camera = Some(Camera::from_file(file.as_ref(), &CameraFileOptions::default())?);
    }

    let mut files: Vec<PathBuf> =
        std::fs::read_dir(frames)?.map(|entry| entry.map(|e| e.path())).collect::<Result<_, _>>()?;
    files.retain(|file| file.extension().is_some_and(|end| end.eq_ignore_ascii_case("png")));
    // frame9 before frame10: shorter names first, then by letter.
    files.sort_by_key(|file| (file.as_os_str().len(), file.clone()));
    let mut tracker = Tracker::new(options)?;
    for (index, file) in files.iter().enumerate() {
        let grey = image::open(file)?.to_luma8();
        tracker.update(&Frame::try_from(&grey)?, index as f64 / rate_hz)?;
    }
    tracker.finish()?;
    Ok((tracker.take_finished(), tracker.seek_report()))
}

fn report(walk: &TrackedWalk) {
    let start = &walk.start;
    eprintln!(
        "frames {:?}..{:?}, {:?} (other direction: p = {:.3}), p_swapped {:.3}, {:?}",
        walk.steps().first().map(|s| s.frame),
        walk.steps().last().map(|s| s.frame),
        walk.direction(),
        start.p_other_direction,
        walk.p_swapped(),
        walk.fit.as_ref().map(|fit| fit.as_ref().map(|fit| fit.quality))
    );
    for event in walk.events() {
        eprintln!("{:.4} s, frame {:.2}: {:?}, {:?}", event.time_s, event.frame, event.kind, event.side);
    }
}

fn header() -> String {
    let mut names: Vec<String> =
        ["frame", "time_s", "x_m", "y_m", "z_m", "heading_rad", "phase", "p_swapped", "speed_mps"]
            .map(String::from)
            .into();
    names.extend(["sd_x_m", "sd_y_m", "sd_z_m", "sd_phase"].map(String::from));
    for side in ["right", "left"] {
        names.extend(["hip", "knee", "shoulder", "elbow"].map(|angle| format!("{side}_{angle}_deg")));
    }
    for side in ["right", "left"] {
        for joint in SideJoints::NAMES {
            names.extend(["x_m", "y_m", "z_m", "u_px", "v_px"].map(|what| format!("{side}_{joint}_{what}")));
        }
    }
    names.join(",")
}

fn csv_row(row: &Row, walk: &TrackedWalk) -> String {
    let p = row.torso_centre;
    let mut values =
        vec![row.time_s, p.x, p.y, p.z, row.heading_rad, row.phase, row.p_swapped, row.speed_mps];
    values.extend(row.sd);
    for side in [row.posture.right, row.posture.left] {
        values.extend([side.hip, side.knee, side.shoulder, side.elbow].map(f64::to_degrees));
    }
    for joint in [row.right, row.left].into_iter().flat_map(SideJoints::to_array) {
        let pixel = walk.camera.project(joint).unwrap_or(memo_core::glam::DVec2::NAN);
        values.extend([joint.x, joint.y, joint.z, pixel.x, pixel.y]);
    }
    let values: Vec<String> = values.iter().map(|v| format!("{v:.6}")).collect();
    format!("{},{}", row.frame, values.join(","))
}

#[cfg(test)]
mod tests {
    use super::*;
    use memo_core::SynthScene;
    use memo_core::synth::SceneOptions;

    #[test]
    fn a_walker_in_a_folder_of_frames_is_followed_in_the_order_of_their_numbers() -> Result<(), Box<dyn Error>>
    {
        let scene = SynthScene::new(SceneOptions { frames: 50, ..SceneOptions::default() })?;
        let folder = std::env::temp_dir().join(format!("memo-track-frames-{}", std::process::id()));
        std::fs::create_dir_all(&folder)?;
        for k in 0..scene.len() {
            let frame = scene.frame(k);
            let (width, height) = (frame.width() as u32, frame.height() as u32);
            let png = image::GrayImage::from_raw(width, height, frame.into_vec()).ok_or("as many pixels")?;
            png.save(folder.join(format!("frame{k}.png")))?;
        }
        let camera = folder.join("camera.toml");
        std::fs::write(&camera, scene.camera.to_toml_string("camera")?)?;
        let height_m = scene.walker.body.height_m.to_string();
        let arguments =
            [folder.display().to_string(), "25".to_owned(), height_m, camera.display().to_string()];
        let found = tracked(&arguments);
        std::fs::remove_dir_all(&folder)?;
        let (walks, _) = found?;
        let [walk] = walks.as_slice() else { return Err(format!("{} walks", walks.len()).into()) };
        for row in walk.rows() {
            let truth = scene.truth(row.frame).ok_or("the walker is there")?;
            // Across the path memo expects a pelvis that sways, and the drawn model's does not.
            let off = row.torso_centre - truth.posed.torso_centre;
            assert!(off.x.abs() < 0.05 && off.y.abs() < 0.15 && off.z.abs() < 0.05, "{off}");
            assert_eq!(csv_row(&row, walk).split(',').count(), header().split(',').count());
        }
        Ok(())
    }
}
