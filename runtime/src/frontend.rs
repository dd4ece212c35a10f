//! What a policy perceives before its programs run: standardised observations, and belief where they are blank.
//!
//! `docs/semantics.md` defines it, `docs/format.md` its section of a blob. The perceived observation is the window
//! itself, which outlives a decision; a belief has some words of its own behind the outputs.

use crate::blob::{ActionKind, Header};
#[cfg(feature = "front-end")]
use crate::math;

/// Largest degree of the belief's monomials.
pub const MAX_DEGREE: u8 = 3;

/// What is perceived when the observation is blank.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[repr(u8)]
pub enum Blank {
    /// Zeros: the means of what was seen.
    Zero = 0,
    /// What was perceived last.
    Hold = 1,
    /// What a learned model makes of it and of the last action.
    Believe = 2,
}

/// The front end of a policy, borrowed from its bytes.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FrontEnd<'a> {
    /// What happens to blank observations.
    pub blank: Blank,
    /// Degree of the model's monomials, 1 to [`MAX_DEGREE`]; 0 without a model.
    pub degree: u8,
    /// First state word of the belief's own: its variables, then a sum for each column; 0 without a model.
    pub start: u16,
    /// What is subtracted from each element of the observation, f32.
    pub means: &'a [[u8; 4]],
    /// What the difference is multiplied by, f32.
    pub scales: &'a [[u8; 4]],
    /// The columns that the model describes, ascending; the others keep their last value.
    pub columns: &'a [[u8; 2]],
    /// For each monomial a coefficient for each column, f32.
    pub coefficients: &'a [[u8; 4]],
}

/// Number of monomials up to `degree` in `variables` variables, the constant included: C(v + d, d).
///
/// [`u64::MAX`] stands for more than any policy has room for. Without 64-bit divisions, which take flash.
#[must_use]
pub fn monomials(variables: usize, degree: u8) -> u64 {
    let v = variables as u64;
    let pairs = (v + 1) * (v + 2) / 2;
    match degree {
        0 => 1,
        1 => v + 1,
        2 => pairs,
        3 if v < 1000 => u64::from(pairs as u32 * (v as u32 + 3) / 3),
        _ => u64::MAX,
    }
}

/// Number of variables by which a model knows the last action: the outputs, or one for all discrete actions.
#[must_use]
pub const fn action_variables(header: &Header) -> usize {
    match header.action_kind {
        ActionKind::Discrete => 1,
        ActionKind::Continuous | ActionKind::Each => header.outputs(),
    }
}

impl<'a> FrontEnd<'a> {
    /// Reads the section of a blob; `None` if its lengths are wrong, if a number in it is out of range, or if it begins elsewhere
    /// in the state than behind the outputs.
    #[must_use]
    pub fn read(bytes: &'a [u8], header: &Header) -> Option<Self> {
        let front_end = Self::view(bytes, header)?;
        let finite = |words: &[[u8; 4]]| words.iter().all(|w| f32::from_le_bytes(*w).is_finite());
        let mut previous = None;
        let mut ascending = front_end.columns.iter().all(|bytes| {
            let column = u16::from_le_bytes(*bytes);
            let higher = previous.is_none_or(|p| column > p) && column < header.observation_len;
            previous = Some(column);
            higher
        });
        let believes = front_end.blank == Blank::Believe;
        ascending &= believes != front_end.columns.is_empty();
        let degrees = if believes { 1..=MAX_DEGREE } else { 0..=0 };
        let variables = front_end.columns.len() + action_variables(header);
        let needed =
            monomials(variables, front_end.degree).saturating_mul(front_end.columns.len() as u64);
        let behind_outputs = usize::from(header.window) + header.outputs();
        let sound = ascending
            && degrees.contains(&front_end.degree)
            && front_end.coefficients.len() as u64 == needed
            && usize::from(front_end.start) == if believes { behind_outputs } else { 0 }
            && finite(front_end.means)
            && finite(front_end.scales)
            && finite(front_end.coefficients);
        sound.then_some(front_end)
    }

    /// The parts of the section, by their lengths alone.
    #[inline]
    pub(crate) fn view(bytes: &'a [u8], header: &Header) -> Option<Self> {
        let ([kind, degree, c0, c1, s0, s1, r0, r1], rest) = bytes.split_first_chunk::<8>()?;
        let blank = match kind {
            0 => Blank::Zero,
            1 => Blank::Hold,
            2 => Blank::Believe,
            _ => return None,
        };
        if [*r0, *r1] != [0, 0] {
            return None;
        }
        let inputs = usize::from(header.observation_len) * 4;
        let columns = usize::from(u16::from_le_bytes([*c0, *c1])) * 2;
        let (means, rest) = rest.split_at_checked(inputs)?;
        let (scales, rest) = rest.split_at_checked(inputs)?;
        let (columns, coefficients) = rest.split_at_checked(columns)?;
        let (coefficients, []) = coefficients.as_chunks() else {
            return None;
        };
        Some(FrontEnd {
            blank,
            degree: *degree,
            start: u16::from_le_bytes([*s0, *s1]),
            means: means.as_chunks().0,
            scales: scales.as_chunks().0,
            columns: columns.as_chunks().0,
            coefficients,
        })
    }

    /// Hands out the section as stored, part by part.
    pub fn write(&self, mut put: impl FnMut(&[u8])) {
        put(&[self.blank as u8, self.degree]);
        put(&(self.columns.len() as u16).to_le_bytes());
        put(&self.start.to_le_bytes());
        put(&[0, 0]);
        put(self.means.as_flattened());
        put(self.scales.as_flattened());
        put(self.columns.as_flattened());
        put(self.coefficients.as_flattened());
    }

    /// State words that it needs beside window and outputs: for a belief its variables and a sum for each column.
    #[must_use]
    pub fn words(&self, header: &Header) -> usize {
        match self.blank {
            Blank::Zero | Blank::Hold => 0,
            Blank::Believe => 2 * self.columns.len() + action_variables(header),
        }
    }

    /// Instructions that an observation counts as: a multiplication for each element.
    #[must_use]
    pub fn visible_instructions(&self) -> u32 {
        self.means.len() as u32
    }

    /// Instructions that a blank observation counts as: a multiplication for each coefficient, and one for each
    /// monomial of more than one factor.
    #[must_use]
    pub fn blank_instructions(&self, header: &Header) -> u32 {
        let variables = self.columns.len() + action_variables(header);
        let products = monomials(variables, self.degree).saturating_sub(1 + variables as u64);
        match self.blank {
            Blank::Zero | Blank::Hold => 0,
            Blank::Believe => (self.coefficients.len() as u32).saturating_add(products as u32),
        }
    }

    /// Instructions of the dearer case.
    pub(crate) fn instructions(&self, header: &Header) -> u32 {
        self.visible_instructions()
            .max(self.blank_instructions(header))
    }

    /// Weighted operations of the dearer case: of each element seen a difference, a product and two comparisons; of a
    /// belief the products, a sum for each coefficient, and of each column a sum and two comparisons.
    pub(crate) fn weighted_operations(&self, header: &Header) -> u64 {
        let visible = 4 * self.means.len() as u64;
        let blank = u64::from(self.blank_instructions(header))
            + self.coefficients.len() as u64
            + 3 * self.columns.len() as u64;
        visible.max(blank)
    }
}

/// Puts what is perceived of an observation in the place of what was, and returns the instructions that it counts as.
///
/// `perceived` has the observation's length, `rest` are the state words behind the window.
#[cfg(feature = "front-end")]
#[inline(never)]
pub(crate) fn perceive(
    front_end: &FrontEnd<'_>,
    header: &Header,
    perceived: &mut [f32],
    rest: &mut [f32],
    observation: &[f32],
) -> u32 {
    if !math::is_blank(observation) {
        let scaling = front_end.means.iter().zip(front_end.scales);
        for ((x, o), (mean, scale)) in perceived.iter_mut().zip(observation).zip(scaling) {
            *x = math::standardise(*o, f32::from_le_bytes(*mean), f32::from_le_bytes(*scale));
        }
        return front_end.visible_instructions();
    }
    match front_end.blank {
        Blank::Zero => perceived.fill(0.0),
        Blank::Hold => {}
        Blank::Believe => believe(front_end, header, perceived, rest),
    }
    front_end.blank_instructions(header)
}

/// Lets the model fill in the believed columns.
#[cfg(feature = "front-end")]
fn believe(front_end: &FrontEnd<'_>, header: &Header, perceived: &mut [f32], rest: &mut [f32]) {
    let variables_len = front_end.columns.len() + action_variables(header);
    let own = rest.get_mut(header.outputs()..).unwrap_or_default();
    let Some((variables, sums)) = own.split_at_mut_checked(variables_len) else {
        return;
    };
    let sums = sums.get_mut(..front_end.columns.len()).unwrap_or_default();
    let column = |bytes: &[u8; 2]| usize::from(u16::from_le_bytes(*bytes));
    for (variable, number) in variables.iter_mut().zip(front_end.columns) {
        *variable = perceived.get(column(number)).copied().unwrap_or(0.0);
    }
    math::changes(sums, variables, front_end.degree, front_end.coefficients);
    for (number, change) in front_end.columns.iter().zip(sums) {
        if let Some(x) = perceived.get_mut(column(number)) {
            *x = math::believe(*x, *change);
        }
        // A sum may have overflowed; no state word is left so.
        *change = 0.0;
    }
}

/// Tells a belief the action that was decided; `rest` are the state words behind the window.
#[cfg(feature = "front-end")]
pub(crate) fn remember(front_end: &FrontEnd<'_>, header: &Header, rest: &mut [f32], action: u16) {
    if front_end.blank != Blank::Believe {
        return;
    }
    let Some((outputs, own)) = rest.split_at_mut_checked(header.outputs()) else {
        return;
    };
    let places = own.get_mut(front_end.columns.len()..).unwrap_or_default();
    match header.action_kind {
        ActionKind::Discrete => {
            if let Some(place) = places.first_mut() {
                *place = math::centred(action, header.actions);
            }
        }
        ActionKind::Continuous | ActionKind::Each => {
            for (place, x) in places.iter_mut().zip(outputs) {
                *place = *x;
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn monomials_are_counted_with_the_constant() {
        assert_eq!(monomials(3, 1), 4);
        assert_eq!(monomials(2, 2), 6);
        assert_eq!(monomials(7, 3), 120);
        assert_eq!(monomials(999, 3), 167_167_000);
    }
}
