//! Helpers of the tests.
#![allow(dead_code, reason = "each test file uses a part")]

pub mod policy;

use std::io::{BufRead as _, BufReader, Read as _};
use std::path::{Path, PathBuf};
use std::process::{Child, ChildStderr, Command, ExitStatus, Stdio};
use std::sync::mpsc::{Receiver, channel};
use std::thread;
use std::time::{Duration, Instant};

/// Whatever takes longer hangs; polling is slow where other programs take the processors.
pub const WATCHDOG: Duration = Duration::from_secs(180);

/// A folder for policy files, removed in the end.
pub struct Folder(tempfile::TempDir);

impl Folder {
    pub fn new() -> Self {
        Folder(tempfile::tempdir().expect("a temporary folder"))
    }

    /// Writes a file into the folder.
    pub fn file(&self, name: &str, bytes: &[u8]) -> PathBuf {
        let path = self.0.path().join(name);
        std::fs::write(&path, bytes).expect("the folder can be written");
        path
    }
}

/// A program of the bridge, killed when it is dropped.
pub struct Process {
    child: Child,
    lines: Receiver<String>,
    stdout: Receiver<String>,
}

/// How a program ended.
#[derive(Debug)]
pub struct End {
    pub status: ExitStatus,
    pub stdout: String,
    pub stderr: String,
}

impl Process {
    pub fn start(program: &str, file: &Path, arguments: &[&str]) -> Self {
        Self::spawn(Command::new(program).arg(file).args(arguments))
    }

    /// Starts a prepared command.
    pub fn spawn(command: &mut Command) -> Self {
        let mut child = command
            .stdin(Stdio::null())
            .stdout(Stdio::piped())
            .stderr(Stdio::piped())
            .spawn()
            .expect("the program is built");
        let (line, lines) = channel();
        let (text, stdout) = channel();
        let stderr: ChildStderr = child.stderr.take().expect("piped");
        let mut pipe = child.stdout.take().expect("piped");
        thread::spawn(move || {
            for read in BufReader::new(stderr).lines().map_while(Result::ok) {
                let _ = line.send(read);
            }
        });
        thread::spawn(move || {
            let mut read = String::new();
            let _ = pipe.read_to_string(&mut read);
            let _ = text.send(read);
        });
        Process {
            child,
            lines,
            stdout,
        }
    }

    pub fn id(&self) -> u32 {
        self.child.id()
    }

    /// Waits for a line on standard error that contains a text.
    pub fn await_line(&self, text: &str) {
        let start = Instant::now();
        while let Some(left) = WATCHDOG.checked_sub(start.elapsed()) {
            match self.lines.recv_timeout(left) {
                Ok(line) if line.contains(text) => return,
                Ok(_) => {}
                Err(error) => panic!("no line with {text:?}: {error}"),
            }
        }
        panic!("no line with {text:?} in time");
    }

    /// Sends a signal by name.
    pub fn signal(&self, signal: &str) {
        send_signal(self.id(), signal);
    }

    /// Waits until the program ends.
    pub fn end(mut self) -> End {
        let start = Instant::now();
        let status = loop {
            if let Some(status) = self.child.try_wait().expect("it can be waited for") {
                break status;
            }
            assert!(start.elapsed() < WATCHDOG, "the program hangs");
            thread::sleep(Duration::from_millis(5));
        };
        let stderr: Vec<String> = self.lines.iter().collect();
        End {
            status,
            stdout: self.stdout.recv_timeout(WATCHDOG).unwrap_or_default(),
            stderr: stderr.join("\n"),
        }
    }
}

impl Drop for Process {
    fn drop(&mut self) {
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

impl End {
    /// Checks status and message of a failure.
    pub fn assert_failure(&self, code: i32, texts: &[&str]) {
        assert_eq!(self.status.code(), Some(code), "{self:?}");
        for text in texts {
            assert!(self.stderr.contains(text), "no {text:?} in {self:?}");
        }
    }
}

pub fn send_signal(pid: u32, signal: &str) {
    let status = Command::new("kill")
        .args([format!("-{signal}"), pid.to_string()])
        .status()
        .expect("there is a kill command");
    assert!(status.success(), "no signal {signal} to {pid}");
}

/// Runs something in a thread that must end.
pub fn within_watchdog<T: Send + 'static>(what: impl FnOnce() -> T + Send + 'static) -> T {
    let (sender, receiver) = channel();
    thread::spawn(move || sender.send(what()));
    receiver
        .recv_timeout(WATCHDOG)
        .expect("it neither hangs nor panics")
}
