//! The front end of a policy: it standardises observations, and fills in what is missing, before the programs run.
//!
//! An element that is not finite is missing. In policies of versions 1 and 2 it counts as zero, and an observation of zeros
//! is blank: all of it is missing. `docs/semantics.md` defines the computation, `docs/format.md` the section of a blob. The standardised observation is the start of the window, which outlives a
//! decision. A model has state words of its own, behind the outputs.

use crate::blob::Header;
#[cfg(feature = "front-end")]
use crate::math;
#[cfg(feature = "front-end")]
use crate::trace::Observer;

/// Largest degree of the model's monomials.
pub const MAX_DEGREE: u8 = 3;

/// What the programs see in place of what is missing.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[repr(u8)]
#[non_exhaustive]
pub enum Fallback {
    /// Zeros: in standardised units, the means of what was observed in training.
    Zero = 0,
    /// What was perceived last.
    Hold = 1,
    /// What was perceived last plus the change that a learned model predicts from it and the last action.
    Model = 2,
}

impl Fallback {
    /// The name used in reports.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Zero => "zero",
            Self::Hold => "hold",
            Self::Model => "believe",
        }
    }
}

/// The front end of a policy, borrowed from its bytes. All numbers are little-endian.
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub struct FrontEnd<'a> {
    /// What replaces a missing element.
    pub fallback: Fallback,
    /// Degree of the model's monomials, 1 to [`MAX_DEGREE`]; 0 without a model.
    pub degree: u8,
    /// First of the model's state words: its variables, then a sum for each column. 0 without a model.
    pub start: u16,
    /// For each element of the observation, the mean that is subtracted from it (f32, in the element's unit).
    pub means: &'a [[u8; 4]],
    /// For each element of the observation, the factor of the difference (f32, the inverse of the element's unit).
    pub scales: &'a [[u8; 4]],
    /// The elements of the observation that the model predicts, ascending. The others keep their last value.
    pub columns: &'a [[u8; 2]],
    /// For each monomial one coefficient for each column (f32, in standardised units).
    pub coefficients: &'a [[u8; 4]],
}

/// Number of monomials up to `degree` in `variables` variables, the constant included: C(v + d, d).
///
/// The result is [`u64::MAX`] where the number is larger than any policy has room for.
#[must_use]
pub fn monomials(variables: usize, degree: u8) -> u64 {
    // This avoids 64-bit divisions, which take a lot of flash.
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

/// Number of variables through which a model sees the last action: one for each output, or one in all if actions are
/// discrete.
#[must_use]
pub const fn action_variables(header: &Header) -> usize {
    match header.outputs() {
        0 => 1,
        outputs => outputs,
    }
}

impl<'a> FrontEnd<'a> {
    /// A front end without a model. `means` and `scales` have one number for each element of the observation.
    #[must_use]
    pub const fn new(fallback: Fallback, means: &'a [[u8; 4]], scales: &'a [[u8; 4]]) -> Self {
        FrontEnd {
            fallback,
            degree: 0,
            start: 0,
            means,
            scales,
            columns: &[],
            coefficients: &[],
        }
    }

    /// Reads the section of a blob.
    ///
    /// `None` if a length is wrong, if a number is out of range or not finite, or if the model's state words do not begin
    /// directly behind the outputs.
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
        let has_model = front_end.fallback == Fallback::Model;
        ascending &= has_model != front_end.columns.is_empty();
        let degrees = if has_model { 1..=MAX_DEGREE } else { 0..=0 };
        let variables = front_end.columns.len() + action_variables(header);
        let needed =
            monomials(variables, front_end.degree).saturating_mul(front_end.columns.len() as u64);
        let behind_outputs = usize::from(header.window) + header.outputs();
        let sound = ascending
            && degrees.contains(&front_end.degree)
            && front_end.coefficients.len() as u64 == needed
            && usize::from(front_end.start) == if has_model { behind_outputs } else { 0 }
            && finite(front_end.means)
            && finite(front_end.scales)
            && finite(front_end.coefficients);
        sound.then_some(front_end)
    }

    /// Splits the section into its parts. Checks the lengths, not the numbers.
    #[inline]
    pub(crate) fn view(bytes: &'a [u8], header: &Header) -> Option<Self> {
        let ([kind, degree, c0, c1, s0, s1, r0, r1], rest) = bytes.split_first_chunk::<8>()?;
        let fallback = match kind {
            0 => Fallback::Zero,
            1 => Fallback::Hold,
            2 => Fallback::Model,
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
            fallback,
            degree: *degree,
            start: u16::from_le_bytes([*s0, *s1]),
            means: means.as_chunks().0,
            scales: scales.as_chunks().0,
            columns: columns.as_chunks().0,
            coefficients,
        })
    }

    /// Passes the bytes of the section to `put`, part by part.
    pub fn write(&self, mut put: impl FnMut(&[u8])) {
        put(&[self.fallback as u8, self.degree]);
        put(&(self.columns.len() as u16).to_le_bytes());
        put(&self.start.to_le_bytes());
        put(&[0, 0]);
        put(self.means.as_flattened());
        put(self.scales.as_flattened());
        put(self.columns.as_flattened());
        put(self.coefficients.as_flattened());
    }

    /// State words that the front end needs besides window and outputs: the model's variables and a sum for each column.
    #[must_use]
    pub fn words(&self, header: &Header) -> usize {
        match self.fallback {
            Fallback::Zero | Fallback::Hold => 0,
            Fallback::Model => 2 * self.columns.len() + action_variables(header),
        }
    }

    /// Instructions that an observation counts as if nothing of it is missing: one multiplication for each element.
    #[must_use]
    pub fn visible_instructions(&self) -> u32 {
        self.means.len() as u32
    }

    /// Instructions that the model counts as: one multiplication for each coefficient, and one for each monomial of two or
    /// more factors. 0 without a model.
    #[must_use]
    pub fn model_instructions(&self, header: &Header) -> u32 {
        let variables = self.columns.len() + action_variables(header);
        let products = monomials(variables, self.degree).saturating_sub(1 + variables as u64);
        match self.fallback {
            Fallback::Zero | Fallback::Hold => 0,
            Fallback::Model => (self.coefficients.len() as u32).saturating_add(products as u32),
        }
    }

    /// Instructions of the most expensive case.
    ///
    /// From version 3 on, the model may run for one element while all others are seen.
    pub(crate) fn instructions(&self, header: &Header) -> u32 {
        let (visible, model) = (self.visible_instructions(), self.model_instructions(header));
        if header.has_missing_values() && model > 0 {
            visible.saturating_sub(1).saturating_add(model)
        } else {
            visible.max(model)
        }
    }

    /// Weighted operations of the most expensive case.
    ///
    /// An element that is seen takes a difference, a product and two comparisons. The model takes its products, a sum for
    /// each coefficient, and a sum and two comparisons for each column.
    pub(crate) fn weighted_operations(&self, header: &Header) -> u64 {
        let visible = 4 * self.means.len() as u64;
        let model = u64::from(self.model_instructions(header))
            + self.coefficients.len() as u64
            + 3 * self.columns.len() as u64;
        if header.has_missing_values() {
            visible + model
        } else {
            visible.max(model)
        }
    }
}

/// Overwrites what was perceived last with what is perceived of `observation`, and returns the instructions that this
/// counts as.
///
/// `perceived` has the observation's length. `rest` are the state words behind the window.
#[cfg(feature = "front-end")]
#[inline(never)]
pub(crate) fn apply<O: Iterator<Item = f32> + Clone>(
    front_end: &FrontEnd<'_>,
    header: &Header,
    perceived: &mut [f32],
    rest: &mut [f32],
    observation: O,
) -> u32 {
    let missing = is_missing(header, observation.clone());
    let mut instructions = 0;
    if front_end.fallback == Fallback::Model
        && believed(front_end, observation.clone()).any(|(_, x)| missing(x))
    {
        changes(front_end, header, perceived, rest);
        instructions = front_end.model_instructions(header);
        let sums = sums(front_end, header, rest);
        for ((column, x), change) in believed(front_end, observation.clone()).zip(sums) {
            if let (true, Some(place)) = (missing(x), perceived.get_mut(column)) {
                *place = math::predict(*place, *change);
            }
            // A sum may have overflowed, and every state word must be finite.
            *change = 0.0;
        }
    }
    let scaling = front_end.means.iter().zip(front_end.scales);
    for ((place, x), (mean, scale)) in perceived.iter_mut().zip(observation).zip(scaling) {
        if !missing(x) {
            *place = math::standardise(x, f32::from_le_bytes(*mean), f32::from_le_bytes(*scale));
            instructions += 1;
        } else if front_end.fallback == Fallback::Zero {
            *place = 0.0;
        }
    }
    instructions
}

/// Tells which elements of an observation are missing.
#[cfg(feature = "front-end")]
#[inline(always)]
fn is_missing<O: Iterator<Item = f32>>(
    header: &Header,
    mut observation: O,
) -> impl Fn(f32) -> bool + use<O> {
    let each = header.has_missing_values();
    let blank = !each && observation.all(|x| math::finite(x) == 0.0);
    // Before version 3, all elements are missing or none is.
    move |x| if each { !x.is_finite() } else { blank }
}

/// Lets the model predict an observation in the observer's room, from what was perceived last. No state changes.
///
/// Returns whether there is a model and room for it.
#[cfg(feature = "front-end")]
#[inline]
pub(crate) fn foresee<O: Observer>(
    front_end: &FrontEnd<'_>,
    header: &Header,
    perceived: &[f32],
    rest: &[f32],
    observer: &mut O,
) -> bool {
    let room = observer.room();
    if room.is_empty() || front_end.fallback != Fallback::Model {
        return false;
    }
    let columns = front_end.columns.len();
    let Some((variables, sums)) = room.split_at_mut_checked(columns + action_variables(header))
    else {
        return false;
    };
    let Some(sums) = sums.get_mut(..columns) else {
        return false;
    };
    let elements = front_end.columns.iter().map(|bytes| {
        let column = usize::from(u16::from_le_bytes(*bytes));
        perceived.get(column).copied().unwrap_or(0.0)
    });
    let actions = rest.iter().skip(header.outputs() + columns).copied();
    for (variable, x) in variables.iter_mut().zip(elements.chain(actions)) {
        *variable = x;
    }
    math::changes(sums, variables, front_end.degree, front_end.coefficients);
    true
}

/// Tells the observer what was foreseen, and how that differs from what is perceived.
#[cfg(feature = "front-end")]
#[inline]
pub(crate) fn compare<O: Observer>(
    front_end: &FrontEnd<'_>,
    header: &Header,
    perceived: &[f32],
    observation: impl Iterator<Item = f32> + Clone,
    observer: &mut O,
) {
    let missing = is_missing(header, observation.clone());
    let variables = front_end.columns.len() + action_variables(header);
    for (k, (column, x)) in believed(front_end, observation).enumerate() {
        let room = observer.room();
        let before = room.get(k).copied().unwrap_or(0.0);
        let change = room.get(variables + k).copied().unwrap_or(0.0);
        let now = perceived.get(column).copied().unwrap_or(0.0);
        let residual = (!missing(x)).then(|| math::residual(now, math::predict(before, change)));
        observer.predict(column as u16, change, residual);
    }
}

/// The columns that the model predicts, each with its element of the observation.
#[cfg(feature = "front-end")]
fn believed<O: Iterator<Item = f32>>(
    front_end: &FrontEnd<'_>,
    observation: O,
) -> impl Iterator<Item = (usize, f32)> {
    // The columns ascend, so one pass over the observation meets all of them.
    let mut columns = front_end
        .columns
        .iter()
        .map(|c| usize::from(u16::from_le_bytes(*c)));
    let mut next = columns.next();
    observation.enumerate().filter(move |(k, _)| {
        let found = next == Some(*k);
        if found {
            next = columns.next();
        }
        found
    })
}

/// Computes the changes that the model predicts for its columns, from what was perceived last and the last action.
#[cfg(feature = "front-end")]
fn changes(front_end: &FrontEnd<'_>, header: &Header, perceived: &[f32], rest: &mut [f32]) {
    let variables_len = front_end.columns.len() + action_variables(header);
    let own = rest.get_mut(header.outputs()..).unwrap_or_default();
    let Some((variables, sums)) = own.split_at_mut_checked(variables_len) else {
        return;
    };
    let sums = sums.get_mut(..front_end.columns.len()).unwrap_or_default();
    for (variable, number) in variables.iter_mut().zip(front_end.columns) {
        let column = usize::from(u16::from_le_bytes(*number));
        *variable = perceived.get(column).copied().unwrap_or(0.0);
    }
    math::changes(sums, variables, front_end.degree, front_end.coefficients);
}

/// The model's sums, one for each column.
#[cfg(feature = "front-end")]
fn sums<'s>(front_end: &FrontEnd<'_>, header: &Header, rest: &'s mut [f32]) -> &'s mut [f32] {
    let columns = front_end.columns.len();
    let start = header.outputs() + columns + action_variables(header);
    rest.get_mut(start..)
        .and_then(|sums| sums.get_mut(..columns))
        .unwrap_or_default()
}

/// Stores the action for the next prediction. `rest` are the state words behind the window.
#[cfg(feature = "front-end")]
pub(crate) fn record_action(
    front_end: &FrontEnd<'_>,
    header: &Header,
    rest: &mut [f32],
    action: u16,
) {
    if front_end.fallback != Fallback::Model {
        return;
    }
    let Some((outputs, own)) = rest.split_at_mut_checked(header.outputs()) else {
        return;
    };
    let places = own.get_mut(front_end.columns.len()..).unwrap_or_default();
    if outputs.is_empty()
        && let Some(place) = places.first_mut()
    {
        *place = math::centred(action, header.actions);
    }
    for (place, x) in places.iter_mut().zip(outputs) {
        *place = *x;
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
