//! Where a walk ends, and whether it was one.
//!
//! 1. While somebody is followed: the person stopped, or the model matches much less than usually, or too little of the
//!    person was visible for too long.
//! 2. Afterwards, frames in which nobody was there are removed from both ends.
//! 3. What is left is a walk if the thing moved on with strides that its legs can take, where something changes.

use super::active::Active;
use super::decisions::{
    DECIDING_SHARE, LEAST_CHANGING, LONGEST_HIDDEN_S, LOST_SHARE, SLOWEST_HZ, SLOWEST_MPS, STANDING_SHARE,
    STRIDE_HEIGHTS,
};
use super::frontal::Frontal;
use super::people::Sign;
use super::rate::latest;
use super::walk::{Step, Twin};

/// Somebody who moves faster over the last frames has left the treadmill, m/s.
const LEAVING_MPS: f64 = 0.7;
/// Number of last frames that decide whether a walk continues, at the usual rate.
const RECENT_FRAMES: usize = 12;

/// Of a walk, at most this share of the frames may show no change where the model walks. Of 43 drawn people (29 walks, ten
/// scenes), none had such a frame while in view; one who stood and waved, taken for a walker before, had 15 of 25.
const MOST_EMPTY: f64 = 0.25;
/// So many last frames without the person are removed; a single one may only be matched badly.
const LEAST_GONE: usize = 3;

impl Active {
    /// Where the person is if the walk ended because the person stopped: the person was seen to the end and was by then
    /// much slower than before. Who is lost or hidden seems to go on.
    pub(super) fn standing(&self) -> Option<Sign> {
        let twin = self.walk.best_twin();
        let recent = latest(&twin.steps, RECENT_FRAMES)?;
        let (first, last) = (&twin.steps[0], &recent[recent.len() - 1]);
        let covered_m = last.state.along.position - first.state.along.position;
        let mean_mps = covered_m.abs() / (last.time_s - first.time_s);
        // Who turns round on the spot is slow for a moment only.
        let speeds_mps = recent.iter().map(|step| step.state.along.velocity.abs());
        let speed_mps = speeds_mps.fold(f64::INFINITY, f64::min);
        let is_seen = matched(recent).is_some_and(|found| found >= LOST_SHARE * mean_similarity(twin));
        let stands = is_seen && speed_mps < STANDING_SHARE * mean_mps;
        let is_on_a_path = !self.is_on_treadmill && !last.by_feet;
        self.sign().filter(|_| stands && is_on_a_path).map(|sign| Sign { stands, ..sign })
    }

    /// True if in the last frames the person stood still or the model matched little.
    pub(super) fn is_over(&self) -> bool {
        let twin = self.walk.best_twin();
        let (Some(longer), Some(recent)) =
            (latest(&twin.steps, 2 * RECENT_FRAMES), latest(&twin.steps, RECENT_FRAMES))
        else {
            return false;
        };
        let (first, last) = (&recent[0], &recent[recent.len() - 1]);
        let covered_m = (last.state.along.position - first.state.along.position).abs();
        let elapsed_s = last.time_s - first.time_s;
        let is_slow = covered_m < SLOWEST_MPS * elapsed_s;
        let left = if self.is_on_treadmill { covered_m > LEAVING_MPS * elapsed_s } else { is_slow };
        // The phase of somebody who walks on may stand for a moment: by half as many frames, five of 42 drawn people who walked alone
        // were lost after 0.4 to 0.8 of their walks. On a treadmill, nothing else shows a stop.
        let of_phase = if self.is_on_treadmill { first } else { &longer[0] };
        let cycles = (last.state.phase.position - of_phase.state.phase.position).abs();
        let stopped = left || cycles < SLOWEST_HZ * (last.time_s - of_phase.time_s);
        let count = twin.steps.len();
        let unseen = |frontal: &Frontal| count - frontal.seen().min(count) >= recent.len();
        let is_unseen = last.by_feet && self.frontal.as_ref().is_some_and(unseen);
        stopped
            || is_unseen
            || matched(recent).is_some_and(|found| found < LOST_SHARE * usual_similarity(twin))
    }

    /// True if for some time too little of the person was visible for a decision.
    pub(super) fn is_hidden(&self) -> bool {
        let steps = self.steps();
        let Some(last) = steps.last() else { return false };
        let seen = steps.iter().rev().find(|step| step.visible >= DECIDING_SHARE);
        last.time_s - seen.unwrap_or(&steps[0]).time_s > LONGEST_HIDDEN_S
    }

    /// True if the person is somewhere else than at the start.
    pub(super) fn moves_on(&self) -> bool {
        let twin = self.walk.best_twin();
        let (Some(first), Some(last)) = (twin.steps.first(), twin.steps.last()) else { return false };
        let covered_m = last.state.along.position - first.state.along.position;
        covered_m.abs() >= SLOWEST_MPS * (last.time_s - first.time_s)
    }

    /// True if the moving thing walked: over all frames it moved on where something changes, and its displacement per
    /// cycle is possible for legs of its height.
    ///
    /// Swinging arms and carried things can look like a walker for half a second, but then the legs of the model
    /// do not fit the displacement.
    pub(super) fn is_walk(&self) -> bool {
        let twin = self.walk.best_twin();
        let (Some(first), Some(last)) = (twin.steps.first(), twin.steps.last()) else { return false };
        let elapsed_s = last.time_s - first.time_s;
        let covered_m = last.state.along.position - first.state.along.position;
        let cycles = last.state.phase.position - first.state.phase.position;
        if self.is_on_treadmill {
            return cycles >= SLOWEST_HZ * elapsed_s;
        }
        let stride = covered_m / cycles / self.walk.walker.body.height_m;
        is_somebody_there(&twin.steps)
            && covered_m.abs() >= SLOWEST_MPS * elapsed_s
            && cycles.abs() >= SLOWEST_HZ * elapsed_s
            && STRIDE_HEIGHTS.contains(&stride)
    }

    /// The frames from where the person appeared to where the walk was over or the person was gone.
    ///
    /// A person who appears between two frames also changes the empty frame, because eq. (1) uses both
    /// neighbours.
    fn seen_range(&self) -> std::ops::Range<usize> {
        let twin = self.walk.best_twin();
        let low = LOST_SHARE * usual_similarity(twin);
        let absent = twin.steps.iter().take_while(|s| f64::from(s.similarity) < low).count();
        let least = least_changing(&twin.steps);
        let is_empty = |s: &Step| s.changing.is_some_and(|changing| changing < least);
        let is_gone = |s: &&Step| f64::from(s.similarity) < low || s.visible < DECIDING_SHARE || is_empty(s);
        let gone =
            Some(twin.steps.iter().rev().take_while(is_gone).count()).filter(|gone| *gone >= LEAST_GONE);
        let recent = latest(&twin.steps, RECENT_FRAMES).filter(|_| self.is_over());
        let over = recent.map_or(0, |recent| recent.len() / 2);
        let end = twin.steps.len() - over.max(gone.unwrap_or(0));
        let frontal = self.frontal.as_ref().filter(|_| twin.steps.last().is_some_and(|step| step.by_feet));
        let end = frontal.map_or(end, |frontal| frontal.seen().min(end));
        absent.min(end)..end
    }

    /// Removes the other frames.
    pub(super) fn trim(&mut self) {
        self.walk.keep(self.seen_range());
    }

    /// Where the person was and went when last seen before a time.
    pub(super) fn last_seen_before(&self, time_s: f64) -> Option<Sign> {
        self.sign_at(self.frames_before(time_s).min(self.seen_range().end).checked_sub(1)?)
    }
}

/// Mean similarity of frames by the share that is visible; `None` if they show too little.
fn matched(steps: &[Step]) -> Option<f64> {
    let visible: f32 = steps.iter().map(|s| s.visible).sum();
    let found: f32 = steps.iter().map(|s| s.similarity * s.visible).sum();
    (visible >= DECIDING_SHARE * steps.len() as f32).then(|| f64::from(found / visible))
}

/// Mean share of the image about a person that changes, by the share that is visible; `None` if it is mostly unknown.
fn changing(steps: &[Step]) -> Option<f32> {
    let known = || steps.iter().filter_map(|step| Some((step.visible, step.changing?)));
    let visible: f32 = known().map(|(visible, _)| visible).sum();
    let changing: f32 = known().map(|(visible, changing)| visible * changing).sum();
    (visible >= DECIDING_SHARE * steps.len() as f32).then(|| changing / visible)
}

/// True if somebody is in most of the frames of which the changes are known. A model that was lost for longer follows nobody.
fn is_somebody_there(steps: &[Step]) -> bool {
    let least = least_changing(steps);
    let known: Vec<f32> =
        steps.iter().filter(|s| s.visible >= DECIDING_SHARE).filter_map(|s| s.changing).collect();
    let empty = known.iter().filter(|&&changing| changing < least).count();
    empty as f64 <= MOST_EMPTY * known.len() as f64
}

/// Nobody is where less than this share of the image about the model changes: much less than usually.
fn least_changing(steps: &[Step]) -> f32 {
    let usual = changing(steps).unwrap_or(0.0);
    LEAST_CHANGING.max(LOST_SHARE as f32 * usual)
}

/// Mean similarity of a twin by the share that is visible.
fn mean_similarity(twin: &Twin) -> f64 {
    twin.similarity_sum / twin.visible_sum.max(f64::MIN_POSITIVE)
}

/// The same of a walk that turns into the line of sight, where contours are less similar: the lower of the two.
fn usual_similarity(twin: &Twin) -> f64 {
    let of = |by_feet: bool| {
        let of_kind = || twin.steps.iter().filter(|step| step.by_feet == by_feet);
        let visible: f64 = of_kind().map(|step| f64::from(step.visible)).sum();
        let found: f64 = of_kind().map(|step| f64::from(step.similarity * step.visible)).sum();
        (visible > 0.0).then_some(found / visible)
    };
    match [true, false].map(of) {
        [Some(feet), Some(contours)] => feet.min(contours),
        _ => mean_similarity(twin),
    }
}

#[cfg(test)]
mod tests {
    use super::super::active::tests::{FRAME_S, active, step};
    use super::*;

    /// A good walk of `count` frames whose last twelve have these speeds and this similarity.
    fn ending(count: usize, speed_mps: f64, rate_hz: f64, similarity: f32) -> Active {
        ending_in(12, count, [speed_mps, rate_hz], similarity)
    }

    /// The same of another number of last frames.
    fn ending_in(last: usize, count: usize, [speed_mps, rate_hz]: [f64; 2], similarity: f32) -> Active {
        let mut at = [0.0, 0.0];
        let next = |k: usize| {
            let is_last = k + last >= count;
            if k > 0 {
                // The first of the last frames is reached at the usual speeds.
                let moves = if k + last > count { [speed_mps, rate_hz] } else { [1.2, 0.9] };
                at = [at[0] + moves[0] * FRAME_S, at[1] + moves[1] * FRAME_S];
            }
            step(k, at, if is_last { similarity } else { 0.5 })
        };
        active((0..count).map(next).collect())
    }

    /// 40 frames at these speeds, of a person 1.75 m tall.
    fn steady(speed_mps: f64, rate_hz: f64) -> Active {
        let at = |k: usize| [speed_mps, rate_hz].map(|v| v * FRAME_S * k as f64);
        active((0..40).map(|k| step(k, at(k), 0.5)).collect())
    }

    fn frames(active: &Active) -> (usize, usize) {
        let steps = &active.walk.twins[0].steps;
        assert_eq!(active.walk.twins[1].steps.len(), steps.len(), "both twins alike");
        (steps[0].frame, steps[steps.len() - 1].frame)
    }

    #[test]
    fn a_walk_goes_on_while_body_and_legs_move_and_the_model_fits() {
        assert!(!ending(40, 1.2, 0.9, 0.5).is_over());
        assert!(!steady(-1.2, -0.9).is_over(), "backwards");
        assert!(ending(40, 0.0, 0.0, 0.5).is_over());
        // A person who stands still or glides no longer walks: 0.25 m/s, 0.3 Hz, of the legs for twice as long.
        for (last, speed_mps, rate_hz, is_over) in [
            (12, 0.24, 0.9, true),
            (12, 0.26, 0.9, false),
            (12, 1.2, 0.0, false),
            (24, 1.2, 0.29, true),
            (24, 1.2, 0.31, false),
            (24, -0.26, -0.31, false),
        ] {
            let walk = ending_in(last, 40, [speed_mps, rate_hz], 0.5);
            assert_eq!(walk.is_over(), is_over, "{last}, {speed_mps}, {rate_hz}");
        }
        let on_the_spot = |rate_hz: f64| Active { is_on_treadmill: true, ..ending(40, 0.0, rate_hz, 0.5) };
        assert!(on_the_spot(0.29).is_over() && !on_the_spot(0.31).is_over());
    }

    /// At 0.6 of the mean speed and less; who is hidden or lost, or walks on a treadmill, does not stand.
    #[test]
    fn who_is_seen_to_slow_down_stands() {
        let slowed = |share: f64| {
            let mut walk = ending(40, 1.2, 0.9, 0.5);
            walk.walk.twins[0].steps[39].state.along.velocity = share * 1.2;
            walk
        };
        let last = slowed(0.1).sign().unwrap();
        assert_eq!(slowed(0.1).standing(), Some(Sign { stands: true, ..last }));
        for (share, stands) in [(0.59, true), (-0.59, true), (0.61, false), (-0.61, false), (1.0, false)] {
            assert_eq!(slowed(share).standing().is_some(), stands, "{share}");
        }
        let mut turned_round = slowed(1.0);
        turned_round.walk.twins[0].steps[33].state.along.velocity = 0.1;
        assert!(turned_round.standing().is_some(), "slow for a moment");
        for (visible, similarity) in [(0.2, 0.5), (1.0, 0.1)] {
            let mut unseen = slowed(0.1);
            for step in &mut unseen.walk.twins[0].steps[28..] {
                (step.visible, step.similarity) = (visible, similarity);
            }
            assert_eq!(unseen.standing(), None, "{visible}, {similarity}");
        }
        assert_eq!(Active { is_on_treadmill: true, ..slowed(0.1) }.standing(), None);
        assert_eq!(active(Vec::new()).standing(), None);
    }

    /// Frames in which others hide the person do not end a walk.
    #[test]
    fn hidden_frames_end_no_walk() {
        let behind = |visible: f32| {
            let mut walk = ending(40, 1.2, 0.9, 0.0);
            walk.walk.twins[0].steps[28..].iter_mut().for_each(|step| step.visible = visible);
            walk.is_over()
        };
        assert!(behind(1.0) && behind(0.5) && !behind(0.4) && !behind(0.0));
    }

    #[test]
    fn a_walk_ends_where_the_model_finds_less_than_its_share() {
        // Twelve of 40 frames at s, the others at 0.5: the share is 0.45 of (14 + 12 s) / 40.
        let border = 0.45 * 14.0 / (40.0 - 0.45 * 12.0);
        assert!(ending(40, 1.2, 0.9, border - 0.005).is_over());
        assert!(!ending(40, 1.2, 0.9, border + 0.005).is_over());
        assert!(ending(40, 1.2, 0.9, 0.0).is_over());
    }

    /// At 100 frames per second a dozen of them, in which the model finds nothing, are a tenth of a second.
    #[test]
    fn a_walk_ends_after_the_same_time_at_a_high_frame_rate() {
        let fast = |lost: usize| {
            // Four times as fast, so the speeds are none at which somebody stands.
            let mut walk = ending_in(lost, 160, [1.2, 0.9], 0.0);
            walk.walk.twins[0].steps.iter_mut().for_each(|step| step.time_s *= 0.25);
            walk.is_over()
        };
        assert!(!fast(12) && fast(40));
    }

    #[test]
    fn a_young_walk_is_not_over() {
        assert!(!ending(23, 0.0, 0.0, 0.0).is_over() && ending(24, 0.0, 0.0, 0.0).is_over());
        assert!(!active(Vec::new()).is_over());
    }

    #[test]
    fn what_does_not_get_on_with_its_legs_is_no_walk() {
        for (speed_mps, rate_hz, is_walk) in [
            (1.2, 0.9, true),
            (-1.2, -0.9, true),
            // Short and long strides: 0.5 and 1.2 body heights.
            (0.7 * 0.5 * 1.75, 0.7, true),
            (1.2 * 1.2 * 1.75, 1.2, true),
            // The legs walk forward while the body moves backward.
            (1.2, -0.9, false),
            (-1.2, 0.9, false),
            // Less than 0.25 m/s or 0.3 Hz, with a valid stride.
            (0.24, 0.35, false),
            (0.26, 0.35, true),
            (0.5, 0.29, false),
            (0.5, 0.31, true),
            // Strides of 0.24 and 1.7 heights.
            (0.24 * 1.75, 1.0, false),
            (0.26 * 1.75, 1.0, true),
            (1.7 * 1.75, 1.0, false),
            (1.5 * 1.75, 1.0, true),
            (0.0, 0.0, false),
        ] {
            assert_eq!(steady(speed_mps, rate_hz).is_walk(), is_walk, "{speed_mps} m/s, {rate_hz} Hz");
        }
        assert!(!active(Vec::new()).is_walk(), "without a frame");
    }

    /// Somebody stands and swings the arms, and the model walks away and comes back.
    #[test]
    fn a_model_that_walks_where_nothing_changes_is_no_walk() {
        let walk = |away: usize, visible: f32| {
            let mut walk = steady(1.2, 0.9);
            for step in walk.walk.twins.iter_mut().flat_map(|twin| &mut twin.steps) {
                step.visible = visible;
                // What changed before the walk started is not known.
                step.changing = (step.frame >= 12).then_some(if step.frame < 12 + away { 0.0 } else { 0.5 });
            }
            walk
        };
        assert!(walk(0, 1.0).is_walk() && walk(7, 1.0).is_walk());
        assert!(!walk(8, 1.0).is_walk() && !walk(14, 1.0).is_walk());
        assert!(walk(14, 0.3).is_walk(), "frames in which the person is hidden do not count");
    }

    #[test]
    fn frames_before_the_person_and_after_the_walk_are_taken_off() {
        let mut good = ending(40, 1.2, 0.9, 0.5);
        good.trim();
        assert_eq!(frames(&good), (0, 39));
        let mut stopped = ending(40, 0.0, 0.0, 0.5);
        stopped.trim();
        assert_eq!(frames(&stopped), (0, 33), "half of the last twelve");
        let mut late = ending(40, 1.2, 0.9, 0.5);
        let steps = &mut late.walk.twins[0].steps;
        steps[..3].iter_mut().for_each(|step| step.similarity = 0.1);
        steps[20].similarity = 0.1;
        late.trim();
        assert_eq!(frames(&late), (3, 39), "a gap within stays");
        let mut lost = ending(40, 1.2, 0.9, 0.0);
        lost.walk.twins[0].steps.iter_mut().for_each(|step| step.similarity = 0.0);
        lost.trim();
        assert!(lost.walk.twins[0].steps.is_empty(), "nobody was there");
    }

    /// Somebody vanishes, and the model walks on along edges of the room.
    #[test]
    fn a_walk_does_not_end_where_nothing_changes() {
        let last = |usual: f32, end: f32, visible: f32| {
            let mut walk = ending(40, 1.2, 0.9, 0.4);
            for twin in &mut walk.walk.twins {
                twin.steps.iter_mut().for_each(|step| step.changing = Some(usual));
                twin.steps[34..].iter_mut().for_each(|step| step.changing = Some(end));
                twin.steps.iter_mut().for_each(|step| step.visible = visible);
                twin.steps[15].changing = Some(0.0);
            }
            walk.trim();
            frames(&walk)
        };
        assert_eq!(last(0.7, 0.0, 1.0), (0, 33));
        assert_eq!(last(0.7, 0.2, 0.5), (0, 33), "as much as another person beside leaves");
        assert_eq!(last(0.7, 0.4, 1.0), (0, 39), "a person who turns into the line of sight");
        assert_eq!(last(0.3, 0.2, 1.0), (0, 39), "who walks towards the camera changes little");
        assert_eq!(last(0.3, 0.1, 1.0), (0, 33));
    }
}
