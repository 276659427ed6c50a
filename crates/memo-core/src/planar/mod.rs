//! Structure from planar motion: limbs that swing in one plane, seen as points in parallel projection.
//!
//! Source: Hoffman and Flinchbaugh 1982 ("The interpretation of biological motion", Biological Cybernetics 42).
//! Image coordinates are metres (or pixels; then every length is in pixels), x right, y down; depth z points away
//! from the camera. Only differences of points are used, so translation of the figure or of the pivot has no
//! effect. Depths and planes are known up to a reflection about the image plane: the mirror of (p, q) is (-p,
//! -q).

pub(crate) mod batch;
pub(crate) mod depth_change;
pub(crate) mod evidence;
pub(crate) mod figure;
mod fit;
pub(crate) mod group;
pub(crate) mod hinge;
pub(crate) mod motion;
pub(crate) mod plane;
pub(crate) mod rod;

pub use batch::{hinge_depths, rod_depths};
pub use depth_change::{
    RecedingHinge, ScaleError, at_one_scale, fit_hinge_in_depth, perspective_error_px,
    perspective_of_figure_px,
};
pub use evidence::{
    FalseTargetRate, Linkage, PlanarEvidence, PlanarEvidenceOptions, Undecided, Verdict, hinge_evidence,
    link_three, rod_evidence,
};
pub use figure::{
    Chain, Contact, Costs, DepthSource, Figure, FigureError, FigureEvidence, FigureInterpretation,
    FigureWindow, Link, MOST_POINTS, MOST_TRACKS, Method, Status, interpret_with_progress, joint_of,
};
pub use fit::{FitError, FitOptions};
pub use group::{Pair, Triple, test_pairs, test_triples};
pub use hinge::{Hinge, HingeFit, HingeRefusal, fit_hinge, hinge_from_two_views};
pub use motion::{MotionFit, MotionRefusal, RodMotion, plane_from_motions};
pub use plane::Plane;
pub use rod::{
    ROUNDING, Rod, RodFit, RodRefusal, fit_rod, rod_by_paper, rod_from_ellipse, rod_from_three_views,
};
