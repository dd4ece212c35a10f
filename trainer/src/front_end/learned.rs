//! A learned front end, and its section of a blob.

use serde::{Deserialize, Serialize};
use tpg_runtime::Header;
use tpg_runtime::front_end::{Fallback, FrontEnd};

use super::FrontEndFallback;
use crate::keys::by_name;

/// A front end, with the numbers that the runtime reads.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct LearnedFrontEnd {
    /// What programs get in place of missing elements. As long as there is no model, a learned one is what they got last.
    #[serde(with = "by_name")]
    pub fallback: FrontEndFallback,
    /// What is subtracted from each element of the observation, in the unit of the element.
    pub means: Vec<f32>,
    /// What the differences are multiplied by.
    pub scales: Vec<f32>,
    /// The model that predicts what is not seen, if there is one.
    pub model: Option<Model>,
}

/// A model of one step, in standardised units: predicts the changes of some columns from them and from the action.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Model {
    /// Degree of its monomials, 1 to 3.
    pub degree: u8,
    /// The columns that it describes, ascending.
    pub columns: Vec<u16>,
    /// For each monomial, in the runtime's order, a coefficient for each column.
    pub coefficients: Vec<f32>,
}

impl LearnedFrontEnd {
    /// Announces the front end in a header, whose window and actions must be set, and returns the bytes of its section.
    #[must_use]
    pub fn section(&self, header: &mut Header) -> Vec<u8> {
        let bytes =
            |numbers: &[f32]| -> Vec<[u8; 4]> { numbers.iter().map(|x| x.to_le_bytes()).collect() };
        let (means, scales) = (bytes(&self.means), bytes(&self.scales));
        let model = self.model.as_ref();
        let columns: Vec<[u8; 2]> = model
            .iter()
            .flat_map(|m| &m.columns)
            .map(|c| c.to_le_bytes())
            .collect();
        let coefficients = model.map_or_else(Vec::new, |m| bytes(&m.coefficients));
        header.front_end = None;
        let fallback = match (self.fallback, model) {
            (FrontEndFallback::None, _) => Fallback::Zero,
            (FrontEndFallback::Learned, Some(_)) => Fallback::Model,
            (FrontEndFallback::Hold, _) | (FrontEndFallback::Learned, None) => Fallback::Hold,
        };
        let mut front_end = FrontEnd::new(fallback, &means, &scales);
        if let Some(model) = model {
            front_end.degree = model.degree;
            // Lowering refuses policies whose state does not fit 16 bits.
            front_end.start = header.registers_start() as u16;
            front_end.columns = &columns;
            front_end.coefficients = &coefficients;
        }
        header.front_end = Some(front_end.words(header) as u16);
        let mut section = Vec::new();
        front_end.write(|part| section.extend_from_slice(part));
        section
    }
}
