//! Explanation of a tracked frame: the terms of eqs. (7)-(11) at the chosen hypothesis, and the similarity over
//! the whole gait cycle (Rohr 1994, section 4.3, Fig. 19).
//!
//! While tracking, only the window and grid of each frame are kept ([`Look`]). The frame is then compared again
//! with the same code, window, grid and fitted person that the tracker used, so the numbers are the same. The
//! curve over the cycle is for one position: that of the best grid point. The search itself also moved the body
//! along the path and up and down at every phase, but only near the predicted phase. So a phase far away could
//! score somewhat higher at another position.
//!
//! Where other people are near, their bodies hide contours as in tracking, but their edges are not taken out.

use super::evidence::{Evidence, EvidenceError, EvidenceOptions, WindowEdges};
use super::score::{ModelLine, Similarity, similarity};
use super::search::{Axis, Grid, Hypothesis, Scene, search_at};
use super::walk::{Look, WalkOptions};

/// Number of phases of [`Explanation::cycle`]: twice as many as the search grid has in a cycle.
const CYCLE_PHASES: usize = 100;

/// Edges, contours and similarity of a frame at the chosen hypothesis.
#[derive(Debug, Clone, PartialEq)]
pub struct Explanation {
    /// Edge points and straight edges of the window.
    pub edges: WindowEdges,
    /// Visible contours of the model at the chosen hypothesis, ideal pixels.
    pub lines: Vec<ModelLine>,
    /// Eq. (11) at the chosen hypothesis, with the edge matched with each line. It differs from the value of the
    /// search, which uses a fast exponential, by some 1e-6.
    pub similarity: Similarity,
    /// Similarity over the whole cycle at the chosen position and height, computed by the search.
    pub cycle: Vec<PhaseScore>,
    /// The chosen hypothesis: the best point of the tracker's grid.
    pub chosen: Hypothesis,
}

/// Similarity at a phase.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PhaseScore {
    /// Gait phase in [0, 1).
    pub phase: f64,
    /// s(p) of eq. (11).
    pub similarity: f32,
}

/// Compares a frame with the model again, as the tracker did.
///
/// `scene` is the scene of the walk with the followed person
/// ([`TrackedWalk::scene`](super::result::TrackedWalk::scene)), `look` is that of the frame's step, whose path is taken.
pub fn explain(
    evidence: &Evidence,
    look: &Look,
    scene: &Scene<'_>,
    evidence_options: &EvidenceOptions,
    options: &WalkOptions,
) -> Result<Explanation, EvidenceError> {
    let scene = &Scene { path: look.path, ..*scene };
    // 1. The edges of the window.
    let edges = evidence.edges(&look.window, Some(scene.camera), evidence_options)?;
    // 2. The model's contours, each with the edge it matches.
    let grid = cycle_at(look);
    let lines = scene.searched_lines(&look.best, &grid, options.hidden_lines);
    let similarity = similarity(&lines, &edges.lines, &options.similarity);
    // 3. The similarity at all phases.
    let along = grid.along.nearest(look.best.along_m);
    let height = grid.height.nearest(look.best.height_m);
    let found = search_at(&edges.lines, scene, &grid, along, &options.similarity, options.hidden_lines);
    let score = |p: usize| PhaseScore {
        phase: grid.phase.at(p).rem_euclid(1.0),
        similarity: found.scores[grid.index(p, along, height)],
    };
    let mut cycle: Vec<PhaseScore> = (0..grid.phase.count).map(score).collect();
    cycle.sort_by(|a, b| a.phase.total_cmp(&b.phase));
    Ok(Explanation { edges, lines, similarity, cycle, chosen: look.best })
}

/// All phases at the positions and heights of the search. The chosen phase is among them.
fn cycle_at(look: &Look) -> Grid {
    let step = 1.0 / CYCLE_PHASES as f64;
    Grid {
        along: look.alongs,
        height: look.heights,
        phase: Axis { centre: look.best.phase - 0.5 * step, step, count: CYCLE_PHASES },
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::SynthScene;
    use crate::synth::SceneOptions;
    use crate::track::evidence::EvidenceStream;
    use crate::track::options::TrackerOptions;
    use crate::track::result::TrackedWalk;
    use crate::track::tracker::Tracker;

    fn tracked(scene: &SynthScene, options: &TrackerOptions) -> TrackedWalk {
        let mut tracker = Tracker::new(options.clone()).unwrap();
        for k in 0..scene.len() {
            tracker.update(&scene.frame(k).as_frame(), scene.time_s(k)).unwrap();
        }
        tracker.finish().unwrap();
        tracker.take_finished().remove(0)
    }

    fn explained(
        scene: &SynthScene,
        walk: &TrackedWalk,
        options: &TrackerOptions,
    ) -> Vec<(f32, Explanation)> {
        let mut stream = EvidenceStream::new(options.evidence);
        let mut all = Vec::new();
        let mut add = |evidence: Evidence| {
            if let Some(step) = walk.steps().iter().find(|s| s.frame == evidence.frame) {
                let why = explain(&evidence, &step.look, &walk.scene(0.0), &options.evidence, &walk.options)
                    .unwrap();
                all.push((step.similarity, why));
            }
        };
        for k in 0..scene.len() {
            stream.push(&scene.frame(k).as_frame(), scene.time_s(k)).unwrap().into_iter().for_each(&mut add);
        }
        stream.finish().unwrap().into_iter().for_each(&mut add);
        all
    }

    #[test]
    fn the_tracker_s_own_similarity_comes_out_again_and_no_near_phase_beats_it() {
        let scene = SynthScene::new(SceneOptions { seed: 3, frames: 60, ..SceneOptions::default() }).unwrap();
        let options = TrackerOptions {
            camera: Some(scene.camera.clone()),
            ..TrackerOptions::for_height(scene.walker.body.height_m)
        };
        let walk = tracked(&scene, &options);
        let all = explained(&scene, &walk, &options);
        assert_eq!(all.len(), walk.steps().len());
        for (tracked, why) in &all {
            let off = |p: f64| {
                let d = p - why.chosen.phase;
                d - d.round()
            };
            let here =
                why.cycle.iter().find(|s| off(s.phase).abs() < 1e-9).expect("the chosen phase is sampled");
            assert!((here.similarity - tracked).abs() < 2e-6, "curve {} tracked {tracked}", here.similarity);
            assert!(
                (why.similarity.value - tracked).abs() < 1e-4,
                "plain {} tracked {tracked}",
                why.similarity.value
            );
            // The search grid contains every second of these phases.
            let is_searched =
                |p: f64| off(p).abs() < 0.05 && ((50.0 * off(p)).round() - 50.0 * off(p)).abs() < 1e-6;
            let near: Vec<f32> =
                why.cycle.iter().filter(|s| is_searched(s.phase)).map(|s| s.similarity).collect();
            assert_eq!(near.len(), 5);
            assert!(near.iter().all(|s| *s <= tracked + 2e-6));
            assert_eq!(why.cycle.len(), CYCLE_PHASES);
            assert!(why.cycle.windows(2).all(|w| w[0].phase < w[1].phase));
            let sum: f32 = why.similarity.matches.iter().map(|m| m.similarity_px).sum();
            assert!((sum / why.similarity.model_px - why.similarity.value).abs() < 1e-6);
        }
    }
}
