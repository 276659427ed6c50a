//! The left side of Rohr 1994, eq. (1): the norm of the second-order fit to the difference of two frames in a
//! 5x5 window.
//!
//! X X* of eq. (1) projects the 25 differences d onto six polynomials that are separable and orthogonal over
//! the window. With the taps 1: (1,1,1,1,1), x: (-2,-1,0,1,2), x^2 - 2: (2,-1,-2,-1,2) of squared length 5,
//! 10, 14, and c_ij the sum of d weighted by the i-th tap along x and the j-th along y,
//!
//! ```text
//! 25 N^2  = c00^2/25 + (c10^2 + c01^2)/50 + c11^2/100 + (c20^2 + c02^2)/70
//! 17500 N^2 = 7 (4 c00^2 + 2 (c10^2 + c01^2) + c11^2) + 10 (c20^2 + c02^2)
//! ```
//!
//! which is exact in integers: |c_ij| <= 10200 and 2 |c00| <= 12750 fit 16 bits, 17500 N^2 <= 17500 * 255^2
//! fits 32.
//!
//! The sums along y are shared by the five windows that contain a column. On processors with AVX2 the rest is
//! computed with AVX2 instructions: one `vpmaddwd` squares and adds two sums, for which compilers emit four
//! instructions.

use super::frame::{Frame, Image};

/// Side of the fit window, pixels.
pub(super) const WINDOW: usize = 5;
/// Distance of the first window centre from the border of the frame, pixels.
pub(super) const BORDER: usize = WINDOW / 2;
/// The integers are this multiple of N^2.
pub(super) const NORM_SCALE: f64 = 17500.0;
/// Windows computed together: the 16-bit lanes of an AVX2 register.
const LANES: usize = 16;

/// Writes `value(17500 N^2)` of every window to its centre in `out`. The three images have the same size.
pub(super) fn for_each_window<T: Copy>(a: &Frame, b: &Frame, out: &mut Image<T>, value: impl Fn(i32) -> T) {
    let (a, b) = (*a, *b);
    #[cfg(target_arch = "x86_64")]
    if let Some(simd) = pulp::x86::V3::try_new() {
        return simd.vectorize(NormRows { a, b, out, value, fit: avx2::Avx2Fit(simd) });
    }
    pulp::Arch::new().dispatch(NormRows { a, b, out, value, fit: PortableFit });
}

/// 17500 N^2 of the window centred on one pixel, which is at least [`BORDER`] from the border of the frame.
pub(super) fn window_norm(a: &Frame, b: &Frame, x: usize, y: usize) -> i32 {
    let row = |j: usize| {
        let [a, b] = [a, b].map(|frame| &frame.row(y + j - BORDER)[x - BORDER..][..WINDOW]);
        std::array::from_fn(|i| i16::from(a[i]) - i16::from(b[i]))
    };
    let rows: [[i16; WINDOW]; WINDOW] = std::array::from_fn(row);
    let columns: [[i16; 3]; WINDOW] = std::array::from_fn(|i| taps(rows.map(|row| row[i])));
    scaled_norm_sq(std::array::from_fn(|order| columns.map(|sums| sums[order])))
}

/// The three tap sums along y of every column, padded to whole blocks of windows.
type ColumnSums = [Vec<i16>; 3];

/// Computes the norms of a block of windows from the tap sums along y.
trait BlockFit: Copy {
    /// 17500 N^2 of the windows whose first columns are `start..start + LANES`.
    fn norms(self, columns: &ColumnSums, start: usize) -> [i32; LANES];
}

/// All windows of two frames in one pass; it keeps five rows of differences and their tap sums along y.
struct NormRows<'a, T, F, K> {
    a: Frame<'a>,
    b: Frame<'a>,
    out: &'a mut Image<T>,
    value: F,
    fit: K,
}

impl<T: Copy, F: Fn(i32) -> T, K: BlockFit> pulp::NullaryFnOnce for NormRows<'_, T, F, K> {
    type Output = ();

    #[inline(always)]
    fn call(self) {
        let (width, height) = (self.a.width(), self.a.height());
        if width < WINDOW || height < WINDOW {
            return;
        }
        let blocks = (width - WINDOW + 1).div_ceil(LANES);
        let padded = blocks * LANES + WINDOW - 1;
        let mut differences: [Vec<i16>; WINDOW] = std::array::from_fn(|_| vec![0; padded]);
        let mut columns: ColumnSums = std::array::from_fn(|_| vec![0; padded]);
        let mut norms = vec![[0i32; LANES]; blocks];
        for y in 0..height {
            difference_row(self.a.row(y), self.b.row(y), &mut differences[y % WINDOW]);
            if y + 1 >= WINDOW {
                let window = std::array::from_fn(|j| differences[(y + 1 + j) % WINDOW].as_slice());
                column_sums(window, &mut columns);
                for (i, block) in norms.iter_mut().enumerate() {
                    *block = self.fit.norms(&columns, i * LANES);
                }
                let centres = &mut self.out.row_mut(y - BORDER)[BORDER..width - BORDER];
                for (centre, &norm) in centres.iter_mut().zip(norms.as_flattened()) {
                    *centre = (self.value)(norm);
                }
            }
        }
    }
}

#[inline(always)]
fn difference_row(a: &[u8], b: &[u8], out: &mut [i16]) {
    for ((d, &a), &b) in out.iter_mut().zip(a).zip(b) {
        *d = i16::from(a) - i16::from(b);
    }
}

/// The three tap sums along y of five rows, from top to bottom.
#[inline(always)]
fn column_sums(rows: [&[i16]; WINDOW], columns: &mut ColumnSums) {
    let width = columns[0].len();
    let rows = rows.map(|row| &row[..width]);
    let [constant, slope, curvature] = columns.each_mut().map(|column| &mut column[..width]);
    for x in 0..width {
        [constant[x], slope[x], curvature[x]] = taps(rows.map(|row| row[x]));
    }
}

/// The block fit in plain Rust.
#[derive(Clone, Copy)]
struct PortableFit;

impl BlockFit for PortableFit {
    #[inline(always)]
    fn norms(self, columns: &ColumnSums, start: usize) -> [i32; LANES] {
        let sums = columns.each_ref().map(|column| &column[start..start + LANES + WINDOW - 1]);
        let mut norms = [0; LANES];
        for i in 0..LANES {
            norms[i] = scaled_norm_sq(sums.map(|s| [s[i], s[i + 1], s[i + 2], s[i + 3], s[i + 4]]));
        }
        norms
    }
}

/// The sums of five values weighted by (1,1,1,1,1), (-2,-1,0,1,2) and (2,-1,-2,-1,2).
#[inline(always)]
fn taps([p, q, r, s, t]: [i16; WINDOW]) -> [i16; 3] {
    let (outer, inner) = (p + t, q + s);
    [outer + inner + r, 2 * (t - p) + (s - q), 2 * (outer - r) - inner]
}

/// 17500 N^2 of one window from the tap sums along y of its five columns.
#[inline(always)]
fn scaled_norm_sq(columns: [[i16; WINDOW]; 3]) -> i32 {
    let [c00, c10, c20] = taps(columns[0]);
    let [c01, c11, _] = taps(columns[1]);
    let [c02, _, _] = taps(columns[2]);
    let square = |c: i16| i32::from(c) * i32::from(c);
    7 * (4 * square(c00) + 2 * (square(c10) + square(c01)) + square(c11)) + 10 * (square(c20) + square(c02))
}

/// The block fit in AVX2 instructions, through pulp's safe wrappers. It uses no closures, because closures
/// would not be compiled for AVX2.
#[cfg(target_arch = "x86_64")]
mod avx2 {
    use super::{BlockFit, ColumnSums, LANES, WINDOW};
    use pulp::x86::V3;
    use std::arch::x86_64::__m256i;

    #[derive(Clone, Copy)]
    pub(super) struct Avx2Fit(pub(super) V3);

    impl BlockFit for Avx2Fit {
        #[inline(always)]
        fn norms(self, [constant, slope, curvature]: &ColumnSums, start: usize) -> [i32; LANES] {
            let [c00, c10, c20] = self.taps(five_columns(constant, start));
            let [c01, c11, _] = self.taps(five_columns(slope, start));
            let [c02, _, _] = self.taps(five_columns(curvature, start));
            let [even, even_high] = self.square_sums(self.twice(c00), c11);
            let [odd, odd_high] = self.square_sums(c10, c01);
            let [second, second_high] = self.square_sums(c20, c02);
            let low = self.weigh(even, odd, second);
            let high = self.weigh(even_high, odd_high, second_high);
            // Both 128-bit lanes have been halved.
            let first = self.0.avx2._mm256_permute2x128_si256::<0x20>(low, high);
            let last = self.0.avx2._mm256_permute2x128_si256::<0x31>(low, high);
            pulp::cast([first, last])
        }
    }

    /// A block of tap sums along y at each of the five columns of the window.
    #[inline(always)]
    fn five_columns(sums: &[i16], start: usize) -> [__m256i; WINDOW] {
        let sums = &sums[start..start + LANES + WINDOW - 1];
        [block(sums, 0), block(sums, 1), block(sums, 2), block(sums, 3), block(sums, 4)]
    }

    #[inline(always)]
    fn block(sums: &[i16], from: usize) -> __m256i {
        let mut block = [0i16; LANES];
        block.copy_from_slice(&sums[from..from + LANES]);
        pulp::cast(block)
    }

    impl Avx2Fit {
        #[inline(always)]
        fn add(self, a: __m256i, b: __m256i) -> __m256i {
            self.0.avx2._mm256_add_epi16(a, b)
        }

        #[inline(always)]
        fn sub(self, a: __m256i, b: __m256i) -> __m256i {
            self.0.avx2._mm256_sub_epi16(a, b)
        }

        #[inline(always)]
        fn twice(self, a: __m256i) -> __m256i {
            self.add(a, a)
        }

        /// As [`super::taps`]; unused sums cost nothing.
        #[inline(always)]
        fn taps(self, [p, q, r, s, t]: [__m256i; WINDOW]) -> [__m256i; 3] {
            let (outer, inner) = (self.add(p, t), self.add(q, s));
            [
                self.add(self.add(outer, inner), r),
                self.add(self.twice(self.sub(t, p)), self.sub(s, q)),
                self.sub(self.twice(self.sub(outer, r)), inner),
            ]
        }

        /// a^2 + b^2 of lanes 0-3 and 8-11, and of lanes 4-7 and 12-15.
        #[inline(always)]
        fn square_sums(self, a: __m256i, b: __m256i) -> [__m256i; 2] {
            let avx2 = self.0.avx2;
            let (low, high) = (avx2._mm256_unpacklo_epi16(a, b), avx2._mm256_unpackhi_epi16(a, b));
            [avx2._mm256_madd_epi16(low, low), avx2._mm256_madd_epi16(high, high)]
        }

        /// 7 (even + 2 odd) + 10 second = 8 (even + 2 odd + second) - (even + 2 odd) + 2 second.
        #[inline(always)]
        fn weigh(self, even: __m256i, odd: __m256i, second: __m256i) -> __m256i {
            let avx2 = self.0.avx2;
            let first = avx2._mm256_add_epi32(even, avx2._mm256_add_epi32(odd, odd));
            let eightfold = avx2._mm256_slli_epi32::<3>(avx2._mm256_add_epi32(first, second));
            let sevenfold = avx2._mm256_sub_epi32(eightfold, first);
            avx2._mm256_add_epi32(sevenfold, avx2._mm256_add_epi32(second, second))
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn differences() -> impl Strategy<Value = Vec<i16>> {
        let one = prop_oneof![4 => -255i16..=255, 1 => Just(255i16), 1 => Just(-255i16)];
        proptest::collection::vec(one, WINDOW * (LANES + WINDOW - 1))
    }

    proptest! {
        #[test]
        fn every_instruction_set_gives_the_same_norms(differences in differences()) {
            let width = LANES + WINDOW - 1;
            let mut columns: ColumnSums = std::array::from_fn(|_| vec![0; width]);
            column_sums(std::array::from_fn(|j| &differences[j * width..][..width]), &mut columns);
            let portable = PortableFit.norms(&columns, 0);
            for (i, norm) in portable.into_iter().enumerate() {
                let window = |order: usize| std::array::from_fn(|k| columns[order][i + k]);
                prop_assert_eq!(norm, scaled_norm_sq(std::array::from_fn(window)));
            }
            #[cfg(target_arch = "x86_64")]
            if let Some(simd) = pulp::x86::V3::try_new() {
                prop_assert_eq!(avx2::Avx2Fit(simd).norms(&columns, 0), portable);
            }
        }
    }
}
