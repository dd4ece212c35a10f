//! One end of a loop: a service in each direction, lock-step, a deadline on every wait.
//!
//! Each process creates the service that it sends on, with its [`Handshake`] as attributes, and opens the
//! other's. So both processes see both handshakes, in whatever order they start.

use std::thread;
use std::time::{Duration, Instant};

use iceoryx2::port::{publisher::Publisher, subscriber::Subscriber};
use iceoryx2::prelude::{PortFactory as _, *};
use iceoryx2::service::builder::publish_subscribe::{
    PublishSubscribeCreateError as CreateError, PublishSubscribeOpenError as OpenError,
};
use iceoryx2::service::port_factory::publish_subscribe::PortFactory;

use crate::args::Deadlines;
use crate::domain;
use crate::error::BridgeError;
use crate::handshake::Handshake;
use crate::interrupt;
use crate::message::Message;
use crate::peer::Peer;
use crate::run::{Presence, RunName};
use crate::watchdog::Watchdog;

/// Silence after which a wait looks whether the peer still lives.
pub(crate) const LIVENESS_INTERVAL: Duration = Duration::from_millis(100);
/// Time between two looks for a peer that has not come yet.
const CONNECT_INTERVAL: Duration = Duration::from_millis(1);
/// Time for which a process that must refuse its peer stays, so that the peer learns why.
const REFUSAL_STAY: Duration = Duration::from_millis(500);
/// Messages that may lie unread; lock-step never needs more than one, in real time the oldest makes room.
const UNREAD: usize = 4;

/// A service that carries messages `M`.
type Service<M> = PortFactory<ipc::Service, M, ()>;

/// An end of a loop that sends `S` and receives `R`.
#[derive(Debug)]
pub struct Link<S: Message, R: Message> {
    publisher: Publisher<ipc::Service, S, ()>,
    subscriber: Subscriber<ipc::Service, R, ()>,
    theirs: Service<R>,
    node: Node<ipc::Service>,
    peer: Peer,
    timeout: Duration,
    /// Left when everything above is gone.
    _presence: Presence,
}

impl<S: Message, R: Message> Link<S, R> {
    /// Joins a run and waits for its peer, in whatever order they start.
    ///
    /// Some waits of the shared memory's library know no deadline. Where
    /// [`may_end_this_process`](crate::may_end_this_process) was called, they end the process instead.
    ///
    /// # Errors
    /// Any [`BridgeError`] that concerns connecting.
    pub fn connect(
        run: &RunName,
        handshake: &Handshake,
        deadlines: impl Into<Deadlines>,
    ) -> Result<Self, BridgeError> {
        let deadlines = deadlines.into();
        let start = Instant::now();
        let watchdog = Watchdog::start(run, deadlines.answer);
        let presence = Presence::enter(run)?;
        let node = domain::node(run, &presence.folder(), S::SENDER.name())?;
        let ours = create::<S>(&node, run, handshake)?;
        let publisher = ours
            .publisher_builder()
            .max_loaned_samples(1)
            // Waiting for room could wait for ever; there is always room, since the oldest message makes it.
            .backpressure_strategy(BackpressureStrategy::DiscardData)
            .create()
            .map_err(BridgeError::transport("create a publisher"))?;
        let pause = || {
            if interrupt::requested() {
                return Err(BridgeError::Interrupted);
            }
            watchdog.feed();
            thread::sleep(CONNECT_INTERVAL);
            Ok(start.elapsed())
        };
        let (theirs, peer) = loop {
            if let Some(met) = meet::<R>(&node, run)? {
                break met;
            }
            if pause()? >= deadlines.start {
                return Err(BridgeError::NotConnected {
                    peer: R::SENDER,
                    run: run.to_string(),
                    waited_ms: deadlines.start.as_millis(),
                });
            }
        };
        let subscriber = theirs
            .subscriber_builder()
            .create()
            .map_err(BridgeError::transport("create a subscriber"))?;
        let peer_is_here = || ours.dynamic_config().number_of_subscribers() > 0;
        if let Some((difference, advice)) = handshake.difference(theirs.attributes()) {
            let stay = start.elapsed() + REFUSAL_STAY;
            while !peer_is_here() && pause()? < stay {}
            return Err(BridgeError::Mismatch {
                peer: R::SENDER,
                run: run.to_string(),
                difference,
                advice,
            });
        }
        while !peer_is_here() {
            if theirs.dynamic_config().number_of_publishers() == 0 {
                return Err(peer.gone(node.config()));
            }
            let waited = pause()?;
            if waited >= deadlines.start {
                peer.look(node.config(), waited, deadlines.start)?;
            }
        }
        Ok(Link {
            publisher,
            subscriber,
            theirs,
            node,
            peer,
            timeout: deadlines.answer,
            _presence: presence,
        })
    }

    /// Process number of the peer.
    #[must_use]
    pub const fn peer_pid(&self) -> u32 {
        self.peer.pid
    }

    /// Sends a message.
    ///
    /// # Errors
    /// [`BridgeError::Left`] if nobody is there to receive it, [`BridgeError::Transport`] if it cannot be sent.
    pub fn send(&self, message: &S) -> Result<(), BridgeError> {
        match self.publisher.send_copy(*message) {
            Ok(0) => Err(self.peer.gone(self.node.config())),
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
            if let Some(message) = self.poll()? {
                return Ok(message);
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

    /// Takes the next message if there is one, without waiting.
    ///
    /// # Errors
    /// The peer left, or shared memory failed.
    pub fn poll(&self) -> Result<Option<R>, BridgeError> {
        // Read before the message is looked for: a peer may send its last word and leave.
        let present = self.theirs.dynamic_config().number_of_publishers() > 0;
        match self.subscriber.receive() {
            Ok(Some(sample)) => Ok(Some(*sample.payload())),
            Ok(None) if !present => Err(self.peer.gone(self.node.config())),
            Ok(None) => Ok(None),
            Err(error) => Err(BridgeError::transport("receive a message")(error)),
        }
    }

    /// Finds out why the peer has said nothing for a while; no error if it may go on saying nothing.
    pub(crate) fn look(&self, waited: Duration) -> Result<(), BridgeError> {
        self.peer.look(self.node.config(), waited, self.timeout)
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
    handshake: &Handshake,
) -> Result<Service<M>, BridgeError> {
    let created = node
        .service_builder(&service_name::<M>(run)?)
        .publish_subscribe::<M>()
        .history_size(0)
        .subscriber_max_buffer_size(UNREAD)
        .subscriber_max_borrowed_samples(1)
        .enable_safe_overflow(true)
        .max_publishers(1)
        .max_subscribers(1)
        .max_nodes(2)
        .create_with_attributes(&handshake.attributes()?);
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
fn meet<M: Message>(
    node: &Node<ipc::Service>,
    run: &RunName,
) -> Result<Option<(Service<M>, Peer)>, BridgeError> {
    let opened = node
        .service_builder(&service_name::<M>(run)?)
        .publish_subscribe::<M>()
        .open();
    let service = match opened {
        Ok(service) => service,
        Err(
            OpenError::DoesNotExist
            | OpenError::HangsInCreation
            | OpenError::IsMarkedForDestruction
            | OpenError::ServiceInCorruptedState,
        ) => return Ok(None),
        Err(OpenError::ExceedsMaxNumberOfNodes) => {
            return Err(BridgeError::Taken {
                run: run.to_string(),
                role: M::SENDER.peer(),
            });
        }
        Err(
            error @ (OpenError::IncompatibleTypes
            | OpenError::IncompatibleMessagingPattern
            | OpenError::VersionMismatch),
        ) => {
            return Err(BridgeError::Foreign {
                peer: M::SENDER,
                run: run.to_string(),
                source: error.into(),
            });
        }
        Err(error) => return Err(BridgeError::transport("open a service")(error)),
    };
    // Without a publisher the peer is about to come or to leave.
    let mut node_id = None;
    service.dynamic_config().list_publishers(|publisher| {
        node_id = Some(publisher.node_id);
        CallbackProgression::Stop
    });
    let peer = node_id.map(|node_id| Peer::meet(M::SENDER, node.config(), node_id));
    Ok(peer.map(|peer| (service, peer)))
}
