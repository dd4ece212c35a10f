//! Checks that no team lists a program twice, which version 3 forbids.

use super::error::VerifyError;
use super::header::MAX_PROGRAMS;
use crate::tables::{Tables, Team};

/// Checks every team. Reads the members twice; the programs exist, and there are at most [`MAX_PROGRAMS`].
pub(super) fn check_duplicates(tables: &Tables<'_>) -> Result<(), VerifyError> {
    // A bit for each program. A team sets those of its members, and clears them afterwards.
    let mut listed = [0u8; MAX_PROGRAMS as usize / 8];
    for (number, bytes) in tables.teams.iter().enumerate() {
        let team = Team::from_bytes(bytes);
        for program in tables.members(&team) {
            let (at, bit) = (usize::from(program.0 / 8), 1u8 << (program.0 % 8));
            let Some(place) = listed.get_mut(at) else {
                continue;
            };
            if *place & bit != 0 {
                return Err(VerifyError::DuplicateMember {
                    team: number as u16,
                    program: program.0,
                });
            }
            *place |= bit;
        }
        for program in tables.members(&team) {
            if let Some(place) = listed.get_mut(usize::from(program.0 / 8)) {
                *place = 0;
            }
        }
    }
    Ok(())
}
