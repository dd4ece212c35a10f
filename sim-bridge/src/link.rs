//! One end of a loop: a service in each direction, lock-step, a deadline on every wait.
//!
//! Each process creates the service that it sends on, with its [`Contract`] as attributes, and opens the
//! other's. So both see both contracts, whoever starts first.

use std::fmt;
use std::str::FromStr;
use std::thread;
use std::time::{Duration, Instant, SystemTime, UNIX_EPOCH};

use iceoryx2::identifiers::UniqueNodeId;
use iceoryx2::port::{publisher::Publisher, subscriber::Subscriber};
use iceoryx2::prelude::*;
use iceoryx2::service::builder::publish_subscribe::{
    PublishSubscribeCreateError as CreateError, PublishSubscribeOpenError as OpenError,
};
use iceoryx2::service::port_factory::publish_subscribe::PortFactory as Service;

use crate::contract::Contract;
use crate::domain::{self, Fate};
use crate::error::BridgeError;
use crate::interrupt;
use crate::message::Message;

/// Silence after which a wait looks whether the peer still lives.
const LIVENESS_INTERVAL: Duration = Duration::from_millis(100);
/// Time between two looks for a peer that has not come yet.
const CONNECT_INTERVAL: Duration = Duration::from_millis(1);
/// Time for which a process that must refuse its peer stays, so that the peer learns why.
const REFUSAL_STAY: Duration = Duration::from_millis(500);
/// Messages that may lie unread; lock-step never needs more than one.
const UNREAD: usize = 4;

/// Name of a run, which both of its processes must be given.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct RunName(String);

impl RunName {
    /// A name that no other run on this machine has.
    #[must_use]
    pub fn unique() -> Self {
        let now = SystemTime::now().duration_since(UNIX_EPOCH);
        let nanos = now.map_or(0, |d| d.as_nanos());
        RunName(format!("{}-{nanos:x}", std::process::id()))
    }
}

impl FromStr for RunName {
    type Err = BridgeError;

    fn from_str(name: &str) -> Result<Self, BridgeError> {
        let allowed = |b: u8| b.is_ascii_alphanumeric() || b"-_.".contains(&b);
        if (1..=64).contains(&name.len()) && name.bytes().all(allowed) {
            Ok(RunName(name.into()))
        } else {
            Err(BridgeError::RunName { name: name.into() })
        }
    }
}

impl fmt::Display for RunName {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.0)
    }
}

/// An end of a loop that sends `S` and receives `R`.
#[derive(Debug)]
pub struct Link<S: Message, R: Message> {
    publisher: Publisher<ipc::Service, S, ()>,
    subscriber: Subscriber<ipc::Service, R, ()>,
    theirs: Service<ipc::Service, R, ()>,
    node: Node<ipc::Service>,
    peer_node: UniqueNodeId,
    peer_pid: u32,
    timeout: Duration,
}

impl<S: Message, R: Message> Link<S, R> {
    /// Joins a run and waits for its peer, in whatever order they start.
    ///
    /// `timeout` is the deadline of this wait and of every later one.
    ///
    /// # Errors
    /// Any [`BridgeError`] that concerns connecting.
    pub fn connect(
        run: &RunName,
        contract: &Contract,
        timeout: Duration,
    ) -> Result<Self, BridgeError> {
        let start = Instant::now();
        let node = domain::node(&format!("{}/{run}", S::SENDER))?;
        let ours = create::<S>(&node, run, contract)?;
        let publisher = ours
            .publisher_builder()
            .max_loaned_samples(1)
            // Waiting for room could wait for ever; lock-step always has room.
            .backpressure_strategy(BackpressureStrategy::DiscardData)
            .create()
            .map_err(BridgeError::transport("create a publisher"))?;
        let pause = |deadline: Duration| {
            if interrupt::requested() {
                return Err(BridgeError::Interrupted);
            }
            thread::sleep(CONNECT_INTERVAL);
            Ok(start.elapsed() < deadline)
        };
        let not_connected = || BridgeError::NotConnected {
            peer: R::SENDER,
            run: run.to_string(),
            waited_ms: timeout.as_millis(),
        };
        let peer_is_here = || ours.dynamic_config().number_of_subscribers() > 0;
        let theirs = loop {
            if let Some(theirs) = open::<R>(&node, run)? {
                break theirs;
            }
            if !pause(timeout)? {
                return Err(not_connected());
            }
        };
        let subscriber = theirs
            .subscriber_builder()
            .create()
            .map_err(BridgeError::transport("create a subscriber"))?;
        if let Some((difference, advice)) = contract.difference(theirs.attributes()) {
            let stay = start.elapsed() + REFUSAL_STAY;
            while !peer_is_here() && pause(stay)? {}
            return Err(BridgeError::Mismatch {
                peer: R::SENDER,
                run: run.to_string(),
                difference,
                advice,
            });
        }
        while !peer_is_here() {
            if !pause(timeout)? {
                return Err(not_connected());
            }
        }
        let mut peer_node = None;
        ours.dynamic_config().list_subscribers(|subscriber| {
            peer_node = Some(subscriber.node_id);
            CallbackProgression::Stop
        });
        let peer_node = peer_node.ok_or_else(not_connected)?;
        let peer_pid = domain::process_of(node.config(), peer_node).unwrap_or(0);
        Ok(Link {
            publisher,
            subscriber,
            theirs,
            node,
            peer_node,
            peer_pid,
            timeout,
        })
    }

    /// Process number of the peer.
    #[must_use]
    pub const fn peer_pid(&self) -> u32 {
        self.peer_pid
    }

    /// Sends a message.
    ///
    /// # Errors
    /// [`BridgeError::Left`] if nobody is there to receive it, [`BridgeError::Transport`] if it cannot be sent.
    pub fn send(&self, message: &S) -> Result<(), BridgeError> {
        match self.publisher.send_copy(*message) {
            Ok(0) => Err(self.gone()),
            Ok(_) => Ok(()),
            Err(error) => Err(BridgeError::transport("send a message")(error)),
        }
    }

    /// Waits for the next message, polling and yielding the processor between.
    ///
    /// # Errors
    /// Why none came: the peer died, left or is silent; the user interrupted; shared memory failed.
    pub fn receive(&self) -> Result<R, BridgeError> {
        let start = Instant::now();
        let mut next_look = LIVENESS_INTERVAL.min(self.timeout);
        loop {
            // Read before the message is looked for: a peer may send its last word and leave.
            let present = self.theirs.dynamic_config().number_of_publishers() > 0;
            match self.subscriber.receive() {
                Ok(Some(sample)) => return Ok(*sample.payload()),
                Ok(None) if !present => return Err(self.gone()),
                Ok(None) => {}
                Err(error) => return Err(BridgeError::transport("receive a message")(error)),
            }
            if interrupt::requested() {
                return Err(BridgeError::Interrupted);
            }
            let waited = start.elapsed();
            if waited >= next_look {
                self.look(waited)?;
                next_look = (waited + LIVENESS_INTERVAL).min(self.timeout);
            }
            thread::yield_now();
        }
    }

    /// Finds out why the peer is silent, if that must not go on.
    #[cold]
    fn look(&self, waited: Duration) -> Result<(), BridgeError> {
        match domain::fate(self.node.config(), self.peer_node) {
            Fate::Alive if waited < self.timeout => Ok(()),
            Fate::Alive => Err(BridgeError::Silent {
                peer: R::SENDER,
                pid: self.peer_pid,
                waited_ms: waited.as_millis(),
            }),
            Fate::Dead | Fate::Gone => Err(self.gone()),
        }
    }

    /// Why the peer's port is no longer there.
    #[cold]
    fn gone(&self) -> BridgeError {
        let (peer, pid) = (R::SENDER, self.peer_pid);
        match domain::fate(self.node.config(), self.peer_node) {
            Fate::Dead => BridgeError::Died { peer, pid },
            Fate::Alive | Fate::Gone => BridgeError::Left { peer, pid },
        }
    }
}

fn service_name<M: Message>(run: &RunName) -> Result<ServiceName, BridgeError> {
    ServiceName::new(&format!("tpg/{run}/{}", M::TOPIC))
        .map_err(BridgeError::transport("name a service"))
}

/// Creates the service that this process sends on, for itself and its one peer.
fn create<M: Message>(
    node: &Node<ipc::Service>,
    run: &RunName,
    contract: &Contract,
) -> Result<Service<ipc::Service, M, ()>, BridgeError> {
    let created = node
        .service_builder(&service_name::<M>(run)?)
        .publish_subscribe::<M>()
        .history_size(0)
        .subscriber_max_buffer_size(UNREAD)
        .subscriber_max_borrowed_samples(1)
        .enable_safe_overflow(false)
        .max_publishers(1)
        .max_subscribers(1)
        .max_nodes(2)
        .create_with_attributes(&contract.attributes()?);
    created.map_err(|error| match error {
        CreateError::AlreadyExists | CreateError::IsBeingCreatedByAnotherInstance => {
            BridgeError::Taken {
                run: run.to_string(),
                role: M::SENDER,
            }
        }
        error => BridgeError::transport("create a service")(error),
    })
}

/// Opens the service that the peer sends on; `None` if it is not there yet.
fn open<M: Message>(
    node: &Node<ipc::Service>,
    run: &RunName,
) -> Result<Option<Service<ipc::Service, M, ()>>, BridgeError> {
    let opened = node
        .service_builder(&service_name::<M>(run)?)
        .publish_subscribe::<M>()
        .open();
    match opened {
        Ok(service) if service.dynamic_config().number_of_publishers() > 0 => Ok(Some(service)),
        // Without a publisher the peer is about to come or to leave.
        Ok(_) => Ok(None),
        Err(
            OpenError::DoesNotExist
            | OpenError::HangsInCreation
            | OpenError::IsMarkedForDestruction
            | OpenError::ServiceInCorruptedState,
        ) => Ok(None),
        Err(OpenError::ExceedsMaxNumberOfNodes) => Err(BridgeError::Taken {
            run: run.to_string(),
            role: M::SENDER.peer(),
        }),
        Err(
            error @ (OpenError::IncompatibleTypes
            | OpenError::IncompatibleMessagingPattern
            | OpenError::VersionMismatch),
        ) => Err(BridgeError::Foreign {
            peer: M::SENDER,
            run: run.to_string(),
            source: error.into(),
        }),
        Err(error) => Err(BridgeError::transport("open a service")(error)),
    }
}
