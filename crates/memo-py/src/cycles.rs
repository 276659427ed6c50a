//! Gait cycles of a walk, and average walking.

use crate::result::{objects, result};
use crate::tracker::choice_error;
use memo_core::track::cycles::{AngleAt, CYCLE_POINTS, MeanAngle, mean_cycles};
use memo_core::track::normal_gait::{self, NormalJoint, departures, normal_cycle};
use memo_core::{Side, TrackedWalk};
use numpy::{PyArray1, PyArray2, PyArray3, PyArrayMethods};
use pyo3::prelude::*;

result! {
    /// A gait cycle of one side, or the mean of its cycles.
    GaitCycle |py, side: Side, kind: &str, times_s: [f64; 2], values: Vec<[f64; VALUES]>| {
        /// "right" or "left".
        side: String = side.name(),
        /// "cycle", "partial" or "mean".
        curve: String = kind,
        /// Time of the first initial contact, seconds; NaN for a mean.
        start_s: f64 = times_s[0],
        /// Time of the next, or of the last frame of a part; NaN for a mean.
        end_s: f64 = times_s[1],
        /// (5, 101, 6): of hip, knee, ankle, shoulder and elbow, at 0 to 100 %, angle, stated standard deviation,
        /// standard deviation over cycles, low and high end of the 95 % interval (degrees), and number of cycles; NaN if
        /// unknown.
        values: Py<PyArray3<f64>> = array(py, &values)?,
    }
    |own| format!("{} {}, {:.2} to {:.2} s", own.side, own.curve, own.start_s, own.end_s)
}

result! {
    /// A joint whose mean cycle is outside of average walking.
    Departure |_py, found: &normal_gait::Departure| {
        /// "right" or "left".
        side: String = found.side.name(),
        /// "hip" or "knee".
        joint: String = found.joint.name(),
        /// How far outside, where that is most, degrees; positive is more flexed.
        excess_deg: f64 = found.excess.to_degrees(),
        /// Half of its 95 % interval, degrees.
        half_deg: f64 = found.half.to_degrees(),
        /// Where that is, per cent of the cycle.
        at_percent: usize,
        /// Share of the cycle that is outside with the whole interval.
        share: f64,
    }
    |own| format!("{} {}, {:.0} deg at {} %", own.side, own.joint, own.excess_deg, own.at_percent)
}

const VALUES: usize = 6;

/// All cycles of a walk, each side's mean after them.
pub fn gait_cycles_of(py: Python<'_>, walk: &TrackedWalk) -> PyResult<Vec<Py<GaitCycle>>> {
    let cycles = walk.cycles();
    let mut found = Vec::new();
    for mean in mean_cycles(&cycles) {
        for cycle in cycles.iter().filter(|cycle| cycle.side == mean.side) {
            let curve = if cycle.is_whole { "cycle" } else { "partial" };
            let values = cycle.angles.iter().flatten().map(single).collect();
            found.push(GaitCycle::of(py, cycle.side, curve, [cycle.start_s, cycle.end_s], values));
        }
        let values = mean.angles.iter().flatten().map(averaged).collect();
        found.push(GaitCycle::of(py, mean.side, "mean", [f64::NAN; 2], values));
    }
    objects(py, found.into_iter())
}

fn single(angle: &AngleAt) -> [f64; VALUES] {
    let unknown = f64::NAN;
    match angle {
        Some([angle, sd]) => [angle.to_degrees(), sd.to_degrees(), unknown, unknown, unknown, 1.0],
        None => [unknown, unknown, unknown, unknown, unknown, 0.0],
    }
}

fn averaged(angle: &Option<MeanAngle>) -> [f64; VALUES] {
    let Some(MeanAngle { mean, stated_sd, cycle_sd, half, n }) = *angle else { return single(&None) };
    let [low, high] = [mean - half, mean + half].map(f64::to_degrees);
    let cycle_sd = cycle_sd.map_or(f64::NAN, f64::to_degrees);
    [mean.to_degrees(), stated_sd.to_degrees(), cycle_sd, low, high, n as f64]
}

fn array<'py>(py: Python<'py>, values: &[[f64; VALUES]]) -> PyResult<Bound<'py, PyArray3<f64>>> {
    let joints = values.len() / CYCLE_POINTS;
    PyArray1::from_vec(py, values.concat()).reshape([joints, CYCLE_POINTS, VALUES])
}

/// Departures of a walk from average walking.
pub fn departures_of(py: Python<'_>, walk: &TrackedWalk) -> PyResult<Vec<Py<Departure>>> {
    objects(py, departures(&mean_cycles(&walk.cycles())).iter().map(|found| Departure::of(py, found)))
}

/// Average walking of healthy adults at 0 to 100 % of the cycle, (101, 2) degrees: average and standard deviation over
/// people of the angle between joint centres; joint is "hip" or "knee".
#[pyfunction]
#[pyo3(name = "normal_cycle")]
pub fn py_normal_cycle<'py>(py: Python<'py>, joint: &str) -> PyResult<Bound<'py, PyArray2<f64>>> {
    let Some(joint) = NormalJoint::ALL.into_iter().find(|known| known.name() == joint) else {
        return Err(choice_error("joint", "'hip' or 'knee'", joint));
    };
    let values: Vec<f64> = normal_cycle(joint).into_iter().flatten().map(f64::to_degrees).collect();
    PyArray1::from_vec(py, values).reshape([CYCLE_POINTS, 2])
}
