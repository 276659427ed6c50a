//! The tracker on somebody who walks on the spot, while nobody else is followed.

use super::super::candidate::{COMFORTABLE_MPS, Given, course, feet_cut_off};
use super::super::height::start_height;
use super::super::treadmill::Spot;
use super::*;

impl Tracker {
    /// Collects frames of what may walk on the spot.
    pub(super) fn stand(
        &mut self,
        evidence: &Evidence,
        sighting: Option<Sighting>,
    ) -> Result<(), TrackError> {
        if self.options.treadmill == Some(false) {
            return Ok(());
        }
        let standing = std::mem::take(&mut self.standing);
        let Some(window) = standing.window(sighting.as_ref().map(|s| &s.rectangle)) else { return Ok(()) };
        let window = grown(&window, evidence, WINDOW_MARGIN_PX);
        let edges = self.edges(evidence, &window, self.options.camera.as_ref())?;
        let piece = |_| Piece::new(evidence.frame, &evidence.grey, window, Vec::new());
        self.standing = standing.with(sighting, edges, self.options.fit.map(piece));
        Ok(())
    }

    /// Starts a walk on the spot when there are enough frames, or drops the oldest ones.
    pub(super) fn start_on_the_spot(&mut self, evidence: &Evidence) {
        if !self.people.is_empty() || self.standing.kept.len() < self.options.path_frames {
            return;
        }
        let size = [evidence.grey.width() as u32, evidence.grey.height() as u32];
        let standing = std::mem::take(&mut self.standing);
        match self.spot(&standing.sightings(), size).map(|spot| spot.begin(standing)) {
            Some(Ok(mut active)) => {
                self.candidates.clear();
                active.person = self.identified(&active);
                self.people.push(active);
            }
            Some(Err(standing)) => self.standing = standing.later(self.options.start_frames),
            None => {}
        }
    }

    /// What a start on the spot needs.
    fn spot(&self, sightings: &[Sighting], size: [u32; 2]) -> Option<Spot<'_>> {
        if feet_cut_off(sightings, size[1] as usize) {
            return None;
        }
        let (options, camera) = (&self.options, self.options.camera.as_ref());
        let height_m = options.height_of(self.identities.count());
        let height = start_height(options, height_m, camera, sightings);
        let walker = options.walker(height.height_m, COMFORTABLE_MPS).ok()?;
        let given = Given { options, camera, height_m, size };
        let (camera, course) = course(sightings, &given, walker.level_crown_height_m(), &height).ok()?;
        Some(Spot { camera, course, height, walker, backdrop: &self.backdrop, options })
    }

    /// A walk that was taken for a slow one but stays where it is begins again on the spot.
    pub(super) fn begun_on_the_spot(&mut self, active: Active) -> Active {
        if self.options.treadmill == Some(false) || active.is_on_treadmill || active.moves_on() {
            return active;
        }
        let standing = std::mem::take(&mut self.standing).followed_by(&active.kept, &active.pieces);
        if standing.kept.len() < self.options.path_frames {
            return active;
        }
        let person = active.person;
        match self.spot(&standing.sightings(), active.camera.size).map(|spot| spot.begin(standing)) {
            Some(Ok(on_the_spot)) => Active { person, ..on_the_spot },
            _ => active,
        }
    }
}
