//! The constants that decide most: who walks, where a walk ends, which way it goes, and how sure all of it is.
//!
//! The comment at a constant says where it comes from and, where it was measured, how near the data come to it. "60
//! walkers" are 25 drawn walks of motion-captured people, ten scenes with one to three of them, five clips (on one of
//! which a filmed woman also walks backwards), and 16 people of [`ClothedScene`](crate::ClothedScene). Things are the
//! trolley, rider and waver of three such scenes each. `tests/gait_parameters.rs`, `tests/clothed_walks.rs` and
//! `tests/score_walks.py` check from both sides how sure a walk is. The model of right and left is
//! [`SwapModel`](super::swap::SwapModel).

// Who walks.
/// Nobody walks faster than this, m/s.
pub(in crate::track) const FASTEST_MPS: f64 = 3.0;
/// Nobody walks slower than this, m/s.
pub(in crate::track) const SLOWEST_MPS: f64 = 0.25;
/// Minimum cadence of a walk, gait cycles per second.
pub(in crate::track) const SLOWEST_HZ: f64 = 0.3;
/// Range of stride lengths (two steps) as shares of the body height. Some 90 walks (motion-captured, on video and
/// drawn) had 0.60 to 1.05.
pub(in crate::track) const STRIDE_HEIGHTS: std::ops::Range<f64> = 0.25..1.6;
/// In frames that are farther apart, steps are not followed, seconds. Steps of 0.4 to 0.8 s cannot be counted in frames a second
/// apart: a walk of 96 steps per minute, with times given for one frame per second, came out as 124 on a treadmill. Filmed
/// walks at 5 frames per second were followed.
pub(in crate::track) const MOST_APART_S: f64 = 0.25;
/// A moving region is a walker if the similarity along the best line of phase exceeds the mean over all phases by
/// this factor, and if the best line is better than any constant phase.
///
/// Of 61 starts of 60 walkers, 55 had 1.33 and more, and the best constant phase was at least 6 % worse. The other
/// six, of people at 30, 45 and 55 degrees and of the one who walks backwards, had 1.22 to 1.32 and constant phases 1
/// to 8 % worse: these margins are thin. Of 105 candidates that were things, one, a waver, passes with 1.29 and a
/// constant phase 0.7 % worse; of all others a constant phase is better. So it is of somebody who stands with the
/// arms spread, up to 1.29, but for three candidates of 1.14 to 1.20.
pub(in crate::track) const WALKER_CONTRAST: f64 = 1.22;
/// Similarity along the best line of phase, divided by the mean over all phases, that the legs of a walker exceed. On
/// two treadmills 1.54 and 1.57; of somebody who comes towards the camera 1.04.
pub(in crate::track) const TREADMILL_CONTRAST: f64 = 1.3;
/// Another gait starts if it looks like walking and is more similar than the average one by this factor. Crouched: of
/// 60 walkers, the two who crouched had 1.27 and 1.81, the others up to 0.94, and the one who stood with the arms spread
/// at first up to 1.15. Short steps: eight drawn walks with half to two thirds of the swing of the legs had 1.07 to 1.23,
/// ordinary ones 0.75 to 0.99 in side view but up to 1.2 on paths 30 to 45 degrees off the image plane, which the fit
/// puts right; things that are carried along up to 1.18, but they do not look like walking.
pub(in crate::track) const OTHER_GAIT_GAIN: f64 = 1.05;
/// A gait is looked at in all frames of a start if its contrast in every third frame reaches this. Of 137 gaits that
/// went on to look like walking (28 drawn and filmed walks, ten scenes, eight clothed people, things), this contrast
/// was at least 0.95 of the one in all frames, and at least 1.198. Half of the 97 candidates that were refused, nearly
/// all of them things, are told by it.
pub(in crate::track) const GLANCE_CONTRAST: f64 = 1.15;
/// A gait other than the average one is looked at in all frames if its similarity in every third frame is at least
/// this share of the average gait's. The 11 gaits that started instead of the average one had 1.02 and more.
pub(in crate::track) const GLANCE_SHARE: f64 = 0.95;
/// A body faces the way it goes, forwards or backwards, that is more similar in every third frame if the other has less than
/// this share of its similarity. Of 183 starts (drawn and filmed walks, scenes, and things) 119 had less; in all frames, none
/// of these had more than 0.76. Of those with more than 0.85, a few had the other way in the end.
pub(in crate::track) const OTHER_WAY_SHARE: f64 = 0.75;
/// A walk starts if the feet are that much more likely (as the logarithm of the ratio) on a line of phase than on one
/// of even motion. Eight drawn walks of three people reached 6 to 9 within 66 frames. Noise of five kinds about even motion,
/// 60 draws each, reached 2.8 in 40 frames, 3.7 in 66 and -1.9 in 92; a saw-tooth at the rate of steps 8. One of the eight had 5.5 in
/// 40 frames on a line that was 0.1 m/s too slow, and was lost.
pub(in crate::track) const FRONTAL_GAIN: f64 = 6.0;
/// The same of the feet before a walk started or after it was lost, whose steps are to go on as those of the walk. Chosen on
/// five drawn people: 1.8 of one who was then 17 cm off along the path, 4.8 to 8.3 of those who were 2 to 10 cm off. The margin
/// was measured neither on further people nor on the feet of others.
pub(in crate::track) const HINDSIGHT_GAIN: f64 = 3.0;
/// A path within this angle of the line of sight is along it; of others, contours show the phase. Drawn people were
/// followed by their feet up to 20 degrees beside it. One at 45 degrees, who stood with arms spread at first, was
/// started falsely.
pub(in crate::track) const ALONG_THE_SIGHT_RAD: f64 = 0.5;

// Whether a walk goes on.
/// A walk ends if the mean similarity of its last frames is below this share of the walk's mean. Of 60 walkers, those
/// in sight had 0.65 and more throughout, and 0.60 along the line of sight; two who vanished were given up seven
/// frames later, at 0.43 and 0.45.
pub(in crate::track) const LOST_SHARE: f64 = 0.45;
/// A walk does not end with frames in which less than this share of the image about the visible body changes, or less than
/// [`LOST_SHARE`] of what changes about that person on average. In ten drawn scenes, 0.22 and more changed (straight
/// towards the camera; across it, 0.32) and 0.5 of the average while the person was there. Beside another person, 0.07 to
/// 0.18 changed where somebody had vanished, of 0.6 before.
pub(in crate::track) const LEAST_CHANGING: f32 = 0.15;
/// Frames in which less of the person is visible decide nothing, and a walk does not end with them. On three scenes with
/// seven people, 0.3 leaves 4 and 7 % of rows in two of them where nobody is, 0.45 2 %; four further scenes with nine
/// people are the same with 0.3 to 0.6.
pub(in crate::track) const DECIDING_SHARE: f32 = 0.45;
/// A person who is hidden for longer is given up, seconds.
pub(in crate::track) const LONGEST_HIDDEN_S: f64 = 2.0;
/// A walk ends when this share of the body's height or width is outside the image: then a leg from the knee down, or
/// a trunk's half, is not seen. Another value only moves the last frame of walks that leave the image.
pub(in crate::track) const OUTSIDE_SHARE: f64 = 0.4;

// Which way it goes.
/// Minimum change of depth over the sightings for an oblique path, metres, between the first and the last third of 40
/// sightings. Of 60 walkers, those within 7 degrees of the image plane had up to 0.17, but 0.23 from 12 m away, and
/// 0.72 and 0.77 beside somebody; one at 15 degrees had 0.37, those from 25 degrees on 0.39 and more.
pub(in crate::track) const SLANT_M: f64 = 0.2;
/// Relative gain of similarity that an oblique path needs over a path parallel to the image plane. Seen from above, a
/// walk can look oblique, but then it fits worse. Of 60 walkers, eight on oblique paths gained 0.05 and more, and
/// three who went straight across the image lost 0.03, 0.15 and 0.52. One at 15 degrees lost 0.02, and one at 45
/// degrees, who stood at first, 0.06: the tracker takes these two as parallel until the person is fitted.
pub(in crate::track) const SLANT_GAIN: f64 = 0.02;
/// Relative gain of similarity that a curve needs over the route so far.
///
/// Of the windows of drawn people who turned, the best gained 0.01 to 0.1. Of 60 windows of 40 frames and more of
/// drawn people who went straight, three gained 0.002 to 0.006 and none more; 18 further people stayed on a straight
/// path. All of these curves were by both rows of the rectangles; those by the soles alone were not measured so.
pub(in crate::track) const TURN_GAIN: f64 = 0.01;
/// The same before the path is settled, when a straight line may be off too. Of 24 drawn people who went straight, 16
/// to 35 frames gained up to 0.04; of 16 who turned by 40 to 69 degrees, most gained 0.05 to 0.36.
pub(in crate::track) const EARLY_TURN_GAIN: f64 = 0.05;
/// Rectangles turn clearly if they are that much more likely (as the logarithm of the ratio) on a curve than on a straight
/// path on which the speed changes as much. Chosen on seven drawn people whose walks would have been over where they turned
/// into the line of sight or out of it, who had 1.5 to 7.5 there, and on 20 who stood still for 2 to 4 s: 17 of these
/// had up to 1.4, the others 1.9 and twice 4.2. So where a walk would be over, it does not decide alone: contours and
/// rectangles together must be more likely on the curve. Of the 20 they were less likely by a factor of 1.6 and more. The
/// margin was not measured on people on whom it was not chosen. Where they turn clearly in all frames of a straight path, a turn
/// is also looked for in the latest ones: three drawn people who turned late had 4.7 to 37, 29 clips of straight walks up to
/// 2.6, and the contours of those straight walks decide that they did not turn.
pub(in crate::track) const CLEAR_TURN: f64 = 1.5;
/// The same of the quick comparison, after which the frames are followed again.
pub(in crate::track) const QUICK_TURN_GAIN: f64 = 0.008;
/// A route that turns by less is compared with a line by the fit. People who turn more have edges that are nearer by 13 % and
/// more on their route, and rectangles that turn clearly over the whole walk.
pub(in crate::track) const SLIGHT_TURN_RAD: f64 = 0.6;

// Whose it is. The last four were taken 1.5 times as large and as small, one at a time, on three scenes with seven people
// (two cross, three, a pair of whom one is hardly visible). All are followed and in place, except: where a smaller body
// explains changes, one of three people is missed; where a larger one does, the hidden one of the pair; with the smaller
// `NEARER` or `TURNED`, the sides of one of three people are wrong; and with the smaller `OWNED` or the larger `NEARER` or
// `TURNED`, one of them has two numbers.
/// A start this near to somebody who is followed is the same person, metres: bodies do not pass through each other,
/// and a trunk is 0.3 m wide.
pub(in crate::track) const SAME_PLACE_M: f64 = 0.3;
/// A start whose body overlaps that of somebody who is followed more than this in the image, on average over its frames
/// (intersection over union of their boxes), is the same person. In the first common frame, five second models on a person
/// who was followed had 0.76 to 0.86 and a sixth 0.59, two people side by side 0.63, and two of whom one passes the other
/// 0.53.
pub(in crate::track) const SAME_BODY: f64 = 0.7;
/// Two walks are of one person if one of the bodies has less than this of its own ([`double`](super::double)). Where the walks are not
/// compared, seven second models have 0.04 to 0.14: six in PETS 2009 S2.L1, by the people's marked boxes, and one drawn; twelve drawn
/// pairs who walk side by side, up to half of one of them hidden, have 0.24 to 0.66. Boxes of the seven overlap by 0.46 to 0.86
/// (intersection over union), of the pairs by 0.27 to 0.64.
pub(in crate::track) const OWN_BODY: f64 = 0.18;
/// Of such two, one that shows somebody on less than this share of its body is where nobody is. One that was half on nobody had 0.30;
/// of the others, second models too, each had 0.78 and more.
pub(in crate::track) const SHOWN_BODY: f64 = 0.5;
/// Somebody who was seen to the end of a walk and is then slower than this share of its mean speed stands still. 22
/// clothed people who stopped had 0.04 to 0.32 and once 0.51, 56 ends of other walks (drawn and filmed) 0.75 and more.
pub(in crate::track) const STANDING_SHARE: f64 = 0.6;
/// How far from the expected place somebody may start again, metres, and how much farther per second. One who did was
/// 0.09 m away, another who came back from the other side 2.6 m.
pub(in crate::track) const PLACE_M: f64 = 0.8;
pub(in crate::track) const PLACE_M_PER_S: f64 = 0.3;
/// Cosine of the largest turn between the two: 60 degrees.
pub(in crate::track) const SAME_WAY: f64 = 0.5;
/// An edge within this distance of another person's contours, and nearer to them by this much, belongs to that
/// person; shares of that person's height in the image. Of a person of 200 pixels 8 and 3 pixels.
pub(in crate::track) const OWNED: f32 = 0.04;
pub(in crate::track) const NEARER: f32 = 0.015;
/// What an angle of 90 degrees between edge and contour counts, share of the height.
pub(in crate::track) const TURNED: f32 = 0.075;
/// Changes within this share of the height of a body are explained by it.
pub(in crate::track) const EXPLAINED: f64 = 0.05;
/// More unexplained changes beside the legs than this share of their area: somebody may be hidden there. Of 25 drawn people alone and
/// two filmed ones, the median over the frames is at most 0.005 (a shadow on the wall), of 39 beside others who were followed 0.006,
/// and 0.014 where two heights were given in the wrong order; beside seven of whom somebody else was not followed, or only for
/// a third of the way, it is 0.024 to 0.094.
pub(in crate::track) const HIDDEN_SHARE: f64 = 0.018;
/// A model that was started beside others and has fewer legs of its own in nine of ten frames, as a share of the area of two legs, is
/// that of nobody. In nine of ten frames, 25 people beside others, half of them mostly hidden, stay below 0.17 to 1.5; a model that lay on
/// a head which another one missed stays at 0, and third models on two people below 0.014 and 0.064.
pub(in crate::track) const OWN_SHARE: f64 = 0.1;

// How well the person fits.
/// A person whose fit to the first frames misses more of the outline is not followed: the average is. Of 48 such fits
/// of 60 walkers, 47 missed 0.093 and less, and that of the one who walks backwards 0.15; the only wrong fit of
/// further drawn walks missed 0.113.
pub(in crate::track) const MOST_MISSED_TO_ADOPT: f64 = 0.1;
/// A fit that misses more of its outline, or is farther from the edges by a share of the height, is no fit. All 96
/// fits of 60 walkers missed up to 0.15 and were up to 0.0064 off.
pub(in crate::track) const MOST_MISSED: f64 = 0.2;
pub(in crate::track) const MOST_RESIDUAL: f64 = 0.012;
/// A fit of a small person that is less off, pixels, is one too, unless it misses more of its outline: filmed people are
/// blurred by compression. Chosen on the only clip of people so small, a filmed crowd of 50 to 150 pixels: the 35 walks that
/// one version kept were 0.8 to 1.49 off and on somebody in 0.7 and more of their frames, and 34 of them missed up to 0.14;
/// others, given up for being farther off, were on a person in 20 to 80 % of them. In another crowd, a fit that is on nobody is
/// 1.5 off and misses 0.19. Both margins are thin, and all these fits count as poor ones.
pub(in crate::track) const MOST_RESIDUAL_PX: f64 = 1.5;
pub(in crate::track) const MOST_MISSED_OF_SMALL: f64 = 0.15;
/// Nobody in these clips is smaller.
pub(in crate::track) const LEAST_OF_SMALL_PX: f64 = 50.0;
/// A fit that misses more of the outline, or is farther from the edges by a share of the height, is a poor one.
pub(in crate::track) const POORLY_MISSED: f64 = 0.1;
pub(in crate::track) const POORLY_OFF: f64 = 0.007;
/// The changes end no farther from the head of a model that is on the person, share of the height. Of 36 walks with the
/// right height 35 had up to 0.010, and one, mostly hidden, -0.022. The fit draws the head there: of 84 walks with heights 5
/// or 10 % wrong none had more than 0.018, but without that 24 of 31 with heights 10 % too small had 0.04 to 0.20.
pub(in crate::track) const POORLY_CROWN: f64 = 0.03;
/// Of 65 drawn walks of motion-captured people, 51 fit well by these, all with hip and knee within 3 and 4 degrees
/// RMS; of the 14 others, 9 are farther off. Of 90 people in clothes of `ClothedScene`, 3 fit well with a knee 5 to 6
/// degrees off.
pub(in crate::track) const WELL_MISSED: f64 = 0.023;
pub(in crate::track) const WELL_LENGTH_SD: f64 = 3.0;
/// Feet farther from the ground, metres, do not stand on it. Drawn walks: up to 0.01.
pub(in crate::track) const MOST_SOLE_M: f64 = 0.05;
/// Hip, knee, ankle, shoulder and elbow with a larger standard deviation were not measured.
pub(in crate::track) const MOST_SD_RAD: [f64; 5] = [0.10, 0.12, 0.14, 0.16, 0.17];
/// Nor were shoulder and elbow where the upper arm, or elbow where the forearm, misses more of its outline: the model's arm is
/// not on the person's, as of somebody who holds a telephone (0.38, elbow 140 degrees off) or a box (0.06 to 0.12, 50 to 68
/// degrees). In 25 drawn walks with swinging arms, upper arms miss up to 0.11 and forearms up to 0.08; of
/// three more, a slow person's right arm, which swings too, is lost to this. The margin is thin.
pub(in crate::track) const MOST_MISSED_OF_ARM: f64 = 0.12;
/// Nor are there contacts of a foot that misses more of its outline. Feet of drawn people miss up to 0.02, in clothes that hardly
/// differ from the room 0.23, and a foot that is painted out 0.70.
pub(in crate::track) const MOST_MISSED_OF_FOOT: f64 = 0.5;

// How sure it is: sides.
/// Log odds per unit of evidence.
pub(in crate::track) const SIDES_LOG_ODDS: f64 = 8.0;
/// The tracker's log odds come from the same frames, so they count half.
pub(in crate::track) const SIDES_OF_TRACKER: f64 = 0.5;
/// Fits that miss so much more of the outline than usual show half as much about the sides. Of 28 drawn walks and three
/// scenes, the only two people whose sides are wrong miss 4 and 6 % more.
pub(in crate::track) const SIDES_OFF: f64 = 0.03;
/// The least probability of exchanged sides of a model that fits poorly, for it may be beside the person: one of two people in step is,
/// with exchanged sides. Of 163 poor fits to drawn walks whose probability is below 0.1, none has them, which allows up to 0.018.
pub(in crate::track) const POORLY_SWAPPED: f64 = 0.02;
/// Weight of the share of inner lines that found no edge.
pub(in crate::track) const SIDES_LOST: f64 = 3.0;

// How sure it is: errors that all frames of a walk share.
/// Errors that the equations do not contain, because edges of neighbouring samples and frames err together, and
/// because people are no cylinders: a factor, and standard deviations to add. With those of ankle, shoulder
/// and elbow, their errors are within 1.64 of what is stated in 87, 86 and 84 % of the frames of 28 drawn walks. The height of the torso is 1 to 10 cm too
/// large for nine drawn people, 4.6 cm in root mean square over them, because their shoulders are lower than the model's.
pub(in crate::track) const SD_FACTOR: f64 = 1.3;
pub(in crate::track) const MODEL_SD_RAD: [f64; 5] = [0.012, 0.017, 0.08, 0.10, 0.12];
pub(in crate::track) const FIT_PLACE_SD: [f64; 4] = [0.005, 0.02, 0.045, 0.012];
/// The same of the range of hip and knee over a walk, beside that of single frames. The hips of 76 drawn walks come out 1.0 to 1.5
/// degrees too still for five people and 5 for one; without it, 86 to 90 % of their ranges are within the 95 % interval, with it
/// 92 to 98 %. Ranges of the knee need none: 98 % are.
pub(in crate::track) const RANGE_SD_RAD: [f64; 2] = [0.035, 0.0];
/// Where the outline is missed, what is found beside it is often something else: standard deviations per share of the
/// outline that is missed beyond `Seen::USUALLY_MISSED`. Low-contrast clothes miss 3 to 10 %, and hip and distance are
/// 2 to 3 degrees and up to 30 cm off. Behind posts and ledges, which hide 5 to 14 % of a person of 1.86 m, heights are 6 to 17 cm off.
pub(in crate::track) const OFF_SD_RAD: f64 = 0.9;
pub(in crate::track) const OFF_ACROSS_SD_M: f64 = 5.0;
pub(in crate::track) const OFF_HEIGHT_SD_M: f64 = 1.2;
/// The same of means over the frames of a walk, in which the errors of single frames average out: of angles, of the torso's
/// centre along, across and up and of the phase, and per share of the outline that is missed. Chosen with 82 drawn walks
/// of six people; of the mean errors of 18 other walks of theirs, 82 to 100 % are within 1.64 of what is stated (with twice as much along
/// the path). That of the phase comes beside the error of its zero; with both, 91 to 92 % of 76 walks are. Of the distances of the
/// 82, 98 % are, with half as much nine tenths: where those walk, the ground is known exactly.
pub(in crate::track) const MEAN_MODEL_SD_RAD: [f64; 5] = [0.010, 0.013, 0.04, 0.12, 0.155];
pub(in crate::track) const MEAN_PLACE_SD: [f64; 4] = [0.005, 0.0, 0.040, 0.005];
pub(in crate::track) const MEAN_OFF_SD_RAD: f64 = 0.6;
pub(in crate::track) const MEAN_OFF_ACROSS_SD_M: f64 = 4.0;
/// Standard deviation to add to that of a fitted body height, metres: hair, soles, and heads that are no cylinders.
pub(in crate::track) const HEIGHT_MODEL_SD_M: f64 = 0.015;
/// Standard deviation over people of the phase at which the average curves have their initial contact, cycles, and
/// the error of a measured one times the person's height in pixels.
pub(in crate::track) const ZERO_SD: f64 = 0.03;
pub(in crate::track) const ZERO_BLUR_PX: f64 = 3.0;
/// Standard deviation over people and clips of the speed of a belt, as a share of it, and of one stance. On ten drawn
/// treadmills the error was -3 to 6 %, its root mean square 2.8 %; part of it is that motion-captured ankles creep
/// forward in stance.
pub(in crate::track) const BELT_COMMON_SHARE: f64 = 0.03;
pub(in crate::track) const BELT_STANCE_SHARE: f64 = 0.03;
/// Standard deviation of the heading of somebody on a treadmill who walks obliquely to the line of sight. On 14 drawn
/// treadmills 25 to 37° off the side view, the errors were up to 7°, their root mean square 3.8°.
pub(in crate::track) const BELT_HEADING_SD_RAD: f64 = 0.07;
/// Standard deviation of the lowest row that all frames of a walk along the line of sight have in common, pixels:
/// shadows and shoes. Of 13 drawn people the mean place was -0.24 to 0.26 m off, 0.16 m in the root mean square.
pub(in crate::track) const COMMON_ROW_SD_PX: f64 = 3.0;
/// Standard deviation of the place across such a path, from the middle columns, metres.
pub(in crate::track) const ACROSS_SD_M: f64 = 0.03;
/// Standard deviation of the phase that all frames of such a walk have in common, cycles: of how much earlier the
/// nearer foot is seen than it stands.
pub(in crate::track) const COMMON_PHASE_SD: f64 = 0.04;
/// Standard deviation over people of the image-based phase at heel strike, cycles, independent for each side.
pub(in crate::track) const STRIKE_SD_CYCLES: f64 = 0.008;
/// Standard deviation over people of the reach asymmetry, metres: how much farther ahead of the trunk one foot lands.
pub(in crate::track) const REACH_SD_M: f64 = 0.012;
/// Step-length error per metre of reach asymmetry: a leg that swings farther ahead also looks later in the cycle.
pub(in crate::track) const REACH_COUNTS: f64 = 1.35;
/// Relative standard deviation over people of the height while walking, compared with the model of the same body
/// height: legs bend more or less than the average's, and feet point in other directions.
pub(in crate::track) const POSTURE_SD: f64 = 0.015;
/// Standard deviation of a fitted contact, and of the errors that a person's initial contacts and toe-offs have in common,
/// seconds: root mean squares over people. Single initial contacts of a side scatter by 9 ms and toe-offs by 12 in nine
/// drawn people, initial contacts by 13 and 9 ms in two filmed ones. On average, initial contacts of seven drawn people are
/// 5 ms early to 7 late, those of CMU12 20 and of one slow walker 32 early, and those of the two filmed people 34 and 43
/// late. Toe-offs of three drawn people are within 10 ms, those of the two filmed ones 76 and 95 ms early: shoes bend at
/// the toes, and the model's foot does not, so it leaves the ground when the heel rises. Not counted are the toe-offs of
/// CMU12, whose toes move forward, back, and forward again.
pub(in crate::track) const CONTACT_SD_S: f64 = 0.012;
pub(in crate::track) const CONTACT_COMMON_SD_S: f64 = 0.021;
pub(in crate::track) const TOE_OFF_COMMON_SD_S: f64 = 0.055;
/// Standard deviation over people of how much earlier contacts of one side are found than those of the other,
/// seconds. Root mean squares are 9 ms of 80 drawn walks of six motion-captured people and 19 ms of 36 walks of `ClothedScene`,
/// whose ankles slow down and go on at half of the walking speed before they stand.
pub(in crate::track) const CONTACT_SIDE_SD_S: f64 = 0.015;
/// Standard deviation of a shift of one side's contacts on a treadmill beyond that over ground, seconds: sides of drawn
/// people are 49 ms early to 30 ms late there. Chosen from that range, not by coverage.
pub(in crate::track) const BELT_CONTACT_SD_S: f64 = 0.025;
