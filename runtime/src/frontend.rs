//! The reserved front-end section: standardisation of the observation and belief through blackouts.
//!
//! Version 1 of the format fixes its layout and checks it; this build does not execute it, so the
//! verifier refuses policies that carry one.

/// Largest degree of the belief's monomials.
const MAX_DEGREE: u8 = 3;

/// Whether `bytes` have the layout of `docs/format.md` for `inputs` observations and `outputs` actions.
pub(crate) fn well_formed(bytes: &[u8], inputs: u16, outputs: usize) -> bool {
    let Some(([degree, reserved, c0, c1], rest)) = bytes.split_first_chunk::<4>() else {
        return false;
    };
    let columns_len = u16::from_le_bytes([*c0, *c1]);
    let columns = usize::from(columns_len);
    if *reserved != 0 || *degree > MAX_DEGREE || columns_len > inputs {
        return false;
    }
    if (*degree == 0) != (columns == 0) {
        return false;
    }
    let floats = usize::from(inputs) * 2;
    let Some((scaling, rest)) = rest.split_at_checked(floats * 4) else {
        return false;
    };
    let Some((numbers, coefficients)) = rest.split_at_checked(columns * 2) else {
        return false;
    };
    let monomials = monomials(columns + outputs, *degree);
    let (numbers, _) = numbers.as_chunks::<2>();
    let mut previous = None;
    let ascending = numbers.iter().all(|bytes| {
        let column = u16::from_le_bytes(*bytes);
        let higher = previous.is_none_or(|p| column > p) && column < inputs;
        previous = Some(column);
        higher
    });
    let finite = |bytes: &[u8]| {
        let (words, rest) = bytes.as_chunks::<4>();
        rest.is_empty() && words.iter().all(|w| f32::from_le_bytes(*w).is_finite())
    };
    ascending
        && coefficients.len() as u64 == monomials.saturating_mul(4 * columns as u64)
        && finite(scaling)
        && finite(coefficients)
}

/// Number of monomials up to `degree` in `variables` variables, the constant included: C(v + d, d).
fn monomials(variables: usize, degree: u8) -> u64 {
    let v = variables as u64;
    (1..=u64::from(degree)).fold(1, |count, k| count * (v + k) / k)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn monomials_are_counted_with_the_constant() {
        assert_eq!(monomials(3, 1), 4);
        assert_eq!(monomials(2, 2), 6);
        assert_eq!(monomials(7, 3), 120);
    }

    #[test]
    fn the_layout_is_checked() {
        let mut standardise = [0u8; 4 + 2 * 2 * 4];
        assert!(well_formed(&standardise, 2, 1));
        assert!(!well_formed(&standardise, 3, 1));
        standardise[7] = 0x7f;
        standardise[6] = 0x80;
        assert!(!well_formed(&standardise, 2, 1), "an infinite mean");
        // Degree 1, one column of two, one output: 3 monomials.
        let mut belief = [0u8; 4 + 16 + 2 + 12];
        (belief[0], belief[2], belief[20]) = (1, 1, 1);
        assert!(well_formed(&belief, 2, 1));
        belief[20] = 2;
        assert!(!well_formed(&belief, 2, 1), "no such column");
        assert!(!well_formed(&[], 0, 0));
    }
}
