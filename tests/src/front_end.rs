//! Front ends for test policies, through the runtime's public types.

use tpg_runtime::Header;
use tpg_runtime::front_end::{Fallback, FrontEnd, action_variables, monomials};

/// Announces a front end in a header and returns its section, with numbers from `number`.
///
/// `columns` are the believed ones, ascending; none without a belief. Window, outputs and actions must be set already, and
/// no program laid out yet: the belief's words lie before the registers.
///
/// # Panics
/// If a number outgrows its field: test policies are small.
pub fn front_end(
    header: &mut Header,
    fallback: Fallback,
    degree: u8,
    columns: &[u16],
    mut number: impl FnMut() -> f32,
) -> Vec<u8> {
    header.front_end = None;
    let variables = columns.len() + action_variables(header);
    let coefficients = match fallback {
        Fallback::Model => monomials(variables, degree) as usize * columns.len(),
        _ => 0,
    };
    let mut numbers =
        |len: usize| -> Vec<[u8; 4]> { (0..len).map(|_| number().to_le_bytes()).collect() };
    let inputs = usize::from(header.observation_len);
    let (means, scales) = (numbers(inputs), numbers(inputs));
    let coefficients = numbers(coefficients);
    let columns: Vec<[u8; 2]> = columns.iter().map(|c| c.to_le_bytes()).collect();
    let start = match fallback {
        Fallback::Model => u16::try_from(header.registers_start()).expect("small policy"),
        _ => 0,
    };
    let mut front_end = FrontEnd::new(fallback, &means, &scales);
    front_end.degree = degree;
    front_end.start = start;
    front_end.columns = &columns;
    front_end.coefficients = &coefficients;
    let words = front_end.words(header);
    header.front_end = Some(u16::try_from(words).expect("small policy"));
    let mut bytes = Vec::new();
    front_end.write(|part| bytes.extend_from_slice(part));
    bytes
}
