//! The body of versions 1 and 2: a message in postcard's encoding.

use super::error::{DecodeError, records};
use crate::parts::Table;
use crate::tables::Tables;

/// The body as postcard reads it.
///
/// The tables of fixed-width records are byte strings, so that the decoder can borrow them from the file.
#[derive(serde::Deserialize)]
struct Body<'a> {
    teams: &'a [u8],
    members: &'a [u8],
    programs: &'a [u8],
    code: &'a [u8],
    constants: &'a [u8],
    cells: &'a [u8],
    memory: &'a [u8],
    front_end: &'a [u8],
    labels: &'a str,
    task: &'a str,
    observability: &'a str,
}

/// Reads the body.
pub(super) fn read(body: &[u8]) -> Result<Tables<'_>, DecodeError> {
    let (body, rest) =
        postcard::take_from_bytes::<Body<'_>>(body).map_err(|_| DecodeError::Body)?;
    if !rest.is_empty() {
        return Err(DecodeError::Body);
    }
    Ok(Tables {
        teams: records(body.teams, Table::Teams)?,
        members: records(body.members, Table::Members)?,
        programs: records(body.programs, Table::Programs)?,
        code: records(body.code, Table::Code)?,
        constants: records(body.constants, Table::Constants)?,
        cells: records(body.cells, Table::Cells)?,
        memory: records(body.memory, Table::Memory)?,
        front_end: body.front_end,
        labels: body.labels,
        task: body.task,
        observability: body.observability,
        ranges: &[],
    })
}
