//! A clothed person who walks through a room: ground truth that is independent of the tracker's own model.
//!
//! Body, gait and rendering share no code with [`model`](crate::model): round cones instead of elliptic
//! cylinders, joint curves from other sources with deviations of 5 to 10 degrees from the shipped average,
//! asymmetric sides, a pelvis that rotates and drops, feet that roll from heel to toe and do not slide in
//! stance, clothes that are wider than the body, hair, stripes, a wall of blocks, tiles, and a contact
//! shadow. Proportions, clothes, gait, heading, camera and room follow from the seed. Tracking results here
//! are closer to those on people than the results on [`SynthScene`](super::SynthScene), where the walker is
//! the model.
//!
//! Contacts are where the rendered foot touches the floor; no gait phase is assumed for them. Frames are
//! rendered one by one and in any order; the same seed gives the same pixels.
//!
//! Limits: the person does not turn during the walk and does not wear skirts or coats; there are no shadows
//! on the wall and no reflections in the floor.

mod person;
mod render;
mod room;
mod round_cone;
mod sizes;
mod stride;

use super::random::Random;
use super::scene::{SceneError, check_ranges, check_size};
use crate::image::Image;
use crate::model::skeleton::Side;
use crate::model::{Camera, SideAngles, SideJoints};
use crate::track::event::EventKind;
use glam::{DMat3, DVec2, DVec3};
use person::{Clothes, Solid};
use render::draw;
use room::Room;
use round_cone::RoundCone;
use sizes::Sizes;
use std::f64::consts::{PI, TAU};
use std::sync::OnceLock;
use stride::{Figure, Stride};

/// What moves through the room.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Mover {
    /// A person who walks.
    #[default]
    Walker,
    /// The same person in one constant posture, carried along as on a scooter.
    Rider,
    /// The same person, standing and swinging the arms.
    Waver,
    /// A trolley as high as a person.
    Trolley,
    /// A person who walks on a treadmill in the middle of the image; the belt is not drawn.
    Treadmill,
}

/// Options of a clothed scene. `None` means that the seed decides.
#[derive(Debug, Clone, PartialEq)]
pub struct ClothedOptions {
    /// Seed; determines everything that is not fixed by the other options.
    pub seed: u64,
    /// Number of frames. The walker passes the middle of the image half-way through them, without a pause.
    pub frames: usize,
    /// Frames per second, 1 to 10,000.
    pub rate_hz: f64,
    /// Width and height, pixels.
    pub size: [u32; 2],
    /// Standard deviation of the sensor noise, grey levels, 0 to 255; by the seed 2 to 5.
    pub noise_sd: Option<f32>,
    /// Whether the walk goes to the left.
    pub leftward: Option<bool>,
    /// Angle of the path out of the image plane, radians, -1.6 to 1.6; by the seed within 0.12.
    pub slant_rad: Option<f64>,
    /// Delay of the left side, as a fraction of the cycle, -0.1 to 0.1; by the seed a few thousandths.
    pub late_left: Option<f64>,
    /// How far a walker turns to the left in all, radians, -4 to 4: the path is an arc about its middle.
    pub turn_rad: f64,
    /// When the mover stands still.
    pub pause: Option<Pause>,
    /// What moves.
    pub mover: Mover,
}

/// The mover slows down, stands still in the posture of that moment, and goes on.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Pause {
    /// From this time on the mover stands still, seconds.
    pub at_s: f64,
    /// For so long, seconds.
    pub lasts_s: f64,
}

/// How long a mover slows down before a pause and speeds up after it, seconds.
const EASE_S: f64 = 0.8;

impl Pause {
    /// The time that the same movement without the pause takes. The speed falls and rises as half a cosine.
    fn moved_s(&self, time_s: f64) -> f64 {
        let wave = |u: f64| EASE_S / TAU * (std::f64::consts::PI * u / EASE_S).sin();
        let slowing = (time_s - (self.at_s - EASE_S)).clamp(0.0, EASE_S);
        let speeding = (time_s - (self.at_s + self.lasts_s)).clamp(0.0, EASE_S);
        let full = time_s.min(self.at_s - EASE_S) + (time_s - (self.at_s + self.lasts_s + EASE_S)).max(0.0);
        full + 0.5 * slowing + wave(slowing) + 0.5 * speeding - wave(speeding)
    }
}

impl Default for ClothedOptions {
    fn default() -> Self {
        Self {
            seed: 0,
            frames: 80,
            rate_hz: 25.0,
            size: [640, 480],
            noise_sd: None,
            leftward: None,
            slant_rad: None,
            late_left: None,
            turn_rad: 0.0,
            pause: None,
            mover: Mover::Walker,
        }
    }
}

/// The ground truth of one frame with a walker.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ClothedTruth {
    /// Number of the frame.
    pub frame: usize,
    /// Time, seconds.
    pub time_s: f64,
    /// Direction of the path where the hips are, radians about world Z.
    pub heading_rad: f64,
    /// Mean of both shoulders and both hips, world axes, metres.
    pub torso_centre: DVec3,
    /// Joints of the right side, world axes, metres.
    pub right: SideJoints,
    /// Joints of the left side, world axes, metres.
    pub left: SideJoints,
    /// Angles of the right and the left side in the vertical plane of the path, radians: thigh relative to
    /// the vertical, knee, upper arm relative to the trunk, elbow.
    pub angles: [SideAngles; 2],
    /// Gait phase, linear in time between initial contacts: right 0, left 0.5; cycles.
    pub phase: f64,
}

/// A foot contact event: a foot touches or leaves the floor.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FootContact {
    /// Time, seconds.
    pub time_s: f64,
    /// Initial contact (heel strike) or toe-off.
    pub kind: EventKind,
    /// Which foot.
    pub side: Side,
    /// Position of the heel at that time, world axes, metres.
    pub heel: DVec3,
}

/// A scene: a room with one mover and a camera, with frames on demand.
#[derive(Debug, Clone)]
pub struct ClothedScene {
    /// The camera.
    pub camera: Camera,
    /// Body height of the person from crown to sole, metres.
    pub height_m: f64,
    /// Direction of the path, of an arc in its middle, radians about world Z; the person faces in this direction.
    pub heading_rad: f64,
    /// Mean speed, metres per second; on a treadmill, that of the belt.
    pub speed_mps: f64,
    /// Mean cadence, gait cycles per second.
    pub cycle_hz: f64,
    /// Fraction of the cycle for which the right and the left foot touch the floor.
    pub stance: [f64; 2],
    options: ClothedOptions,
    noise_sd: f32,
    sizes: Sizes,
    clothes: Clothes,
    stride: Stride,
    /// Cycles at the start, and the variation of the rate: amplitude and phase of a slow wave.
    start_cycles: f64,
    sway: [f64; 2],
    room: Room,
    /// Drawn with the first frame.
    empty: OnceLock<Image<f32>>,
    /// Other movers in the room, and by how much their paths are shifted.
    companions: Vec<(ClothedScene, DVec3)>,
}

/// Period of the slow variation of the rate, cycles.
const SWAY_CYCLES: f64 = 2.3;

impl ClothedScene {
    /// A scene in which the seed determines everything that the options leave open.
    ///
    /// # Errors
    ///
    /// A size or an option out of range.
    pub fn new(options: ClothedOptions) -> Result<Self, SceneError> {
        check(&options)?;
        let mut random = Random::new(options.seed ^ 0xC107_4ED0);
        let room = Room::drawn(&mut random);
        // 1. The person and the gait.
        let height_m = random.uniform(1.52, 1.95);
        let sizes = Sizes::drawn(height_m, &mut random);
        let clothes = Clothes::drawn(room.wall, &mut random);
        let stride = Stride::drawn(&sizes, options.late_left, &mut random);
        let cycle_hz = random.uniform(0.82, 1.02);
        // 2. The camera.
        let camera = drawn_camera(options.size, &mut random);
        // 3. The path.
        let leftward = random.uniform(0.0, 1.0) < 0.5;
        let slant = random.uniform(-0.12, 0.12);
        let across_rad = if options.leftward.unwrap_or(leftward) { PI } else { 0.0 };
        let heading_rad = across_rad + options.slant_rad.unwrap_or(slant);
        let noise_sd = random.uniform(2.0, 5.0) as f32;
        Ok(Self {
            camera,
            height_m,
            heading_rad,
            speed_mps: stride.length_m * cycle_hz,
            cycle_hz,
            stance: [0, 1].map(|side| stride.leaves[side] - stride.strikes[side]),
            noise_sd: options.noise_sd.unwrap_or(noise_sd),
            options,
            sizes,
            clothes,
            stride,
            start_cycles: random.uniform(0.0, 1.0),
            sway: [random.uniform(0.0, 0.03) * SWAY_CYCLES / TAU, random.uniform(0.0, TAU)],
            room,
            empty: OnceLock::new(),
            companions: Vec::new(),
        })
    }

    /// The same room and camera with the mover of another scene in it too, whose path is shifted on the floor by this
    /// many metres. Its truth is that of the other scene, shifted.
    #[must_use]
    pub fn joined_by(mut self, other: Self, shift_m: DVec2) -> Self {
        self.companions.push((other, shift_m.extend(0.0)));
        self
    }

    /// The room without anybody.
    fn empty(&self) -> &Image<f32> {
        self.empty.get_or_init(|| self.room.seen_by(&self.camera))
    }

    /// Number of frames.
    pub fn len(&self) -> usize {
        self.options.frames
    }

    /// Whether the scene has no frame.
    pub fn is_empty(&self) -> bool {
        self.options.frames == 0
    }

    /// Time of a frame, seconds.
    pub fn time_s(&self, frame: usize) -> f64 {
        frame as f64 / self.options.rate_hz
    }

    /// A time less that of a pause: what moves is a function of it.
    fn moved_s(&self, time_s: f64) -> f64 {
        self.options.pause.map_or(time_s, |pause| pause.moved_s(time_s))
    }

    /// The time of the scene at which the mover has moved for so long, by bisection up to the last frame.
    fn scene_s(&self, moved_s: f64) -> f64 {
        if self.options.pause.is_none() {
            return moved_s;
        }
        let (mut low, mut high) = (0.0, self.time_s(self.len()));
        for _ in 0..60 {
            let middle = 0.5 * (low + high);
            if self.moved_s(middle) < moved_s { low = middle } else { high = middle }
        }
        0.5 * (low + high)
    }

    /// The ground truth of a frame; `None` unless the mover is a walker.
    pub fn truth(&self, frame: usize) -> Option<ClothedTruth> {
        if !self.walks() {
            return None;
        }
        let time_s = self.time_s(frame);
        let moved_s = self.moved_s(time_s);
        let [right, left] = self.figure(moved_s).joints;
        Some(ClothedTruth {
            frame,
            time_s,
            heading_rad: self.heading_of(right.hip.midpoint(left.hip)),
            torso_centre: 0.25 * (right.shoulder + left.shoulder + right.hip + left.hip),
            right,
            left,
            angles: self.angles([right, left]),
            phase: self.phase(moved_s),
        })
    }

    /// Initial contacts and toe-offs from the first to the last frame, in order; empty unless the mover is a
    /// walker.
    pub fn contacts(&self) -> Vec<FootContact> {
        if !self.walks() || self.is_empty() {
            return Vec::new();
        }
        let last = self.cycles(self.moved_s(self.time_s(self.len() - 1)));
        let mut contacts = Vec::new();
        for (index, side) in [Side::Right, Side::Left].into_iter().enumerate() {
            let strike = (EventKind::HeelStrike, self.stride.strikes[index]);
            let leave = (EventKind::ToeOff, self.stride.leaves[index]);
            for (kind, cycles) in [strike, leave] {
                let first = (self.start_cycles - cycles).ceil() as i64;
                for turn in first..=(last - cycles).floor() as i64 {
                    let moved_s = self.time_of(turn as f64 + cycles);
                    let (time_s, heel) = (self.scene_s(moved_s), self.figure(moved_s).feet[index][0]);
                    contacts.push(FootContact { time_s, kind, side, heel });
                }
            }
        }
        contacts.sort_by(|a, b| a.time_s.total_cmp(&b.time_s));
        contacts
    }

    /// Length and duration of an undisturbed step of a side, metres and seconds: from the heel of the other
    /// foot to the side's own heel at its initial contact, and the time between the two contacts.
    pub fn step(&self, side: Side) -> (f64, f64) {
        let own = usize::from(side == Side::Left);
        let [here, there] = [own, 1 - own].map(|side| self.stride.strikes[side]);
        let lasts = (here - there).rem_euclid(1.0);
        let heel = |side: usize, cycles: f64| self.stride.figure(cycles).feet[side][0].x;
        (heel(own, here) - heel(1 - own, here - lasts), lasts / self.cycle_hz)
    }

    /// The rendered grey frame.
    pub fn frame(&self, frame: usize) -> Image<u8> {
        let mut levels = self.empty().clone();
        let (solids, shadows) = self.solids(self.time_s(frame));
        draw(&solids, &shadows, &self.room, &self.camera, &mut levels);
        let lot = (frame as u64).wrapping_add(1).wrapping_mul(0x9E37_79B9_7F4A_7C15);
        super::scene::with_noise(&levels, self.noise_sd, Random::new(self.options.seed ^ lot))
    }

    /// The solids in the room at a time, and the spheres near the floor that cast the contact shadow.
    fn solids(&self, time_s: f64) -> (Vec<Solid>, Vec<(DVec3, f64)>) {
        let (mut solids, mut shadows) = self.own_solids(time_s);
        for (other, shift_m) in &self.companions {
            let (of_other, shadows_of_other) = other.solids(time_s);
            solids.extend(of_other.into_iter().map(|solid| solid.moved(*shift_m)));
            shadows.extend(shadows_of_other.into_iter().map(|(centre, radius)| (centre + *shift_m, radius)));
        }
        (solids, shadows)
    }

    fn own_solids(&self, time_s: f64) -> (Vec<Solid>, Vec<(DVec3, f64)>) {
        let moved_s = self.moved_s(time_s);
        if self.options.mover == Mover::Trolley {
            return self.trolley(moved_s);
        }
        let figure = self.figure(moved_s);
        let radii = self.sizes.foot_radii_m();
        let feet = figure.feet.iter().flat_map(|foot| foot.iter().copied().zip(radii));
        (person::solids(&figure, &self.sizes, &self.clothes), feet.collect())
    }

    /// Whether the mover is a person who walks.
    fn walks(&self) -> bool {
        matches!(self.options.mover, Mover::Walker | Mover::Treadmill)
    }

    /// The posed person after this time in motion.
    fn figure(&self, time_s: f64) -> Figure {
        let cycles = self.cycles(time_s);
        let middle = self.stride.length_m * self.cycles(self.middle_s());
        let still = self.start_cycles;
        // Carried on from the position of the initial posture.
        let carried =
            |way: f64| self.stride.figure(still).placed(0.0, DVec3::X * (way - self.stride.length_m * still));
        let figure = match self.options.mover {
            Mover::Walker | Mover::Trolley => self.stride.figure(cycles),
            Mover::Treadmill => {
                let belt_m = self.speed_mps * (time_s - self.middle_s());
                self.stride.figure(cycles).placed(0.0, -DVec3::X * belt_m)
            }
            Mover::Rider => carried(self.stride.length_m * cycles),
            Mover::Waver => waving(carried(middle), (TAU * self.cycle_hz * time_s).sin()),
        };
        figure.placed(0.0, -middle * DVec3::X).rolled(self.curvature()).placed(self.heading_rad, DVec3::ZERO)
    }

    /// Curvature of the path, 1/m, positive to the left.
    fn curvature(&self) -> f64 {
        self.options.turn_rad / (2.0 * self.middle_s() * self.speed_mps)
    }

    /// Direction of the path where a person with these hips is.
    fn heading_of(&self, hips: DVec3) -> f64 {
        if self.curvature() == 0.0 {
            return self.heading_rad;
        }
        // From the centre of the arc, which lies beside its middle.
        let radius = self.curvature().recip();
        let left = DVec2::from_angle(self.heading_rad).perp();
        let from_centre = hips.truncate() - radius * left;
        self.heading_rad + (-radius * left).angle_to(from_centre)
    }

    /// Four posts on a board with wheels.
    fn trolley(&self, time_s: f64) -> (Vec<Solid>, Vec<(DVec3, f64)>) {
        let heading = DVec2::from_angle(self.heading_rad).extend(0.0);
        let across = heading.cross(DVec3::Z);
        let centre = self.speed_mps * (time_s - self.middle_s()) * heading;
        let corners = [(-1.0, -1.0), (-1.0, 1.0), (1.0, -1.0), (1.0, 1.0)];
        let corner = |(x, y): (f64, f64)| centre + 0.16 * x * heading + 0.12 * y * across;
        let cloths = self.clothes.of_a_trolley();
        let mut solids = Vec::new();
        let mut wheels = Vec::new();
        for place in corners.map(corner) {
            let shape = |low, high, radius| {
                RoundCone::new(place + DVec3::Z * low, place + DVec3::Z * high, radius, radius)
            };
            solids.push(Solid { shape: shape(0.3, self.height_m - 0.12, 0.12), cloth: cloths[0] });
            solids.push(Solid { shape: shape(0.06, 0.08, 0.06), cloth: cloths[1] });
            wheels.push((place + DVec3::Z * 0.06, 0.06));
        }
        (solids, wheels)
    }

    /// The time in motion at which the mover passes the middle of the image: half of all.
    fn middle_s(&self) -> f64 {
        0.5 * self.moved_s(self.time_s(self.len()))
    }

    /// Gait cycles at a time: a constant rate with a slow wave.
    fn cycles(&self, time_s: f64) -> f64 {
        let [amplitude, phase] = self.sway;
        let even = self.cycle_hz * time_s;
        self.start_cycles + even + amplitude * ((TAU * even / SWAY_CYCLES + phase).sin() - phase.sin())
    }

    /// The time at which a number of cycles is completed, by bisection: the wave is small, so the cycles
    /// increase.
    fn time_of(&self, cycles: f64) -> f64 {
        let even = (cycles - self.start_cycles) / self.cycle_hz;
        let (mut low, mut high) = (even - 0.1, even + 0.1);
        for _ in 0..60 {
            let middle = 0.5 * (low + high);
            if self.cycles(middle) < cycles { low = middle } else { high = middle }
        }
        0.5 * (low + high)
    }

    fn phase(&self, time_s: f64) -> f64 {
        let cycles = self.cycles(time_s);
        let [right, left] = self.stride.strikes;
        // The last contact of either side, then the next contact of the other side.
        let since = |strike: f64| (cycles - strike).rem_euclid(1.0);
        let (base, from, to) = if since(right) < since(left) {
            (0.0, cycles - since(right), left)
        } else {
            (0.5, cycles - since(left), right)
        };
        let to = from + (to - from).rem_euclid(1.0);
        let [from_s, to_s] = [from, to].map(|at| self.time_of(at));
        (base + 0.5 * (time_s - from_s) / (to_s - from_s)).rem_euclid(1.0)
    }

    fn angles(&self, joints: [SideJoints; 2]) -> [SideAngles; 2] {
        let hips = joints[0].hip.midpoint(joints[1].hip);
        let forward = DVec2::from_angle(self.heading_of(hips)).extend(0.0);
        let elevation = |from: DVec3, to: DVec3| (to - from).dot(forward).atan2(from.z - to.z);
        let [right, left] = joints;
        let trunk = elevation(right.shoulder.midpoint(left.shoulder), right.hip.midpoint(left.hip));
        joints.map(|j| {
            let (thigh, upper_arm) = (elevation(j.hip, j.knee), elevation(j.shoulder, j.elbow));
            SideAngles {
                hip: thigh,
                knee: thigh - elevation(j.knee, j.ankle),
                shoulder: upper_arm - trunk,
                elbow: elevation(j.elbow, j.wrist) - upper_arm,
                ankle: 0.0,
                thigh_tilt: 0.0,
                shank_tilt: 0.0,
            }
        })
    }
}

fn check(options: &ClothedOptions) -> Result<(), SceneError> {
    check_size(options.size)?;
    check_ranges(&[
        ("rate_hz", options.rate_hz, 1.0..=1e4, "1 to 10000 frames a second"),
        ("noise_sd", options.noise_sd.map_or(0.0, f64::from), 0.0..=255.0, "0 to 255 grey levels"),
        ("slant_rad", options.slant_rad.unwrap_or(0.0), -1.6..=1.6, "-1.6 to 1.6 rad"),
        ("turn_rad", options.turn_rad, -4.0..=4.0, "-4 to 4 rad"),
        ("late_left", options.late_left.unwrap_or(0.0), -0.1..=0.1, "-0.1 to 0.1 of a cycle"),
        ("pause.at_s", options.pause.map_or(EASE_S, |pause| pause.at_s), EASE_S..=1e4, "0.8 to 10000 s"),
        ("pause.lasts_s", options.pause.map_or(0.0, |pause| pause.lasts_s), 0.0..=1e4, "0 to 10000 s"),
    ])
}

/// A camera on a tripod, nearly level, that sees the walk across the middle of the image.
fn drawn_camera(size: [u32; 2], random: &mut Random) -> Camera {
    let field_of_view_rad = random.uniform(0.7, 1.05);
    let height_m = random.uniform(0.8, 1.7);
    // Wide images show more than the walk; narrow images must contain the person.
    let distance_m = random.uniform(5.2, 6.4) * (0.5 * 0.9f64).tan() / (0.5 * field_of_view_rad).tan();
    let pitch_rad = ((height_m - 0.95) / distance_m).atan() + random.uniform(-0.01, 0.01);
    let level = Camera::level(size, field_of_view_rad, height_m, distance_m)
        .expect("a camera about a metre above the ground is valid");
    let rotation = DMat3::from_rotation_x(pitch_rad) * level.rotation;
    Camera { translation: rotation * -level.position(), rotation, ..level }
}

/// Arms that swing about the shoulders by a fraction of 1 rad, and a nodding head.
fn waving(mut figure: Figure, swings: f64) -> Figure {
    for (joints, hand) in figure.joints.iter_mut().zip(&mut figure.hands) {
        let turn = DMat3::from_rotation_y(-swings);
        let swung = |point: DVec3| joints.shoulder + turn * (point - joints.shoulder);
        [joints.elbow, joints.wrist, *hand] = [joints.elbow, joints.wrist, *hand].map(swung);
    }
    let nod = DMat3::from_rotation_y(0.1 * swings);
    figure.head = figure.neck + nod * (figure.head - figure.neck);
    figure
}

#[cfg(test)]
mod tests;
