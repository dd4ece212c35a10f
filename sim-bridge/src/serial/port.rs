//! A tty or a Unix socket, read without waiting.

use std::fmt;
use std::io::{self, ErrorKind, Read, Write};
use std::os::unix::fs::FileTypeExt as _;
use std::os::unix::net::UnixStream;
use std::str::FromStr;
use std::thread;
use std::time::{Duration, Instant};

use crate::error::BridgeError;

/// Bits per second of a tty by default.
const RATE: u32 = 115_200;

/// Where a controller is: `serial:PATH` or `serial:PATH@RATE`.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct SerialPath {
    /// A tty, or a Unix socket such as that of an emulator's serial line.
    pub path: String,
    /// Bits per second; ignored for a socket.
    pub rate: u32,
}

impl FromStr for SerialPath {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let place = text
            .strip_prefix("serial:")
            .filter(|place| !place.is_empty());
        let place = place.ok_or_else(|| {
            format!("{text:?} is not a controller: use serial:PATH, such as serial:/dev/ttyACM0")
        })?;
        let (path, rate) = match place.rsplit_once('@') {
            Some((path, rate)) => match rate.parse() {
                Ok(rate) if rate > 0 => (path, rate),
                _ => return Err(format!("{rate:?} is not a rate in bits per second")),
            },
            None => (place, RATE),
        };
        Ok(SerialPath {
            path: path.to_owned(),
            rate,
        })
    }
}

impl fmt::Display for SerialPath {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.path)
    }
}

trait Stream: Read + Write + Send {}
impl<T: Read + Write + Send> Stream for T {}

/// An open line.
pub(super) struct Port {
    stream: Box<dyn Stream>,
    name: String,
}

impl fmt::Debug for Port {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_tuple("Port").field(&self.name).finish()
    }
}

impl Port {
    pub(super) fn open(place: &SerialPath) -> Result<Self, BridgeError> {
        let cannot = |source: io::Error| BridgeError::CannotOpen {
            path: place.path.clone(),
            source,
        };
        let file_type = std::fs::metadata(&place.path).map_err(cannot)?.file_type();
        let stream: Box<dyn Stream> = if file_type.is_socket() {
            let stream = UnixStream::connect(&place.path).map_err(cannot)?;
            stream.set_nonblocking(true).map_err(cannot)?;
            Box::new(stream)
        } else {
            let port = serialport::new(&place.path, place.rate)
                .timeout(Duration::ZERO)
                .open_native();
            Box::new(port.map_err(|error| cannot(error.into()))?)
        };
        Ok(Port {
            stream,
            name: place.path.clone(),
        })
    }

    /// Reads what has come; 0 bytes if nothing has.
    pub(super) fn read(&mut self, buffer: &mut [u8]) -> Result<usize, BridgeError> {
        match self.stream.read(buffer) {
            Ok(0) => Err(self.unplugged(ErrorKind::UnexpectedEof.into())),
            Ok(len) => Ok(len),
            Err(error) if is_wait(&error) => Ok(0),
            Err(error) => Err(self.unplugged(error)),
        }
    }

    /// Writes a frame, at most until `deadline`; what does not get out by then is lost, as on any line.
    pub(super) fn write(&mut self, mut frame: &[u8], deadline: Instant) -> Result<(), BridgeError> {
        while !frame.is_empty() {
            match self.stream.write(frame) {
                Ok(0) => return Err(self.unplugged(ErrorKind::WriteZero.into())),
                Ok(len) => frame = &frame[len..],
                Err(error) if is_wait(&error) => {
                    if Instant::now() >= deadline {
                        return Ok(());
                    }
                    thread::sleep(Duration::from_micros(100));
                }
                Err(error) => return Err(self.unplugged(error)),
            }
        }
        Ok(())
    }

    fn unplugged(&self, source: io::Error) -> BridgeError {
        BridgeError::Unplugged {
            path: self.name.clone(),
            source,
        }
    }
}

fn is_wait(error: &io::Error) -> bool {
    matches!(
        error.kind(),
        ErrorKind::WouldBlock | ErrorKind::TimedOut | ErrorKind::Interrupted
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn places_are_read_and_nonsense_is_named() {
        let place: SerialPath = "serial:/dev/ttyACM0".parse().unwrap();
        assert_eq!((place.path.as_str(), place.rate), ("/dev/ttyACM0", RATE));
        let place: SerialPath = "serial:/dev/ttyS1@921600".parse().unwrap();
        assert_eq!((place.path.as_str(), place.rate), ("/dev/ttyS1", 921_600));
        for nonsense in ["", "serial:", "/dev/ttyACM0", "serial:/dev/ttyS1@fast"] {
            assert!(nonsense.parse::<SerialPath>().is_err(), "{nonsense}");
        }
    }
}
