//! What a fit says of the person: body, motion, contacts, and how well the model fits, with standard deviations.

use super::super::super::decisions::{
    FIT_PLACE_SD, HEIGHT_MODEL_SD_M, MODEL_SD_RAD, MOST_SD_RAD, OFF_ACROSS_SD_M, OFF_SD_RAD, SD_FACTOR,
    ZERO_BLUR_PX, ZERO_SD,
};
use super::super::belt::{self, Belt};
use super::super::contacts::{self, Feet};
use super::super::unknowns::{
    self, ANGLES, FRAME, FRAME_ALONG, FRAME_HEIGHT, FRAME_PHASE, JOINTS, Prior, STATURE, TORSO, Unknowns,
    WHOLE, WHOLE_ACROSS, WHOLE_BEND, WHOLE_HEADING, WHOLE_LEAN, body, excess, posture, slopes,
};
use super::super::{FitQuality, FittedFrame, Measured, PartQuality, WalkFit};
use super::{Fitted, Problem};
use crate::estimate::arrow::Covariance;
use crate::estimate::median::median;
use crate::track::height::{BodyHeight, HeightSource};
use glam::DVec2;
use rayon::prelude::*;

impl Problem<'_> {
    /// How much of a measured zero of the phase is believed: contacts of small people are blurred, and the average
    /// curves have their zero within ZERO_SD of a person's.
    fn share_of_zero(&self, quality: &FitQuality) -> f64 {
        let blur = ZERO_BLUR_PX / quality.height_px;
        ZERO_SD.powi(2) / (ZERO_SD.powi(2) + blur.powi(2))
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
            missed: seen.outer_missed / seen.outer.max(1.0),
            missed_inside: seen.inner_missed / seen.inner.max(1.0),
            worst_length_sd: lengths.fold(0.0, f64::max),
            sole_m: self.is_scale_seen.then(|| self.mean_sole_m(&fitted.unknowns)),
            crown_off: self.crown_off(&fitted.unknowns),
            cost: seen.cost,
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
                measured: self.measured(fitted, covariance, k),
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
        let contacts = contacts::contacts(&times_s, &phases, &feet, &ahead);
        // Phase 0 is the initial contact where the feet show it, and not where the average curves have it.
        let zero = contacts::mean_phase(&contacts, &times_s, &phases) * self.share_of_zero(&quality);
        all.iter_mut().for_each(|frame| frame.phase -= zero);
        let curves = unknowns::curves(&self.walker.gait, whole, zero);
        WalkFit {
            body: body(&self.walker.body, whole),
            height: self.height(fitted, covariance, &quality),
            route,
            curves,
            frames: all,
            contacts,
            p_swapped,
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
            sd_m: (SD_FACTOR * height_m / weight.sqrt()).hypot(HEIGHT_MODEL_SD_M),
            source: HeightSource::Measured,
            scale_sd: 0.0,
        })
    }

    /// The angles of a frame that the pictures determine, with standard deviations.
    fn measured(&self, fitted: &Fitted, covariance: &Covariance, frame: usize) -> [Measured; 2] {
        let (unknowns, off) = (&fitted.unknowns, fitted.seen.off());
        let angles = unknowns::angles(&self.walker.gait, &unknowns.whole, &unknowns.frames[frame]);
        let mut all = Vec::new();
        slopes(&self.walker.gait, &unknowns.whole, &unknowns.frames[frame], &mut all);
        let measured = |at: usize| {
            let (mut whole, mut frames) = (Vec::new(), Vec::new());
            for &(_, unknown, slope) in all.iter().filter(|s| s.0 == ANGLES + at) {
                match unknown.checked_sub(WHOLE) {
                    None => whole.push((unknown, slope)),
                    Some(unknown) => frames.push((frame * FRAME + unknown, slope)),
                }
            }
            let [sd, most] =
                [SD_FACTOR * covariance.variance(&whole, &frames).sqrt(), MOST_SD_RAD[at % JOINTS]];
            let sd = sd.hypot(MODEL_SD_RAD[at % JOINTS]).hypot(OFF_SD_RAD * off);
            (sd <= most).then_some([angles[at], sd])
        };
        [0, 1].map(|side| Measured { angles: std::array::from_fn(|joint| measured(side * JOINTS + joint)) })
    }

    /// Standard deviations of the torso's centre along, across and up, and of the phase.
    fn place_sd(&self, fitted: &Fitted, covariance: &Covariance, frame: usize) -> [f64; 4] {
        let (height_m, lean) = (self.walker.body.height_m, fitted.unknowns.whole[WHOLE_LEAN]);
        let half_m = 0.5 * body(&self.walker.body, &fitted.unknowns.whole).torso_length_m();
        let along_m = fitted.unknowns.frames[frame][FRAME_ALONG];
        let at = |unknown: usize| [(frame * FRAME + unknown, 1.0)];
        let sd = |whole: &[(usize, f64)], frames: &[(usize, f64)], common: f64| {
            (SD_FACTOR * covariance.variance(whole, frames).sqrt()).hypot(common)
        };
        let half_torso = 0.5 * height_m;
        let mut across = vec![(WHOLE_ACROSS, 1.0), (WHOLE_HEADING, along_m)];
        let bend = self.bend.map(|bend| bend.terms(self.origin_along_m + along_m));
        across.extend(bend.iter().flatten().enumerate().map(|(j, [moved, ..])| (WHOLE_BEND + j, *moved)));
        [
            sd(
                &[(WHOLE_LEAN, half_m * lean.cos()), (TORSO, half_torso * lean.sin())],
                &at(FRAME_ALONG),
                FIT_PLACE_SD[0],
            ),
            sd(&across, &[], FIT_PLACE_SD[1].hypot(OFF_ACROSS_SD_M * fitted.seen.off())),
            sd(&[(TORSO, half_torso * lean.cos())], &at(FRAME_HEIGHT), FIT_PLACE_SD[2]),
            sd(&[], &at(FRAME_PHASE), FIT_PLACE_SD[3]),
        ]
    }
}
