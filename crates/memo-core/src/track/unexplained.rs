//! Changes beside the legs of a person that no body explains: somebody who is hidden, a skirt, a bag, a dog.
//!
//! Somebody who walks in another's shadow has no region of changes, so nobody is started. But the legs of two people are hardly
//! ever in step, and the legs of somebody who is followed are modelled better than arms, hair and clothes are. So what
//! changes between ankle and thigh, more than shadows do, beyond a margin of all bodies that are followed, is counted:
//!
//! 1. In each frame, as a share of the area of two legs, without what changes as often farther away (noise, a shaken camera).
//! 2. Of a walk, the median over its frames.
//!
//! A model that was started beside others and has no legs of its own, because the others explain all that changes there, is
//! that of nobody: it lies on what another model leaves over, as a head.
//!
//! Limits: that it is a person is not known. Somebody whose legs are wholly hidden in half of the frames, or hardly differ from the
//! wall, is not noticed, and in a crowd, where as much changes farther out, nobody is.

use super::crowd::{body_box, paint_body};
use super::decisions::{HIDDEN_SHARE, OWN_SHARE};
use super::result::TrackedWalk;
use crate::estimate::median::median;
use crate::image::{Mask, Sides};
use crate::model::{Camera, EllipticCylinder};
use glam::{DVec2, USizeVec2};

/// The area of two legs of average size, as a share of the square of the body height.
const LEGS: f64 = 0.072;
/// Changes within this share of the height of a body are its own. With 0.05, those beside a filmed person in wide trousers are 0.032
/// instead of 0.005 of the legs, beside hidden people they are 0.05 to 0.18 instead of 0.024 to 0.094; with 0.08, 0 and 0.005 to 0.04.
const MARGIN: f64 = 0.065;
/// The change detection looks at windows of pixels, so changes begin this far from a body, pixels.
const MARGIN_PX: f64 = 3.0;
/// Rows between ankle and thigh, shares of the body height above the lowest point.
const ROWS: [f64; 2] = [0.1, 0.42];
/// Columns on either side of the middle of the body that are beside the legs, and those beyond that tell how much changes
/// anyway, shares of the body height.
const BESIDE: f64 = 0.35;
const BEYOND: f64 = 0.65;
/// A walk with fewer frames that show the legs tells nothing.
const LEAST_FRAMES: usize = 13;
/// The same of legs that are those of others, in this share of the frames.
const LEAST_OWN_FRAMES: usize = 5;
const MOSTLY: f64 = 0.9;
/// Who has less in every frame has none: in the first second, of two hidden people the most were 0.14 and 0.15, of a second model of
/// somebody who walked alone 0.012. Nobody else was looked at.
const NEVER_SHARE: f64 = 0.05;

/// Changes in a frame that bodies do not explain, as shares of the area of two legs.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Unexplained {
    /// At the legs of one body, and beside them.
    pub at_legs: f64,
    /// The same without what changes as often farther away; below 0 if more changes there.
    pub more: f64,
}

/// Changes at and beside the legs of a body that these bodies do not explain; `None` if the image does not show all that is
/// beside the legs.
pub(super) fn beside_legs(
    mask: &Mask,
    camera: &Camera,
    own: &[EllipticCylinder],
    bodies: &[&[EllipticCylinder]],
) -> Option<Unexplained> {
    // 1. The rows and columns.
    let Sides { left, top, right, bottom } = body_box(camera, own)?;
    let (height_px, middle) = (bottom - top, 0.5 * (left + right));
    let size = DVec2::new(mask.width() as f64, mask.height() as f64);
    let [beside, beyond] = [BESIDE, BEYOND].map(|share| {
        let low = DVec2::new(middle - share * height_px, bottom - ROWS[1] * height_px);
        let high = DVec2::new(middle + share * height_px, bottom - ROWS[0] * height_px);
        [low, high]
    });
    if beside[0].min_element() < 0.0 || beside[1].cmpge(size - 1.0).any() {
        return None;
    }
    let low: USizeVec2 = beyond[0].max(DVec2::ZERO).as_usizevec2();
    let high: USizeVec2 = beyond[1].min(size - 1.0).as_usizevec2();
    // 2. What the bodies leave free.
    let mut free = Mask::filled(high.x - low.x + 1, high.y - low.y + 1, true);
    for body in bodies {
        let Some(Sides { top, bottom, .. }) = body_box(camera, body) else { continue };
        let margin_px = MARGIN * (bottom - top) + MARGIN_PX;
        paint_body(&mut free, low.into(), camera, body, margin_px, false);
    }
    // 3. Pixels and changes, beside the legs and beyond.
    let (mut near, mut far) = ([0_u32; 2], [0_u32; 2]);
    for y in 0..free.height() {
        let changes = &mask.row(low.y + y)[low.x..=high.x];
        for (x, (_, &changes)) in free.row(y).iter().zip(changes).enumerate().filter(|(_, (free, _))| **free)
        {
            let is_near = ((low.x + x) as f64 - middle).abs() <= BESIDE * height_px;
            let counts = if is_near { &mut near } else { &mut far };
            *counts = [counts[0] + 1, counts[1] + u32::from(changes)];
        }
    }
    let anyway = f64::from(far[1]) / f64::from(far[0].max(1));
    let [free_px, changes_px] = near.map(f64::from);
    let share = |px: f64| px / (LEGS * height_px * height_px);
    Some(Unexplained { at_legs: share(changes_px), more: share(changes_px - anyway * free_px) })
}

/// The median of those of a walk's frames; `None` of too few.
pub(super) fn of_walk(shares: &[f64]) -> Option<f64> {
    if shares.len() < LEAST_FRAMES { None } else { median(&mut shares.to_vec()) }
}

/// True if a body has hardly any legs of its own: all that changes there, in nearly all of the frames, the others explain.
pub(super) fn has_no_legs(of_its_own: &[f64]) -> bool {
    let mut shares = of_its_own.to_vec();
    shares.sort_by(f64::total_cmp);
    shares.len() >= LEAST_OWN_FRAMES && shares[(MOSTLY * (shares.len() - 1) as f64) as usize] < OWN_SHARE
}

/// True if a body has never had any legs of its own.
pub(super) fn never_has_legs(of_its_own: &[f64]) -> bool {
    of_its_own.len() >= LEAST_OWN_FRAMES && of_its_own.iter().all(|share| *share < NEVER_SHARE)
}

impl TrackedWalk {
    /// True if so much changes beside the legs that somebody else may walk there who is not followed, or something moves with
    /// the person.
    #[must_use]
    pub fn is_beside_somebody(&self) -> bool {
        self.unexplained.is_some_and(|share| share > HIDDEN_SHARE)
    }
}

#[cfg(test)]
mod tests {
    use super::super::active::tests::PATH;
    use super::super::crowd::clear_explained;
    use super::super::search::tests::{camera, walker};
    use super::super::search::{Hypothesis, Scene};
    use super::*;
    use crate::model::body::PART_COUNT;

    fn body(along_m: f64, phase: f64) -> [EllipticCylinder; PART_COUNT] {
        let (camera, walker) = (camera(), walker());
        let hypothesis = Hypothesis { along_m, height_m: 1.15, phase };
        Scene::new(&walker, &camera, &PATH).pose(&hypothesis).cylinders
    }

    /// Changes where these bodies are.
    fn mask(bodies: &[&[EllipticCylinder]]) -> Mask {
        let mut still = Mask::filled(640, 480, true);
        for body in bodies {
            clear_explained(&mut still, &camera(), body, 0.0);
        }
        let mut mask = Mask::filled(640, 480, false);
        (0..480).for_each(|y| (0..640).for_each(|x| mask.set(x, y, !still.at(x, y))));
        mask
    }

    #[test]
    fn legs_of_somebody_else_are_seen_and_those_of_who_is_followed_are_not() {
        let (own, other) = (body(0.0, 0.1), body(0.25, 0.35));
        let seen = |bodies: &[&[EllipticCylinder]], followed: &[&[EllipticCylinder]]| {
            beside_legs(&mask(bodies), &camera(), &own, followed).unwrap().more
        };
        assert_eq!(seen(&[&own], &[&own]), 0.0);
        let hidden = seen(&[&own, &other], &[&own]);
        assert!((0.15..1.0).contains(&hidden), "{hidden}");
        assert_eq!(seen(&[&own, &other], &[&own, &other]), 0.0);
        // Arms and head beside the person are no legs.
        let above: Vec<EllipticCylinder> = other.iter().filter(|c| c.centre().z > 1.1).copied().collect();
        assert!(seen(&[&own, &above], &[&own]) < 0.02);
    }

    /// Half hidden legs are somebody's own, whether of all else as much changes or not; those of another model are not.
    #[test]
    fn a_second_model_of_one_person_has_no_legs() {
        let (front, behind) = (body(0.0, 0.1), body(0.3, 0.35));
        let of_its_own = |bodies: &[&[EllipticCylinder]]| {
            beside_legs(&mask(bodies), &camera(), &behind, &[&front]).unwrap().at_legs
        };
        let (alone, two) = (of_its_own(&[&front]), of_its_own(&[&front, &behind]));
        assert!(alone < 0.02 && two > 2.0 * OWN_SHARE, "{alone} {two}");
        assert!(has_no_legs(&[alone; 9]) && !has_no_legs(&[two; 9]));
        // Somebody may be hidden in most of the frames.
        let mut shares = [alone; 20];
        shares[..3].fill(two);
        assert!(!has_no_legs(&shares));
        shares[1..3].fill(alone);
        assert!(has_no_legs(&shares));
        assert!(!has_no_legs(&[alone; LEAST_OWN_FRAMES - 1]), "few frames tell nothing");
    }

    #[test]
    fn what_changes_everywhere_is_nobody() {
        let own = body(0.0, 0.1);
        let mut noisy = mask(&[&own]);
        (0..480).for_each(|y| {
            (0..640).for_each(|x| {
                if (7 * x + 13 * y) % 10 == 0 {
                    noisy.set(x, y, true);
                }
            });
        });
        let share = beside_legs(&noisy, &camera(), &own, &[&own]).unwrap();
        assert!(share.more.abs() < 0.02 && share.at_legs > 0.05, "{share:?}");
    }

    #[test]
    fn near_the_border_and_in_few_frames_nothing_is_known() {
        let camera = camera();
        let at_border = body(3.2, 0.1);
        let blank = Mask::filled(640, 480, false);
        assert_eq!(beside_legs(&blank, &camera, &at_border, &[&at_border]), None);
        assert_eq!(of_walk(&[0.5; LEAST_FRAMES - 1]), None);
        let mut shares = [0.0; LEAST_FRAMES];
        shares[..LEAST_FRAMES / 2].fill(0.9);
        assert_eq!(of_walk(&shares), Some(0.0), "half of the frames are too few");
    }
}
