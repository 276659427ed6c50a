//! Who is who: numbers of people over the walks of one stream.
//!
//! A walk can end because a person was hidden, stood still or could not be told from the background. A walk that
//! starts soon after where that person would be by then, in the same direction, is the same person's. Somebody who stood
//! still stays there, and may go any way and much later.

use super::decisions::{PLACE_M, PLACE_M_PER_S, SAME_WAY};
use glam::{DVec2, DVec3};

/// The latest filtered estimate.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Now {
    /// Number of the person, in order of appearance.
    pub person: usize,
    /// Number of the frame.
    pub frame: usize,
    /// Its time, seconds.
    pub time_s: f64,
    /// Centre of the torso, metres.
    pub torso_centre: DVec3,
    /// Direction the body faces, radians about world Z.
    pub heading_rad: f64,
    /// Gait phase in [0, 1), 0 = right heel strike (initial contact).
    pub phase: f64,
    /// Probability, from the frames so far, that left and right are swapped.
    pub p_swapped: f64,
    /// Speed along the path, m/s.
    pub speed_mps: f64,
}

/// Where and how somebody walks at a time, on the ground.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Sign {
    pub time_s: f64,
    pub place_m: DVec2,
    pub velocity_mps: DVec2,
    /// The direction that the person walks in, also on a treadmill.
    pub way: DVec2,
    /// How fast that direction changes, radians per second to the left.
    pub turn_rad_per_s: f64,
    /// Whether the person stood still.
    pub stands: bool,
}

/// A person is expected back for this long, seconds.
const EXPECTED_S: f64 = 3.0;
/// Somebody who stood still is expected to go on for this long, seconds: it may be that nobody saw the person go.
const STANDS_S: f64 = 60.0;

/// The numbers given so far.
#[derive(Debug, Default)]
pub(super) struct Identities {
    /// How many walks each person has.
    walks: Vec<usize>,
    ended: Vec<(usize, Sign)>,
}

impl Identities {
    /// How many people appeared.
    pub fn count(&self) -> usize {
        self.walks.len()
    }

    /// The person who ended nearest to where this walk starts, or a new one.
    pub fn appear(&mut self, sign: &Sign) -> usize {
        let Some(person) = self.known(sign) else {
            self.walks.push(1);
            return self.walks.len() - 1;
        };
        self.is_back(person);
        person
    }

    /// The person who ended nearest to where this walk starts, of those who are expected back.
    pub fn known(&self, sign: &Sign) -> Option<usize> {
        let expected = self.ended.iter().filter(|(_, end)| end.is_expected(sign.time_s));
        let nearest = expected.filter_map(|(person, end)| Some((*person, end.distance_to(sign)?)));
        nearest.min_by(|a, b| a.1.total_cmp(&b.1)).map(|(person, _)| person)
    }

    /// Everybody who is expected back at a time.
    pub fn expected(&self, time_s: f64) -> impl Iterator<Item = usize> {
        let expected = self.ended.iter().filter(move |(_, end)| end.is_expected(time_s));
        expected.map(|(person, _)| *person)
    }

    /// Notes the end of a person's walk, the last one of that person.
    pub fn end(&mut self, person: usize, sign: Sign) {
        self.ended.retain(|(ended, end)| *ended != person && end.is_expected(sign.time_s));
        self.ended.push((person, sign));
    }

    /// Notes a further walk of a person.
    pub fn is_back(&mut self, person: usize) {
        self.walks[person] += 1;
        self.forget_end(person);
    }

    /// Forgets where a person's walk ended: the person was found again.
    pub fn forget_end(&mut self, person: usize) {
        self.ended.retain(|(ended, _)| *ended != person);
    }

    /// Expects nobody back.
    pub fn forget_ended(&mut self) {
        self.ended.clear();
    }

    /// Gives a walk of one person to another one.
    pub fn pass_on(&mut self, from: usize, to: usize) {
        self.walks[to] += 1;
        self.withdraw(from);
    }

    /// Takes a walk of a person back, and the number with the last of them, if no later one is in use.
    pub fn withdraw(&mut self, person: usize) {
        self.walks[person] -= 1;
        while self.walks.last() == Some(&0) {
            self.walks.pop();
        }
        let walks = &self.walks;
        self.ended.retain(|(ended, _)| walks.get(*ended).is_some_and(|walks| *walks > 0));
    }
}

impl Sign {
    /// True if a later walk starts where this one would be by then.
    pub fn leads_to(&self, later: &Self) -> bool {
        self.distance_to(later).is_some()
    }

    /// How far a later walk starts from where this one would be by then, metres; `None` if it is somebody else's.
    fn distance_to(&self, later: &Self) -> Option<f64> {
        let elapsed_s = later.time_s - self.time_s;
        if self.stands {
            let off_m = self.place_m.distance(later.place_m);
            return (elapsed_s >= 0.0 && off_m <= PLACE_M).then_some(off_m);
        }
        // Who turned goes on to turn, or straight on.
        let off_m = |turn_rad: f64| {
            let off_m = self.led(elapsed_s, turn_rad).distance(later.place_m);
            let is_same = elapsed_s >= 0.0
                && off_m <= PLACE_M + PLACE_M_PER_S * elapsed_s
                && DVec2::from_angle(turn_rad).rotate(self.way).dot(later.way) >= SAME_WAY;
            is_same.then_some(off_m)
        };
        let [straight, turned] = [0.0, elapsed_s * self.turn_rad_per_s].map(off_m);
        [straight, turned].into_iter().flatten().reduce(f64::min)
    }

    /// Where the person is after some time, on an arc that turns by an angle.
    fn led(&self, elapsed_s: f64, turn_rad: f64) -> DVec2 {
        // The chord of an arc is shorter than the arc by sin(a) / a, half-way turned.
        let half_rad = 0.5 * turn_rad;
        let chord = if half_rad.abs() < 1e-6 { 1.0 } else { half_rad.sin() / half_rad };
        self.place_m + chord * elapsed_s * DVec2::from_angle(half_rad).rotate(self.velocity_mps)
    }

    /// True if the person is expected back at a time.
    fn is_expected(&self, time_s: f64) -> bool {
        time_s - self.time_s <= if self.stands { STANDS_S } else { EXPECTED_S }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn sign(time_s: f64, x: f64, speed_mps: f64) -> Sign {
        let (place_m, velocity_mps) = (DVec2::new(x, 5.0), DVec2::new(speed_mps, 0.0));
        Sign {
            time_s,
            place_m,
            velocity_mps,
            way: velocity_mps.normalize(),
            turn_rad_per_s: 0.0,
            stands: false,
        }
    }

    #[test]
    fn who_comes_back_where_expected_keeps_the_number() {
        let mut people = Identities::default();
        assert_eq!([people.appear(&sign(0.0, 0.0, 1.2)), people.appear(&sign(0.5, 4.0, -1.0))], [0, 1]);
        people.end(0, sign(2.0, 2.4, 1.2));
        people.end(1, sign(2.0, 2.5, -1.0));
        // One second later the first is expected at 3.6 m, the second at 1.5 m.
        assert_eq!(people.appear(&sign(3.0, 3.9, 1.2)), 0);
        assert_eq!(people.appear(&sign(3.0, 1.2, -1.1)), 1);
        assert_eq!(people.count(), 2);
    }

    /// The second walk turned out to be of the first person: its number is free again, and where the first one ended is known.
    #[test]
    fn a_walk_that_is_passed_on_leaves_its_number_and_the_end_of_the_other() {
        let mut people = Identities::default();
        assert_eq!([people.appear(&sign(0.0, 0.0, 1.2)), people.appear(&sign(0.5, 4.0, -1.0))], [0, 1]);
        people.end(0, sign(2.0, 2.4, 1.2));
        people.pass_on(1, 0);
        assert_eq!((people.count(), people.known(&sign(3.0, 3.7, 1.2))), (1, Some(0)));
        // It goes on to its own end, and there only is the person expected.
        people.end(0, sign(4.0, 5.0, 1.2));
        assert_eq!(people.known(&sign(4.5, 5.6, 1.2)), Some(0));
        assert_eq!(people.known(&sign(2.5, 3.0, 1.2)), None);
        // Both walks of the person have to be taken back.
        people.withdraw(0);
        assert_eq!(people.count(), 1);
        people.withdraw(0);
        assert_eq!(people.count(), 0);
    }

    #[test]
    fn elsewhere_later_or_the_other_way_is_somebody_else() {
        for other in [sign(3.0, 4.8, 1.2), sign(3.0, 3.6, -1.2), sign(5.1, 6.1, 1.2), sign(1.9, 2.3, 1.2)] {
            let mut people = Identities::default();
            people.appear(&sign(0.0, 0.0, 1.2));
            people.end(0, sign(2.0, 2.4, 1.2));
            assert_eq!(people.appear(&other), 1, "{other:?}");
        }
    }

    /// Half a circle of 2 m to the left, of somebody who was seen in its first quarter.
    #[test]
    fn who_turned_is_expected_on_the_arc_and_straight_on() {
        let turn_rad_per_s = 0.6;
        let end = Sign { turn_rad_per_s, ..sign(2.0, 0.0, 1.2) };
        let on_arc = |elapsed_s: f64| {
            let way = DVec2::from_angle(turn_rad_per_s * elapsed_s);
            let place_m = DVec2::new(0.0, 7.0) + 2.0 * DVec2::new(way.y, -way.x);
            Sign { time_s: 2.0 + elapsed_s, place_m, way, ..sign(2.0, 0.0, 1.2) }
        };
        for elapsed_s in [0.5, 1.0, 2.0] {
            let there = on_arc(elapsed_s);
            assert!(end.distance_to(&there).unwrap() < 1e-9, "{elapsed_s}");
            assert!(!end.leads_to(&Sign { way: -there.way, ..there }));
        }
        assert!(end.leads_to(&sign(3.0, 1.2, 1.2)));
        let straight = Sign { turn_rad_per_s: 0.0, ..end };
        assert!(!straight.leads_to(&on_arc(2.0)) && straight.leads_to(&sign(3.0, 1.2, 1.2)));
    }

    #[test]
    fn who_stood_still_goes_on_any_way_and_later() {
        let stood = Sign { stands: true, ..sign(2.0, 2.4, 0.1) };
        for (other, number) in [
            (sign(3.0, 2.9, 1.2), 0),
            (sign(61.9, 2.9, 1.2), 0),
            (sign(62.1, 2.9, 1.2), 1),
            (sign(9.0, 1.7, -1.2), 0),
            (sign(9.0, 1.5, -1.2), 1),
            (sign(9.0, 3.3, 1.2), 1),
            (sign(1.9, 2.4, 1.2), 1),
        ] {
            let mut people = Identities::default();
            people.appear(&sign(0.0, 0.0, 1.2));
            people.end(0, stood);
            assert_eq!(people.appear(&other), number, "{other:?}");
        }
    }

    #[test]
    fn the_last_number_is_taken_back_from_what_did_not_walk() {
        let mut people = Identities::default();
        for x in [0.0, 9.0, 18.0] {
            people.appear(&sign(0.0, x, 1.0));
        }
        people.withdraw(1);
        assert_eq!(people.count(), 3, "an earlier number stays");
        people.withdraw(2);
        assert_eq!(people.appear(&sign(0.0, 30.0, 1.0)), 1, "and goes with the later ones");
    }

    #[test]
    fn a_number_stays_with_who_walked_before() {
        let mut people = Identities::default();
        people.appear(&sign(0.0, 0.0, 1.2));
        people.end(0, sign(2.0, 2.4, 1.2));
        assert_eq!(people.appear(&sign(3.0, 3.6, 1.2)), 0);
        people.withdraw(0);
        assert_eq!(people.appear(&sign(4.0, 9.0, 1.2)), 1, "a stranger");
        // Nobody is where a walk ended that was taken back.
        people.end(1, sign(5.0, 10.2, 1.2));
        people.withdraw(1);
        assert_eq!(people.known(&sign(5.1, 10.3, 1.2)), None);
    }

    #[test]
    fn who_walks_on_a_treadmill_stays_the_same_whatever_its_speed() {
        let on_the_spot = |time_s: f64, way: f64| Sign {
            velocity_mps: DVec2::ZERO,
            way: DVec2::new(way, 0.0),
            ..sign(time_s, 0.0, 1.0)
        };
        assert!(on_the_spot(40.0, 1.0).leads_to(&on_the_spot(40.1, 1.0)));
        assert!(!on_the_spot(40.0, 1.0).leads_to(&on_the_spot(40.1, -1.0)));
    }
}
