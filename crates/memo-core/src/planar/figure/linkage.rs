//! A linkage found in moving points: links, chains, and how chains sit on each other.

use crate::planar::{Evidence, Plane, Verdict};

/// How the links were found.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Method {
    /// The least costly exact cover.
    Cover,
    /// A minimum spanning tree over rods: too many points for a cover.
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
    /// By how much the best figure without this link costs more, in the unit of the tracks; infinite if there
    /// is none.
    pub margin: f64,
    /// Share of the weight of all figures that have this link, in [0, 1]; NaN for a forest.
    pub confidence: f64,
}

/// One or two links in one plane.
#[derive(Debug, Clone, PartialEq)]
pub struct Chain {
    /// End and end (2), or end, pivot, end (3). The first is nearest to the rest of the body.
    pub points: Vec<usize>,
    /// The links, in that order.
    pub links: Vec<Link>,
    /// Plane of the motion, or its mirror.
    pub plane: Plane,
    /// RMS of the residuals, in the unit of the tracks.
    pub residual_rms: f64,
    /// Whether its motion is evidence of a plane.
    pub evidence: Evidence,
    /// Depth of each point against the first, frame by frame in the order of `points`; NaN where unseen.
    /// Or all with the other sign.
    pub depth: Vec<Vec<f64>>,
    /// By how many degrees its joints keep their ranges better than those of its mirror; `None` where the
    /// reflection is open. See [`interpret_named_figure`](super::interpret_named_figure).
    pub reflection_margin_deg: Option<f64>,
    /// Angle at the pivot frame by frame, radians, π = straight; empty for a rod. The mirror has the same.
    pub angle_rad: Vec<f64>,
}

/// Where two groups sit on each other: a pair of points that hardly moves apart.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Contact {
    /// A point of each group.
    pub points: [usize; 2],
    /// What sets them apart (residual and motion), in the unit of the tracks.
    pub apart: f64,
}

/// A linkage found in one window.
#[derive(Debug, Clone, PartialEq)]
pub struct Figure {
    /// How it was found.
    pub method: Method,
    /// Its chains.
    pub chains: Vec<Chain>,
    /// How chains and single points sit on each other, best first; points of no joint stand free.
    pub joints: Vec<Contact>,
    /// Points in no chain.
    pub alone: Vec<usize>,
    /// Cost of the cover in the unit of the tracks; NaN for a forest.
    pub cost: f64,
    /// The size that costs are relative to, in the unit of the tracks.
    pub size: f64,
}

impl Figure {
    /// All links.
    pub fn links(&self) -> impl Iterator<Item = &Link> {
        self.chains.iter().flat_map(|chain| &chain.links)
    }

    /// Number of chains with a verdict of this kind.
    pub(super) fn count(&self, is_kind: impl Fn(Verdict) -> bool) -> usize {
        self.chains.iter().filter(|chain| is_kind(chain.evidence.verdict)).count()
    }
}
