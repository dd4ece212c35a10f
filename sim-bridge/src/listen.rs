//! A controller for any plant: it listens on a Unix socket or a UDP port and speaks the open protocol of docs/wire.md.

use std::fmt;
use std::io::{self, ErrorKind, Read as _, Write as _};
use std::net::{SocketAddr, UdpSocket};
use std::os::unix::net::{UnixListener, UnixStream};
use std::path::{Path, PathBuf};
use std::str::FromStr;
use std::thread;
use std::time::Duration;

use tpg_runtime::Policy;

use crate::conversation::{Conversation, FRAME, greets};
use crate::error::BridgeError;
use crate::interrupt;

/// Longest time without a look for an interruption.
const LOOK_INTERVAL: Duration = Duration::from_millis(100);
/// Time between two looks for a plant.
const ACCEPT_INTERVAL: Duration = Duration::from_millis(5);

/// Where a controller listens: `unix:PATH` or `udp:HOST:PORT`.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum ListenPlace {
    /// A Unix socket with this path.
    Unix(PathBuf),
    /// A UDP address with its port.
    Udp(String),
}

impl FromStr for ListenPlace {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        match text.split_once(':') {
            Some(("unix", path)) if !path.is_empty() => Ok(ListenPlace::Unix(path.into())),
            Some(("udp", address)) if address.contains(':') => {
                Ok(ListenPlace::Udp(address.to_owned()))
            }
            _ => Err(format!(
                "{text:?} is no place to listen: use unix:PATH, or udp:HOST:PORT such as udp:127.0.0.1:7000"
            )),
        }
    }
}

impl fmt::Display for ListenPlace {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            ListenPlace::Unix(path) => write!(f, "unix:{}", path.display()),
            ListenPlace::Udp(address) => write!(f, "udp:{address}"),
        }
    }
}

/// Answers whatever plant asks, one after another, until the user interrupts. `ready` is told where it listens.
///
/// # Errors
/// [`BridgeError::CannotListen`], [`BridgeError::Interrupted`], and those of a policy that does not fit.
pub fn listen(
    policy: Policy<'_>,
    file: &[u8],
    place: &ListenPlace,
    ready: impl FnOnce(&str),
) -> Result<(), BridgeError> {
    let mut conversation = Conversation::new(policy, file)?;
    let failed = |source: io::Error| BridgeError::CannotListen {
        place: place.to_string(),
        source,
    };
    match place {
        ListenPlace::Unix(path) => {
            let listener = UnixListener::bind(path).map_err(failed)?;
            let _socket = SocketFile(path);
            listener.set_nonblocking(true).map_err(failed)?;
            ready(&place.to_string());
            loop {
                match listener.accept() {
                    Ok((stream, _)) => serve(stream, &mut conversation)?,
                    Err(error) if is_wait(&error) => thread::sleep(ACCEPT_INTERVAL),
                    Err(error) => return Err(failed(error)),
                }
                check_interrupt()?;
            }
        }
        ListenPlace::Udp(address) => {
            let socket = UdpSocket::bind(address).map_err(failed)?;
            socket
                .set_read_timeout(Some(LOOK_INTERVAL))
                .map_err(failed)?;
            let bound = socket.local_addr().map_err(failed)?;
            ready(&format!("udp:{bound}"));
            serve_datagrams(&socket, &mut conversation).map_err(|error| match error {
                Stop::Interrupted => BridgeError::Interrupted,
                Stop::Failed(source) => failed(source),
            })
        }
    }
}

/// The file of a socket, removed in the end.
struct SocketFile<'a>(&'a Path);

impl Drop for SocketFile<'_> {
    fn drop(&mut self) {
        // Somebody else may have removed it.
        let _ = std::fs::remove_file(self.0);
    }
}

/// Answers on a stream until its plant leaves.
fn serve(mut stream: UnixStream, conversation: &mut Conversation<'_>) -> Result<(), BridgeError> {
    // A stream that cannot be prepared or written to is that of a plant that has left.
    if stream.set_nonblocking(false).is_err()
        || stream.set_read_timeout(Some(LOOK_INTERVAL)).is_err()
    {
        return Ok(());
    }
    let mut buffer = [0; FRAME];
    loop {
        match stream.read(&mut buffer) {
            Ok(0) => return Ok(()),
            Ok(len) => {
                for byte in &buffer[..len] {
                    if stream.write_all(conversation.take(*byte)).is_err() {
                        return Ok(());
                    }
                }
            }
            Err(error) if is_wait(&error) => {}
            Err(_) => return Ok(()),
        }
        check_interrupt()?;
    }
}

/// Why no more datagrams are answered.
enum Stop {
    Interrupted,
    Failed(io::Error),
}

/// Answers datagrams of whoever has greeted last.
fn serve_datagrams(socket: &UdpSocket, conversation: &mut Conversation<'_>) -> Result<(), Stop> {
    let mut buffer = [0; FRAME];
    let mut plant: Option<SocketAddr> = None;
    loop {
        if interrupt::requested() {
            return Err(Stop::Interrupted);
        }
        match socket.recv_from(&mut buffer) {
            Ok((len, from)) => {
                let datagram = &buffer[..len];
                if plant != Some(from) {
                    if !greets(datagram) {
                        continue;
                    }
                    plant = Some(from);
                }
                for byte in datagram {
                    let answer = conversation.take(*byte);
                    if !answer.is_empty() {
                        // What does not get out is lost, as on any line; the plant asks again.
                        let _ = socket.send_to(answer, from);
                    }
                }
            }
            // The last one reports that an earlier answer found nobody.
            Err(error) if is_wait(&error) || error.kind() == ErrorKind::ConnectionRefused => {}
            Err(error) => return Err(Stop::Failed(error)),
        }
    }
}

fn check_interrupt() -> Result<(), BridgeError> {
    if interrupt::requested() {
        return Err(BridgeError::Interrupted);
    }
    Ok(())
}

/// Whether an error only says that there is nothing to read, or no room to write, by now.
pub(crate) fn is_wait(error: &io::Error) -> bool {
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
        for text in ["unix:/run/tpg.sock", "udp:127.0.0.1:7000", "udp:[::1]:7000"] {
            let place = text.parse::<ListenPlace>().map(|place| place.to_string());
            assert_eq!(place, Ok(text.into()));
        }
        for nonsense in ["", "unix:", "udp:7000", "tcp:127.0.0.1:1", "/run/tpg.sock"] {
            assert!(nonsense.parse::<ListenPlace>().is_err(), "{nonsense}");
        }
    }
}
