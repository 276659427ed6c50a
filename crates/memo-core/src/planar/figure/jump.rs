//! Jumps: positions that leave their track and return. They are wrong detections and are removed before the fits.
//!
//! The fit of a group can also exclude views ([`FitOptions::max_outlier_fraction`](crate::planar::FitOptions)),
//! but then takes ten times as long. Here the order in time is known, and each track is checked once.
//!
//! Limits: a wrong position that stays for several frames is not detected.

use glam::DVec2;

/// A position is a jump if its distance from the middle of its neighbours is this many times the usual one.
const JUMP: f64 = 10.0;

/// The same track without jumps; `noise_sd` is the standard deviation of each coordinate.
///
/// The distance of p_t from (p_t-1 + p_t+1) / 2 is due to acceleration and noise. It is large for a foot that
/// lands, but at most half of |p_t+1 - p_t-1|: a jump is larger than the distance between its neighbours. A wrong
/// position changes its neighbours' distances by half of its own, so the largest is removed first.
pub(super) fn without_jumps(track: &[DVec2], noise_sd: f64) -> Vec<DVec2> {
    let mut clean = track.to_vec();
    let off = |track: &[DVec2], t: usize| {
        if t == 0 || t + 1 >= track.len() {
            f64::NAN
        } else {
            track[t].distance(0.5 * (track[t - 1] + track[t + 1]))
        }
    };
    let mut distances: Vec<f64> = (0..track.len()).map(|t| off(track, t)).filter(|d| !d.is_nan()).collect();
    if distances.len() < 8 {
        return clean;
    }
    let middle = distances.len() / 2;
    let usual = *distances.select_nth_unstable_by(middle, f64::total_cmp).1;
    // Noise alone gives a median distance of 1.44 standard deviations.
    let limit = JUMP * usual.max(1.44 * noise_sd);
    // If more than a tenth would be removed, the track is rough and not wrong.
    let most = (track.len() / 10).max(1);
    for _ in 0..=most {
        let turns_back = |t: usize, d: f64| d > clean[t - 1].distance(clean[t + 1]);
        let distances =
            (0..clean.len()).map(|t| (off(&clean, t), t)).filter(|&(d, t)| d > limit && turns_back(t, d));
        let Some((_, worst)) = distances.max_by(|a, b| a.0.total_cmp(&b.0)) else { return clean };
        clean[worst] = DVec2::NAN;
    }
    track.to_vec()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::planar::figure::example::walker;
    use crate::synth::Random;

    #[test]
    fn a_foot_that_lands_is_no_jump() {
        let track: Vec<DVec2> = (0..40).map(|t| DVec2::new(8.0 * f64::from(t.clamp(10, 20)), 0.0)).collect();
        assert_eq!(without_jumps(&track, 0.0), track);
    }

    #[test]
    fn as_many_jumps_as_allowed_go_and_more_stay() {
        for (frames, jumps) in [(19, 1), (66, 6), (69, 6), (69, 8)] {
            let smooth: Vec<DVec2> =
                (0..frames).map(|t| DVec2::new(f64::from(t), 0.1 * f64::from(t * t))).collect();
            let mut wrong = smooth.clone();
            let places: Vec<usize> = (0..jumps).map(|k| 4 + 7 * k).collect();
            places.iter().for_each(|&t| wrong[t].y += 120.0);
            let kept = without_jumps(&wrong, 0.0);
            let gone: Vec<usize> = (0..wrong.len()).filter(|&t| kept[t].is_nan()).collect();
            assert_eq!(gone, if jumps == 8 { vec![] } else { places }, "{frames} frames");
        }
    }

    #[test]
    fn jumps_go_and_walks_stay() {
        for noise_px in [0.0, 1.0] {
            let (tracks, ..) = walker(66, |_| 0.0, noise_px);
            let mut random = Random::new(2);
            for track in &tracks {
                let kept = without_jumps(track, noise_px);
                assert!(kept.iter().all(|p| p.is_finite()), "nothing of a walk is a jump");
                let mut wrong = track.clone();
                for t in [7, 30, 31, 50] {
                    wrong[t] += 80.0 * DVec2::from_angle(random.uniform(0.0, 6.3));
                }
                let kept = without_jumps(&wrong, noise_px);
                for t in [7, 50] {
                    assert!(kept[t].is_nan(), "frame {t}");
                }
                assert!(kept.iter().filter(|p| p.is_nan()).count() <= 5);
            }
        }
    }

    /// If points hardly move, the stated noise is the usual distance, and jumps are ten times as large.
    #[test]
    fn a_jump_is_large_beside_the_noise_that_was_stated() {
        let mut track = vec![DVec2::ZERO; 40];
        for (t, p) in track.iter_mut().enumerate() {
            p.x = f64::from(u8::try_from(t).unwrap());
        }
        track[20].y = 12.0;
        assert!(without_jumps(&track, 0.0)[20].is_nan());
        assert!(without_jumps(&track, 0.5)[20].is_nan());
        // 14.4 px for a noise of 1 px.
        assert_eq!(without_jumps(&track, 1.0), track);
    }
}
