//! The tracker on people who walk on the spot or along the line of sight.

use super::super::active::Active;
use super::super::approach::Approach;
use super::super::candidate::{Given, course, feet_cut_off};
use super::super::decisions::MOST_APART_S;
use super::super::evidence::Evidence;
use super::super::fit::views::Piece;
use super::super::locate::{Crown, Rows, Sighting, locate_by};
use super::super::options::{approaching_height, start_height};
use super::super::standing::{Standing, last_rectangle};
use super::super::treadmill::Spot;
use super::{TrackError, Tracker, WINDOW_MARGIN_PX, feet, grown};

/// A start looks at so many seconds at most.
const LONGEST_S: f64 = 4.0;

/// Feet show a walk towards the camera after three steps.
const SHORTEST_S: f64 = 1.5;

impl Tracker {
    /// Collects frames of what may walk on the spot or along the line of sight: the largest region while nobody is followed, and
    /// all that a given camera shows to be of a person's size.
    pub(super) fn stand(
        &mut self,
        evidence: &Evidence,
        largest: Option<Sighting>,
        sightings: &[Sighting],
    ) -> Result<(), TrackError> {
        let given = self.options.camera.as_ref();
        let is_further = |sighting: &&Sighting| {
            largest.as_ref() != Some(sighting)
                && given.is_some_and(|camera| self.is_of_a_person(camera, sighting))
        };
        let further = sightings.iter().filter(is_further).copied();
        let mut seen: Vec<Sighting> = largest.into_iter().chain(further).collect();
        for standing in std::mem::take(&mut self.standings) {
            let own = most(seen.iter().map(|sighting| standing.overlap(&sighting.rectangle)));
            let own = own.map(|k| seen.remove(k));
            if let Some(standing) = self.stood(standing, own, evidence)? {
                self.standings.push(standing);
            }
        }
        for sighting in seen {
            let standing = self.stood(Standing::default(), Some(sighting), evidence)?;
            self.standings.extend(standing);
        }
        Ok(())
    }

    /// What stands with the next frame; `None` if it is gone.
    fn stood(
        &mut self,
        standing: Standing,
        sighting: Option<Sighting>,
        evidence: &Evidence,
    ) -> Result<Option<Standing>, TrackError> {
        let Some(window) = standing.window(sighting.as_ref().map(|s| &s.rectangle)) else { return Ok(None) };
        if sighting.is_none() && standing.is_gone(evidence.frame) {
            return Ok(None);
        }
        let window = grown(&window, evidence, WINDOW_MARGIN_PX);
        let edges = self.unowned_edges(evidence, &window)?;
        let crown = sighting.as_ref().filter(|_| !edges.shared);
        let piece =
            |_| Piece::new(evidence.frame, &evidence.grey, window, edges.others.clone()).with_crown(crown);
        let piece = self.options.fit.map(piece);
        let feet = sighting.and_then(|sighting| feet(&sighting, evidence, &self.options));
        Ok(Some(standing.with(sighting, feet, edges, piece)))
    }

    /// Takes the frames of what stood where somebody starts to be followed.
    pub(super) fn standing_of(&mut self, active: &Active) -> Standing {
        let Some(at) = last_rectangle(&active.kept) else { return Standing::default() };
        let own = most(self.standings.iter().map(|standing| standing.overlap(&at)));
        own.map(|k| self.standings.remove(k)).unwrap_or_default()
    }

    /// Starts walks on the spot, or towards the camera or away from it, from time to time when there are enough frames.
    pub(super) fn start_on_the_spot(&mut self, evidence: &Evidence) {
        for standing in std::mem::take(&mut self.standings) {
            let standing = self.started_on_the_spot(standing, evidence);
            self.standings.extend(standing);
        }
    }

    /// Starts a walk on what stands; otherwise what is left of it.
    fn started_on_the_spot(&mut self, standing: Standing, evidence: &Evidence) -> Option<Standing> {
        let (least, every) = (self.options.path_frames, self.options.start_frames);
        let further = standing.kept.len().checked_sub(least);
        if further.is_none_or(|further| !further.is_multiple_of(every)) {
            return Some(standing);
        }
        if standing.lasts_s() > MOST_APART_S * standing.kept.len() as f64 {
            return None;
        }
        let size = [evidence.grey.width() as u32, evidence.grey.height() as u32];
        let begun = self.begun_where_it_stays(standing, size);
        let along_the_sight = |standing| {
            self.begun_with_a_height(standing, |standing, person| {
                self.begun_along_the_sight(standing, size, person)
            })
        };
        match begun.or_else(along_the_sight) {
            Ok(active) if !self.is_of_its_own(&active) => None,
            Ok(mut active) => {
                let at = last_rectangle(&active.kept);
                self.candidates.retain(|candidate| !at.is_some_and(|at| candidate.is_at(&at)));
                match self.gone_on(&active) {
                    Some(joined) => active = joined,
                    None => active.person = self.identified(&active),
                }
                active.started_near = !self.people.is_empty();
                active.known_frame.get_or_insert(evidence.frame);
                self.people.push(active);
                None
            }
            Err(standing) if standing.lasts_s() < LONGEST_S => Some(standing),
            Err(standing) => Some(standing.later(every)),
        }
    }

    fn begun_where_it_stays(&self, standing: Standing, size: [u32; 2]) -> Result<Active, Standing> {
        if self.options.treadmill == Some(false) {
            return Err(standing);
        }
        self.begun_with_a_height(standing, |standing, person| {
            match self.spot(&standing.sightings(), size, person) {
                Some(spot) => spot.begin(standing),
                None => Err(standing),
            }
        })
    }

    /// The walk with the height of somebody who is expected back and is back with it, or of the next person.
    fn begun_with_a_height(
        &self,
        standing: Standing,
        begin: impl Fn(Standing, usize) -> Result<Active, Standing>,
    ) -> Result<Active, Standing> {
        let time_s = standing.kept.first().map_or(0.0, |(_, edges)| edges.time_s);
        let is_back = |&person: &usize| {
            begin(standing.clone(), person).ok().filter(|active| self.is_back(person, active))
        };
        let back = self.of_other_height(time_s).iter().find_map(is_back);
        back.map_or_else(|| begin(standing, self.identities.count()), Ok)
    }

    /// A walk towards the camera or away from it, with the height of this person. Only a calibrated camera shows how far away
    /// feet are.
    fn begun_along_the_sight(
        &self,
        standing: Standing,
        size: [u32; 2],
        person: usize,
    ) -> Result<Active, Standing> {
        let (options, sightings) = (&self.options, standing.sightings());
        let Some(camera) = options.camera.as_ref().filter(|_| options.treadmill != Some(true)) else {
            return Err(standing);
        };
        if feet_cut_off(&sightings, size[1] as usize) || standing.lasts_s() < SHORTEST_S {
            return Err(standing);
        }
        let height = approaching_height(options, self.given_height(person), camera, &sightings);
        match options.walker(height.height_m) {
            Ok(walker) => Approach { camera, height, walker, options }.begin(standing),
            Err(_) => Err(standing),
        }
    }

    /// What a start of a person on the spot needs.
    pub(super) fn spot(&self, sightings: &[Sighting], size: [u32; 2], person: usize) -> Option<Spot<'_>> {
        if feet_cut_off(sightings, size[1] as usize) {
            return None;
        }
        let (options, camera) = (&self.options, self.options.camera.as_ref());
        let height_m = self.given_height(person);
        let height = start_height(options, height_m, camera, sightings);
        let walker = options.walker(height.height_m).ok()?;
        let given = Given { options, camera, tilt: self.tilt, scale_sd: 0.0, height_m, size };
        let crown_m = walker.level_crown_height_m();
        let usual = course(sightings, &given, crown_m, &height).ok();
        // The scale of an assumed camera is that of both rows.
        let by_each_row = camera.map_or_else(Vec::new, |camera| {
            let crown = Crown { height_m: crown_m, sd_m: height.sd_in_camera_m() };
            let ways = [Rows::Soles, Rows::Crown].into_iter();
            ways.filter_map(|rows| locate_by(rows, sightings, camera, &crown).ok()).collect()
        });
        let assumed = usual.as_ref().map(|(assumed, _)| assumed);
        let camera = camera.or(assumed)?.clone();
        let courses = usual.into_iter().map(|(_, course)| course).chain(by_each_row).collect();
        let (tilt, backdrop) = (self.tilt, &self.backdrop);
        Some(Spot { camera, tilt, courses, height, walker, backdrop, options })
    }

    /// What was taken for a walk across the picture begins again if it stays where it is and walks on the spot, or if its
    /// feet go along the line of sight.
    pub(super) fn begun_otherwise(&self, active: Active) -> Active {
        if active.is_on_treadmill || active.frontal.is_some() {
            return active;
        }
        let standing = active.earlier.clone().followed_by(&active.kept, &active.pieces, &active.feet);
        if standing.kept.len() < self.options.path_frames {
            return active;
        }
        let (size, person) = (active.camera.size, active.person);
        let may_stay = self.options.treadmill != Some(false) && !active.moves_on();
        let spot = may_stay.then(|| self.spot(&standing.sightings(), size, person)).flatten();
        let begun = match spot {
            Some(spot) => spot.begin(standing),
            None => Err(standing),
        };
        // Where others reach into the region, the lowest rows are not those of its feet.
        let shared = active.kept.iter().filter(|(_, edges)| edges.shared).count();
        let along_the_sight = |standing| match 4 * shared <= active.kept.len() {
            true => self.begun_along_the_sight(standing, size, person),
            false => Err(standing),
        };
        match begun.or_else(along_the_sight) {
            Ok(begun) => Active { person, known_frame: active.known_frame, ..begun },
            Err(_) => active,
        }
    }
}

/// The place of the largest overlap; `None` if there is none.
fn most(overlaps: impl Iterator<Item = Option<f64>>) -> Option<usize> {
    let known = overlaps.enumerate().filter_map(|(k, overlap)| Some((k, overlap?)));
    known.max_by(|a, b| a.1.total_cmp(&b.1)).map(|(k, _)| k)
}
