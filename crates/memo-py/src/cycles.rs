//! Gait cycles of a walk, and average walking.

use crate::tracker::choice_error;
use memo_core::track::cycles::{AngleAt, CYCLE_POINTS, MeanAngle, mean_cycles};
use memo_core::track::normal_gait::{Departure, NormalJoint, departures, normal_cycle};
use memo_core::track::result::TrackedWalk;
use numpy::{PyArray1, PyArray2, PyArray3, PyArrayMethods};
use pyo3::prelude::*;

/// Side, kind of curve, first and last second, and values of each joint at each point.
pub type CycleTuple<'py> = (&'static str, &'static str, f64, f64, Bound<'py, PyArray3<f64>>);

const VALUES: usize = 6;

/// All cycles of a walk, each side's mean after them.
pub fn cycles_of<'py>(py: Python<'py>, walk: &TrackedWalk) -> PyResult<Vec<CycleTuple<'py>>> {
    let cycles = walk.cycles();
    let mut found = Vec::new();
    for mean in mean_cycles(&cycles) {
        for cycle in cycles.iter().filter(|cycle| cycle.side == mean.side) {
            let curve = if cycle.is_whole { "cycle" } else { "partial" };
            let values = array(py, cycle.angles.iter().flatten().flat_map(single))?;
            found.push((cycle.side.name(), curve, cycle.start_s, cycle.end_s, values));
        }
        let values = array(py, mean.angles.iter().flatten().flat_map(averaged))?;
        found.push((mean.side.name(), "mean", f64::NAN, f64::NAN, values));
    }
    Ok(found)
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

fn array<'py>(py: Python<'py>, values: impl Iterator<Item = f64>) -> PyResult<Bound<'py, PyArray3<f64>>> {
    let values: Vec<f64> = values.collect();
    let joints = values.len() / (CYCLE_POINTS * VALUES);
    PyArray1::from_vec(py, values).reshape([joints, CYCLE_POINTS, VALUES])
}

/// Departures of a walk from average walking, degrees.
pub fn departures_of(walk: &TrackedWalk) -> Vec<(&'static str, &'static str, f64, f64, usize, f64)> {
    let row = |d: Departure| {
        let (excess_deg, half_deg) = (d.excess.to_degrees(), d.half.to_degrees());
        (d.side.name(), d.joint.name(), excess_deg, half_deg, d.at_percent, d.share)
    };
    departures(&mean_cycles(&walk.cycles())).into_iter().map(row).collect()
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
