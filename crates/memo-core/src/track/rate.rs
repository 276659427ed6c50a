//! Numbers of frames at the frame rate of a video.
//!
//! Decisions of the tracker that count frames were chosen on videos of 25 to 30 frames per second. At a higher rate, as many
//! frames as last as long are counted: what twelve frames of a quarter of the time show is not enough for any of them, and
//! the errors of more neighbouring frames are alike.

use super::walk::Step;
use crate::estimate::median::median;

/// Time from frame to frame up to which numbers of frames stay as they are, seconds.
const USUAL_EVERY_S: f64 = 1.0 / 30.0;
/// So many first intervals tell the rate.
const INTERVALS: usize = 12;

/// How many frames, `every_s` apart, last as long as so many at the usual rate; at least so many.
pub(super) fn lasting(count: usize, every_s: f64) -> usize {
    (count as f64 * more(every_s)).round() as usize
}

/// How many times as many frames there are as at the usual rate, at least 1.
pub(super) fn more(every_s: f64) -> f64 {
    if every_s > 0.0 { (USUAL_EVERY_S / every_s).max(1.0) } else { 1.0 }
}

/// Mean time between neighbours, seconds; NaN for fewer than two.
pub(super) fn mean_interval_s(times_s: impl ExactSizeIterator<Item = f64>) -> f64 {
    let count = times_s.len();
    let mut ends = None;
    times_s.for_each(|time_s| ends = Some((ends.map_or(time_s, |(first, _)| first), time_s)));
    ends.map_or(f64::NAN, |(first, last)| (last - first) / (count as f64 - 1.0))
}

/// The last frames, as many as last as long as `count` at the usual rate; `None` if there are fewer.
pub(super) fn latest(steps: &[Step], count: usize) -> Option<&[Step]> {
    let every_s = mean_interval_s(steps.iter().map(|step| step.time_s));
    Some(&steps[steps.len().checked_sub(lasting(count, every_s))?..])
}

/// The frame rate of a stream, by its first frames.
#[derive(Debug, Clone, Default)]
pub(super) struct FrameRate {
    before_s: Option<f64>,
    intervals_s: Vec<f64>,
}

impl FrameRate {
    /// The median interval so far after the next frame, seconds; `None` once it stays as it is.
    pub fn push(&mut self, time_s: f64) -> Option<f64> {
        if self.intervals_s.len() == INTERVALS {
            return None;
        }
        let before_s = self.before_s.replace(time_s)?;
        self.intervals_s.push(time_s - before_s);
        median(&mut self.intervals_s.clone())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::track::active::tests::step;

    #[test]
    fn more_frames_are_counted_at_a_higher_rate_and_no_fewer_at_a_lower_one() {
        for (rate_hz, counted) in [(7.0, 12), (25.0, 12), (30.0, 12), (50.0, 20), (120.0, 48), (240.0, 96)] {
            assert_eq!(lasting(12, 1.0 / rate_hz), counted, "{rate_hz}");
        }
        assert_eq!([0.0, f64::NAN, -1.0].map(|every_s| lasting(12, every_s)), [12; 3]);
    }

    #[test]
    fn the_latest_frames_last_as_long_at_any_rate() {
        for (every_s, count) in [(0.04, 12), (0.01, 40)] {
            let steps: Vec<Step> =
                (0..50).map(|k| Step { time_s: every_s * k as f64, ..step(k, [0.0, 0.0], 0.5) }).collect();
            let last = latest(&steps, 12).unwrap();
            assert_eq!((last.len(), last[count - 1].frame), (count, 49));
            assert!(latest(&steps[..count - 1], 12).is_none());
        }
        assert!(latest(&[], 12).is_none() && latest(&[step(0, [0.0; 2], 0.5)], 1).is_some());
    }

    #[test]
    fn the_rate_is_that_of_the_first_frames_but_for_a_gap() {
        let mut rate = FrameRate::default();
        let times_s: Vec<f64> =
            (0..20).map(|k| 0.01 * f64::from(k) + if k > 4 { 2.0 } else { 0.0 }).collect();
        let told: Vec<Option<f64>> = times_s.into_iter().map(|time_s| rate.push(time_s)).collect();
        assert!(told[0].is_none() && told[1..=INTERVALS].iter().all(|every_s| every_s.is_some()));
        assert!((told[INTERVALS].unwrap() - 0.01).abs() < 1e-9);
        assert!(told[INTERVALS + 1..].iter().all(Option::is_none));
    }
}
