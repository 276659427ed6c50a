//! The six feature points of a head (Lee and Chen 1985, Table A.2(a)).

use crate::model::Body;
use crate::model::resection::ResectionError;
use glam::DVec3;

/// The feature points, in the order of [`HeadModel::points_m`].
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[allow(missing_docs, reason = "the names say it")]
pub enum HeadPoint {
    Neck,
    Nose,
    RightEye,
    LeftEye,
    RightEar,
    LeftEar,
}

impl HeadPoint {
    /// All points, in order.
    pub const ALL: [Self; 6] =
        [Self::Neck, Self::Nose, Self::RightEye, Self::LeftEye, Self::RightEar, Self::LeftEar];

    /// The name in Table A.2.
    pub fn name(self) -> &'static str {
        ["Neck", "Nose", "Right eye", "Left eye", "Right ear", "Left ear"][self as usize]
    }
}

/// Table A.2(a), centimetres.
///
/// The right eye's x is printed -32.168; only -31.168, as for the left eye, agrees with A.2(b) and with the
/// depths of Table 2(d).
pub(crate) const TABLE_A2_POINTS_CM: [DVec3; 6] = [
    DVec3::new(-34.168, 52.103, 0.0),
    DVec3::new(-29.168, 61.603, 0.0),
    DVec3::new(-31.168, 65.103, 5.5),
    DVec3::new(-31.168, 65.103, -5.5),
    DVec3::new(-35.168, 60.103, 8.5),
    DVec3::new(-35.168, 60.103, -8.5),
];

/// Body height of the person of Tables A.1 and A.2, metres.
///
/// Not printed. The eyes are 13.0 cm above the neck (A.2), the ankles 131.2 cm below it (A.1: neck to hips 56.2,
/// hips to ankles 75). With eyes at 0.936 and ankles at 0.039 of body height (Drillis and Contini 1966), it is
/// 1.608.
pub const LEE_CHEN_BODY_HEIGHT_M: f64 = 1.608;

/// A rigid head: the positions of its feature points.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct HeadModel {
    /// The points in the head's frame (x forward, y up, z right), metres, in the order of [`HeadPoint::ALL`].
    pub points_m: [DVec3; 6],
}

impl HeadModel {
    /// Table A.2(a) in metres, with the right eye corrected. The frame's origin is the paper's, in the trunk.
    pub fn lee_chen() -> Self {
        Self { points_m: TABLE_A2_POINTS_CM.map(|point_cm| point_cm / 100.0) }
    }

    /// The same head scaled to a person of `height_m`.
    ///
    /// Heads vary less than bodies: for a child this head is too small.
    ///
    /// # Errors
    ///
    /// A height outside 0.4 to 2.6 metres.
    pub fn lee_chen_for_height(height_m: f64) -> Result<Self, ResectionError> {
        Body::from_height(height_m)?;
        let scale = height_m / LEE_CHEN_BODY_HEIGHT_M;
        Ok(Self { points_m: Self::lee_chen().points_m.map(|point_m| point_m * scale) })
    }

    /// One point, metres.
    pub fn point_m(&self, point: HeadPoint) -> DVec3 {
        self.points_m[point as usize]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_head_is_symmetric_has_its_size_and_scales() {
        let head = HeadModel::lee_chen();
        let mirrored = |p: DVec3| DVec3::new(p.x, p.y, -p.z);
        assert_eq!(head.point_m(HeadPoint::RightEye), mirrored(head.point_m(HeadPoint::LeftEye)));
        assert_eq!(head.point_m(HeadPoint::RightEar), mirrored(head.point_m(HeadPoint::LeftEar)));
        assert!(head.point_m(HeadPoint::Nose).x > head.point_m(HeadPoint::RightEar).x, "x is forward");
        let ears = |h: HeadModel| h.point_m(HeadPoint::RightEar).z - h.point_m(HeadPoint::LeftEar).z;
        assert!((ears(head) - 0.17).abs() < 1e-12);
        let tall = HeadModel::lee_chen_for_height(1.1 * LEE_CHEN_BODY_HEIGHT_M).unwrap();
        assert!((ears(tall) - 0.187).abs() < 1e-12);
    }

    #[test]
    fn implausible_heights_are_refused() {
        for height_m in [f64::NAN, 0.0, -1.7, 170.0, f64::INFINITY] {
            assert!(matches!(HeadModel::lee_chen_for_height(height_m), Err(ResectionError::Body(_))));
        }
    }
}
