//! The median.

/// The middle value, or the mean of the two middle values for an even number of values; `None` without
/// values.
///
/// The values are reordered. NaN counts as the largest.
pub(crate) fn median(values: &mut [f64]) -> Option<f64> {
    let count = values.len();
    if count == 0 {
        return None;
    }
    let (below, &mut middle, _) = values.select_nth_unstable_by(count / 2, f64::total_cmp);
    if count % 2 == 1 {
        return Some(middle);
    }
    let lower = below.iter().copied().max_by(f64::total_cmp)?;
    Some(0.5 * (lower + middle))
}

#[cfg(test)]
mod tests {
    use super::median;
    use proptest::prelude::*;

    #[test]
    fn of_an_even_number_it_is_halfway_between_the_two_in_the_middle() {
        assert_eq!(median(&mut []), None);
        assert_eq!(median(&mut [3.0]), Some(3.0));
        assert_eq!(median(&mut [4.0, 1.0]), Some(2.5));
        assert_eq!(median(&mut [9.0, 1.0, 2.0]), Some(2.0));
        assert_eq!(median(&mut [1.0, 3.0, 1.2, 1.1]), Some(1.15));
        assert_eq!(median(&mut [1.0, f64::NAN, 2.0]), Some(2.0));
    }

    proptest! {
        #[test]
        fn it_is_that_of_the_sorted_values(mut values in prop::collection::vec(-1e3f64..1e3, 1..40)) {
            let mut sorted = values.clone();
            sorted.sort_by(f64::total_cmp);
            let n = sorted.len();
            prop_assert_eq!(median(&mut values), Some(0.5 * (sorted[(n - 1) / 2] + sorted[n / 2])));
        }
    }
}
