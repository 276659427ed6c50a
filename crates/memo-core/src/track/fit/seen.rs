//! What a step saw: samples with and without an edge, and how far the edges are.

use super::edge_search::FoundEdge;
use super::lines::Sample;
use crate::model::body::PART_COUNT;

/// Steps of less grey levels are noise.
pub const LEAST_STEP: f64 = 3.0;

/// Sums over samples.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Seen {
    /// Samples of the outline, and those without an edge; the same of inner lines.
    pub outer: f64,
    pub outer_missed: f64,
    pub inner: f64,
    pub inner_missed: f64,
    /// Distances of the outline's edges, pixels.
    pub distance_px: f64,
    /// Robust cost of all distances.
    pub cost: f64,
    /// The outline of each part, in the order of [`Part::ALL`](crate::model::body::Part::ALL).
    pub parts: [Outline; PART_COUNT],
}

/// Sums over the samples of an outline.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Outline {
    pub samples: f64,
    /// Samples without an edge.
    pub missed: f64,
    /// Distances of the edges, pixels.
    pub distance_px: f64,
}

impl Seen {
    /// Counts a sample with its edge and its part of the cost.
    pub fn count(&mut self, sample: &Sample, edge: &FoundEdge, cost: f64) {
        let missed = f64::from(u8::from(edge.strength < LEAST_STEP));
        if sample.is_outer {
            self.outer += 1.0;
            self.outer_missed += missed;
            self.distance_px += (1.0 - missed) * edge.offset_px.abs();
            let part = &mut self.parts[sample.point.part as usize];
            part.samples += 1.0;
            part.missed += missed;
            part.distance_px += (1.0 - missed) * edge.offset_px.abs();
        } else {
            self.inner += 1.0;
            self.inner_missed += missed;
        }
        self.cost += (1.0 - missed) * cost;
    }

    /// The share of the outline that is missed where the model fits.
    pub const USUALLY_MISSED: f64 = 0.012;

    /// The share of the outline without an edge beyond the usual.
    pub fn off(&self) -> f64 {
        (self.outer_missed / self.outer.max(1.0) - Self::USUALLY_MISSED).max(0.0)
    }

    /// Cost of the outline that is seen, per sample; one without an edge costs as much as one whose edge is far away.
    pub fn mean_cost(&self) -> f64 {
        (self.cost + self.outer_missed) / self.outer.max(1.0)
    }

    /// Adds the sums of another frame.
    pub fn add(&mut self, other: &Self) {
        self.outer += other.outer;
        self.outer_missed += other.outer_missed;
        self.inner += other.inner;
        self.inner_missed += other.inner_missed;
        self.distance_px += other.distance_px;
        self.cost += other.cost;
        for (part, of_part) in self.parts.iter_mut().zip(&other.parts) {
            part.samples += of_part.samples;
            part.missed += of_part.missed;
            part.distance_px += of_part.distance_px;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn who_hides_or_misses_edges_does_not_lower_the_mean_cost() {
        let seen = Seen { outer: 200.0, outer_missed: 20.0, cost: 18.0, ..Seen::default() };
        assert_eq!(seen.mean_cost(), 0.19);
        // Half of the outline behind somebody: half of the costs and half of the samples.
        let hidden = Seen { outer: 100.0, outer_missed: 10.0, cost: 9.0, ..Seen::default() };
        assert_eq!(hidden.mean_cost(), seen.mean_cost());
        let missed = Seen { outer_missed: 60.0, cost: 14.0, ..seen };
        assert!(missed.mean_cost() > seen.mean_cost() && missed.cost < seen.cost);
        assert_eq!(Seen::default().mean_cost(), 0.0);
    }
}
