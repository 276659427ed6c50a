//! Which true postures of real people the constraints keep, and how many others.

mod mocap;

use std::collections::BTreeMap;

use memo_core::posture::Bearings;
use memo_core::posture::group::{DEFAULT_GROUP_M, group};
use memo_core::posture::rules::MotionModel;
use memo_core::posture::skeleton::SegmentLengths;
use memo_core::posture::tree::{TreeOptions, View};
use mocap::{Motion, WALKS, load, view};

const VIEWS: [(&str, f64); 3] = [("front", 0.0), ("45 deg", 45.0), ("side", 90.0)];

/// What happened to the true leaf in a set of frames, and the number of leaves and groups.
#[derive(Default)]
struct Tally {
    frames: usize,
    kept: usize,
    lost: BTreeMap<String, (usize, f64)>,
    leaves: Vec<usize>,
    groups: Vec<usize>,
}

impl Tally {
    fn percent(&self) -> f64 {
        100.0 * self.kept as f64 / self.frames as f64
    }

    fn print(&self, title: &str) {
        let median = |values: &[usize]| {
            let mut sorted = values.to_vec();
            sorted.sort_unstable();
            sorted.get(sorted.len() / 2).copied().unwrap_or(0)
        };
        println!(
            "{title:45} frames {:4}  true leaf kept {:5.1} %  median leaves {:4}, groups {:3}",
            self.frames,
            self.percent(),
            median(&self.leaves),
            median(&self.groups)
        );
        for (name, (times, worst)) in &self.lost {
            println!("      lost to {name} {times} times, by up to {worst:.3} (rad or m)");
        }
    }
}

struct Setting<'a> {
    azimuth_deg: f64,
    noise_px: f64,
    options: &'a TreeOptions,
    count_groups: bool,
}

fn tally(motions: &[Motion], setting: &Setting) -> Tally {
    let mut tally = Tally::default();
    for motion in motions {
        let lengths = SegmentLengths::from_figures(&motion.figures).unwrap();
        for (i, figure) in motion.figures.iter().enumerate() {
            let seen = view(figure, motion.heading, setting.azimuth_deg, setting.noise_px, i as u64);
            let truth = seen.figure_in_camera;
            let neck = truth.0[0];
            let view = View::new(seen.rays, neck, lengths);
            let bearings = Bearings { up: Some(seen.up), heading: Some(seen.heading), head: None };
            let options = setting.options.clone().with_bearings(bearings);
            let path = view.nearest_path(&truth);
            let violations = view.violations(path, &options);
            let found = view.interpret(&options).unwrap();
            tally.frames += 1;
            let kept = found.survivors.contains(&path);
            assert_eq!(kept, violations.is_empty());
            tally.kept += usize::from(kept);
            for violation in violations {
                let entry = tally.lost.entry(violation.constraint.name()).or_default();
                *entry = (entry.0 + 1, entry.1.max(violation.excess));
            }
            tally.leaves.push(found.survivors.len());
            if setting.count_groups {
                tally.groups.push(group(&found.figures(), DEFAULT_GROUP_M).len());
            }
        }
    }
    tally
}

fn motions(names: &[&str]) -> Option<Vec<Motion>> {
    names.iter().map(|name| load(name)).collect()
}

#[test]
fn survey() {
    let Some(walks) = motions(&WALKS) else { return };
    let Some(others) = motions(&["CMU_02_04_jump", "CMU_02_05_punch"]) else { return };
    let physical = TreeOptions::physical();
    let general = TreeOptions::physical().with_motion(MotionModel::walking_general());
    let walking = TreeOptions::physical().with_motion(MotionModel::walking());
    let paper = TreeOptions::physical_paper();
    let paper12 = TreeOptions::physical_paper().with_motion(MotionModel::walking_general_paper());
    let paper15 = TreeOptions::physical_paper().with_motion(MotionModel::walking_paper());
    for noise_px in [0.0, 3.0] {
        for (name, azimuth_deg) in VIEWS {
            for (what, options) in [
                ("physical", &physical),
                ("rules 1-2", &general),
                ("rules 1-5", &walking),
                ("paper physical", &paper),
                ("paper rules 1-2", &paper12),
                ("paper rules 1-5", &paper15),
            ] {
                let count_groups = what == "rules 1-5";
                let setting = Setting { azimuth_deg, noise_px, options, count_groups };
                tally(&walks, &setting).print(&format!("walks {name} {noise_px} px {what}"));
            }
            for (what, options) in [("physical", &physical), ("rules 1-5", &walking)] {
                let setting = Setting { azimuth_deg, noise_px, options, count_groups: false };
                for other in &others {
                    tally(std::slice::from_ref(other), &setting)
                        .print(&format!("{} {name} {noise_px} px {what}", other.name));
                }
            }
        }
    }
}
