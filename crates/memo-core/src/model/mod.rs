//! The model of a walker in an image: camera, body, gait, contours and visibility.

pub mod angles;
pub mod body;
pub mod camera;
pub mod camera_file;
pub mod cylinder;
pub mod distortion;
pub mod euler;
pub mod gait;
pub mod limits;
pub mod position;
pub mod resection;
pub mod silhouette;
pub mod skeleton;
pub mod spline;
pub mod surface;
pub mod visibility;

pub use body::{Body, PosedBody, Proportions, SideJoints, Walker};
pub use camera::{Camera, CameraError, DEFAULT_HORIZONTAL_FIELD_OF_VIEW_RAD, TsaiParameters};
pub use camera_file::{CameraFileError, CameraFileOptions, FileFormat, LengthUnit};
pub use cylinder::EllipticCylinder;
pub use distortion::Distortion;
pub use gait::{Gait, GaitStyle, Posture, SideAngles};
pub use position::{
    FootPosition, Midpoints, PositionError, PositionOptions, height_on_ground, position_from_feet,
    position_from_head, position_from_rectangle, position_on_ground,
};
pub use silhouette::{Contour, ContourKind, RimAspect, RimChord, rims, side_lines};
pub use surface::{NO_PART, SurfaceError, SurfaceMap, surface_map};
pub use visibility::{
    Others, PreparedView, VisibilityOptions, VisibleSegment, hidden_interval, visible_contours,
};
