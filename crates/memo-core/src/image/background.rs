//! A slowly varying image of the empty scene, for people who stop: compared with it they stay visible when
//! eq. (1) between consecutive frames detects nothing.
//!
//! Each pixel of the background is a temporal median. A person who covers the pixel for less than half of the
//! time does not change it. From a file, [`Background::from_frames`] takes the exact median of a few frames.
//! On a stream the median is approximated by stochastic approximation (Robbins and Monro 1951): each frame
//! moves the level towards its grey value by at most a step that falls as 1/k to a constant. Memory is one
//! image, whatever the length of the stream. Foreground pixels are those for which eq. (1) of
//! [`super::change`] holds against this image.
//!
//! Limits: whatever covers a pixel most of the time counts as background, and the camera must be static.

use super::change::{ChangeOptions, changes_between};
use super::clean::fill_holes;
use super::frame::{Frame, FrameError, Image, Mask};
use crate::OptionError;
use thiserror::Error;

/// Options for the background.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct BackgroundOptions {
    /// Largest lasting change of the level, grey levels per frame, 1/256 to 128. The default 0.05 follows
    /// daylight (a few grey levels per minute) and takes a minute or so to absorb a person who stands still
    /// and is not masked.
    pub rate: f64,
    /// The step at the second frame, grey levels; it falls as 1/k until it reaches `rate`. With the default
    /// 64, the first dozens of frames correct a first frame with people in it.
    pub first_step: f64,
    /// How a frame is compared with the background. By default T is at least 8, twice that of consecutive
    /// frames: soft shadows and slow changes of light appear at full strength here.
    pub change: ChangeOptions,
}

impl Default for BackgroundOptions {
    fn default() -> Self {
        let change = ChangeOptions { min_threshold: 8.0, ..ChangeOptions::default() };
        Self { rate: 0.05, first_step: 64.0, change }
    }
}

impl BackgroundOptions {
    /// Refuses options outside their ranges.
    pub fn check(&self) -> Result<(), OptionError> {
        let is_followed = (1.0 / f64::from(LEVELS)..=128.0).contains(&self.rate);
        OptionError::unless(is_followed, "rate", "1/256 to 128 grey levels per frame", self.rate)?;
        OptionError::unless_positive("first_step", self.first_step)?;
        self.change.check()
    }
}

/// Why no background was computed.
#[derive(Debug, Clone, PartialEq, Error)]
#[non_exhaustive]
pub enum BackgroundError {
    /// No frame was given.
    #[error("a background needs at least one frame")]
    NoFrames,
    /// The frames differ in size.
    #[error(transparent)]
    Frame(#[from] FrameError),
    /// An option is outside its range.
    #[error(transparent)]
    Option(#[from] OptionError),
}

/// Steps of the stored level in one grey level.
const LEVELS: i32 = 256;

/// The current estimate of the empty scene.
#[derive(Debug, Clone)]
pub struct Background {
    options: BackgroundOptions,
    /// Grey value times [`LEVELS`].
    level: Image<u16>,
    frames: usize,
}

impl Background {
    /// Starts from one frame.
    ///
    /// # Errors
    ///
    /// An option is outside its range.
    pub fn new(first: &Frame, options: BackgroundOptions) -> Result<Self, OptionError> {
        Self::from_image(&first.to_image(), 1, options)
    }

    /// The temporal median of frames, best spread evenly over the footage; for an even number of frames, the
    /// lower of the two middle values. Does not keep a copy of the frames.
    ///
    /// # Errors
    ///
    /// There are no frames, they differ in size, or an option is outside its range.
    pub fn from_frames(frames: &[Frame], options: BackgroundOptions) -> Result<Self, BackgroundError> {
        let first = frames.first().ok_or(BackgroundError::NoFrames)?;
        frames.iter().try_for_each(|frame| first.check_same_size(frame))?;
        let mut median = Image::filled(first.width(), first.height(), 0u8);
        for y in 0..median.height() {
            let rows: Vec<&[u8]> = frames.iter().map(|frame| frame.row(y)).collect();
            median_row(&rows, median.row_mut(y));
        }
        Ok(Self::from_image(&median, frames.len(), options)?)
    }

    fn from_image(image: &Image<u8>, frames: usize, options: BackgroundOptions) -> Result<Self, OptionError> {
        options.check()?;
        let mut level = Image::filled(image.width(), image.height(), 0u16);
        for (level, &grey) in level.pixels_mut().iter_mut().zip(image.pixels()) {
            *level = u16::from(grey) * LEVELS as u16;
        }
        Ok(Self { options, level, frames })
    }

    /// The background rounded to grey values.
    pub fn image(&self) -> Image<u8> {
        let (width, height) = (self.level.width(), self.level.height());
        let mut image = Image::filled(width, height, 0u8);
        for (grey, &level) in image.pixels_mut().iter_mut().zip(self.level.pixels()) {
            *grey = ((i32::from(level) + LEVELS / 2) / LEVELS).min(255) as u8;
        }
        image
    }

    /// Moves the level towards a frame, except where `foreground` is marked.
    ///
    /// # Errors
    ///
    /// The frame or the mask differs in size from the background.
    pub fn update(&mut self, frame: &Frame, foreground: Option<&Mask>) -> Result<(), FrameError> {
        self.check_size(frame.width(), frame.height())?;
        if let Some(mask) = foreground {
            self.check_size(mask.width(), mask.height())?;
        }
        self.frames += 1;
        let step = self.step();
        pulp::Arch::new().dispatch(MoveLevels { levels: &mut self.level, frame: *frame, foreground, step });
        Ok(())
    }

    /// The pixels where eq. (1) holds between a frame and the background.
    ///
    /// # Errors
    ///
    /// The frame differs in size from the background.
    pub fn foreground(&self, frame: &Frame) -> Result<Mask, FrameError> {
        changes_between(&self.image().as_frame(), frame, &self.options.change)
    }

    /// The pixels of `within` whose grey value differs from the background by more than `threshold` grey
    /// levels, with holes filled: a mask that ends at the visible edge, where eq. (1) with its 5x5 windows
    /// reaches beyond it.
    ///
    /// The difference is smoothed by (1, 2, 1) / 4 along x and y, so noise of standard deviation s is reduced
    /// to 0.38 s. A good threshold is above the darkening by soft shadows (5 to 15 grey levels) and below
    /// half of the person's contrast: 20 to 30 on well-lit footage. Parts with less contrast are lost; in
    /// such footage use the region itself.
    ///
    /// # Errors
    ///
    /// The frame or the mask differs in size from the background.
    pub fn silhouette(&self, frame: &Frame, within: &Mask, threshold: f64) -> Result<Mask, FrameError> {
        self.check_size(frame.width(), frame.height())?;
        self.check_size(within.width(), within.height())?;
        let background = self.image();
        let limit = (16.0 * threshold.clamp(0.0, 255.0)).floor() as i32;
        let last = frame.height() - 1;
        let mut mask = within.clone();
        let mut columns = vec![0i32; frame.width()];
        for y in 0..=last {
            let rows = [y.saturating_sub(1), y, (y + 1).min(last)];
            add_rows(rows.map(|y| frame.row(y)), rows.map(|y| background.row(y)), &mut columns);
            keep_differing(&columns, limit, mask.row_mut(y));
        }
        Ok(fill_holes(&mask))
    }

    /// The largest change at this frame, in units of the stored level.
    fn step(&self) -> i32 {
        let grey_levels = (2.0 * self.options.first_step / self.frames as f64).max(self.options.rate);
        (grey_levels * f64::from(LEVELS)).round().clamp(1.0, f64::from(128 * LEVELS)) as i32
    }

    fn check_size(&self, width: usize, height: usize) -> Result<(), FrameError> {
        let (expected_width, expected_height) = (self.level.width(), self.level.height());
        if (width, height) == (expected_width, expected_height) {
            return Ok(());
        }
        Err(FrameError::SizeChanged { expected_width, expected_height, width, height })
    }
}

/// Differences of three rows weighted by (1, 2, 1).
fn add_rows(frame: [&[u8]; 3], background: [&[u8]; 3], columns: &mut [i32]) {
    for (x, column) in columns.iter_mut().enumerate() {
        let difference = |i: usize| i32::from(frame[i][x]) - i32::from(background[i][x]);
        *column = difference(0) + 2 * difference(1) + difference(2);
    }
}

/// Clears pixels where the column sums weighted by (1, 2, 1) do not exceed the limit; the row is replicated
/// beyond its ends.
fn keep_differing(columns: &[i32], limit: i32, mask: &mut [bool]) {
    let last = columns.len() - 1;
    for (x, pixel) in mask.iter_mut().enumerate().filter(|(_, pixel)| **pixel) {
        let sum = columns[x.saturating_sub(1)] + 2 * columns[x] + columns[(x + 1).min(last)];
        *pixel = sum.abs() > limit;
    }
}

/// The level, moved by at most `step` >= 0. `clamp` is not used: its check of the bounds would keep the loop
/// scalar.
#[inline(always)]
fn moved(level: u16, grey: u8, step: i32) -> u16 {
    let level = i32::from(level);
    (level + (i32::from(grey) * LEVELS - level).max(-step).min(step)) as u16
}

/// Moves levels towards a frame, with the widest vectors available at run time.
struct MoveLevels<'a> {
    levels: &'a mut Image<u16>,
    frame: Frame<'a>,
    foreground: Option<&'a Mask>,
    step: i32,
}

impl pulp::NullaryFnOnce for MoveLevels<'_> {
    type Output = ();

    #[inline(always)]
    fn call(self) {
        for y in 0..self.frame.height() {
            let (row, levels) = (self.frame.row(y), self.levels.row_mut(y));
            match self.foreground {
                None => move_row(levels, row, self.step),
                Some(mask) => move_unmasked_row(levels, row, mask.row(y), self.step),
            }
        }
    }
}

#[inline(always)]
fn move_row(levels: &mut [u16], row: &[u8], step: i32) {
    for (level, &grey) in levels.iter_mut().zip(row) {
        *level = moved(*level, grey, step);
    }
}

#[inline(always)]
fn move_unmasked_row(levels: &mut [u16], row: &[u8], mask: &[bool], step: i32) {
    for ((level, &grey), &masked) in levels.iter_mut().zip(row).zip(mask) {
        *level = moved(*level, grey, step * i32::from(!masked));
    }
}

/// Lower median of each column, bit by bit: the largest value such that at most (n - 1) / 2 of the n values
/// are smaller.
fn median_row(rows: &[&[u8]], median: &mut [u8]) {
    let most_below = (rows.len() - 1) / 2;
    let mut below = vec![0u32; median.len()];
    for bit in (0..8).rev() {
        below.fill(0);
        for row in rows {
            for ((below, &grey), &known) in below.iter_mut().zip(*row).zip(&*median) {
                *below += u32::from(grey < known | 1 << bit);
            }
        }
        for (known, &below) in median.iter_mut().zip(&below) {
            *known |= u8::from(below as usize <= most_below) << bit;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn row(pixels: Vec<u8>) -> Image<u8> {
        Image::from_vec(pixels.len(), 1, pixels).unwrap()
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(64))]
        #[test]
        fn the_median_is_the_middle_of_the_sorted_values(
            frames in (1usize..40).prop_flat_map(|width| {
                proptest::collection::vec(proptest::collection::vec(any::<u8>(), width), 1..12)
            })
        ) {
            let images: Vec<_> = frames.iter().map(|pixels| row(pixels.clone())).collect();
            let views: Vec<_> = images.iter().map(Image::as_frame).collect();
            let background = Background::from_frames(&views, BackgroundOptions::default()).unwrap().image();
            for x in 0..frames[0].len() {
                let mut values: Vec<u8> = frames.iter().map(|frame| frame[x]).collect();
                values.sort_unstable();
                prop_assert_eq!(background.at(x, 0), values[(values.len() - 1) / 2]);
            }
        }
    }

    /// A textured 60x40 scene, with a bright 10x20 block at `left`.
    fn scene(left: Option<usize>) -> Image<u8> {
        let grey = |i: usize| {
            let (x, y) = (i % 60, i / 60);
            let inside = left.is_some_and(|left| (left..left + 10).contains(&x) && (10..30).contains(&y));
            if inside { 200 } else { (60 + x + 7 * y % 13) as u8 }
        };
        Image::from_vec(60, 40, (0..2400).map(grey).collect()).unwrap()
    }

    #[test]
    fn the_first_frame_s_person_fades_when_gone() {
        let mut background =
            Background::new(&scene(Some(20)).as_frame(), BackgroundOptions::default()).unwrap();
        for i in 0..40 {
            background.update(&scene((i < 20).then_some(22 + i)).as_frame(), None).unwrap();
        }
        let worst =
            background.image().pixels().iter().zip(scene(None).pixels()).map(|(a, b)| a.abs_diff(*b)).max();
        assert!(worst.unwrap() <= 3, "{worst:?}");
    }

    #[test]
    fn a_person_who_stops_stays_foreground() {
        let empty = scene(None);
        let mut background =
            Background::from_frames(&[empty.as_frame()], BackgroundOptions::default()).unwrap();
        let standing = scene(Some(20));
        for _ in 0..500 {
            let foreground = background.foreground(&standing.as_frame()).unwrap();
            assert!(foreground.at(25, 20) && !foreground.at(40, 20));
            background.update(&standing.as_frame(), Some(&foreground)).unwrap();
        }
        assert_eq!(background.image(), empty);
    }

    #[test]
    fn a_silhouette_ends_at_the_edge_where_the_change_mask_does_not() {
        let background = Background::new(&scene(None).as_frame(), BackgroundOptions::default()).unwrap();
        let frame = scene(Some(20));
        let foreground = background.foreground(&frame.as_frame()).unwrap();
        let silhouette = background.silhouette(&frame.as_frame(), &foreground, 40.0).unwrap();
        let inside = |i: usize| (20..30).contains(&(i % 60)) && (10..30).contains(&(i / 60));
        let corners = [(20, 10), (29, 10), (20, 29), (29, 29)].map(|(x, y)| y * 60 + x);
        for i in (0..2400).filter(|i| !corners.contains(i)) {
            assert_eq!(silhouette.pixels()[i], inside(i), "{} {}", i % 60, i / 60);
        }
        assert!(foreground.at(18, 20) && !foreground.at(17, 20));
    }

    #[test]
    fn slow_drift_is_followed() {
        let options = BackgroundOptions { rate: 0.1, first_step: 1.0, ..BackgroundOptions::default() };
        let mut background = Background::new(&Image::filled(8, 8, 100u8).as_frame(), options).unwrap();
        for i in 0..400 {
            background.update(&Image::filled(8, 8, 100 + (i / 20) as u8).as_frame(), None).unwrap();
        }
        assert_eq!(background.image().at(4, 4), 119);
    }

    #[test]
    fn options_outside_their_ranges_are_refused() {
        let frame = Image::filled(8, 8, 0u8);
        let usual = BackgroundOptions::default();
        let change = ChangeOptions { threshold: Some(f64::NAN), ..usual.change };
        for (name, options) in [
            ("rate", BackgroundOptions { rate: f64::NAN, ..usual }),
            ("rate", BackgroundOptions { rate: 0.001, ..usual }),
            ("rate", BackgroundOptions { rate: 129.0, ..usual }),
            ("first_step", BackgroundOptions { first_step: 0.0, ..usual }),
            ("threshold", BackgroundOptions { change, ..usual }),
        ] {
            let refused = |error: &OptionError| error.name == name;
            assert!(
                Background::new(&frame.as_frame(), options).is_err_and(|error| refused(&error)),
                "{name}"
            );
            let error = Background::from_frames(&[frame.as_frame()], options).unwrap_err();
            assert!(matches!(error, BackgroundError::Option(error) if refused(&error)), "{name}");
        }
    }

    #[test]
    fn no_frames_and_other_sizes_are_refused() {
        let options = BackgroundOptions::default();
        assert_eq!(Background::from_frames(&[], options).unwrap_err(), BackgroundError::NoFrames);
        let mut background = Background::new(&Image::filled(8, 8, 0u8).as_frame(), options).unwrap();
        assert!(background.update(&Image::filled(8, 9, 0u8).as_frame(), None).is_err());
        let mask = Image::filled(7, 8, false);
        assert!(background.update(&Image::filled(8, 8, 0u8).as_frame(), Some(&mask)).is_err());
    }

    /// A silhouette has no holes, even where the person's shirt is as grey as the wall.
    #[test]
    fn a_silhouette_is_filled() {
        let background =
            Background::new(&Image::filled(40, 40, 100u8).as_frame(), BackgroundOptions::default()).unwrap();
        let mut frame = Image::filled(40, 40, 100u8);
        (10..30).for_each(|y| frame.row_mut(y)[10..30].fill(200));
        (16..24).for_each(|y| frame.row_mut(y)[16..24].fill(100));
        let everywhere = Image::filled(40, 40, true);
        let mask = background.silhouette(&frame.as_frame(), &everywhere, 40.0).unwrap();
        let marked = mask.pixels().iter().filter(|p| **p).count();
        assert!(mask.at(20, 20) && (390..=410).contains(&marked), "{marked}");
    }

    /// Long after its start a background follows by a twentieth of a grey level per frame and reports the
    /// nearest grey level; changes begin at 8.
    #[test]
    fn an_old_background_follows_slowly() {
        let mut background =
            Background::new(&Image::filled(8, 8, 100u8).as_frame(), BackgroundOptions::default()).unwrap();
        background.frames = 1_000_000;
        let brighter = Image::filled(8, 8, 140u8);
        for frame in 1..=100 {
            background.update(&brighter.as_frame(), None).unwrap();
            // Steps are whole 256ths: 13 of them.
            let level = 100.0 + f64::from(frame) * 13.0 / 256.0;
            assert_eq!(background.image().at(3, 3), level.round() as u8, "{frame}");
        }
        let still =
            Background::new(&Image::filled(40, 40, 100u8).as_frame(), BackgroundOptions::default()).unwrap();
        for (by, is_changed) in [(8, false), (9, true)] {
            let mut frame = Image::filled(40, 40, 100u8);
            (5..15).for_each(|y| frame.row_mut(y)[5..15].fill(100 + by));
            let mask = still.foreground(&frame.as_frame()).unwrap();
            assert_eq!(mask.at(10, 10), is_changed, "{by}");
        }
    }
}
