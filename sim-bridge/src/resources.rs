//! What a process of the loop may take from the system for itself: a priority, memory that stays, a processor.

use std::io;
use std::str::FromStr;

use crate::error::BridgeError;

/// What a process asks of the system.
#[derive(Debug, Clone, Default, clap::Args)]
pub struct ResourceArgs {
    /// Real-time priority of plant and controller, FIFO:1 to FIFO:99 or RR:1 to RR:99; needs the right to it.
    #[arg(long, value_name = "FIFO:N")]
    pub priority: Option<Priority>,
    /// Keep plant and controller in memory, so that none of their pages has to be fetched; needs the right to it.
    #[arg(long)]
    pub lock_memory: bool,
    /// Processor of plant and controller, from 0; two numbers, as in 1,2, give each its own.
    #[arg(long, value_name = "N[,M]", value_delimiter = ',', num_args = 1)]
    pub cpu: Vec<usize>,
}

/// A class of real-time scheduling.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Class {
    /// Runs until it waits or yields.
    Fifo,
    /// The same, in turns with others of its priority.
    RoundRobin,
}

/// A real-time priority.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Priority {
    class: Class,
    /// 1 to 99; the greatest goes first.
    level: u8,
}

impl FromStr for Priority {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let nonsense =
            || format!("{text:?} is no priority: use FIFO:1 to FIFO:99, or RR:1 to RR:99");
        let (class, level) = text.split_once(':').ok_or_else(nonsense)?;
        let class = match class {
            "FIFO" | "fifo" => Class::Fifo,
            "RR" | "rr" => Class::RoundRobin,
            _ => return Err(nonsense()),
        };
        match level.parse() {
            Ok(level) if (1..=99).contains(&level) => Ok(Priority { class, level }),
            _ => Err(nonsense()),
        }
    }
}

impl std::fmt::Display for Priority {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let class = match self.class {
            Class::Fifo => "FIFO",
            Class::RoundRobin => "RR",
        };
        write!(f, "{class}:{}", self.level)
    }
}

/// Which of the processors given is whose.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Place {
    /// The plant's: the first.
    First,
    /// The controller's: the last.
    Last,
}

impl ResourceArgs {
    /// Checks what needs no system to be wrong.
    ///
    /// # Errors
    /// More processors than processes.
    pub fn check(&self) -> Result<(), BridgeError> {
        if self.cpu.len() <= 2 {
            return Ok(());
        }
        Err(denied(
            format!("use {} processors", self.cpu.len()),
            "the loop has two processes: give --cpu one number, or two as in 1,2",
            io::ErrorKind::InvalidInput.into(),
        ))
    }

    /// The arguments as they were given, for another process.
    #[must_use]
    pub fn to_arguments(&self) -> Vec<String> {
        let mut arguments = Vec::new();
        if let Some(priority) = self.priority {
            arguments.extend(["--priority".to_owned(), priority.to_string()]);
        }
        if self.lock_memory {
            arguments.push("--lock-memory".to_owned());
        }
        if !self.cpu.is_empty() {
            let numbers: Vec<String> = self.cpu.iter().map(usize::to_string).collect();
            arguments.extend(["--cpu".to_owned(), numbers.join(",")]);
        }
        arguments
    }

    /// Asks the system, for the thread that calls.
    ///
    /// # Errors
    /// [`BridgeError::Denied`] where the process has no right to it, or there is no such processor.
    pub fn apply(&self, place: Place) -> Result<(), BridgeError> {
        self.check()?;
        let cpu = match place {
            Place::First => self.cpu.first(),
            Place::Last => self.cpu.last(),
        };
        if let Some(cpu) = cpu {
            system::pin(*cpu).map_err(|source| {
                let advice =
                    "give --cpu the number of one that this process may use; `nproc` counts them";
                denied(format!("run on processor {cpu}"), advice, source)
            })?;
        }
        if self.lock_memory {
            system::lock_memory().map_err(|source| {
                let advice = "raise the limit by `ulimit -l unlimited`, give the capability CAP_IPC_LOCK, or leave out --lock-memory";
                denied("keep the process in memory".into(), advice, source)
            })?;
        }
        if let Some(priority) = self.priority {
            system::prioritise(priority).map_err(|source| {
                let advice = "raise the limit by `ulimit -r 99`, give the capability CAP_SYS_NICE, or leave out --priority";
                denied(format!("take the priority {priority}"), advice, source)
            })?;
        }
        Ok(())
    }
}

fn denied(what: String, advice: &'static str, source: io::Error) -> BridgeError {
    BridgeError::Denied {
        what,
        advice,
        source,
    }
}

#[cfg(target_os = "linux")]
mod system {
    use std::io;

    use nix::sched::{CpuSet, sched_setaffinity};
    use nix::sys::mman::{MlockAllFlags, mlockall};
    use nix::unistd::Pid;
    use thread_priority::unix::{
        RealtimeThreadSchedulePolicy as Realtime, ThreadSchedulePolicy,
        set_thread_priority_and_policy, thread_native_id,
    };
    use thread_priority::{Error, ThreadPriority, ThreadPriorityValue};

    use super::{Class, Priority};

    /// Pins the calling thread to a processor.
    pub(super) fn pin(cpu: usize) -> io::Result<()> {
        let mut set = CpuSet::new();
        set.set(cpu)?;
        Ok(sched_setaffinity(Pid::from_raw(0), &set)?)
    }

    /// Keeps all pages of the process in memory, those to come too.
    pub(super) fn lock_memory() -> io::Result<()> {
        Ok(mlockall(
            MlockAllFlags::MCL_CURRENT | MlockAllFlags::MCL_FUTURE,
        )?)
    }

    /// Gives the calling thread a real-time priority.
    pub(super) fn prioritise(priority: Priority) -> io::Result<()> {
        let policy = ThreadSchedulePolicy::Realtime(match priority.class {
            Class::Fifo => Realtime::Fifo,
            Class::RoundRobin => Realtime::RoundRobin,
        });
        let level = ThreadPriorityValue::try_from(priority.level).map_err(io::Error::other)?;
        let level = ThreadPriority::Crossplatform(level);
        set_thread_priority_and_policy(thread_native_id(), level, policy).map_err(|error| {
            match error {
                Error::OS(code) => io::Error::from_raw_os_error(code),
                error => io::Error::other(format!("{error:?}")),
            }
        })
    }
}

#[cfg(not(target_os = "linux"))]
mod system {
    use std::io;

    use super::Priority;

    fn unsupported() -> io::Result<()> {
        Err(io::ErrorKind::Unsupported.into())
    }

    pub(super) fn pin(_cpu: usize) -> io::Result<()> {
        unsupported()
    }

    pub(super) fn lock_memory() -> io::Result<()> {
        unsupported()
    }

    pub(super) fn prioritise(_priority: Priority) -> io::Result<()> {
        unsupported()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn priorities_are_read_and_nonsense_is_named() {
        for text in ["FIFO:80", "RR:1", "FIFO:99"] {
            assert_eq!(
                text.parse::<Priority>().map(|p| p.to_string()),
                Ok(text.into())
            );
        }
        for nonsense in ["", "80", "FIFO", "FIFO:0", "FIFO:100", "OTHER:1", "FIFO:x"] {
            assert!(nonsense.parse::<Priority>().is_err(), "{nonsense}");
        }
    }

    #[test]
    fn a_processor_that_does_not_exist_is_refused() {
        let resources = ResourceArgs {
            cpu: vec![1_000],
            ..ResourceArgs::default()
        };
        let error = resources.apply(Place::First).expect_err("no such one");
        assert!(error.to_string().contains("processor 1000"), "{error}");
        let three = ResourceArgs {
            cpu: vec![0, 1, 2],
            ..ResourceArgs::default()
        };
        assert!(three.check().is_err());
    }
}
