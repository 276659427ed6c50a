//! The model of a walker in an image: camera, body, gait, contours and visibility.

pub mod angles;
pub(crate) mod body;
pub(crate) mod camera;
pub(crate) mod camera_file;
pub(crate) mod cylinder;
pub(crate) mod distortion;
pub mod euler;
pub(crate) mod gait;
pub mod limits;
pub(crate) mod position;
pub mod resection;
pub(crate) mod silhouette;
pub(crate) mod skeleton;
pub mod spline;
pub(crate) mod surface;
pub(crate) mod tilt;
pub(crate) mod visibility;

pub use body::{BodyError, PART_COUNT, Part, PosedBody, Proportions, SideJoints};
pub use camera::{
    ASSUMED_FOCAL_SD, CameraError, DEFAULT_HORIZONTAL_FIELD_OF_VIEW_RAD, MAX_DISTANCE_M, TsaiParameters,
    assumed_field_of_view_rad,
};
pub use camera_file::{CameraFileError, CameraFileOptions, FileFormat, LengthUnit, NearestLens, Place};
pub use cylinder::EllipticCylinder;
pub use distortion::Distortion;
pub use gait::{GaitStyle, Posture, SideAngles};
pub use position::{
    FootPosition, Midpoints, PositionError, PositionOptions, height_on_ground, position_from_feet,
    position_from_head, position_from_rectangle, position_on_ground,
};
pub use silhouette::{Contour, ContourKind, RimAspect, RimChord, rims, side_lines};
pub use skeleton::{JOINT_COUNT, LengthError, MAX_SEGMENT_M, PELVIS_ON_TRUNK, RigidDistance, segment_name};
pub use surface::{NO_PART, SurfaceError, SurfaceMap, surface_map};
pub use tilt::Tilt;
pub use visibility::{
    Others, PreparedView, VisibilityOptions, VisibleSegment, hidden_interval, visible_contours,
};
// Public at the top of the crate alone.
pub(crate) use body::{Body, Walker};
pub(crate) use camera::Camera;
pub(crate) use gait::Gait;
