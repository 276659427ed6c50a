//! The frames in which the feet alone show the walk, beside the fitted ones.

use super::super::decisions::{ACROSS_SD_M, COMMON_PHASE_SD};
use super::super::route::Route;
use super::contacts::Contact;
use super::of_walk::Tracked;
use super::{FittedFrame, WalkFit};
use crate::estimate::line::line_through;
use glam::DVec2;

/// Number of frames beside those of the feet whose places and phases these go on with.
const SEAM: usize = 8;
/// Beside the frames of the feet, places are those to which the fit leads, and until this time from there ever more those
/// of the feet, seconds. Chosen: with the difference added to all frames of the feet, two drawn people were 19 and 11
/// instead of 7 and 9 cm off along the path, and one 4 instead of 8.
const SEAM_S: f64 = 1.0;

impl Tracked<'_> {
    /// The fit with the frames in which the feet alone show the walk: there the person goes on from the fitted frames, soon
    /// where the feet say, with the person's own curves, of which nothing is measured. The fit bends the whole route by the
    /// frames that it sees, so in the others the route is the tracker's.
    pub(super) fn with_feet(&self, fit: WalkFit) -> WalkFit {
        let steps = self.steps();
        if steps.iter().all(|step| !step.by_feet) {
            return fit;
        }
        let walker = fit.walker();
        let shown: Vec<usize> = (0..steps.len()).filter(|&k| !steps[k].by_feet).collect();
        let time_s = |k: usize| steps[k].time_s;
        // 1. How far the place to which some fitted frames lead is from what the feet say of the frame after them, or
        // before them, and the mean difference of their phases.
        let by_feet = |k: usize| self.walk.route.place(steps[k].state.along.position);
        let apart = |range: std::ops::Range<usize>, next: isize| {
            let beside = if next > 0 { range.end - 1 } else { range.start };
            let k = shown[beside].saturating_add_signed(next);
            let led = [DVec2::X, DVec2::Y].map(|axis| {
                let place = |n: usize| (time_s(shown[n]), axis.dot(fit.frames[n].torso_centre.truncate()));
                let (speed, at_0) = line_through(&range.clone().map(place).collect::<Vec<_>>());
                at_0 + speed * time_s(k)
            });
            let count = range.len() as f64;
            let phase_off = |n: usize| fit.frames[n].phase - steps[shown[n]].state.phase.position;
            (DVec2::from_array(led) - by_feet(k), range.map(phase_off).sum::<f64>() / count)
        };
        let height_m = |n: usize| fit.frames[n].torso_centre.z - walker.gait.vertical_m(fit.frames[n].phase);
        let level_m = (0..shown.len()).map(height_m).sum::<f64>() / shown.len() as f64;
        // 2. Place and phase of all frames, and the route through the places.
        let at = |k: usize| {
            let after = shown.partition_point(|&other| other < k);
            if shown.get(after) == Some(&k) {
                return (fit.frames[after].torso_centre.truncate(), fit.frames[after].phase);
            }
            let before = (after > 0).then(|| (after - 1, apart(after.saturating_sub(SEAM)..after, 1)));
            let behind =
                (after < shown.len()).then(|| (after, apart(after..(after + SEAM).min(shown.len()), -1)));
            let from_s = |n: usize| (time_s(k) - time_s(shown[n])).abs();
            let (off_m, phase_off) = match (before, behind) {
                (Some((a, before)), Some((b, behind))) => {
                    let lasts_s = from_s(a) + from_s(b);
                    let fading = |n: usize| (1.0 - from_s(n) / lasts_s.min(SEAM_S)).max(0.0);
                    // The phases may be half a cycle apart, if the feet lost count.
                    let phase_off = before.1 + from_s(a) / lasts_s * (behind.1 - before.1);
                    (fading(a) * before.0 + fading(b) * behind.0, phase_off)
                }
                (a, b) => a.or(b).map_or_else(Default::default, |(n, (off_m, phase_off))| {
                    ((1.0 - from_s(n) / SEAM_S).max(0.0) * off_m, phase_off)
                }),
            };
            (by_feet(k) + off_m, steps[k].state.phase.position + phase_off)
        };
        let places: Vec<(DVec2, f64)> = (0..steps.len()).map(at).collect();
        let first_m = fit.frames[0].along_m;
        let points: Vec<DVec2> = places.iter().map(|(place, _)| *place).collect();
        let route = Route::through(&points, first_m).unwrap_or_else(|| fit.route.clone());
        let mut near_m = first_m;
        let frame = |(k, (place, phase)): (usize, (DVec2, f64))| {
            near_m = route.along(place, near_m);
            let after = shown.partition_point(|&other| other < k);
            if shown.get(after) == Some(&k) {
                return FittedFrame { along_m: near_m, ..fit.frames[after].clone() };
            }
            let state = &steps[k].state;
            let nearest = &fit.frames[after.min(shown.len() - 1)];
            FittedFrame {
                torso_centre: place.extend(level_m + walker.gait.vertical_m(phase)),
                heading_rad: route.at(near_m).heading_rad,
                along_m: near_m,
                phase,
                posture: walker.gait.posture(phase.rem_euclid(1.0), &walker.style),
                measured: Default::default(),
                sd: [
                    state.along.position_sd().hypot(self.depth_sd_m),
                    nearest.sd[1].hypot(ACROSS_SD_M),
                    nearest.sd[2],
                    state.phase.position_sd().hypot(COMMON_PHASE_SD),
                ],
            }
        };
        let frames = places.into_iter().enumerate().map(frame).collect();
        // 3. Contacts are those of feet that were seen as a whole.
        let is_shown = |contact: &Contact| {
            let after = steps.partition_point(|step| step.time_s < contact.time_s);
            let near = [after.saturating_sub(1), after.min(steps.len() - 1)];
            near.iter().all(|&k| !steps[k].by_feet)
        };
        let contacts = fit.contacts.iter().copied().filter(is_shown).collect();
        WalkFit { frames, contacts, route, ..fit }
    }
}
