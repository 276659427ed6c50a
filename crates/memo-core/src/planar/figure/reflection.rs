//! Which of the two reflections of a limb a body can do.

use glam::{DVec2, DVec3};

/// Which reflection of a two-link chain bends as the joint can: knees backwards, elbows forwards.
///
/// With v from the first to the middle point and u from the middle to the last, the part of u across v points
/// against `facing` at a knee and along it at an elbow. `facing`: direction of the body in the camera's axes
/// (x right, y down, z away). Returns +1 for the depths as given, -1 for the mirror, and by how many degrees of
/// mean bend it is better; near 0 says that the view cannot tell (a pure side view never can).
pub fn reflection_by_bend(
    positions: &[[DVec2; 3]],
    depth: &[Vec<f64>],
    facing: DVec3,
    bends_forward: bool,
) -> Option<(f64, f64)> {
    let facing = facing.try_normalize()?;
    let wanted = if bends_forward { 1.0 } else { -1.0 };
    let bend = |sign: f64| {
        let frames = positions.iter().zip(depth).filter_map(|(p, z)| {
            let [a, b, c] = [0, 1, 2].map(|k| p[k].extend(sign * z[k]));
            let v = (b - a).try_normalize()?;
            let u = (c - b).try_normalize()?;
            let across = u - v * u.dot(v);
            Some(wanted * across.dot(facing).clamp(-1.0, 1.0).asin()).filter(|x| x.is_finite())
        });
        let bends: Vec<f64> = frames.collect();
        (!bends.is_empty()).then(|| bends.iter().sum::<f64>() / bends.len() as f64)
    };
    let (given, mirrored) = (bend(1.0)?, bend(-1.0)?);
    let sign = if mirrored > given { -1.0 } else { 1.0 };
    Some((sign, (given - mirrored).abs().to_degrees()))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_knee_seen_from_the_front_shows_which_way_it_bends() {
        // Seen from the front, facing the camera: the knee towards it, the ankle back.
        let positions = vec![[DVec2::ZERO, DVec2::new(2.0, 80.0), DVec2::new(3.0, 160.0)]; 5];
        let depth = vec![vec![0.0, -30.0, 10.0]; 5];
        let facing = -DVec3::Z;
        let (sign, degrees) = reflection_by_bend(&positions, &depth, facing, false).unwrap();
        assert!(sign == 1.0 && degrees > 20.0);
        assert_eq!(reflection_by_bend(&positions, &depth, facing, true).unwrap().0, -1.0);
        let (_, degrees) = reflection_by_bend(&positions, &depth, DVec3::X, false).unwrap();
        assert!(degrees < 1e-9, "the side view cannot tell");
        assert_eq!(reflection_by_bend(&positions, &depth, DVec3::ZERO, true), None);
    }
}
