//! Step 2 of the tracker: a candidate starts as a person, with a number and a height.

use super::super::active::Active;
use super::super::candidate::{Candidate, Given, Seen};
use super::super::decisions::{SAME_BODY, SAME_PLACE_M};
use super::super::evidence::Evidence;
use super::super::left_out::Reason;
use super::super::people::Sign;
use super::Tracker;
use std::sync::Arc;

/// Given heights are put in another order than that of appearance if the picture is nearer to another one by so many standard
/// deviations of what it shows.
const CLEAR_SD: f64 = 2.0;

impl Tracker {
    /// Starts walks on candidates that have enough frames, in order of appearance, or drops their oldest ones.
    pub(super) fn start(&mut self, evidence: &Evidence) {
        let size = [evidence.grey.width() as u32, evidence.grey.height() as u32];
        for mut candidate in std::mem::take(&mut self.candidates) {
            let frames = self.frames_to_start(&candidate);
            if !candidate.can_start(frames) {
                self.candidates.push(candidate);
                continue;
            }
            let order = self.order_of_heights.clone();
            let mut older = candidate.set_aside(frames);
            self.order_heights(&candidate);
            let begun = match self.begun(&candidate, size) {
                Err(reason) if candidate.with_older(std::mem::take(&mut older), &self.options) => {
                    self.begun(&candidate, size).map_err(|_| reason)
                }
                begun => begun,
            };
            let begun = begun.and_then(|active| match self.is_of_its_own(&active) {
                true => Ok(active),
                false => Err(Reason::Beside),
            });
            match begun {
                Ok(mut active) => {
                    let known = self.identities.count();
                    active.person = self.identified(&active);
                    active.started_near = !self.people.is_empty();
                    active.earlier = self.standing_of(&active);
                    active.before = self.before(&candidate);
                    // In the frames before somebody is back, there may be the earlier walk.
                    if active.person < known {
                        active.before.clear();
                        self.order_of_heights = order;
                    }
                    active.known_frame = Some(evidence.frame);
                    self.people.push(active);
                }
                Err(reason) => {
                    self.order_of_heights = order;
                    self.report.refused_starts += 1;
                    let last = candidate.last_rectangle();
                    last.iter().for_each(|r| self.unfollowed.refuse(evidence.frame, r, reason));
                    candidate.with_older(older, &self.options);
                    candidate.refuse(&self.options);
                    self.candidates.push(candidate);
                }
            }
        }
    }

    /// What the regions of the frames before those of a candidate showed.
    fn before(&self, candidate: &Candidate) -> Vec<Arc<Seen>> {
        let first = candidate.seen.first().map_or(0, |seen| seen.edges.frame);
        self.sought.iter().filter(|seen| seen.edges.frame < first).cloned().collect()
    }

    /// The given height of a person; `None` if it is to be measured.
    pub(super) fn given_height(&self, person: usize) -> Option<f64> {
        self.options.height_of(self.order_of_heights.get(person).copied().unwrap_or(person))
    }

    /// Gives the next person the one of the heights of nobody yet that a calibrated camera shows, if that is clearly not the
    /// first of them.
    pub(super) fn order_heights(&mut self, candidate: &Candidate) {
        let next = self.identities.count();
        let Some(camera) = &self.options.camera else { return };
        let Some(left) = self.order_of_heights.get(next..).filter(|left| left.len() > 1) else { return };
        let seen = candidate.seen_height(&self.options, camera);
        let off_m = |k: usize| {
            let given = self.options.height_of(left[k]);
            given.map_or(f64::INFINITY, |height_m| (height_m - seen.height_m).abs())
        };
        let nearest = (0..left.len()).min_by(|&a, &b| off_m(a).total_cmp(&off_m(b)));
        if let Some(k) = nearest.filter(|&k| off_m(0) > off_m(k) + CLEAR_SD * seen.sd_m) {
            self.order_of_heights[next..=next + k].rotate_right(1);
        }
    }

    /// The walk of a candidate, with the height of its person: of somebody who is expected back and is back with it, or
    /// of the next one.
    fn begun(&self, candidate: &Candidate, size: [u32; 2]) -> Result<Active, Reason> {
        let begin = |person: usize| {
            let (options, camera, tilt) = (&self.options, self.camera(), self.tilt);
            let (scale_sd, height_m) = (self.scale_sd(), self.given_height(person));
            candidate.begin(&Given { options, camera, tilt, scale_sd, height_m, size })
        };
        let is_back = |person: usize| begin(person).ok().filter(|active| self.is_back(person, active));
        let time_s = candidate.seen.first().map_or(0.0, |seen| seen.edges.time_s);
        let back = self.of_other_height(time_s).into_iter().find_map(is_back);
        back.map_or_else(|| begin(self.identities.count()), Ok)
    }

    /// True if a walk would start on somebody who is not followed, and not on what is left over from somebody who is.
    pub(super) fn is_of_its_own(&mut self, new: &Active) -> bool {
        self.is_somebody_else(new) && !self.is_left_over(new)
    }

    fn frames_to_start(&self, candidate: &Candidate) -> usize {
        let options = &self.options;
        let is_beside =
            |active: &Active| active.as_followed().is_some_and(|followed| candidate.is_in(&followed.window));
        let is_beside_others = self.people.iter().any(is_beside);
        if is_beside_others { options.start_frames_beside_others() } else { options.start_frames }
    }

    /// False if somebody is followed where a walk would start: on the ground or, as far as distances are known badly, in
    /// the picture.
    fn is_somebody_else(&self, new: &Active) -> bool {
        let place = |active: &Active| active.sign().map(|sign| sign.place_m);
        let near =
            |other: &Active| place(other).zip(place(new)).is_some_and(|(a, b)| a.distance(b) < SAME_PLACE_M);
        !self.people.iter().any(|other| near(other) || new.overlap(other) > SAME_BODY)
    }

    /// True if the changes were left over from somebody who turned: that person's contours are more similar on a curve.
    fn is_left_over(&mut self, new: &Active) -> bool {
        let Some(found) = new.as_followed() else { return false };
        let beside = |person: &&mut Active| person.as_followed().is_some_and(|other| other.meets(&found));
        let options = &self.options;
        self.people.iter_mut().filter(beside).any(|person| person.has_turned(options))
    }

    /// The walk that seemed to be over but went on as a later one, which the feet in between and since show.
    pub(super) fn gone_on(&mut self, later: &Active) -> Option<Active> {
        let options = &self.options;
        let (n, joined) = self
            .fading
            .iter()
            .enumerate()
            .find_map(|(n, (_, old))| Some((n, old.joined(later, options)?)))?;
        self.fading.remove(n);
        Some(joined)
    }

    /// The number of somebody who starts to be followed. A walk can leave its person, who turns or slows. Who starts
    /// where that person was is the same person, whose first walk ends there.
    pub(super) fn identified(&mut self, new: &Active) -> usize {
        let start = new.sign_at(0).expect("a walk starts with frames");
        let Some(n) = self.faded(&start) else { return self.identities.appear(&start) };
        let (_, mut old) = self.fading.remove(n);
        old.end_before(start.time_s);
        let person = old.person;
        self.identities.is_back(person);
        self.end_walk(old);
        self.identities.forget_end(person);
        person
    }

    /// Asks again whose walk it is, once its path is settled: it starts as if it went across the picture. Somebody of another
    /// given height stays.
    pub(super) fn identify_again(&mut self, active: &mut Active) {
        let (Some(start), person) = (active.sign_at(0), active.person) else { return };
        let known = self.faded(&start).map(|n| self.fading[n].1.person);
        let Some(known) = known.or_else(|| self.identities.known(&start)) else { return };
        let is_new = person + 1 == self.identities.count() && known < person;
        if is_new && self.given_height(known) == self.given_height(person) {
            self.identities.withdraw(person);
            active.person = self.identified(active);
        }
    }

    /// Which of the walks that are over leads to a start.
    fn faded(&self, start: &Sign) -> Option<usize> {
        // The old walk may have gone on for some frames while the person turned round.
        let stood = |end: Sign| Sign { time_s: end.time_s.min(start.time_s), ..end };
        let end = |old: &Active| old.standing().map(stood).or_else(|| old.last_seen_before(start.time_s));
        self.fading.iter().position(|(_, old)| end(old).is_some_and(|end| end.leads_to(start)))
    }

    /// True if a walk would get the number of this person, whose walk is over.
    pub(super) fn is_back(&self, person: usize, new: &Active) -> bool {
        let Some(start) = new.sign_at(0) else { return false };
        let known = self.faded(&start).map(|n| self.fading[n].1.person);
        known.or_else(|| self.identities.known(&start)) == Some(person)
    }

    /// People who may be back, and whose given heights are not that of the next person.
    pub(super) fn of_other_height(&self, time_s: f64) -> Vec<usize> {
        let height_m = |person: usize| self.given_height(person);
        let next_m = height_m(self.identities.count());
        let fading = self.fading.iter().map(|(_, old)| old.person);
        let mut people: Vec<usize> = fading.chain(self.identities.expected(time_s)).collect();
        people.retain(|&person| height_m(person) != next_m);
        people.sort_unstable();
        people.dedup();
        people
    }

    /// Relative standard deviation of the scale of that camera, if it is that of somebody who is followed.
    fn scale_sd(&self) -> f64 {
        let borrowed = self.people.first().filter(|_| self.options.camera.is_none());
        borrowed.map_or(0.0, |active| active.height.relative_sd().max(active.height.scale_sd))
    }
}
