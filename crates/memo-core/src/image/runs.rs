//! Runs of marked pixels, row by row, and their connected areas.

use super::frame::Mask;

/// Adjacent marked pixels in one row.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub struct Run {
    /// Row.
    pub y: usize,
    /// First column.
    pub start: usize,
    /// Column after the last one, more than `start`.
    pub end: usize,
}

/// Which pixels count as neighbours.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Connectivity {
    /// Pixels that share an edge.
    Four,
    /// Pixels that share an edge or a corner.
    Eight,
}

/// The runs of pixels equal to `value`, row by row and left to right.
pub(super) fn runs(mask: &Mask, value: bool) -> Vec<Run> {
    let mut runs = Vec::new();
    for y in 0..mask.height() {
        let row = mask.row(y);
        let mut x = 0;
        while x < row.len() {
            let start = x + distance_to(&row[x..], value);
            x = start + distance_to(&row[start..], !value);
            if start < row.len() {
                runs.push(Run { y, start, end: x });
            }
        }
    }
    runs
}

/// Number of pixels before the first one equal to `value`. Whole blocks without that value are skipped.
fn distance_to(row: &[bool], value: bool) -> usize {
    const BLOCK: usize = 64;
    let skipped =
        row.chunks_exact(BLOCK).take_while(|block| !block.iter().fold(false, |any, &p| any | (p == value)));
    let skipped = skipped.count() * BLOCK;
    row[skipped..].iter().position(|&pixel| pixel == value).map_or(row.len(), |i| skipped + i)
}

/// Groups runs (ordered as by [`runs`]) into connected areas, in the order of their first runs.
pub(super) fn connected_runs(runs: &[Run], connectivity: Connectivity) -> Vec<Vec<Run>> {
    let reach = usize::from(connectivity == Connectivity::Eight);
    let mut parents: Vec<usize> = (0..runs.len()).collect();
    let mut above = 0;
    for (i, run) in runs.iter().enumerate() {
        while runs[above].y + 1 < run.y
            || (runs[above].y + 1 == run.y && runs[above].end + reach <= run.start)
        {
            above += 1;
        }
        let touching = runs[above..i].iter().take_while(|up| up.y < run.y && up.start < run.end + reach);
        for j in above..above + touching.count() {
            join(&mut parents, i, j);
        }
    }
    areas_by_root(runs, &mut parents)
}

fn areas_by_root(runs: &[Run], parents: &mut [usize]) -> Vec<Vec<Run>> {
    let mut areas: Vec<Vec<Run>> = Vec::new();
    let mut area_of_root = vec![usize::MAX; runs.len()];
    for (i, &run) in runs.iter().enumerate() {
        let root = root(parents, i);
        if area_of_root[root] == usize::MAX {
            area_of_root[root] = areas.len();
            areas.push(Vec::new());
        }
        areas[area_of_root[root]].push(run);
    }
    areas
}

fn root(parents: &mut [usize], mut i: usize) -> usize {
    while parents[i] != i {
        parents[i] = parents[parents[i]];
        i = parents[i];
    }
    i
}

fn join(parents: &mut [usize], i: usize, j: usize) {
    let (a, b) = (root(parents, i), root(parents, j));
    parents[a.max(b)] = a.min(b);
}
