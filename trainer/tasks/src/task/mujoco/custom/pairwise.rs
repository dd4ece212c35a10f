//! Sums whose rounding equals NumPy's.

use std::ops::Add;

/// Sums like NumPy: by eight partial sums from eight values on, in halves beyond 128.
pub(super) fn pairwise<T: Copy + Default + Add<Output = T>>(
    count: usize,
    value: impl Fn(usize) -> T,
) -> T {
    if count == 0 {
        return T::default();
    }
    sum(0, count, &value)
}

fn sum<T: Copy + Add<Output = T>>(start: usize, count: usize, value: &impl Fn(usize) -> T) -> T {
    const LANES: usize = 8;
    const BLOCK: usize = 128;
    let rest = |from: usize, begun: T| (from..start + count).fold(begun, |sum, i| sum + value(i));
    if count < LANES {
        return rest(start + 1, value(start));
    }
    if count > BLOCK {
        let half = count / 2 / LANES * LANES;
        return sum(start, half, value) + sum(start + half, count - half, value);
    }
    let mut lanes: [T; LANES] = std::array::from_fn(|k| value(start + k));
    let whole = count / LANES * LANES;
    for i in (LANES..whole).step_by(LANES) {
        for (k, lane) in lanes.iter_mut().enumerate() {
            *lane = *lane + value(start + i + k);
        }
    }
    let [a, b, c, d, e, f, g, h] = lanes;
    rest(start + whole, ((a + b) + (c + d)) + ((e + f) + (g + h)))
}
