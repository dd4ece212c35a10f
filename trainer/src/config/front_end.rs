//! Checks of the settings of learned front ends.

use tpg_runtime::front_end::monomials;

use super::error::ConfigError;
use crate::front_end::{Columns, FrontEndParams};
use crate::keys::nearest;
use tpg_tasks::task::Channel;

/// Most monomials of a model. The time of a fit grows with their square, and each policy has room for all of them.
const MOST_MONOMIALS: u64 = 700;

/// Checks the settings and returns the numbers of the columns that a model describes, ascending; `None` if the data are to
/// choose them.
///
/// `actions` is the number of variables by which a model knows an action.
pub(super) fn check(
    params: &FrontEndParams,
    inputs: &[Channel],
    actions: usize,
) -> Result<Option<Vec<u16>>, ConfigError> {
    let columns = columns(&params.columns, inputs)?;
    let most = columns.as_ref().map_or(inputs.len(), Vec::len) + actions;
    let count = monomials(most, params.degree);
    if params.belief.has_model() && count > MOST_MONOMIALS {
        let why = format!(
            "a model of {most} variables has {count} monomials, at most {MOST_MONOMIALS} are fitted: \
             name fewer front-end.columns, or take a lower degree"
        );
        return Err(ConfigError::value("front-end.degree", params.degree, why));
    }
    Ok(columns)
}

fn columns(columns: &Columns, inputs: &[Channel]) -> Result<Option<Vec<u16>>, ConfigError> {
    let names = match columns {
        Columns::Auto => return Ok(None),
        Columns::Names(names) => names,
    };
    if names.is_empty() {
        return Ok(Some((0..inputs.len() as u16).collect()));
    }
    let mut numbers = Vec::new();
    for name in names {
        let Some(number) = inputs.iter().position(|input| input.name == *name) else {
            let known = nearest(name, inputs.iter().map(|input| input.name.as_str()));
            let why = format!("the observation has no such element; did you mean {known:?}?");
            return Err(ConfigError::text("front-end.columns", name, why));
        };
        numbers.push(number as u16);
    }
    numbers.sort_unstable();
    numbers.dedup();
    Ok(Some(numbers))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::front_end::FrontEndFallback;

    #[test]
    fn columns_are_named_or_all_or_left_to_the_data() {
        let channel = |name: &str| Channel {
            name: name.into(),
            unit: "m".into(),
            velocity: false,
            range: None,
        };
        let inputs = [channel("z"), channel("angle"), channel("speed")];
        let with = |columns: Columns| {
            let params = FrontEndParams {
                columns,
                belief: FrontEndFallback::Learned,
                ..FrontEndParams::default()
            };
            check(&params, &inputs, 1).map_err(|error| error.to_string())
        };
        let names =
            |names: &[&str]| Columns::Names(names.iter().map(|n| (*n).to_owned()).collect());
        assert_eq!(with(names(&[])), Ok(Some(vec![0, 1, 2])));
        assert_eq!(with(names(&["speed", "z", "z"])), Ok(Some(vec![0, 2])));
        assert_eq!(with(Columns::Auto), Ok(None));
        let unknown = with(names(&["angel"])).expect_err("no such name");
        assert!(unknown.contains("did you mean \"angle\""), "{unknown}");
    }
}
