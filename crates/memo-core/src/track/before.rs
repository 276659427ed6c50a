//! The frames before a walk started in which the person was already walking.
//!
//! A walk starts on a region that is one person's for some frames. Before, the person may have been one region with somebody
//! else, or a start may have been refused. Once the walk is over, body, route, speed and cadence are known:
//!
//! 1. What the regions of the frames before the start showed was kept. Nearer people who were not followed then either stand
//!    in front where their first steps lead.
//! 2. From the start backwards, the person is searched in each near where the first steps lead, as long as the contours are
//!    about as similar as in the walk and others do not hide most of the person.
//! 3. From the earliest of these frames on, all are followed again.

use super::active::Active;
use super::candidate::{MISSED_FRAMES, Seen};
use super::crowd::{Expected, body_box, expected, keep_unowned};
use super::decisions::{DECIDING_SHARE, LOST_SHARE};
use super::fit::views::Piece;
use super::options::TrackerOptions;
use super::rate::lasting;
use super::search::{Axis, Grid, Hypothesis, PHASE_STEP, POSITION_STEP_M, Scene, search_peak};
use super::standing::Standing;
use super::walk::{Beginning, FrameEdges, State, Step, Walk};
use crate::estimate::line::line_through;
use crate::model::{Camera, Others};
use std::collections::HashMap;

/// So much of what a frame's place and phase are off is expected in the frame before.
const DRIFT: f64 = 0.5;
/// Half width of the search in steps of the grid.
const STEPS: f64 = 3.0;
/// So much of the body's height and width must be in the window in which edges were searched.
const LEAST_IN_WINDOW: f64 = 0.95;
/// First steps lead no farther back, seconds.
const LONGEST_LEAD_S: f64 = 2.0;
/// The frames of the walk may become less similar by this share.
const MOST_LOST: f64 = 0.01;

/// The person in a region.
struct Found {
    best: Hypothesis,
    /// Similarity times the visible share.
    similarity: f64,
    visible: f32,
}

/// Where the first steps of a walk lead.
struct Lead {
    speed_mps: f64,
    along_m: f64,
    rate_hz: f64,
    phase: f64,
    height_m: f64,
}

impl Lead {
    fn of(steps: &[Step], options: &TrackerOptions) -> Self {
        let first = &steps[..steps.len().min(2 * options.start_frames)];
        let line = |of: fn(&State) -> f64| {
            line_through(&first.iter().map(|step| (step.time_s, of(&step.state))).collect::<Vec<_>>())
        };
        let (speed_mps, along_m) = line(|state| state.along.position);
        let (rate_hz, phase) = line(|state| state.phase.position);
        let height_m = first.iter().map(|step| step.state.height.position).sum::<f64>() / first.len() as f64;
        Self { speed_mps, along_m, rate_hz, phase, height_m }
    }

    fn at(&self, time_s: f64) -> Hypothesis {
        let Self { speed_mps, along_m, rate_hz, phase, height_m } = *self;
        Hypothesis { along_m: along_m + speed_mps * time_s, height_m, phase: phase + rate_hz * time_s }
    }
}

/// Somebody else, with the frames in which that person is followed and those before.
pub(super) struct Beside<'a> {
    walk: &'a Walk,
    camera: &'a Camera,
    lead: Lead,
}

impl<'a> Beside<'a> {
    pub fn new(walk: &'a Walk, camera: &'a Camera, options: &TrackerOptions) -> Option<Self> {
        let steps = walk.steps();
        (!steps.is_empty()).then(|| Self { walk, camera, lead: Lead::of(steps, options) })
    }

    /// Where the person is in a frame, or was shortly before the walk started; `None` after it.
    fn place(&self, frame: usize, time_s: f64) -> Option<Hypothesis> {
        let steps = self.walk.steps();
        let after = steps.partition_point(|step| step.frame < frame);
        match steps.get(after)? {
            step if step.frame == frame => Some(step.state.hypothesis()),
            first if after == 0 && first.time_s - time_s <= LONGEST_LEAD_S => Some(self.lead.at(time_s)),
            _ => None,
        }
    }

    fn scene(&self, place: &Hypothesis) -> Scene<'_> {
        Scene::new(&self.walk.walker, self.camera, &self.walk.route.at(place.along_m))
    }

    /// The person in a frame; `None` after the walk, or if nothing of the person is before the camera.
    fn in_frame(&self, seen: &Seen) -> Option<Expected> {
        let FrameEdges { frame, time_s, window, .. } = seen.edges;
        let place = self.place(frame, time_s)?;
        let scene = self.scene(&place);
        let height_px = body_box(self.camera, &scene.pose(&place).cylinders)?.height();
        let other = Hypothesis { phase: place.phase + 0.5, ..place };
        Some(expected(&scene, [place, other], window, height_px))
    }
}

impl Active {
    /// Begins the walk with the frames before it in which the contours show it too.
    pub(super) fn begin_before(&mut self, beside: &[Beside<'_>], options: &TrackerOptions) {
        let before = std::mem::take(&mut self.before);
        let is_whole = self.kept.len() == self.steps().len();
        if before.is_empty() || self.is_on_treadmill || self.frontal.is_some() || !is_whole {
            return;
        }
        // 1. Where the first steps lead, and who stands in front there.
        let lead = Lead::of(self.steps(), options);
        let before: Vec<Seen> = before.iter().map(|seen| self.behind(beside, &lead, seen)).collect();
        let sum = |walk: &Walk, from: usize| -> f64 {
            walk.steps()[from..].iter().map(|step| f64::from(step.similarity * step.visible)).sum()
        };
        let least = LOST_SHARE * sum(&self.walk, 0) / self.steps().len() as f64;
        // 2. The frames that show the person there, the latest first.
        let [mut along_off, mut phase_off] = [0.0; 2];
        let mut added: Vec<&Seen> = Vec::new();
        let mut beginning = None;
        let (mut missed, most_missed) = (0, lasting(MISSED_FRAMES, self.every_s()));
        for regions in before.chunk_by(|a, b| a.edges.frame == b.edges.frame).rev() {
            let time_s = regions[0].edges.time_s;
            let at = lead.at(time_s);
            let led = Hypothesis { along_m: at.along_m + along_off, phase: at.phase + phase_off, ..at };
            let found = regions.iter().filter_map(|seen| Some((seen, self.similar(&led, seen, options)?)));
            let most = found.max_by(|(_, a), (_, b)| a.similarity.total_cmp(&b.similarity));
            let shows = |found: &Found| found.similarity >= least && found.visible >= DECIDING_SHARE;
            let Some((seen, Found { best, .. })) = most.filter(|(_, found)| shows(found)) else {
                missed += 1;
                if missed > most_missed {
                    break;
                }
                continue;
            };
            let cycles = best.phase - led.phase;
            along_off += DRIFT * (best.along_m - led.along_m);
            phase_off += DRIFT * (cycles - cycles.round());
            missed = 0;
            added.push(seen);
            beginning = Some(Beginning {
                time_s,
                along_m: led.along_m,
                phase: led.phase,
                speed_mps: lead.speed_mps,
                rate_hz: lead.rate_hz,
            });
        }
        let Some(beginning) = beginning else { return };
        added.reverse();
        // 3. All frames from there on.
        let frames = added.iter().map(|seen| &seen.edges).chain(self.kept.iter().map(|(_, edges)| edges));
        let walk = Walk::new(self.walk.walker.clone(), self.walk.route.clone(), beginning);
        let walk = walk.through(frames, &self.camera, &options.walk);
        if sum(&walk, added.len()) < (1.0 - MOST_LOST) * sum(&self.walk, 0) {
            return;
        }
        self.walk = walk;
        self.earlier = Standing::default();
        self.kept.splice(0..0, added.iter().map(|seen| (None, seen.edges.clone())));
        // The crown of a region may be somebody else's.
        let pieces = added.iter().filter_map(|seen| Some(Piece { crown_px: None, ..seen.piece.clone()? }));
        self.pieces.splice(0..0, pieces.collect::<Vec<_>>());
    }

    /// Adds the people behind this one to what the frames of the walk show: before them, an outline borders on no empty scene,
    /// and the crown of the changes may be theirs.
    pub(super) fn before_others(&mut self, beside: &[Beside<'_>]) {
        let steps: HashMap<usize, &Step> = self.walk.steps().iter().map(|step| (step.frame, step)).collect();
        for piece in &mut self.pieces {
            let Some(step) = steps.get(&piece.frame) else { continue };
            let place = step.state.hypothesis();
            let path = self.walk.route.at(place.along_m);
            let body = Scene::new(&self.walk.walker, &self.camera, &path).pose(&place);
            let distance_m = body.torso_centre.distance(self.camera.position());
            for other in beside {
                let Some(place) = other.place(piece.frame, step.time_s) else { continue };
                let body = other.scene(&place).pose(&place);
                let is_behind = body.torso_centre.distance(other.camera.position()) > distance_m;
                let is_near = body_box(other.camera, &body.cylinders)
                    .is_some_and(|sides| sides.overlap(&piece.kept.sides(0.0)) > 0.0);
                if is_behind && is_near {
                    piece.others.extend(body.cylinders);
                    piece.crown_px = None;
                }
            }
        }
    }

    /// What a region showed, with the people who stand in front of this one there.
    fn behind(&self, beside: &[Beside<'_>], lead: &Lead, seen: &Seen) -> Seen {
        let path = self.walk.route.at(lead.at(seen.edges.time_s).along_m);
        let scene = Scene::new(&self.walk.walker, &self.camera, &path);
        let centre = scene.pose(&lead.at(seen.edges.time_s)).torso_centre;
        let distance_m = centre.distance(self.camera.position());
        let mut behind = seen.clone();
        let all = beside.iter().filter_map(|other| other.in_frame(seen));
        for nearer in all.filter(|other| other.distance_m < distance_m) {
            behind.edges.shared = true;
            keep_unowned(&mut behind.edges.edges, &[&nearer]);
            behind.edges.others.extend(nearer.body);
            behind.piece.iter_mut().for_each(|piece| piece.others.extend(nearer.body));
        }
        behind
    }

    /// The most similar hypothesis near one; `None` if the edges of the body were not searched.
    fn similar(&self, near: &Hypothesis, seen: &Seen, options: &TrackerOptions) -> Option<Found> {
        let near = Hypothesis { phase: near.phase.rem_euclid(1.0), ..*near };
        let others = Others::new(&seen.edges.others, self.camera.position());
        let path = self.walk.route.at(near.along_m);
        let scene = Scene::new(&self.walk.walker, &self.camera, &path).among(&others);
        let body = body_box(&self.camera, &scene.pose(&near).cylinders)?;
        let window = seen.edges.window.sides(0.0);
        let inside = |low: f64, high: f64, from: f64, to: f64| (high.min(to) - low.max(from)) / (high - low);
        let across = inside(body.left, body.right, window.left, window.right);
        let along = inside(body.top, body.bottom, window.top, window.bottom);
        if across.min(along) < LEAST_IN_WINDOW {
            return None;
        }
        let grid = Grid {
            along: Axis::around(near.along_m, STEPS * POSITION_STEP_M, POSITION_STEP_M),
            height: Axis::around(near.height_m, STEPS * POSITION_STEP_M, POSITION_STEP_M),
            phase: Axis::around(near.phase, STEPS * PHASE_STEP, PHASE_STEP),
        };
        let (similarity, hidden_lines) = (&options.walk.similarity, options.walk.hidden_lines);
        let found = search_peak(&seen.edges.edges, &scene, &grid, similarity, hidden_lines);
        let visible = scene.visible_share(&near);
        Some(Found { best: found.best(), similarity: f64::from(found.best_score() * visible), visible })
    }
}

#[cfg(test)]
mod tests {
    use super::super::active::tests::{BEGINNING, PATH, active, frames_on, options};
    use super::super::search::Path;
    use super::*;
    use crate::image::Image;
    use glam::DVec2;
    use std::sync::Arc;

    const FRAME_S: f64 = 0.05;
    const FIRST: usize = 20;

    /// A walk along a path that is followed from the frame `FIRST` on, and what was seen before.
    fn begun() -> Active {
        let mut frames = frames_on(60, FRAME_S, &PATH.into(), &PATH.into());
        let kept = frames.split_off(FIRST);
        let mut active = active(Vec::new());
        let time_s = kept[0].1.time_s;
        let beginning = Beginning {
            time_s,
            along_m: BEGINNING.along_m + BEGINNING.speed_mps * time_s,
            phase: BEGINNING.phase + BEGINNING.rate_hz * time_s,
            ..BEGINNING
        };
        let walk = Walk::new(active.walk.walker.clone(), PATH, beginning);
        active.walk = walk.through(kept.iter().map(|(_, edges)| edges), &active.camera, &options().walk);
        active.kept = kept;
        let seen = |(sighting, edges): (Option<_>, FrameEdges)| Seen {
            sighting: sighting.unwrap(),
            edges,
            piece: None,
        };
        active.before = frames.into_iter().map(|frame| Arc::new(seen(frame))).collect();
        active
    }

    fn first_frame(active: Active) -> usize {
        first_frame_beside(active, &[])
    }

    fn first_frame_beside(mut active: Active, beside: &[Beside<'_>]) -> usize {
        active.begin_before(beside, &options());
        let steps = active.steps();
        assert_eq!(steps.len(), active.kept.len());
        for (step, (_, edges)) in steps.iter().zip(&active.kept) {
            assert_eq!(step.frame, edges.frame);
            let along_m = BEGINNING.along_m + BEGINNING.speed_mps * step.time_s;
            let cycles = step.state.phase.position - BEGINNING.phase - BEGINNING.rate_hz * step.time_s;
            assert!((step.state.along.position - along_m).abs() < 0.03, "{}: {:?}", step.frame, step.state);
            assert!((cycles - cycles.round()).abs() < 0.03, "{}: {cycles}", step.frame);
        }
        steps[0].frame
    }

    /// Without the edges of a region in some frames.
    fn without(active: &mut Active, frames: std::ops::Range<usize>) {
        for seen in &mut active.before[frames] {
            Arc::make_mut(seen).edges.edges.clear();
        }
    }

    #[test]
    fn a_walk_begins_with_the_first_frame_that_shows_it() {
        assert_eq!(first_frame(begun()), 0);
        let mut late = begun();
        without(&mut late, 0..6);
        assert_eq!(first_frame(late), 6);
        let mut gap = begun();
        without(&mut gap, 8..8 + MISSED_FRAMES);
        assert_eq!(first_frame(gap), 0, "over a short gap");
        let mut lost = begun();
        without(&mut lost, 8..9 + MISSED_FRAMES);
        assert_eq!(first_frame(lost), 9 + MISSED_FRAMES);
    }

    /// Of several regions in a frame, the one with the person counts; a window that cuts the body shows too little.
    #[test]
    fn the_region_with_the_person_is_looked_at() {
        let mut beside = begun();
        let other = |seen: &Arc<Seen>| {
            let mut other = Seen::clone(seen);
            other.edges.edges.clear();
            Arc::new(other)
        };
        beside.before = beside.before.iter().flat_map(|seen| [other(seen), seen.clone()]).collect();
        assert_eq!(first_frame(beside), 0);
        let mut cut = begun();
        for seen in &mut cut.before[..10] {
            let seen = Arc::make_mut(seen);
            seen.edges.window.bottom = seen.sighting.rectangle.bottom - seen.sighting.rectangle.height() / 5;
        }
        assert_eq!(first_frame(cut), 10);
    }

    /// Somebody else may stand in front in these frames, who was not followed then either.
    #[test]
    fn what_may_be_the_contours_of_somebody_in_front_is_nobody_elses() {
        let camera = begun().camera;
        for (nearer_m, first) in [(1.5, FIRST), (-1.5, 0)] {
            // In the same line of sight.
            let mut walk = begun().walk;
            walk.route = Path { origin: DVec2::new(0.0, -nearer_m), ..PATH }.into();
            let distance_m = camera.position().y.abs();
            for step in walk.twins.iter_mut().flat_map(|twin| &mut twin.steps) {
                step.state.along.position *= (distance_m - nearer_m) / distance_m;
            }
            let other = Beside::new(&walk, &camera, &options()).unwrap();
            assert_eq!(first_frame_beside(begun(), &[other]), first, "{nearer_m} m nearer");
        }
    }

    /// A person behind is known to the frames of both walks and to those before that person's start, but not to others; one in front
    /// or far to the side to none.
    #[test]
    fn the_fit_is_told_who_is_behind() {
        let begun_at = |frame: usize| {
            let mut active = begun();
            let steps = &mut active.walk.twins[0].steps;
            steps.retain(|step| step.frame >= frame);
            active
        };
        let behind = |away_m: f64, ahead_m: f64, from: usize, to: usize| {
            let mut other = begun_at(from);
            other.walk.route = Path { origin: PATH.origin + DVec2::new(ahead_m, away_m), ..PATH }.into();
            other.walk.twins[0].steps.retain(|step| step.frame < to);
            let other = Beside::new(&other.walk, &other.camera, &options()).map(|beside| {
                let mut active = begun();
                let image = Image::filled(640, 480, 0u8);
                active.pieces = (FIRST..60)
                    .map(|frame| Piece {
                        crown_px: Some(7.0),
                        ..Piece::new(frame, &image, active.kept[0].1.window, Vec::new())
                    })
                    .collect();
                active.before_others(&[beside]);
                active
            });
            let told = |piece: &Piece| (!piece.others.is_empty(), piece.crown_px.is_none());
            other.unwrap().pieces.iter().map(told).collect::<Vec<_>>()
        };
        assert_eq!(behind(0.5, 0.1, FIRST, 60), [(true, true); 40]);
        assert_eq!(behind(0.5, 0.1, FIRST + 20, 60), [(true, true); 40], "before the other one starts");
        let until = behind(0.5, 0.1, FIRST, FIRST + 30);
        assert_eq!(
            (until[..30].to_vec(), until[30..].to_vec()),
            (vec![(true, true); 30], vec![(false, false); 10])
        );
        assert_eq!(behind(-0.5, 0.1, FIRST, 60), [(false, false); 40], "in front");
        assert_eq!(behind(0.5, 40.0, FIRST, 60), [(false, false); 40], "elsewhere");
    }

    #[test]
    fn who_is_followed_by_the_feet_or_walks_on_the_spot_begins_as_before() {
        let mut on_the_spot = begun();
        on_the_spot.is_on_treadmill = true;
        assert_eq!(first_frame(on_the_spot), FIRST);
        let mut nothing = begun();
        nothing.before.clear();
        assert_eq!(first_frame(nothing), FIRST);
        let mut thinned = begun();
        thinned.kept.drain(..3);
        thinned.begin_before(&[], &options());
        assert_eq!(thinned.steps()[0].frame, FIRST, "the first frames are gone");
    }
}
