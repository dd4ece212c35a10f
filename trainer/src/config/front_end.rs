//! Checks of the settings of learned front ends.

use tpg_runtime::front_end::{MAX_DEGREE, monomials};

use super::ConfigError;
use super::layers::nearest;
use super::settings::value;
use crate::front_end::{Columns, FrontEndFallback, FrontEndParams};
use tpg_tasks::task::Channel;

/// Most monomials of a model: a fit takes time with their square and room in each policy.
const MOST_MONOMIALS: u64 = 700;

/// Checks the settings and returns the numbers of the columns that a model describes; `None` if the data are to choose them.
pub(super) fn check(
    params: &FrontEndParams,
    inputs: &[Channel],
    actions: usize,
) -> Result<Option<Vec<u16>>, ConfigError> {
    if !(1..=MAX_DEGREE).contains(&params.degree) {
        let why = format!("a model's degree lies between 1 and {MAX_DEGREE}");
        return Err(value("front-end.degree", &params.degree.to_string(), why));
    }
    for (key, number) in [
        ("front-end.weighting", params.weighting),
        ("front-end.outlier", params.outlier),
        ("front-end.ridge", params.ridge),
    ] {
        if !(number.is_finite() && number >= 0.0) {
            return Err(value(
                key,
                &number.to_string(),
                "must be finite and not negative",
            ));
        }
    }
    for (key, number) in [
        ("front-end.pairs", params.pairs),
        ("front-end.refit-every", params.refit_every),
    ] {
        if number == 0 {
            return Err(value(key, "0", "must be at least 1"));
        }
    }
    let columns = columns(&params.columns, inputs)?;
    let most = columns.as_ref().map_or(inputs.len(), Vec::len) + actions;
    let count = monomials(most, params.degree);
    if params.belief == FrontEndFallback::Learned && count > MOST_MONOMIALS {
        let why = format!(
            "a model of {most} variables has {count} monomials, at most {MOST_MONOMIALS} are fitted: \
             name fewer front-end.columns, or take a lower degree"
        );
        return Err(value("front-end.degree", &params.degree.to_string(), why));
    }
    Ok(columns)
}

fn columns(columns: &Columns, inputs: &[Channel]) -> Result<Option<Vec<u16>>, ConfigError> {
    let key = "front-end.columns";
    let names = match columns {
        _ if columns.is_auto() => return Ok(None),
        Columns::Word(word) => {
            let why = "give a list of the observation's names, or \"auto\"";
            return Err(value(key, word, why));
        }
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
            return Err(value(key, name, why));
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

    #[test]
    fn columns_are_named_or_all_or_left_to_the_data() {
        let channel = |name: &str| Channel {
            name: name.into(),
            unit: "m".into(),
            velocity: false,
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
        assert_eq!(with(Columns::Word("auto".into())), Ok(None));
        let unknown = with(names(&["angel"])).expect_err("no such name");
        assert!(unknown.contains("did you mean \"angle\""), "{unknown}");
        assert!(with(Columns::Word("all".into())).is_err());
    }
}
