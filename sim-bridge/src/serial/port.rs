//! A tty, a Unix socket or a UDP port, read without waiting.

use std::fmt;
use std::io::{self, ErrorKind, Read, Write};
use std::net::{ToSocketAddrs as _, UdpSocket};
use std::os::unix::fs::FileTypeExt as _;
use std::os::unix::net::UnixStream;
use std::str::FromStr;
use std::thread;
use std::time::{Duration, Instant};

use crate::error::BridgeError;
use crate::listen::is_wait;

/// Bits per second of a tty by default.
const RATE: u32 = 115_200;

/// What lies between here and a controller.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Medium {
    /// A tty with this many bits per second, or a Unix socket, which ignores them.
    Serial {
        /// Bits per second.
        rate: u32,
    },
    /// UDP, one frame in a datagram.
    Udp,
}

/// Where a controller is: `serial:PATH`, `serial:PATH@RATE` or `udp:HOST:PORT`.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct SerialPath {
    /// A tty, a Unix socket such as that of an emulator's serial line, or host and port.
    pub path: String,
    /// What leads there.
    pub medium: Medium,
}

impl FromStr for SerialPath {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let nonsense = || {
            format!(
                "{text:?} is not a controller: use serial:PATH, such as serial:/dev/ttyACM0, or udp:HOST:PORT"
            )
        };
        let (kind, place) = text.split_once(':').ok_or_else(nonsense)?;
        let (path, medium) = match kind {
            "serial" if !place.is_empty() => match place.rsplit_once('@') {
                Some((path, rate)) => match rate.parse() {
                    Ok(rate) if rate > 0 => (path, Medium::Serial { rate }),
                    _ => return Err(format!("{rate:?} is not a rate in bits per second")),
                },
                None => (place, Medium::Serial { rate: RATE }),
            },
            "udp" if place.contains(':') => (place, Medium::Udp),
            _ => return Err(nonsense()),
        };
        Ok(SerialPath {
            path: path.to_owned(),
            medium,
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

/// A UDP port as a stream of whole frames. What finds nobody is lost, as on any line.
struct Datagrams(UdpSocket);

impl Datagrams {
    fn open(place: &str) -> io::Result<Self> {
        let address = place.to_socket_addrs()?.next();
        let address = address.ok_or_else(|| io::Error::from(ErrorKind::AddrNotAvailable))?;
        let here = if address.is_ipv4() {
            "0.0.0.0:0"
        } else {
            "[::]:0"
        };
        let socket = UdpSocket::bind(here)?;
        socket.connect(address)?;
        socket.set_nonblocking(true)?;
        Ok(Datagrams(socket))
    }
}

impl Read for Datagrams {
    /// Reads a datagram; one without bytes is nothing, not the end.
    fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        match self.0.recv(buffer) {
            Ok(0) => Err(ErrorKind::WouldBlock.into()),
            Err(error) if error.kind() == ErrorKind::ConnectionRefused => {
                Err(ErrorKind::WouldBlock.into())
            }
            received => received,
        }
    }
}

impl Write for Datagrams {
    fn write(&mut self, frame: &[u8]) -> io::Result<usize> {
        match self.0.send(frame) {
            // An earlier datagram found nobody, which is told now.
            Err(error) if error.kind() == ErrorKind::ConnectionRefused => Ok(frame.len()),
            sent => sent,
        }
    }

    fn flush(&mut self) -> io::Result<()> {
        Ok(())
    }
}

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
        let is_socket = || {
            let metadata = std::fs::metadata(&place.path).map_err(cannot)?;
            Ok::<_, BridgeError>(metadata.file_type().is_socket())
        };
        let stream: Box<dyn Stream> = match place.medium {
            Medium::Udp => Box::new(Datagrams::open(&place.path).map_err(cannot)?),
            Medium::Serial { .. } if is_socket()? => {
                let stream = UnixStream::connect(&place.path).map_err(cannot)?;
                stream.set_nonblocking(true).map_err(cannot)?;
                Box::new(stream)
            }
            Medium::Serial { rate } => {
                let port = serialport::new(&place.path, rate)
                    .timeout(Duration::ZERO)
                    .open_native();
                Box::new(port.map_err(|error| cannot(error.into()))?)
            }
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn places_are_read_and_nonsense_is_named() {
        let read = |text: &str| {
            let place: SerialPath = text.parse()?;
            Ok::<_, String>((place.path, place.medium))
        };
        let serial = |path: &str, rate| Ok((path.to_owned(), Medium::Serial { rate }));
        assert_eq!(read("serial:/dev/ttyACM0"), serial("/dev/ttyACM0", RATE));
        assert_eq!(
            read("serial:/dev/ttyS1@921600"),
            serial("/dev/ttyS1", 921_600)
        );
        assert_eq!(
            read("udp:[::1]:7000"),
            Ok(("[::1]:7000".to_owned(), Medium::Udp))
        );
        for nonsense in [
            "",
            "serial:",
            "/dev/ttyACM0",
            "serial:/dev/ttyS1@fast",
            "udp:7000",
            "udp:",
        ] {
            assert!(nonsense.parse::<SerialPath>().is_err(), "{nonsense}");
        }
    }
}
