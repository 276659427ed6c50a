//! Frames along the line of sight, seen with hindsight: before a walk started, and after it seemed to be over.
//!
//! Along the line of sight the contours start no walk, and on a curve the feet may start none: their steps show too little
//! before the way turns. Around a corner the rectangles show the new way only when the contours are lost. The walk before
//! or after tells cadence and phase, so the feet need only go on with them. They do if their steps fit better than even
//! motion.

use super::active::Active;
use super::decisions::{HINDSIGHT_GAIN, PLACE_M, SLOWEST_MPS};
use super::frontal::{Frontal, Lowest};
use super::locate::Sighting;
use super::options::TrackerOptions;
use super::rate::lasting;
use super::route::Route;
use super::standing::Standing;
use super::trail::{Anchor, CORNER_JERK_SD, JERK_SD, Trail};
use super::walk::FrameEdges;
use glam::DVec2;
use std::ops::Range;

/// Number of places of the walk to which the curve is joined, here and below at the usual rate.
const ANCHORS: usize = 10;
/// Distance of the points of a route that is continued, metres.
const POINTS_M: f64 = 0.05;
/// So many frames are added before places and phases are solved for again.
const AT_ONCE: usize = 5;

impl Active {
    /// Begins the walk with the frames before it, if their feet fit its steps better than even motion.
    pub(super) fn begin_earlier(&mut self, options: &TrackerOptions) {
        let earlier = std::mem::take(&mut self.earlier);
        let is_whole = self.kept.len() == self.steps().len();
        if options.camera.is_none() || self.is_on_treadmill || self.is_frontal() || !is_whole {
            return;
        }
        let Some((route, places)) = self.route_from(&earlier) else { return };
        let mut frontal = self.recorded().moved_to(&route);
        let before: Vec<_> = earlier.kept.iter().zip(places).rev().collect();
        for some in before.chunks(lasting(AT_ONCE, self.every_s())) {
            for ((sighting, edges), place) in some {
                let all = earlier.feet.get(&edges.frame).copied();
                frontal.precede(edges.time_s, &Lowest { firm: *sighting, all }, *place);
            }
            if frontal.solve(0).is_none() {
                return;
            }
        }
        if !walks(&mut frontal, 0..before.len()) {
            return;
        }
        let Standing { kept, pieces, feet } = earlier;
        self.kept.splice(0..0, kept);
        self.pieces.splice(0..0, pieces);
        self.feet.extend(feet);
        self.frontal = Some(frontal);
        self.follow_on(&route, 0..self.kept.len(), usize::MAX, &options.walk);
    }

    /// The walk that went on as the `later` one, whose feet were found along the line of sight; `None` if they are not of
    /// the same person, or if their steps are not those of the walk.
    pub(super) fn joined(&self, later: &Active, options: &TrackerOptions) -> Option<Self> {
        if options.camera.is_none() || self.is_on_treadmill || later.kept.is_empty() {
            return None;
        }
        let mut joined = self.clone();
        // 1. The walk without the frames in which it was lost, and the frames since.
        joined.turned(options);
        let whole = joined.steps().len();
        joined.trim();
        let first = joined.steps().first()?.frame;
        joined.kept.retain(|(_, edges)| edges.frame >= first);
        let count = joined.steps().len();
        let anchored = lasting(ANCHORS, joined.every_s());
        if count < anchored || joined.is_frontal() || self.kept.len() != whole {
            return None;
        }
        let last = joined.steps()[count - 1].frame;
        let is_after = |frame: usize| joined.kept.last().is_some_and(|(_, edges)| frame > edges.frame);
        let since: Vec<&(Option<Sighting>, FrameEdges)> = joined.kept[count..]
            .iter()
            .chain(later.kept.iter().filter(|(_, edges)| is_after(edges.frame)))
            .collect();
        let sightings: Vec<Sighting> = since.iter().filter_map(|(sighting, _)| *sighting).collect();
        let is_at_once = sightings.first()?.time_s - joined.steps()[count - 1].time_s <= LONGEST_GAP_S;
        // 2. The way since.
        let anchor = |k: usize| {
            let step = &joined.steps()[k];
            Anchor { time_s: step.time_s, place_m: joined.walk.route.place(step.state.along.position) }
        };
        let anchors: Vec<Anchor> = (count - anchored..count).map(anchor).collect();
        let crown = joined.crown();
        let trail = Trail::new(joined.rows, &anchors, &sightings, &joined.camera, &crown);
        let points = trail.curve(CORNER_JERK_SD);
        let from_m = joined.steps()[count - anchored].state.along.position;
        let route = joined.walk.route.continued(&points, from_m)?;
        let is_near = points.get(anchored)?.distance(anchors[anchored - 1].place_m) < PLACE_M;
        if !is_at_once || !is_near {
            return None;
        }
        // 3. The feet on it, with the steps of the walk.
        joined.feet.extend(later.feet.iter().map(|(frame, feet)| (*frame, *feet)));
        let mut frontal = joined.recorded().moved_to(&route);
        for some in since.chunks(lasting(AT_ONCE, joined.every_s())) {
            for (sighting, edges) in some {
                frontal.push(edges.time_s, &joined.lowest(*sighting, edges.frame));
            }
            frontal.solve(0)?;
        }
        let frames: Vec<(Option<Sighting>, FrameEdges)> = since.into_iter().cloned().collect();
        if !walks(&mut frontal, count..count + frames.len()) {
            return None;
        }
        // 4. All frames followed on it.
        joined.kept.truncate(count);
        joined.kept.extend(frames);
        joined.pieces.retain(|piece| piece.frame <= last);
        let own_last = self.pieces.last().map_or(last, |piece| piece.frame.max(last));
        let since = self.pieces.iter().filter(|piece| piece.frame > last);
        joined
            .pieces
            .extend(since.chain(later.pieces.iter().filter(|piece| piece.frame > own_last)).cloned());
        joined.unexplained.extend(&later.unexplained);
        joined.frontal = Some(frontal);
        joined.follow_on(&route, 0..joined.kept.len(), usize::MAX, &options.walk);
        Some(joined)
    }

    /// The route with the curve of the earlier rectangles before it, and their places on it; `None` without any.
    fn route_from(&self, earlier: &Standing) -> Option<(Route, Vec<DVec2>)> {
        let steps = self.steps();
        let ends_m = [steps.first()?, steps.last()?].map(|step| step.state.along.position);
        // 1. The curve of what came before, from the walk backwards in time.
        let anchor = |k: usize| Anchor {
            time_s: -steps[k].time_s,
            place_m: self.walk.route.place(steps[k].state.along.position),
        };
        let anchored = lasting(ANCHORS, self.every_s()).min(steps.len());
        let anchors: Vec<Anchor> = (0..anchored).rev().map(anchor).collect();
        let backwards: Vec<Sighting> =
            earlier.sightings().iter().rev().map(|s| Sighting { time_s: -s.time_s, ..*s }).collect();
        let trail = Trail::new(self.rows, &anchors, &backwards, &self.camera, &self.crown());
        let mut way: Vec<DVec2> = trail.curve(JERK_SD)[anchors.len()..].iter().rev().copied().collect();
        let times_s: Vec<f64> = trail.times_s()[anchors.len()..].iter().rev().map(|time_s| -time_s).collect();
        if times_s.len() < 2 {
            return None;
        }
        // 2. The places of frames without a rectangle are between those of others.
        let at = |time_s: f64| {
            let after = times_s.partition_point(|&t| t < time_s).clamp(1, times_s.len() - 1);
            let t = (time_s - times_s[after - 1]) / (times_s[after] - times_s[after - 1]);
            way[after - 1].lerp(way[after], t)
        };
        let places = earlier.kept.iter().map(|(_, edges)| at(edges.time_s)).collect();
        // 3. The walk's own route from its first place on.
        let length_m = ends_m[1] - ends_m[0];
        let count = (length_m / POINTS_M).max(2.0) as usize;
        let own = |k: usize| self.walk.route.place(ends_m[0] + length_m * k as f64 / count as f64);
        way.extend((0..=count).map(own));
        let before_m: f64 = way[..=times_s.len()].windows(2).map(|pair| pair[0].distance(pair[1])).sum();
        Some((Route::through(&way, ends_m[0] - before_m)?, places))
    }
}

/// A frame later than this after the last one of a walk does not continue it, seconds.
const LONGEST_GAP_S: f64 = 0.5;

/// Whether feet move on, in steps that fit better than even motion.
fn walks(frontal: &mut Frontal, frames: Range<usize>) -> bool {
    frontal.speed_mps(frames.clone()) >= SLOWEST_MPS
        && frontal.gain(frames).is_some_and(|gain| gain > HINDSIGHT_GAIN)
}
