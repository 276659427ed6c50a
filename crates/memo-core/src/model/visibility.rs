//! Hidden-line removal for bodies of elliptic cylinders, exact and in closed form (Rohr 1994, section 3.2:
//! "hidden contours have been removed").
//!
//! A convex solid K hides from the camera C the set S = {C + m (k - C) : k in K, m >= 1}: its own points and
//! those behind it. S is convex, so each part hides **one interval** of a segment, and the visible remainder
//! is the complement of the union over all parts. The paper does not describe its method; this derivation is
//! ours.
//!
//! # One occluder
//!
//! In the occluder's unit frame ([`silhouette`](super::silhouette)) let c be the camera's (x, y), T₁ and T₂
//! the points where the tangents from c touch the unit circle, and P a point with (x, y) = c + α (T₁ - c) + β
//! (T₂ - c) and Δz = P_z - C_z. α, β and Δz are linear in P. Write σ = α + β and μ = 4/|c|². Then
//!
//! * the tangent planes are α = 0 and β = 0; the plane through both tangent points is σ = 1;
//! * the infinite cylinder is (1 - σ)² <= μ α β, and the ray from C to P is inside it for s from 1/(σ +
//!   sqrt(μ α β)) to 1/(σ - sqrt(μ α β)) (s = 0 at C, 1 at P);
//! * the cone from C over the end ellipse in the plane z = ±1, at distance k = ±1 - C_z, is (Δz - k σ)² <= μ
//!   k² α β.
//!
//! Of P(t) = A + t (B - A) the infinite cylinder hides the points that lie between the tangent planes and not
//! in front of the body. The two limits of that interval determine whether the ends of the solid shorten it:
//! if the ray to a limit is inside the infinite cylinder only above (below) the solid, the true limit is
//! where the segment meets the cone over the top (bottom) end ellipse or passes through that end. A camera
//! inside the infinite cylinder, beyond an end, sees only that end: the hidden set is the cone over it, from
//! the plane of the end on.
//!
//! # Conventions for degenerate cases
//!
//! * Contact does not hide: an occluder is shrunk by 1e-11 of its size. Side lines of equal cylinders in one
//!   row coincide with each other's surface and would otherwise hide each other by a rounding error. With a
//!   camera some hundred radii away, rounding stays below 1e-13 radii.
//! * A part does not hide its own contours; points of other parts inside it are hidden.
//! * If the camera is inside a part, or closer to it than 1e-7 of its size, everything is hidden, as the
//!   definition of S gives.
//! * A part with a semi-axis or a half length that is not positive has no contours and hides nothing.
//! * There is no image plane: contours behind the camera are treated like those in front of it. Clipping is
//!   left to the projection.
//! * Visible pieces shorter than 1e-11 of their contour are dropped: they are rounding between two occluders
//!   that meet.

use super::silhouette::{ContourKind, RimAspect, RimChord, camera_in_unit_frame, rims, side_lines};
use super::{Camera, Contour, EllipticCylinder};
use glam::{DVec2, DVec3};

/// Relative size below which lengths are rounding errors: occluders shrink by it, and shorter visible pieces
/// are dropped.
const ROUNDING: f64 = 1e-11;

/// A camera closer to a part than this fraction of its size counts as inside. On the surface the tangent
/// planes coincide; at this distance their coordinates still have eight digits.
const CONTACT: f64 = 1e-7;

/// A visible piece of a contour generator in the world, metres.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct VisibleSegment {
    /// The part it belongs to, an index into the given cylinders.
    pub part: usize,
    /// Which contour of the part.
    pub kind: ContourKind,
    /// First end point, metres, in the order of [`Contour`].
    pub start: DVec3,
    /// Second end point, metres.
    pub end: DVec3,
}

impl VisibleSegment {
    /// Its end points in image pixels; `None` unless both are in front of the camera and imaged by the lens.
    pub fn ends_px(&self, camera: &Camera) -> Option<[DVec2; 2]> {
        Some([camera.project(self.start)?, camera.project(self.end)?])
    }
}

/// Options for [`visible_contours`].
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct VisibilityOptions {
    /// Whether the end ellipses are returned too. Off by default: Rohr compares straight lines only.
    pub rims: bool,
    /// Number of chords per end ellipse. With the default 24 they deviate from the ellipse by less than 1 %
    /// of its semi-axis.
    pub rim_chords: usize,
}

impl VisibilityOptions {
    /// All contours of a drawing: side lines and end ellipses.
    pub const DRAWN: Self = Self { rims: true, rim_chords: 24 };
}

impl Default for VisibilityOptions {
    fn default() -> Self {
        Self { rims: false, rim_chords: Self::DRAWN.rim_chords }
    }
}

/// Writes the visible pieces of all contours into `out`, which is cleared first: part by part, the left side
/// line before the right.
///
/// To reuse memory over many views, keep a [`PreparedView`].
pub fn visible_contours(
    cylinders: &[EllipticCylinder],
    camera_position: DVec3,
    options: &VisibilityOptions,
    out: &mut Vec<VisibleSegment>,
) {
    PreparedView::default().visible_contours(cylinders, camera_position, options, out);
}

/// The interval [t0, t1] of P(t) = `start` + t (`end` - `start`), 0 <= t <= 1, that `occluder` hides, if any.
pub fn hidden_interval(
    start: DVec3,
    end: DVec3,
    occluder: &EllipticCylinder,
    camera_position: DVec3,
) -> Option<(f64, f64)> {
    let shadow = Shadow::new(occluder, camera_position)?;
    let hidden = shadow.hidden_interval(&Chord { a: start - camera_position, b: end - camera_position })?;
    Some((hidden.t0, hidden.t1))
}

/// Working memory of [`visible_contours`], for successive views.
#[derive(Debug, Clone, Default)]
pub struct PreparedView {
    camera_position: DVec3,
    /// A direction from the camera to the body, along which depths are measured.
    towards: DVec3,
    occluders: Vec<Occluder>,
    hidden: Vec<Interval>,
    chords: Vec<RimChord>,
}

impl PreparedView {
    /// As the function [`visible_contours`]; allocates nothing after the buffers have grown.
    pub fn visible_contours(
        &mut self,
        cylinders: &[EllipticCylinder],
        camera_position: DVec3,
        options: &VisibilityOptions,
        out: &mut Vec<VisibleSegment>,
    ) {
        self.visible_contours_among(cylinders, Others::NONE, camera_position, options, out);
    }

    /// The same of a body that other bodies may hide.
    pub fn visible_contours_among(
        &mut self,
        cylinders: &[EllipticCylinder],
        others: &Others,
        camera_position: DVec3,
        options: &VisibilityOptions,
        out: &mut Vec<VisibleSegment>,
    ) {
        let has_rims = |_| options.rims;
        self.contours_and_rims_of(cylinders, others, camera_position, has_rims, options.rim_chords, out);
    }

    /// The same with the end ellipses of some parts.
    pub(crate) fn contours_and_rims_of(
        &mut self,
        cylinders: &[EllipticCylinder],
        others: &Others,
        camera_position: DVec3,
        has_rims: impl Fn(usize) -> bool,
        rim_chords: usize,
        out: &mut Vec<VisibleSegment>,
    ) {
        out.clear();
        self.prepare(cylinders, camera_position);
        let shadows = self.occluders.iter().map(|o| &o.shadow).chain(&others.shadows);
        if shadows.into_iter().any(|shadow| matches!(shadow, Shadow::Everything)) {
            return;
        }
        for (part, cylinder) in cylinders.iter().enumerate() {
            for line in side_lines(cylinder, camera_position).iter().flatten() {
                self.push_visible(part, line, others, out);
            }
            if has_rims(part) {
                self.push_visible_rims(part, cylinder, rim_chords, others, out);
            }
        }
    }

    fn prepare(&mut self, cylinders: &[EllipticCylinder], camera_position: DVec3) {
        self.camera_position = camera_position;
        self.towards = cylinders.iter().map(|k| k.centre() - camera_position).sum();
        self.occluders.clear();
        for (part, cylinder) in cylinders.iter().enumerate() {
            if let Some(shadow) = Shadow::new(cylinder, camera_position) {
                let nearest = least_along(cylinder, camera_position, self.towards);
                self.occluders.push(Occluder { part, nearest, shadow });
            }
        }
    }

    fn push_visible_rims(
        &mut self,
        part: usize,
        cylinder: &EllipticCylinder,
        chords: usize,
        others: &Others,
        out: &mut Vec<VisibleSegment>,
    ) {
        let mut rim_chords = std::mem::take(&mut self.chords);
        rim_chords.clear();
        rims(cylinder, self.camera_position, chords, &mut rim_chords);
        for chord in rim_chords.iter().filter(|chord| chord.aspect != RimAspect::Hidden) {
            self.push_visible(part, &chord.contour, others, out);
        }
        self.chords = rim_chords;
    }

    /// Appends the pieces of one contour that neither the other parts nor other bodies hide.
    fn push_visible(
        &mut self,
        part: usize,
        contour: &Contour,
        others: &Others,
        out: &mut Vec<VisibleSegment>,
    ) {
        let chord = Chord { a: contour.start - self.camera_position, b: contour.end - self.camera_position };
        let farthest = self.towards.dot(chord.a).max(self.towards.dot(chord.b));
        self.hidden.clear();
        let own = self.occluders.iter().filter(|o| o.part != part && !o.is_behind(farthest));
        for shadow in own.map(|occluder| &occluder.shadow).chain(&others.shadows) {
            match shadow.hidden_interval(&chord) {
                Some(Interval { t0, t1 }) if t0 <= 0.0 && t1 >= 1.0 => return,
                Some(hidden) => self.hidden.push(hidden),
                None => {}
            }
        }
        self.hidden.sort_unstable_by(|p, q| p.t0.total_cmp(&q.t0));
        let mut visible_from = 0.0;
        for hidden in self.hidden.iter().chain(&[Interval { t0: 1.0, t1: 1.0 }]) {
            if hidden.t0 - visible_from > ROUNDING {
                let (start, end) = (contour.at(visible_from), contour.at(hidden.t0));
                out.push(VisibleSegment { part, kind: contour.kind, start, end });
            }
            visible_from = hidden.t1.max(visible_from);
        }
    }
}

impl Contour {
    /// The point at parameter t; exactly the end points at t = 0 and t = 1.
    fn at(&self, t: f64) -> DVec3 {
        self.start * (1.0 - t) + self.end * t
    }
}

/// A segment from a to b, relative to the camera.
#[derive(Debug, Clone, Copy)]
struct Chord {
    a: DVec3,
    b: DVec3,
}

/// A hidden part t0 <= t <= t1 of a segment.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Interval {
    t0: f64,
    t1: f64,
}

#[derive(Debug, Clone)]
struct Occluder {
    part: usize,
    /// The smallest depth of its points, along [`PreparedView::towards`].
    nearest: f64,
    shadow: Shadow,
}

impl Occluder {
    /// Whether the occluder lies in front of the camera and behind all points of a given depth: hidden points
    /// are deeper than the part that hides them.
    fn is_behind(&self, depth: f64) -> bool {
        self.nearest > depth.max(0.0)
    }
}

/// The smallest dot product of a direction with the points of a cylinder relative to the camera.
fn least_along(cylinder: &EllipticCylinder, camera_position: DVec3, direction: DVec3) -> f64 {
    let along = cylinder.world_from_cylinder.matrix3.transpose() * direction;
    let reach = (along.truncate() * cylinder.semi_axes).length() + along.z.abs() * cylinder.half_length;
    direction.dot(cylinder.centre() - camera_position) - reach
}

/// What other bodies hide from a camera. The hidden sets are relative to the camera, so they are prepared once for all
/// places of the body behind them.
#[derive(Debug, Clone, Default)]
pub struct Others {
    shadows: Vec<Shadow>,
}

impl Others {
    /// No other body.
    pub const NONE: &'static Self = {
        static NONE: Others = Others { shadows: Vec::new() };
        &NONE
    };

    /// Bodies of elliptic cylinders, seen by a camera.
    pub fn new(cylinders: &[EllipticCylinder], camera_position: DVec3) -> Self {
        Self { shadows: cylinders.iter().filter_map(|k| Shadow::new(k, camera_position)).collect() }
    }

    /// True if there is no other body.
    pub fn is_empty(&self) -> bool {
        self.shadows.is_empty()
    }
}

/// The hidden set S of one part in one view.
#[derive(Debug, Clone)]
enum Shadow {
    Side(SideShadow),
    End(EndShadow),
    Everything,
}

impl Shadow {
    /// `None` for a part that is not a solid.
    fn new(cylinder: &EllipticCylinder, camera_position: DVec3) -> Option<Self> {
        let shrunk = EllipticCylinder {
            semi_axes: cylinder.semi_axes * (1.0 - ROUNDING),
            half_length: cylinder.half_length * (1.0 - ROUNDING),
            ..*cylinder
        };
        let camera = camera_in_unit_frame(&shrunk, camera_position)?;
        let axes = shrunk.world_from_cylinder.matrix3;
        let (x, y) = (axes.x_axis / shrunk.semi_axes.x, axes.y_axis / shrunk.semi_axes.y);
        let z = axes.z_axis / shrunk.half_length;
        let is_beside = camera.truncate().length() > 1.0 + CONTACT;
        let is_beyond = camera.z.abs() > 1.0 + CONTACT;
        Some(match (is_beside, is_beyond) {
            (true, _) => Self::Side(SideShadow::new(camera, x, y, z)),
            (false, true) => Self::End(EndShadow { camera, x, y, z }),
            (false, false) => Self::Everything,
        })
    }

    fn hidden_interval(&self, chord: &Chord) -> Option<Interval> {
        match self {
            Self::Side(side) => side.hidden_interval(chord),
            Self::End(end) => end.hidden_interval(chord),
            Self::Everything => Some(Interval { t0: 0.0, t1: 1.0 }),
        }
    }
}

/// S for a camera outside the infinite cylinder. The vectors are gradients in the world, to be multiplied by
/// a point relative to the camera.
#[derive(Debug, Clone)]
struct SideShadow {
    alpha: DVec3,
    beta: DVec3,
    z: DVec3,
    /// Positive above the plane through the camera that touches K from above.
    above: DVec3,
    /// Positive below the plane through the camera that touches K from below.
    below: DVec3,
    mu: f64,
    camera_z: f64,
}

impl SideShadow {
    /// Computed from the camera in the unit frame and the gradients of the coordinates of the unit frame.
    ///
    /// With ρ along c and λ perpendicular to it, T₁ - c = (1/|c| - |c|, -w) and T₂ - c = (1/|c| - |c|, w), w
    /// = sqrt(1 - 1/|c|²), so α + β = -ρ |c| / (|c|² - 1) and β - α = λ / w. In the (ρ, z) plane K is the
    /// square |ρ|, |z| <= 1; the planes `above` and `below` pass through the camera at (|c|, C_z) and a
    /// corner of the square.
    fn new(camera: DVec3, x: DVec3, y: DVec3, z: DVec3) -> Self {
        let distance_sq = camera.truncate().length_squared();
        let distance = distance_sq.sqrt();
        let toward = camera.truncate() / distance;
        let rho = x * toward.x + y * toward.y;
        let lambda = y * toward.x - x * toward.y;
        let sum = rho * (-distance / (distance_sq - 1.0));
        let difference = lambda * (distance / (distance_sq - 1.0).sqrt());
        let corner_above = if camera.z > 1.0 { -1.0 } else { 1.0 };
        let corner_below = if camera.z < -1.0 { -1.0 } else { 1.0 };
        Self {
            alpha: (sum - difference) * 0.5,
            beta: (sum + difference) * 0.5,
            z,
            above: rho * (1.0 - camera.z) + z * (distance - corner_above),
            below: rho * (1.0 + camera.z) - z * (distance - corner_below),
            mu: 4.0 / distance_sq,
            camera_z: camera.z,
        }
    }

    fn hidden_interval(&self, chord: &Chord) -> Option<Interval> {
        let is_outside = |plane: DVec3| Linear::along(plane, chord).is_never_negative();
        if is_outside(self.above) || is_outside(self.below) {
            return None;
        }
        let (alpha, beta) = (Linear::along(self.alpha, chord), Linear::along(self.beta, chord));
        if alpha.is_never_positive() || beta.is_never_positive() {
            return None;
        }
        let ray = SideRays {
            shadow: self,
            alpha,
            beta,
            sigma: alpha.plus(1.0, beta),
            dz: Linear::along(self.z, chord),
        };
        let between = alpha.where_positive(Interval { t0: 0.0, t1: 1.0 })?;
        let between = beta.where_positive(between)?;
        let behind = ray.not_in_front(between)?;
        ray.cut_by_ends(behind)
    }
}

/// The rays from the camera to the points of a segment, in the coordinates of a [`SideShadow`].
struct SideRays<'a> {
    shadow: &'a SideShadow,
    alpha: Linear,
    beta: Linear,
    sigma: Linear,
    dz: Linear,
}

impl SideRays<'_> {
    /// The interval that the infinite cylinder hides of a piece between its tangent planes. The near surface
    /// of the cylinder bounds the interval where a limit lies in front of the plane of the tangent points, σ
    /// < 1, and not in the body.
    fn not_in_front(&self, between: Interval) -> Option<Interval> {
        let front = Linear { at0: 1.0, at1: 1.0 }.plus(-1.0, self.sigma);
        let (front0, front1) = (front.at(between.t0), front.at(between.t1));
        if front0 <= 0.0 && front1 <= 0.0 {
            return Some(between);
        }
        let body = Conic { e: front, alpha: self.alpha, beta: self.beta, m: self.shadow.mu };
        let is_outside = |t: f64, front: f64| front > 0.0 && body.at(t) > 0.0;
        let (cut0, cut1) = (is_outside(between.t0, front0), is_outside(between.t1, front1));
        if !cut0 && !cut1 {
            return Some(between);
        }
        // A segment that changes side between the tangent points passes through the body; rounding may lose
        // the roots.
        let touching = (cut0 != cut1).then(|| [front.root(); 2]);
        let [enter, leave] = body.roots().or(touching)?;
        let t0 = if cut0 { enter.max(between.t0) } else { between.t0 };
        let t1 = if cut1 { leave.min(between.t1) } else { between.t1 };
        (t0 <= t1).then_some(Interval { t0, t1 })
    }

    /// The interval that the finite cylinder hides of an interval hidden by the infinite one.
    fn cut_by_ends(&self, behind: Interval) -> Option<Interval> {
        let t0 = match self.passes(behind.t0) {
            Passage::Through => behind.t0,
            Passage::Beyond(end) => self.cone_interval(end)?.t0,
        };
        let t1 = match self.passes(behind.t1) {
            Passage::Through => behind.t1,
            Passage::Beyond(end) => self.cone_interval(end)?.t1,
        };
        (t0 <= t1).then_some(Interval { t0, t1 })
    }

    /// Where the ray to P(t) passes while it is inside the infinite cylinder.
    fn passes(&self, t: f64) -> Passage {
        let (alpha, beta, dz) = (self.alpha.at(t), self.beta.at(t), self.dz.at(t));
        let camera_z = self.shadow.camera_z;
        if camera_z.abs() <= 1.0 && (camera_z + dz).abs() <= 1.0 {
            return Passage::Through;
        }
        let half_width = (self.shadow.mu * alpha * beta).max(0.0).sqrt();
        let enter = camera_z + dz * (1.0 / (alpha + beta + half_width)).min(1.0);
        let leave = camera_z + dz * (1.0 / (alpha + beta - half_width)).min(1.0);
        let end = 1.0 + 1e-15 * (1.0 + camera_z.abs() + dz.abs());
        if enter.min(leave) > end {
            Passage::Beyond(1.0)
        } else if enter.max(leave) < -end {
            Passage::Beyond(-1.0)
        } else {
            Passage::Through
        }
    }

    /// The interval whose rays meet the end face in the plane z = `end`.
    fn cone_interval(&self, end: f64) -> Option<Interval> {
        let k = end - self.shadow.camera_z;
        let e = self.dz.plus(-k, self.sigma);
        let cone = Conic { e, alpha: self.alpha, beta: self.beta, m: self.shadow.mu * k * k };
        meets_end_face(&cone, &self.dz, k)
    }
}

enum Passage {
    /// In at least one point between the planes of the ends.
    Through,
    /// Only beyond the end at this z.
    Beyond(f64),
}

/// S for a camera beyond an end that looks along the axis: x, y, z are the gradients of the coordinates of
/// the unit frame.
#[derive(Debug, Clone)]
struct EndShadow {
    camera: DVec3,
    x: DVec3,
    y: DVec3,
    z: DVec3,
}

impl EndShadow {
    /// The cone over the near end face, |c Δz + k (x, y)|² <= Δz², as Y² <= (Δz - X) (Δz + X).
    fn hidden_interval(&self, chord: &Chord) -> Option<Interval> {
        let k = self.camera.z.signum() - self.camera.z;
        let dz = Linear::along(self.z, chord);
        let x = dz.scaled(self.camera.x).plus(k, Linear::along(self.x, chord));
        let y = dz.scaled(self.camera.y).plus(k, Linear::along(self.y, chord));
        let cone = Conic { e: y, alpha: dz.plus(-1.0, x), beta: dz.plus(1.0, x), m: 1.0 };
        meets_end_face(&cone, &dz, k)
    }
}

/// The interval of a segment whose rays, with z from 0 to Δz(t), meet an end face in the plane z = k. `cone`
/// is negative inside the double cone over the face. The limits of the interval are the ends of the segment,
/// the cone, or the point where the segment passes through the face.
fn meets_end_face(cone: &Conic, dz: &Linear, k: f64) -> Option<Interval> {
    let is_inside = |t: f64| cone.at(t) <= 0.0;
    let slack = 1e-15 * (dz.at0.abs() + dz.at1.abs());
    let reaches = |t: f64| dz.at(t) * k.signum() >= k.abs() - slack;
    let pierces = (k - dz.at0) / (dz.at1 - dz.at0);
    let [enter, leave] = cone.roots().unwrap_or([f64::NAN; 2]);
    let candidates = [
        (0.0, is_inside(0.0) && reaches(0.0)),
        (1.0, is_inside(1.0) && reaches(1.0)),
        (pierces, is_inside(pierces)),
        (enter, reaches(enter)),
        (leave, reaches(leave)),
    ];
    let is_on_segment = |t: f64| (-ROUNDING..=1.0 + ROUNDING).contains(&t);
    let limits = candidates.iter().filter(|&&(t, is_limit)| is_limit && is_on_segment(t));
    limits.map(|&(t, _)| Interval { t0: t, t1: t }).reduce(Interval::hull).map(Interval::on_segment)
}

impl Interval {
    fn hull(self, other: Self) -> Self {
        Self { t0: self.t0.min(other.t0), t1: self.t1.max(other.t1) }
    }

    fn on_segment(self) -> Self {
        Self { t0: self.t0.clamp(0.0, 1.0), t1: self.t1.clamp(0.0, 1.0) }
    }
}

/// A linear function on a segment, given by its values at t = 0 and t = 1.
#[derive(Debug, Clone, Copy)]
struct Linear {
    at0: f64,
    at1: f64,
}

impl Linear {
    fn along(gradient: DVec3, chord: &Chord) -> Self {
        Self { at0: gradient.dot(chord.a), at1: gradient.dot(chord.b) }
    }

    fn at(&self, t: f64) -> f64 {
        self.at0 + t * self.slope()
    }

    fn slope(&self) -> f64 {
        self.at1 - self.at0
    }

    fn cross(&self, other: Self) -> f64 {
        self.at0 * other.at1 - self.at1 * other.at0
    }

    /// self + factor · other.
    fn plus(&self, factor: f64, other: Self) -> Self {
        Self { at0: self.at0 + factor * other.at0, at1: self.at1 + factor * other.at1 }
    }

    fn scaled(&self, factor: f64) -> Self {
        Self { at0: factor * self.at0, at1: factor * self.at1 }
    }

    fn root(&self) -> f64 {
        self.at0 / (self.at0 - self.at1)
    }

    fn is_never_positive(&self) -> bool {
        self.at0 <= 0.0 && self.at1 <= 0.0
    }

    fn is_never_negative(&self) -> bool {
        self.at0 >= 0.0 && self.at1 >= 0.0
    }

    /// The part of an interval where the function, which is positive somewhere on the segment, is not
    /// negative.
    fn where_positive(&self, within: Interval) -> Option<Interval> {
        let t0 = if self.at0 < 0.0 { within.t0.max(self.root()) } else { within.t0 };
        let t1 = if self.at1 < 0.0 { within.t1.min(self.root()) } else { within.t1 };
        (t0 <= t1).then_some(Interval { t0, t1 })
    }
}

/// e² - m α β along a segment: negative inside a cone or cylinder whose tangent planes from the camera are α
/// = 0 and β = 0.
#[derive(Debug, Clone, Copy)]
struct Conic {
    e: Linear,
    alpha: Linear,
    beta: Linear,
    m: f64,
}

impl Conic {
    fn at(&self, t: f64) -> f64 {
        let e = self.e.at(t);
        e * e - self.m * self.alpha.at(t) * self.beta.at(t)
    }

    /// The real roots in ascending order; one is infinite where the function is linear.
    ///
    /// The discriminant is computed from the adjoint of the form, m (m/4 [αβ]² + [eα] [eβ]), with the products of the
    /// differences between the ends [pq] = p₀ q₁ - p₁ q₀. b² - 4ac would lose all digits for a camera near the plane
    /// of an end, where m approaches 0.
    fn roots(&self) -> Option<[f64; 2]> {
        let (e, alpha, beta, m) = (self.e, self.alpha, self.beta, self.m);
        let across = alpha.cross(beta);
        let discriminant = m * (0.25 * m * across * across + e.cross(alpha) * e.cross(beta));
        if discriminant < 0.0 {
            return None;
        }
        let c0 = e.at0 * e.at0 - m * alpha.at0 * beta.at0;
        let c2 = e.slope() * e.slope() - m * alpha.slope() * beta.slope();
        let half = 0.5 * m * (alpha.at0 * beta.slope() + beta.at0 * alpha.slope()) - e.at0 * e.slope();
        let q = half + discriminant.sqrt().copysign(half);
        let (r, s) = (q / c2, c0 / q);
        (q != 0.0).then(|| [r.min(s), r.max(s)])
    }
}

#[cfg(test)]
pub(super) mod tests;
