//! What a fit says of the person: body, motion, contacts, and how well the model fits, with standard deviations.

use super::super::super::decisions::{
    FIT_PLACE_SD, HEIGHT_MODEL_SD_M, MEAN_MODEL_SD_RAD, MEAN_OFF_ACROSS_SD_M, MEAN_OFF_SD_RAD, MEAN_PLACE_SD,
    MODEL_SD_RAD, MOST_MISSED_OF_ARM, MOST_MISSED_OF_FOOT, MOST_SD_RAD, OFF_ACROSS_SD_M, OFF_HEIGHT_SD_M,
    OFF_SD_RAD, SD_FACTOR, ZERO_BLUR_PX, ZERO_SD,
};
use super::super::belt::{self, Belt};
use super::super::contacts::{self, Contact, Feet};
use super::super::unknowns::{
    self, ANGLES, FRAME, FRAME_ALONG, FRAME_HEIGHT, FRAME_PHASE, JOINTS, Prior, STATURE, TORSO, Unknowns,
    WHOLE, WHOLE_ACROSS, WHOLE_BEND, WHOLE_HEADING, WHOLE_LEAN, body, excess, posture, slopes,
};
use super::super::{FitQuality, FittedFrame, MeanSd, Measured, PartQuality, WalkFit};
use super::{Fitted, Problem};
use crate::estimate::arrow::Covariance;
use crate::estimate::median::median;
use crate::model::body::Part;
use crate::model::skeleton::Side;
use crate::track::event::EventKind;
use crate::track::height::{BodyHeight, HeightSource};
use glam::DVec2;
use rayon::prelude::*;

/// Which joints of each side are not those of an arm that is elsewhere than the model's.
pub(super) fn arms_seen(quality: &FitQuality) -> [[bool; JOINTS]; 2] {
    let is_seen =
        |part: Part| quality.parts[part as usize].is_none_or(|of_part| of_part.missed <= MOST_MISSED_OF_ARM);
    let arms = [(Part::RightUpperArm, Part::RightForearm), (Part::LeftUpperArm, Part::LeftForearm)];
    arms.map(|(upper_arm, forearm)| {
        let shoulder = is_seen(upper_arm);
        [true, true, true, shoulder, shoulder && is_seen(forearm)]
    })
}

/// True if the outline of a foot, where contacts are measured, has edges.
fn is_foot_seen(quality: &FitQuality, side: Side) -> bool {
    let foot = if side == Side::Right { Part::RightFoot } else { Part::LeftFoot };
    quality.parts[foot as usize].is_none_or(|of_part| of_part.missed <= MOST_MISSED_OF_FOOT)
}

impl Problem<'_> {
    /// The zero of the phase by the contacts, and its standard deviation: contacts of small people are blurred, and the average
    /// curves have their zero within ZERO_SD of a person's.
    fn zero(&self, contacts: &[Contact], times_s: &[f64], phases: &[f64], quality: &FitQuality) -> [f64; 2] {
        if !contacts.iter().any(|contact| contact.kind == EventKind::HeelStrike) {
            return [0.0, ZERO_SD];
        }
        let blur = ZERO_BLUR_PX / quality.height_px;
        let share = ZERO_SD.powi(2) / (ZERO_SD.powi(2) + blur.powi(2));
        [share * contacts::mean_phase(contacts, times_s, phases), share.sqrt() * blur]
    }

    pub(super) fn quality(&self, fitted: &Fitted) -> FitQuality {
        let seen = &fitted.seen;
        let lengths = STATURE.iter().map(|&n| {
            let Prior { mean, sd } = self.priors[n];
            ((self.of_its_size(&fitted.unknowns.whole, n) - mean) / sd).abs()
        });
        FitQuality {
            residual_px: seen.distance_px / (seen.outer - seen.outer_missed).max(1.0),
            height_px: fitted.height_px,
            // Pictures that show nothing of the person show no edge of the outline.
            missed: if seen.outer > 0.0 { seen.outer_missed / seen.outer } else { 1.0 },
            missed_inside: seen.inner_missed / seen.inner.max(1.0),
            worst_length_sd: lengths.fold(0.0, f64::max),
            sole_m: self.is_scale_seen.then(|| self.mean_sole_m(&fitted.unknowns)),
            crown_off: self.crown_off(&fitted.unknowns),
            cost: seen.cost,
            total_cost: self.total_cost_of(fitted),
            parts: seen.parts.map(|of| {
                let found = of.samples - of.missed;
                (of.samples > 0.0).then(|| PartQuality {
                    share: of.samples / seen.outer,
                    missed: of.missed / of.samples,
                    residual_px: (found > 0.0).then(|| of.distance_px / found),
                })
            }),
        }
    }

    /// How far the crown of the changes is above the model's, in the median of the frames, as a share of the height.
    fn crown_off(&self, unknowns: &Unknowns) -> Option<f64> {
        let off = |k: usize| {
            let figure = self.figure(unknowns, k);
            let (_, off_px) = self.crown(&figure, self.frames[k].view.crown_px?)?;
            Some(off_px / self.camera.pixel_height_at(figure.pelvis.with_z(0.0), figure.body.height_m)?)
        };
        median(&mut (0..self.frames.len()).filter_map(off).collect::<Vec<_>>())
    }

    /// Mean height of the lower sole above the ground.
    fn mean_sole_m(&self, unknowns: &Unknowns) -> f64 {
        let soles: f64 =
            (0..self.frames.len()).map(|k| self.figure(unknowns, k).lowest_point().world.z).sum();
        soles / self.frames.len() as f64
    }

    /// Step 7.
    pub(super) fn result(&self, fitted: &Fitted, p_swapped: f64, quality: FitQuality) -> WalkFit {
        let Unknowns { whole, frames } = &fitted.unknowns;
        let covariance = &fitted.solution.covariance();
        let (turn, left_m) = (whole[WHOLE_HEADING], whole[WHOLE_ACROSS]);
        let arms = arms_seen(&quality);
        let ends_m = [0, frames.len() - 1].map(|k| self.along(&frames[k]));
        let bent = self.bend.and_then(|bend| bend.moved(whole, self.route, ends_m));
        let route = bent.as_ref().unwrap_or(self.route);
        let route = route.moved(self.origin, self.origin_along_m, turn, left_m);
        let frame = |k: usize| {
            let figure = self.figure(&fitted.unknowns, k);
            let frame = FittedFrame {
                torso_centre: figure.posed.torso_centre,
                heading_rad: self.heading_at(whole, self.along(&frames[k])),
                along_m: route.along(figure.posed.torso_centre.truncate(), frames[k][FRAME_ALONG]),
                phase: frames[k][FRAME_PHASE],
                posture: posture(&self.walker.gait, whole, &frames[k]),
                measured: self.measured(fitted, covariance, k, &arms),
                sd: self.place_sd(fitted, covariance, k),
            };
            (frame, figure.feet())
        };
        let (mut all, feet): (Vec<FittedFrame>, Vec<_>) =
            (0..frames.len()).into_par_iter().map(frame).unzip();
        // The speed of the belt is that of the feet in the frames, contacts lie between these.
        let belt = self.is_on_treadmill.then(|| self.belt(&all, &feet)).flatten();
        let (times_s, between) = contacts::between(&self.times_s(), frames);
        let phases: Vec<f64> = between.iter().map(|frame| frame[FRAME_PHASE]).collect();
        let figure = |frame: &[f64; FRAME]| self.figure_of(whole, frame);
        let (mut feet, ahead): (Vec<_>, Vec<DVec2>) =
            between.par_iter().map(figure).map(|figure| (figure.feet(), figure.ahead)).unzip();
        if let Some(belt) = belt {
            belt::move_with(&mut feet, &times_s, ahead[0] * belt.speed_mps);
        }
        // Feet that stand move with a belt, and how fast nobody knows without one.
        let are_still = belt.is_some() || !self.is_on_treadmill;
        let mut contacts =
            if are_still { contacts::contacts(&times_s, &phases, &feet, &ahead) } else { Vec::new() };
        contacts.retain(|contact| is_foot_seen(&quality, contact.side));
        // Phase 0 is the initial contact where the feet show it, and not where the average curves have it.
        let [zero, zero_sd] = self.zero(&contacts, &times_s, &phases, &quality);
        for frame in &mut all {
            frame.phase -= zero;
            frame.sd[3] = frame.sd[3].hypot(zero_sd);
        }
        let mut mean_sd = self.mean_sd(fitted, &all);
        mean_sd.place[3] = mean_sd.place[3].hypot(zero_sd);
        let curves = unknowns::curves(&self.walker.gait, whole, zero);
        WalkFit {
            body: body(&self.walker.body, whole),
            height: self.height(fitted, covariance, &quality),
            route,
            curves,
            mean_sd,
            frames: all,
            contacts,
            p_swapped: quality.p_swapped(p_swapped),
            mirrored: None,
            belt,
            quality,
        }
    }

    fn times_s(&self) -> Vec<f64> {
        self.frames.iter().map(|frame| frame.time_s).collect()
    }

    fn belt(&self, frames: &[FittedFrame], feet: &[Feet]) -> Option<Belt> {
        let phases: Vec<f64> = frames.iter().map(|f| f.phase).collect();
        let sight = self.origin - self.camera.position().truncate();
        belt::belt(&self.times_s(), &phases, feet, DVec2::from_angle(frames[0].heading_rad), sight)
    }

    /// The body height without the prior of the excess, which is taken out as it was put in: with estimate x and
    /// variance v after all evidence, and prior m, s², the others say x' = v' (x / v - m / s²), 1 / v' = 1 / v - 1 / s².
    fn height(&self, fitted: &Fitted, covariance: &Covariance, quality: &FitQuality) -> Option<BodyHeight> {
        let excess = excess(&fitted.unknowns.whole);
        let variance = covariance.variance(&STATURE.map(|n| (n, 1.0)), &[]);
        let Prior { mean, sd } = self.excess;
        let weight = variance.recip() - sd.powi(-2);
        let seen = (excess / variance - mean / sd.powi(2)) / weight;
        let height_m = self.walker.body.height_m;
        let is_seen = self.is_scale_seen && !quality.is_off_ground() && weight > 0.0 && weight.is_finite();
        is_seen.then(|| BodyHeight {
            height_m: height_m * (1.0 + seen),
            sd_m: (SD_FACTOR * height_m / weight.sqrt())
                .hypot(HEIGHT_MODEL_SD_M)
                .hypot(OFF_HEIGHT_SD_M * fitted.seen.off()),
            source: HeightSource::Measured,
            scale_sd: 0.0,
        })
    }

    /// The angles of a frame that the pictures determine, with standard deviations.
    fn measured(
        &self,
        fitted: &Fitted,
        covariance: &Covariance,
        frame: usize,
        arms: &[[bool; JOINTS]; 2],
    ) -> [Measured; 2] {
        let (unknowns, off) = (&fitted.unknowns, fitted.seen.off());
        let angles = unknowns::angles(&self.walker.gait, &unknowns.whole, &unknowns.frames[frame]);
        let forms = self.angle_forms(unknowns, frame);
        let measured = |at: usize| {
            let Form { whole, frames } = &forms[at];
            let [sd, most] =
                [SD_FACTOR * covariance.variance(whole, frames).sqrt(), MOST_SD_RAD[at % JOINTS]];
            let sd = sd.hypot(MODEL_SD_RAD[at % JOINTS]).hypot(OFF_SD_RAD * off);
            (sd <= most && arms[at / JOINTS][at % JOINTS]).then_some([angles[at], sd])
        };
        [0, 1].map(|side| Measured { angles: std::array::from_fn(|joint| measured(side * JOINTS + joint)) })
    }

    /// Standard deviations of the torso's centre along, across and up, and of the phase.
    fn place_sd(&self, fitted: &Fitted, covariance: &Covariance, frame: usize) -> [f64; 4] {
        let forms = self.place_forms(&fitted.unknowns, frame);
        let mut sd = std::array::from_fn(|at| {
            let Form { whole, frames } = &forms[at];
            (SD_FACTOR * covariance.variance(whole, frames).sqrt()).hypot(FIT_PLACE_SD[at])
        });
        sd[ACROSS] = sd[ACROSS].hypot(OFF_ACROSS_SD_M * fitted.seen.off());
        sd
    }

    /// Standard deviations of means over the frames: of each angle over those that show the limb, of the place over all.
    fn mean_sd(&self, fitted: &Fitted, frames: &[FittedFrame]) -> MeanSd {
        let (unknowns, off) = (&fitted.unknowns, fitted.seen.off());
        let sd = |mean: &Form| SD_FACTOR * fitted.solution.variance(&mean.whole, &mean.frames).sqrt();
        // 1. The angles.
        let angle_forms: Vec<_> = (0..frames.len()).map(|k| self.angle_forms(unknowns, k)).collect();
        let of_angle = |side: usize, joint: usize| {
            let is_shown = |k: &usize| frames[*k].measured[side].angles[joint].is_some();
            let shown: Vec<usize> = (0..frames.len()).filter(is_shown).collect();
            let mean = Form::mean(shown.iter().map(|&k| &angle_forms[k][side * JOINTS + joint]))?;
            Some(sd(&mean).hypot(MEAN_MODEL_SD_RAD[joint]).hypot(MEAN_OFF_SD_RAD * off))
        };
        let angles = [0, 1].map(|side| std::array::from_fn(|joint| of_angle(side, joint)));
        // 2. The place.
        let place_forms: Vec<_> = (0..frames.len()).map(|k| self.place_forms(unknowns, k)).collect();
        let mut place = std::array::from_fn(|at| {
            let mean = Form::mean(place_forms.iter().map(|forms| &forms[at])).unwrap_or_default();
            sd(&mean).hypot(MEAN_PLACE_SD[at])
        });
        place[ACROSS] = place[ACROSS].hypot(MEAN_OFF_ACROSS_SD_M * off);
        MeanSd { angles, place }
    }

    /// How the angles of a frame, right then left, change with the unknowns.
    pub(super) fn angle_forms(&self, unknowns: &Unknowns, frame: usize) -> [Form; 2 * JOINTS] {
        let mut all = Vec::new();
        slopes(&self.walker.gait, &unknowns.whole, &unknowns.frames[frame], &mut all);
        let mut forms: [Form; 2 * JOINTS] = Default::default();
        for (of, unknown, slope) in all {
            let Some(form) = of.checked_sub(ANGLES).and_then(|at| forms.get_mut(at)) else { continue };
            match unknown.checked_sub(WHOLE) {
                None => form.whole.push((unknown, slope)),
                Some(unknown) => form.frames.push((frame * FRAME + unknown, slope)),
            }
        }
        forms
    }

    /// The same of the torso's centre along, across and up, and of the phase.
    pub(super) fn place_forms(&self, unknowns: &Unknowns, frame: usize) -> [Form; 4] {
        let (height_m, lean) = (self.walker.body.height_m, unknowns.whole[WHOLE_LEAN]);
        let half_m = 0.5 * body(&self.walker.body, &unknowns.whole).torso_length_m();
        let half_torso = 0.5 * height_m;
        let along_m = unknowns.frames[frame][FRAME_ALONG];
        let at = |unknown: usize| vec![(frame * FRAME + unknown, 1.0)];
        let mut across = vec![(WHOLE_ACROSS, 1.0), (WHOLE_HEADING, along_m)];
        let bend = self.bend.map(|bend| bend.terms(self.origin_along_m + along_m));
        across.extend(bend.iter().flatten().enumerate().map(|(j, [moved, ..])| (WHOLE_BEND + j, *moved)));
        let along = vec![(WHOLE_LEAN, half_m * lean.cos()), (TORSO, half_torso * lean.sin())];
        let up = vec![(WHOLE_LEAN, -half_m * lean.sin()), (TORSO, half_torso * lean.cos())];
        [
            Form { whole: along, frames: at(FRAME_ALONG) },
            Form { whole: across, frames: Vec::new() },
            Form { whole: up, frames: at(FRAME_HEIGHT) },
            Form { whole: Vec::new(), frames: at(FRAME_PHASE) },
        ]
    }
}

/// The place across the path, of the four of a place.
const ACROSS: usize = 1;

/// A linear form of the unknowns: those of the whole, and those of frames by their index among all, with their factors.
#[derive(Debug, Clone, Default)]
pub(super) struct Form {
    pub whole: Vec<(usize, f64)>,
    pub frames: Vec<(usize, f64)>,
}

impl Form {
    /// Their mean; `None` of none.
    pub fn mean<'a>(forms: impl ExactSizeIterator<Item = &'a Self>) -> Option<Self> {
        let share = 1.0 / forms.len() as f64;
        let of = |terms: &[(usize, f64)]| terms.iter().map(|&(at, a)| (at, share * a)).collect::<Vec<_>>();
        forms.fold(None, |mean: Option<Self>, form| {
            let mut mean = mean.unwrap_or_default();
            mean.whole.extend(of(&form.whole));
            mean.frames.extend(of(&form.frames));
            Some(mean)
        })
    }
}
