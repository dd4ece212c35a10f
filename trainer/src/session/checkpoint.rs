//! Checkpoints: everything that a run needs to go on, in one file that is replaced as a whole.

use std::collections::BTreeMap;
use std::io::Write as _;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use serde::{Deserialize, Serialize};
use sha2::{Digest as _, Sha256};

use super::{Lineage, Race, Record, Session};
use crate::config::Config;
use crate::evolve::{Action, Instruction, Population, Program, ProgramId, ResetRule, Team, TeamId};
use crate::front_end::Learner;

const MAGIC: &[u8; 8] = b"TPGCHKPT";
const VERSION: u32 = 4;
const DIGEST_BYTES: usize = 32;

/// Why a checkpoint could not be written or read.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum CheckpointError {
    /// The file system said no.
    #[error("cannot {action} {path}")]
    Io {
        /// What was tried.
        action: &'static str,
        /// On which path.
        path: PathBuf,
        /// What came of it.
        source: std::io::Error,
    },
    /// The file is no checkpoint, or a damaged one.
    #[error("{path} is no checkpoint: {why}")]
    Malformed {
        /// Which file.
        path: PathBuf,
        /// What is wrong with it.
        why: String,
    },
}

/// A program as stored: its constants stand in a table of their own, since clones share them.
#[derive(Serialize, Deserialize)]
struct StoredProgram {
    id: ProgramId,
    instructions: Vec<Instruction>,
    constants: u32,
    offset: u16,
    action: Action,
}

#[derive(Serialize, Deserialize)]
struct StoredTeam {
    id: TeamId,
    members: Vec<ProgramId>,
    memory: u32,
    stream_key: u32,
    reset_rule: Option<ResetRule>,
}

#[derive(Serialize, Deserialize)]
struct Stored {
    config: String,
    seed: u64,
    generation: u64,
    steps: u64,
    seconds: f64,
    next_team: u64,
    next_program: u64,
    roots: Vec<TeamId>,
    memory: Option<Arc<[f32]>>,
    medians: [Option<f64>; 2],
    records: Vec<(TeamId, Record)>,
    teams: Vec<StoredTeam>,
    programs: Vec<StoredProgram>,
    constants: Vec<Arc<[f32]>>,
    lineages: Vec<Lineage>,
    race: Race,
    stage: u32,
    learner: Option<Learner>,
}

/// Blocks of constants, each once however many genomes share it.
#[derive(Default)]
struct Blocks {
    numbers: BTreeMap<*const f32, u32>,
    blocks: Vec<Arc<[f32]>>,
}

impl Blocks {
    fn number(&mut self, block: &Arc<[f32]>) -> u32 {
        let next = self.blocks.len() as u32;
        let number = *self.numbers.entry(block.as_ptr()).or_insert(next);
        if number == next {
            self.blocks.push(block.clone());
        }
        number
    }
}

/// A session as it stands between two generations: shares its genomes, so that training can go on while this is written.
pub struct Snapshot {
    config: Config,
    seed: u64,
    generation: u64,
    steps: u64,
    seconds: f64,
    population: Population,
    records: Vec<(TeamId, Record)>,
    memory: Option<Arc<[f32]>>,
    medians: [Option<f64>; 2],
    lineages: Vec<Lineage>,
    race: Race,
    stage: u32,
    learner: Option<Learner>,
}

impl Snapshot {
    /// Takes one.
    #[must_use]
    pub fn new(session: &Session) -> Self {
        let records = session.records.iter();
        Snapshot {
            config: session.config.clone(),
            seed: session.seed,
            generation: session.generation,
            steps: session.steps,
            seconds: session.seconds,
            population: session.population.clone(),
            records: records.map(|(id, r)| (*id, r.clone())).collect(),
            memory: session.memory.clone(),
            medians: session.medians,
            lineages: session.lineages.clone(),
            race: session.race.clone(),
            stage: session.stage,
            learner: session.learner.clone(),
        }
    }

    /// Writes it to a temporary file beside `path`, then renames that, so that a crash leaves the old checkpoint.
    ///
    /// # Errors
    /// [`CheckpointError::Io`].
    pub fn save(self, path: &Path) -> Result<(), CheckpointError> {
        let io = |action| {
            move |source| CheckpointError::Io {
                action,
                path: path.to_owned(),
                source,
            }
        };
        let body = self.encode().map_err(|why| malformed(path, &why))?;
        let temporary = path.with_extension("tmp");
        let mut file = std::fs::File::create(&temporary).map_err(io("create"))?;
        file.write_all(MAGIC)
            .and_then(|()| file.write_all(&VERSION.to_le_bytes()))
            .and_then(|()| file.write_all(&Sha256::digest(&body)))
            .and_then(|()| file.write_all(&body))
            .and_then(|()| file.sync_all())
            .map_err(io("write"))?;
        std::fs::rename(&temporary, path).map_err(io("replace"))
    }

    fn encode(self) -> Result<Vec<u8>, String> {
        let population = self.population;
        let mut blocks = Blocks::default();
        let teams = population
            .teams
            .iter()
            .map(|(id, team)| StoredTeam {
                id: *id,
                members: team.members.clone(),
                memory: blocks.number(&team.memory),
                stream_key: team.stream_key,
                reset_rule: team.reset_rule,
            })
            .collect();
        let programs = population
            .programs
            .iter()
            .map(|(id, program)| StoredProgram {
                id: *id,
                instructions: program.instructions.clone(),
                constants: blocks.number(&program.constants),
                offset: program.offset,
                action: program.action,
            })
            .collect();
        let stored = Stored {
            config: toml::to_string(&self.config).map_err(|e| e.to_string())?,
            seed: self.seed,
            generation: self.generation,
            steps: self.steps,
            seconds: self.seconds,
            next_team: population.next_team,
            next_program: population.next_program,
            roots: population.roots,
            memory: self.memory,
            medians: self.medians,
            records: self.records,
            teams,
            programs,
            constants: blocks.blocks,
            lineages: self.lineages,
            race: self.race,
            stage: self.stage,
            learner: self.learner,
        };
        postcard::to_stdvec(&stored).map_err(|e| e.to_string())
    }
}

/// Reads a checkpoint.
///
/// # Errors
/// [`CheckpointError`] if the file cannot be read, is damaged, or was written by another version.
pub fn load(path: &Path) -> Result<Session, CheckpointError> {
    let bytes = std::fs::read(path).map_err(|source| CheckpointError::Io {
        action: "read",
        path: path.to_owned(),
        source,
    })?;
    let rest = bytes
        .strip_prefix(MAGIC)
        .ok_or_else(|| malformed(path, &"it does not begin as one"))?;
    let (version, rest) = rest
        .split_first_chunk::<4>()
        .ok_or_else(|| malformed(path, &"it is truncated"))?;
    let version = u32::from_le_bytes(*version);
    if version != VERSION {
        let why = format!(
            "it has version {version}, this build reads version {VERSION}; \
             resume it with the build that wrote it"
        );
        return Err(malformed(path, &why));
    }
    let (digest, body) = rest
        .split_first_chunk::<DIGEST_BYTES>()
        .ok_or_else(|| malformed(path, &"it is truncated"))?;
    if Sha256::digest(body).as_slice() != digest {
        return Err(malformed(path, &"its checksum differs, so it is damaged"));
    }
    let stored: Stored = postcard::from_bytes(body).map_err(|e| malformed(path, &e))?;
    restore(stored).map_err(|why| malformed(path, &why))
}

fn malformed(path: &Path, why: &dyn ToString) -> CheckpointError {
    CheckpointError::Malformed {
        path: path.to_owned(),
        why: why.to_string(),
    }
}

/// Rebuilds a session and checks that everything that is named exists.
fn restore(stored: Stored) -> Result<Session, String> {
    let config: Config = toml::from_str(&stored.config).map_err(|e| e.to_string())?;
    let block = |number: u32| {
        let block = stored.constants.get(number as usize).cloned();
        block.ok_or_else(|| format!("it lacks block {number} of constants"))
    };
    let mut population = Population {
        roots: stored.roots,
        next_team: stored.next_team,
        next_program: stored.next_program,
        ..Population::default()
    };
    for program in stored.programs {
        let restored = Program {
            instructions: program.instructions,
            constants: block(program.constants)?,
            offset: program.offset,
            action: program.action,
        };
        population.programs.insert(program.id, Arc::new(restored));
    }
    for team in stored.teams {
        let restored = Team {
            members: team.members,
            memory: block(team.memory)?,
            stream_key: team.stream_key,
            reset_rule: team.reset_rule,
        };
        population.teams.insert(team.id, Arc::new(restored));
    }
    let records: BTreeMap<TeamId, Record> = stored.records.into_iter().collect();
    let tuned = stored.lineages.iter().flat_map(Lineage::roots);
    let mut roots = tuned
        .chain(stored.race.champion)
        .chain(population.roots.iter().copied());
    if !population.is_closed() || !roots.all(|r| records.contains_key(&r)) {
        return Err("it names teams, programs or scores that it does not hold".into());
    }
    let session = Session::with_population(config, stored.seed, population);
    Ok(Session {
        generation: stored.generation,
        steps: stored.steps,
        seconds: stored.seconds,
        records,
        memory: stored.memory,
        medians: stored.medians,
        lineages: stored.lineages,
        race: stored.race,
        stage: stored.stage,
        learner: stored.learner,
        ..session.map_err(|e| e.to_string())?
    })
}
