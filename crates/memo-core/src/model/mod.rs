//! What a walker would show: camera, body, gait, contours and what hides what.

pub mod camera;
pub mod cylinder;
pub mod silhouette;
pub mod surface;
pub mod visibility;

pub use camera::Camera;
pub use cylinder::EllipticCylinder;
pub use silhouette::{Contour, ContourKind, RimAspect, RimChord, rims, side_lines};
pub use surface::{NO_PART, PixelWindow, SurfaceError, SurfaceMap, surface_map};
pub use visibility::{PreparedView, VisibilityOptions, VisibleSegment, hidden_interval, visible_contours};
