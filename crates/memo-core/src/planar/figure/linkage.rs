//! A linkage of moving points: links, chains, and contacts between chains.

use crate::planar::{PlanarEvidence, Plane, Verdict};

/// Method by which the links were found.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Method {
    /// The exact cover with the smallest cost.
    Cover,
    /// A minimum spanning tree over rods, for more points than a cover allows.
    Forest,
}

/// A limb segment: two points at a fixed distance.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Link {
    /// The two points, the lower index first.
    pub points: [usize; 2],
    /// Length, in the unit of the tracks.
    pub length: f64,
    /// Its standard deviation (first order).
    pub length_sd: f64,
    /// Extra cost of the best figure without this link, in the unit of the tracks; infinite if there is none.
    pub margin: f64,
    /// Share of the weight of all figures that contain this link, in [0, 1]; NaN for a forest.
    pub confidence: f64,
}

/// One or two links in one plane.
#[derive(Debug, Clone, PartialEq)]
pub struct Chain {
    /// End and end (2), or end, pivot, end (3). The first is the nearest to the rest of the body.
    pub points: Vec<usize>,
    /// The links, in that order.
    pub links: Vec<Link>,
    /// Plane of the motion, or its mirror.
    pub plane: Plane,
    /// RMS of the residuals, in the unit of the tracks.
    pub residual_rms: f64,
    /// Evidence that its motion is planar.
    pub evidence: PlanarEvidence,
    /// Depth of each point relative to the first, frame by frame in the order of `points`; NaN if not seen. All
    /// signs may be opposite.
    pub depth: Vec<Vec<f64>>,
    /// Excess over the joint limits of the mirror less that of this reflection, degrees; `None` if the reflection
    /// is not determined. See [`interpret_named_figure`](super::interpret_named_figure).
    pub reflection_margin_deg: Option<f64>,
    /// Angle at the pivot frame by frame, radians, π = straight; empty for a rod. The mirror has the same angle.
    pub angle_rad: Vec<f64>,
}

/// Contact of two groups: a pair of points with almost no relative motion.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Contact {
    /// A point of each group.
    pub points: [usize; 2],
    /// Separation of the two points (residual and motion), in the unit of the tracks.
    pub apart: f64,
}

/// The linkage of one window.
#[derive(Debug, Clone, PartialEq)]
pub struct Figure {
    /// Method by which it was found.
    pub method: Method,
    /// Its chains.
    pub chains: Vec<Chain>,
    /// Contacts of chains and single points, best first. Points without contact are not listed.
    pub joints: Vec<Contact>,
    /// Points in no chain.
    pub alone: Vec<usize>,
    /// Cost of the cover in the unit of the tracks; NaN for a forest.
    pub cost: f64,
    /// The size that costs are relative to, in the unit of the tracks.
    pub size: f64,
}

impl Figure {
    /// The links of all chains.
    pub fn links(&self) -> impl Iterator<Item = &Link> {
        self.chains.iter().flat_map(|chain| &chain.links)
    }

    /// Number of chains with a verdict of this kind.
    pub(super) fn count(&self, is_kind: impl Fn(Verdict) -> bool) -> usize {
        self.chains.iter().filter(|chain| is_kind(chain.evidence.verdict)).count()
    }
}
