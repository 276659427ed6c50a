//! Silhouettes of the person in a clip with a static background.
//!
//! All frames are available, so the temporal median gives the scene without the person, and eq. (1) of Rohr
//! 1994 against it detects people who stand as well as people who move. Limits: clothes of the same grey as
//! the background are lost; soft shadows do not matter.

use super::background::{Background, BackgroundError, BackgroundOptions};
use super::clean::{CleanOptions, clean, fill_holes};
use super::frame::{Frame, FrameError, Mask};
use super::region::{GroupOptions, group_regions, regions};
use crate::OptionError;
use thiserror::Error;

/// Why no silhouettes were computed.
#[derive(Debug, Clone, PartialEq, Error)]
#[non_exhaustive]
pub enum SilhouetteError {
    /// The threshold is negative or not a number.
    #[error("threshold must be a number of grey levels from 0, got {threshold}")]
    Threshold {
        /// The threshold given.
        threshold: f64,
    },
    /// No background could be computed.
    #[error(transparent)]
    Background(#[from] BackgroundError),
    /// Frames differ in size.
    #[error(transparent)]
    Frame(#[from] FrameError),
    /// Cleaning the mask failed.
    #[error(transparent)]
    Option(#[from] OptionError),
}

/// Default threshold, grey levels.
pub const SILHOUETTE_THRESHOLD: f64 = 25.0;

/// The silhouette of the largest candidate in each frame; an empty mask where there is no candidate.
///
/// `threshold` in grey levels, as in [`Background::silhouette`].
///
/// # Errors
///
/// The threshold is negative or not finite, there are no frames, or the frames differ in size.
pub fn silhouettes(frames: &[Frame<'_>], threshold: f64) -> Result<Vec<Mask>, SilhouetteError> {
    if !(threshold >= 0.0 && threshold.is_finite()) {
        return Err(SilhouetteError::Threshold { threshold });
    }
    let background = Background::from_frames(frames, BackgroundOptions::default())?;
    frames.iter().map(|frame| silhouette(frame, &background, threshold)).collect()
}

/// 1. Find what differs from the background.
/// 2. Take its largest candidate.
/// 3. Cut the candidate to the visible edge.
fn silhouette(frame: &Frame<'_>, background: &Background, threshold: f64) -> Result<Mask, SilhouetteError> {
    let changed = fill_holes(&clean(&background.foreground(frame)?, &CleanOptions::default())?);
    let group = GroupOptions::default();
    let candidates = group_regions(&regions(&changed, group.min_part_area), &group)?;
    let within = match candidates.first() {
        Some(region) => region.mask(frame.width(), frame.height()),
        None => Mask::filled(frame.width(), frame.height(), false),
    };
    Ok(background.silhouette(frame, &within, threshold)?)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::SynthScene;
    use crate::image::Image;
    use crate::model::surface::{NO_PART, surface_map};
    use crate::synth::SceneOptions;

    #[test]
    fn the_drawn_walker_is_cut_out() {
        let scene = SynthScene::new(SceneOptions { seed: 4, ..SceneOptions::default() }).unwrap();
        let shown: Vec<usize> = (0..80).step_by(5).collect();
        let images: Vec<_> = shown.iter().map(|&k| scene.frame(k)).collect();
        let views: Vec<_> = images.iter().map(|image| image.as_frame()).collect();
        let masks = silhouettes(&views, 25.0).unwrap();
        for (mask, &k) in masks.iter().zip(&shown).skip(2) {
            let truth = surface_map(&scene.truth(k).unwrap().posed.cylinders, &scene.camera, None).unwrap();
            let is_body = truth.part.pixels().iter().map(|part| *part != NO_PART);
            let (both, either) = mask.pixels().iter().zip(is_body).fold((0, 0), |(both, either), (a, b)| {
                (both + usize::from(*a && b), either + usize::from(*a || b))
            });
            assert!(both * 10 > either * 8, "frame {k}: {both} of {either} pixels agree");
        }
        assert!(silhouettes(&views, f64::NAN).is_err() && silhouettes(&[], 25.0).is_err());
    }

    /// Nine frames of a plain background, the fifth with blocks (left, width, height) and a line 1 pixel high
    /// from column 58 to 94.
    fn scene(blocks: &[(usize, usize, usize)], line_level: u8) -> Vec<Image<u8>> {
        let mut frames = vec![Image::filled(220, 90, 100u8); 9];
        for &(left, width, height) in blocks {
            (80 - height..80).for_each(|y| frames[4].row_mut(y)[left..left + width].fill(200));
        }
        frames[4].row_mut(50)[58..94].fill(100 + line_level);
        frames
    }

    /// The columns of the fifth frame's silhouette.
    fn cut_out(images: &[Image<u8>]) -> Vec<usize> {
        let views: Vec<_> = images.iter().map(|image| image.as_frame()).collect();
        let mask = &silhouettes(&views, 25.0).unwrap()[4];
        (0..220).filter(|&x| (0..90).any(|y| mask.at(x, y))).collect()
    }

    /// Of two people, the larger one gives the silhouette.
    #[test]
    fn the_largest_mover_is_the_silhouette() {
        let columns = cut_out(&scene(&[(122, 14, 40), (42, 24, 60)], 0));
        assert!(columns.iter().all(|x| (38..72).contains(x)) && columns.len() >= 22, "{columns:?}");
    }

    /// A line of single changed pixels joins nothing: cleaning removes it, and both blocks stay separate.
    #[test]
    fn a_thin_line_joins_no_people() {
        let changed = |level: u8| -> Vec<usize> {
            let images = scene(&[(94, 14, 40), (34, 24, 60)], level);
            let views: Vec<_> = images.iter().map(|image| image.as_frame()).collect();
            let background = Background::from_frames(&views, BackgroundOptions::default()).unwrap();
            let foreground = background.foreground(&views[4]).unwrap();
            (30..70).filter(|&y| foreground.at(76, y)).collect()
        };
        // So faint that only windows with the line at their border differ, where its weight in the fit is
        // largest.
        let level = (1..100).find(|&level| !changed(level).is_empty()).unwrap();
        assert_eq!(changed(level), [48, 52]);
        let columns = cut_out(&scene(&[(94, 14, 40), (34, 24, 60)], level));
        assert!(columns.iter().all(|x| (30..64).contains(x)) && columns.len() >= 22, "{columns:?}");
    }

    /// A patch of the wall's grey inside a person is part of the region, and of the silhouette if it differs
    /// slightly.
    #[test]
    fn a_faint_patch_within_a_person_is_filled() {
        let patched = |level: u8| {
            let mut images = scene(&[(52, 30, 60)], 0);
            (40..60).for_each(|y| images[4].row_mut(y)[59..75].fill(level));
            let views: Vec<_> = images.iter().map(|image| image.as_frame()).collect();
            let mask = &silhouettes(&views, 0.0).unwrap()[4];
            let patch = (40..60).flat_map(|y| (59..75).map(move |x| (x, y)));
            patch.filter(|&(x, y)| mask.at(x, y)).count()
        };
        assert_eq!(patched(101), 16 * 20);
    }
}
