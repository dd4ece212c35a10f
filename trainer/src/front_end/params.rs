//! Settings of learned front ends.

use serde::{Deserialize, Serialize};

use crate::defaults::is_default;

/// What policies perceive when they see nothing.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum FrontEndFallback {
    /// Zeros.
    #[default]
    None,
    /// What they perceived last.
    Hold,
    /// What a learned model says.
    Learned,
}

/// Which columns of the observation a model describes.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
#[serde(untagged)]
pub enum Columns {
    /// `auto`: chosen from the data.
    Word(String),
    /// These, by name; none stands for all.
    Names(Vec<String>),
}

impl Columns {
    /// Whether they are chosen from the data.
    #[must_use]
    pub fn is_auto(&self) -> bool {
        matches!(self, Columns::Word(word) if word == "auto")
    }
}

/// What policies perceive of the columns that a model does not describe.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Others {
    /// What was seen last.
    #[default]
    Hold,
    /// Nothing: zeros, also where the observation is visible.
    Drop,
}

/// How front ends are learned; `presets/defaults.toml` explains every key.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, rename_all = "kebab-case")]
pub struct FrontEndParams {
    /// Whether observations are shifted and scaled by the moments of what was seen.
    pub standardise: bool,
    /// What policies perceive when they see nothing.
    pub belief: FrontEndFallback,
    /// Degree of a model's monomials, 1 to 3.
    pub degree: u8,
    /// Columns that a model describes.
    pub columns: Columns,
    /// What policies perceive of the other columns, once there is a model.
    #[serde(default, skip_serializing_if = "is_default")]
    pub others: Others,
    /// Distance from the means at which a pair of observations loses weight, in standard deviations; 0 weighs all alike.
    pub weighting: f64,
    /// Error in predicting a pair's columns, in standard deviations, beyond which the pair loses weight; 0 believes all pairs alike.
    #[serde(default, skip_serializing_if = "is_default")]
    pub outlier: f64,
    /// What is added to the diagonal of the normal equations, scaled to ones.
    pub ridge: f64,
    /// Pairs of consecutive visible observations that are kept for fitting, the latest.
    pub pairs: u32,
    /// Generations between two fits.
    pub refit_every: u32,
}

impl Default for FrontEndParams {
    fn default() -> Self {
        FrontEndParams {
            standardise: false,
            belief: FrontEndFallback::None,
            degree: 1,
            columns: Columns::Names(Vec::new()),
            others: Others::Hold,
            weighting: 0.0,
            outlier: 0.0,
            ridge: 1e-6,
            pairs: 40_000,
            refit_every: 5,
        }
    }
}

impl FrontEndParams {
    /// Whether nothing differs from the defaults, which configurations leave out.
    #[must_use]
    pub fn is_default(&self) -> bool {
        *self == FrontEndParams::default()
    }

    /// Whether policies have a front end.
    #[must_use]
    pub fn is_on(&self) -> bool {
        self.standardise || self.belief != FrontEndFallback::None
    }
}
