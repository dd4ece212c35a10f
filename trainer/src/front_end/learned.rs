//! A learned front end, as lowering puts it into blobs.

use serde::{Deserialize, Serialize};
use tpg_runtime::Header;
use tpg_runtime::front_end::{Fallback, FrontEnd};

/// A front end: its numbers are those that the runtime reads.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct LearnedFrontEnd {
    /// Whether what was perceived last stays where nothing is seen and no model says more.
    pub hold: bool,
    /// What is subtracted from each element.
    pub means: Vec<f32>,
    /// What the differences are multiplied by.
    pub scales: Vec<f32>,
    /// The model, if there is one.
    pub model: Option<Model>,
}

/// A model of one step, in standardised units.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Model {
    /// Degree of its monomials.
    pub degree: u8,
    /// The columns that it describes, ascending.
    pub columns: Vec<u16>,
    /// For each monomial a coefficient for each column.
    pub coefficients: Vec<f32>,
}

impl LearnedFrontEnd {
    /// Announces it in a header, whose window and actions are set, and returns its section.
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
        let fallback = match (model, self.hold) {
            (Some(_), _) => Fallback::Model,
            (None, true) => Fallback::Hold,
            (None, false) => Fallback::Zero,
        };
        let mut front_end = FrontEnd::new(fallback, &means, &scales);
        if let Some(model) = model {
            front_end.degree = model.degree;
            // Too long a window is refused by its own limit.
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
