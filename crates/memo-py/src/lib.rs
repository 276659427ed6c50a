//! Python bindings of memo-core. Each converts its arguments, releases the interpreter lock, makes one call and
//! converts the result.

mod array;
mod calibrate;
mod camera;
mod cycles;
mod defaults;
mod error;
mod euler;
mod explain;
mod fit;
mod image;
mod keypoints;
mod planar;
mod pointlight;
mod pool;
mod posture;
mod record;
mod reproduce;
mod result;
mod score;
mod steady;
mod synth;
mod tracker;
mod unswap;
mod wait;
mod walk;
mod whole;

use pyo3::prelude::*;

/// The compiled core of the `memo` package.
#[pymodule]
mod _memo {
    use pyo3::prelude::*;

    #[pymodule_export]
    use super::calibrate::{
        PointCalibration, WalkerCalibration, calibrate_points, calibrate_walker, walker_sightings,
    };
    #[pymodule_export]
    use super::camera::{PyCamera, camera_of_parameters};
    #[pymodule_export]
    use super::cycles::{Departure, GaitCycle, py_normal_cycle};
    #[pymodule_export]
    use super::defaults::defaults;
    #[pymodule_export]
    use super::euler::euler_angles;
    #[pymodule_export]
    use super::explain::{Explanation, PyExplainer};
    #[pymodule_export]
    use super::fit::WalkFit;
    #[pymodule_export]
    use super::image::{
        camera_tilt, change_mask, edge_segments, moving_regions, shrunk, silhouettes, velocity_field,
    };
    #[pymodule_export]
    use super::keypoints::{
        follow_everyone, foot_points, guess_layout, head_points, joint_name, keypoint_layout,
        keypoint_layouts, side_pairs, stick_joints,
    };
    #[pymodule_export]
    use super::planar::{
        PlanarChain, PlanarInterpretation, PlanarLink, PlanarWindow, planar, planar_hinges, planar_rods,
    };
    #[pymodule_export]
    use super::pointlight::{
        PointLightDisplay, WalkerMotion, pointlight, pointlight_cycle, pointlight_together, walker_motion,
    };
    #[pymodule_export]
    use super::posture::{PostureSequence, SecondMotion, posture, posture_tree};
    #[pymodule_export]
    use super::record::recorded_contours;
    #[pymodule_export]
    use super::reproduce::hoffman_flinchbaugh::{
        HingeTrials, PrintedRod, RodTrials, hoffman_flinchbaugh_degenerate,
        hoffman_flinchbaugh_false_targets, hoffman_flinchbaugh_hinges, hoffman_flinchbaugh_rod,
        hoffman_flinchbaugh_rods,
    };
    #[pymodule_export]
    use super::reproduce::lee_chen::{
        CountTable, FrameSurvivors, HeadColumn, LastStage, TableInputs, joint_names, lee_chen_counts,
        lee_chen_figures, lee_chen_head, lee_chen_inputs, lee_chen_last_stage, lee_chen_walker,
        segment_names,
    };
    #[pymodule_export]
    use super::reproduce::rohr::{
        ImageStages, WalkSimilarity, body_parts, gait_curves, image_stages, model_contours, rohr_deviations,
        rohr_numbers, search_windows, walk_filtered, walk_lines, walk_similarity,
    };
    #[pymodule_export]
    use super::score::similarity;
    #[pymodule_export]
    use super::steady::{FrameMotion, LostView, PyFieldSeeker, PySteadier, SteadiedFrame};
    #[pymodule_export]
    use super::synth::{PyClothedScene, PyScene};
    #[pymodule_export]
    use super::tracker::{LeftOut, PyTracker, SeekReport, WalkerState, population_height_m};
    #[pymodule_export]
    use super::unswap::{LimbSides, unswap};
    #[pymodule_export]
    use super::wait::panic_on_purpose;
    #[pymodule_export]
    use super::walk::{
        BodyHeight, CameraTilt, GaitEvent, GaitParameter, PhaseLine, Treadmill, Walk, WalkRatio, WalkStart,
        fit_walk,
    };

    #[pymodule_init]
    fn init(module: &Bound<'_, PyModule>) -> PyResult<()> {
        super::error::add_internal_error(module)?;
        module.add("__version__", env!("CARGO_PKG_VERSION"))
    }
}
