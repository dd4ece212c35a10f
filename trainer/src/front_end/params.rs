//! Settings of learned front ends.

use std::fmt;

use serde::de::{SeqAccess, Visitor};
use serde::{Deserialize, Deserializer, Serialize, Serializer, de};
use tpg_runtime::front_end::MAX_DEGREE;

use crate::keys::{Key, Values, by_name, is_default, named};

/// Largest distance, error and ridge.
const LARGEST: f64 = 1e6;
/// The word that stands for [`Columns::Auto`].
const AUTO: &str = "auto";

/// What programs get in place of missing elements.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum FrontEndFallback {
    /// Zeros.
    #[default]
    None,
    /// What they got last.
    Hold,
    /// What a learned model of one step predicts.
    Learned,
}

impl FrontEndFallback {
    /// Every value.
    pub const ALL: &'static [Self] = &[Self::None, Self::Hold, Self::Learned];

    /// The name used in configurations.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::None => "none",
            Self::Hold => "hold",
            Self::Learned => "learned",
        }
    }

    /// Whether a model is learned.
    #[must_use]
    pub const fn has_model(self) -> bool {
        matches!(self, Self::Learned)
    }
}

/// Which columns of the observation a model describes.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Columns {
    /// Those that the data show to matter; `"auto"` in configurations.
    Auto,
    /// These, by name. None stands for all.
    Names(Vec<String>),
}

impl Serialize for Columns {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        match self {
            Columns::Auto => serializer.serialize_str(AUTO),
            Columns::Names(names) => names.serialize(serializer),
        }
    }
}

impl<'de> Deserialize<'de> for Columns {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        struct ColumnsVisitor;

        impl<'de> Visitor<'de> for ColumnsVisitor {
            type Value = Columns;

            fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
                write!(f, "a list of the observation's names, or {AUTO:?}")
            }

            fn visit_str<E: de::Error>(self, word: &str) -> Result<Columns, E> {
                if word == AUTO {
                    Ok(Columns::Auto)
                } else {
                    Err(E::invalid_value(de::Unexpected::Str(word), &self))
                }
            }

            fn visit_seq<A: SeqAccess<'de>>(self, mut list: A) -> Result<Columns, A::Error> {
                let mut names = Vec::new();
                while let Some(name) = list.next_element()? {
                    names.push(name);
                }
                Ok(Columns::Names(names))
            }
        }

        deserializer.deserialize_any(ColumnsVisitor)
    }
}

/// What programs get of the columns that a model does not describe.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Others {
    /// What was seen last.
    #[default]
    Hold,
    /// Zeros, also where the observation is visible.
    Drop,
}

impl Others {
    /// Every value.
    pub const ALL: &'static [Self] = &[Self::Hold, Self::Drop];

    /// The name used in configurations.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Hold => "hold",
            Self::Drop => "drop",
        }
    }
}

named!(FrontEndFallback Others);

/// How front ends are learned; `presets/defaults.toml` explains every key.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, rename_all = "kebab-case")]
pub struct FrontEndParams {
    /// Whether observations are shifted and scaled by the moments of what was seen.
    pub standardise: bool,
    /// What programs get in place of missing elements.
    #[serde(with = "by_name")]
    pub belief: FrontEndFallback,
    /// Degree of a model's monomials, 1 to 3.
    pub degree: u8,
    /// Columns that a model describes.
    pub columns: Columns,
    /// What programs get of the other columns, once there is a model.
    #[serde(with = "by_name", default, skip_serializing_if = "is_default")]
    pub others: Others,
    /// Distance from the means at which a pair of observations loses weight, in standard deviations. 0 weighs all pairs alike.
    pub weighting: f64,
    /// Error of a prediction, in standard deviations, beyond which its pair loses weight. 0 weighs all pairs alike.
    #[serde(default, skip_serializing_if = "is_default")]
    pub outlier: f64,
    /// What is added to the diagonal of the normal equations, which are scaled so that it is 1.
    pub ridge: f64,
    /// Pairs of consecutive visible observations that are kept for fitting. The latest are kept.
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
    pub(crate) const KEYS: &[Key] = &[
        Key::flag("standardise"),
        Key::name::<FrontEndFallback>("belief"),
        Key::whole("degree", 1, MAX_DEGREE as u64),
        Key::new("columns", Values::TextsOr(AUTO)),
        Key::name::<Others>("others"),
        Key::number("weighting", 0.0, LARGEST),
        Key::number("outlier", 0.0, LARGEST),
        Key::number("ridge", 0.0, LARGEST),
        Key::whole("pairs", 1, 10_000_000),
        Key::whole("refit-every", 1, 1_000_000_000),
    ];

    /// Whether policies have a front end.
    #[must_use]
    pub fn is_on(&self) -> bool {
        self.standardise || self.belief != FrontEndFallback::None
    }
}
