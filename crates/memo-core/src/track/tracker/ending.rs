//! Step 5 of the tracker: walks that are over, completed, fitted and returned, or withdrawn.

use super::super::active::Active;
use super::super::before::Beside;
use super::super::double::are_at_a_time;
use super::super::evidence::Evidence;
use super::super::fit::edge_search::View;
use super::super::fit::views::Backdrop;
use super::super::fit::{FitError, WalkFit};
use super::super::left_out::Reason;
use super::super::people::Sign;
use super::super::result::TrackedWalk;
use super::super::steady::Loss;
use super::super::unexplained::{self, has_no_legs};
use super::Tracker;
use super::unfollowed::walk_boxes;

/// A walk that is over is returned after this time, in which somebody may start where it ended, seconds.
const FADING_S: f64 = 1.0;
/// The same with a calibrated camera: the feet of somebody who turned into the line of sight show a walk later.
const FADING_BY_FEET_S: f64 = 3.0;

impl Tracker {
    /// Ends walks that are over. On a wrong path a walk can seem to be over, so a turn is looked for first.
    pub(super) fn end_walks(&mut self, evidence: &Evidence) {
        let (time_s, longest) = (evidence.time_s, self.longest_walk);
        let is_long = |active: &mut Active| active.settled && active.walk.twins[0].steps.len() >= longest;
        let mut ended: Vec<Active> = self.people.extract_if(.., is_long).collect();
        let options = &self.options;
        let is_over = |active: &mut Active| {
            active.settled && (active.is_hidden() || active.is_over() && !active.goes_on(options))
        };
        self.fading.extend(self.people.extract_if(.., is_over).map(|active| (time_s, active)));
        let fading_s = if self.options.camera.is_some() { FADING_BY_FEET_S } else { FADING_S };
        let is_gone = |(end_s, _): &mut (f64, Active)| time_s - *end_s > fading_s;
        ended.extend(self.fading.extract_if(.., is_gone).map(|(_, active)| active));
        ended.into_iter().for_each(|active| self.end_walk(active));
    }

    /// Ends all walks before the view ended; what follows is another scene.
    pub(super) fn end_view(&mut self, loss: &Loss) {
        let fading = self.fading.iter_mut().map(|(_, active)| active);
        fading.chain(&mut self.people).for_each(|active| active.drop_from(loss.frame.saturating_sub(1)));
        let is_short = |active: &Active| active.steps().len() < self.options.start_frames;
        let fading = self.fading.extract_if(.., |(_, active)| is_short(active)).map(|(_, active)| active);
        let short: Vec<Active> =
            fading.chain(self.people.extract_if(.., |active| is_short(active))).collect();
        for active in short {
            let reason = Reason::TooBrief { frames: active.steps().len() };
            self.withdraw(active.person, walk_boxes(&active), reason);
        }
        self.end_everybody();
        self.unfollowed.finish(self.options.start_frames);
        self.candidates.clear();
        self.sought.clear();
        self.side_by_side.clear();
        self.standings.clear();
        self.tilt = None;
        self.identities.forget_ended();
        self.backdrop = Backdrop::default();
    }

    /// Ends the walks of everybody who is followed or was until lately, one by one: others may have stood in front.
    pub(super) fn end_everybody(&mut self) {
        while !self.fading.is_empty() {
            let (_, active) = self.fading.remove(0);
            self.end_walk(active);
        }
        while !self.people.is_empty() {
            let active = self.people.remove(0);
            self.end_walk(active);
        }
    }

    /// 1. The route and its frames, from before and after each of them.
    /// 2. The person, fitted to all of them.
    /// 3. What is no walk, or has no legs of its own, is withdrawn.
    /// 4. Of two models of one person, one stays in the frames of both.
    pub(super) fn end_walk(&mut self, active: Active) {
        let was_settled = active.settled;
        let mut active = if was_settled { active } else { self.begun_otherwise(active) };
        let standing = self.complete(&mut active);
        if !was_settled {
            self.identify_again(&mut active);
        }
        let walk_boxes = walk_boxes(&active);
        if !active.is_walk() {
            return self.withdraw(active.person, walk_boxes, Reason::NotWalking);
        }
        if has_no_legs(&active.of_its_own) {
            return self.withdraw(active.person, walk_boxes, Reason::Beside);
        }
        active.before_others(&self.beside());
        let p_swapped = active.p_swapped(&self.options);
        let fit = active.fit(&self.backdrop, &self.options, Some(p_swapped));
        if let Some(reason) = self.no_walk(&active, fit.as_ref()) {
            return self.withdraw(active.person, walk_boxes, reason);
        }
        let sign = standing.or_else(|| active.sign());
        let others = || self.finished.iter().chain(&self.returned);
        let views = match others().any(|other| are_at_a_time(active.steps(), other.steps())) {
            true => active.views(&self.backdrop),
            false => Vec::new(),
        };
        let walk = self.tracked(active, fit);
        let end = walk.first_and_last().map(|[_, last]| last);
        let walk = match self.without_others(walk, &views) {
            Ok(walk) => walk,
            Err(person) => return self.withdraw(person, walk_boxes, Reason::Beside),
        };
        walk_boxes.into_iter().for_each(|walk_boxes| self.unfollowed.followed(walk_boxes));
        if let Some(sign) = sign.filter(|_| walk.first_and_last().map(|[_, last]| last) == end) {
            self.identities.end(walk.person, sign);
        }
        self.finished.push(walk);
    }

    /// What remains of a walk beside other models of its person: two can come to lie on one person, the fitted ones too. The
    /// number of its person if nothing does.
    fn without_others(
        &mut self,
        mut walk: TrackedWalk,
        views: &[(usize, View)],
    ) -> Result<TrackedWalk, usize> {
        let least = self.options.start_frames_beside_others();
        loop {
            // 1. Of a second model, what goes on with the person of the first.
            let is_first = |other: &&TrackedWalk| walk.is_second_to(other, views) == Some(true);
            if let Some(first) = self.finished.iter().chain(&self.returned).find(is_first) {
                let (person, frames, number) = (first.person, first.first_and_last(), walk.person);
                let rest = frames.and_then(|frames| walk.outside(frames, least)).ok_or(number)?;
                walk = self.of_person(rest, person);
                continue;
            }
            // 2. The same of one to which it is the first. If other walks are of that person, this one is too.
            let is_second = |other: &TrackedWalk| walk.is_second_to(other, views) == Some(false);
            let Some(k) = self.finished.iter().position(is_second) else { return Ok(walk) };
            let second = self.finished.remove(k);
            let person = second.person;
            let rest = walk.first_and_last().and_then(|frames| second.outside(frames, least));
            if rest.is_some() || self.finished.iter().any(|other| other.person == person) {
                walk = self.of_person(walk, person);
            }
            match rest {
                Some(rest) => self.finished.insert(k, rest),
                None => self.withdraw(person, None, Reason::Beside),
            }
        }
    }

    /// A walk with the number of the person whom it turned out to be of.
    fn of_person(&mut self, walk: TrackedWalk, person: usize) -> TrackedWalk {
        if walk.person != person {
            self.identities.pass_on(walk.person, person);
        }
        TrackedWalk { person, ..walk }
    }

    /// Completes the route and the frames of a walk that is over; returns where the person stands, if so.
    fn complete(&self, active: &mut Active) -> Option<Sign> {
        active.settle(&self.backdrop, &self.options);
        // On a smoothed route, the feet would walk on.
        let standing = active.standing();
        active.begin_before(&self.beside(), &self.options);
        active.begin_earlier(&self.options);
        active.turned(&self.options);
        active.pace_all();
        active.straighten(&self.options.walk);
        let standing = standing.or_else(|| active.standing());
        active.trim();
        standing
    }

    /// Everybody else who is or was followed of late.
    fn beside(&self) -> Vec<Beside<'_>> {
        let fading = self.fading.iter().map(|(_, other)| other);
        let followed = self.people.iter().chain(fading).map(|other| (&other.walk, &other.camera));
        let ended = self.finished.iter().chain(&self.returned).map(|other| (&other.walk, &other.camera));
        followed.chain(ended).filter_map(|(walk, camera)| Beside::new(walk, camera, &self.options)).collect()
    }

    /// Why something that was followed is no walk. What was left over from somebody else can look like a walker, but then
    /// the contours do not fit.
    fn no_walk(&self, active: &Active, fit: Option<&Result<WalkFit, FitError>>) -> Option<Reason> {
        let frames = active.steps().len();
        if active.started_near && frames < self.options.start_frames {
            return Some(Reason::TooBrief { frames });
        }
        let is_left_over = active.started_near && matches!(fit, Some(Err(FitError::Misfit { .. })));
        let takes_steps = active.takes_steps(fit.and_then(|fit| fit.as_ref().ok()));
        (is_left_over || !takes_steps).then_some(Reason::NotWalking)
    }

    fn tracked(&self, active: Active, fit: Option<Result<WalkFit, FitError>>) -> TrackedWalk {
        TrackedWalk {
            person: active.person,
            camera_turns: active.turns(self.stream.camera_motions()),
            crowns_px: active.crowns_px(),
            unexplained: unexplained::of_walk(&active.unexplained),
            height: active.height_by(fit.as_ref().and_then(|fit| fit.as_ref().ok())),
            is_frontal: active.is_frontal(),
            walk: active.walk,
            frame_camera: self.frame_camera(&active.camera),
            camera: active.camera,
            average: active.average,
            depth_sd_m: active.depth_sd_m,
            shown_height_m: active.shown_height_m,
            start: active.start,
            tilt: active.tilt,
            is_on_treadmill: active.is_on_treadmill,
            fit,
            options: self.options.walk,
        }
    }
}
