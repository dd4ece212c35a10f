//! Peers that do not keep to the protocol: what they send is told, never believed.

mod support;

use std::thread::{self, JoinHandle};
use std::time::Duration;

use iceoryx2::prelude::ZeroCopySend;
use support::{policy, within_watchdog};
use tpg_runtime::Policy;
use tpg_sim_bridge::message::{
    ActionMessage, Message, ObservationMessage, Refusal, Request, Response, Role,
};
use tpg_sim_bridge::{BridgeError, Handshake, Link, RunName, Server, Status};

/// Longer than any test may take.
const NEVER: Duration = Duration::from_secs(3600);

fn handshake(blob: &[u8]) -> Handshake {
    Handshake::new(&Policy::load(blob).unwrap(), blob).unwrap()
}

/// A controller that serves until its plant leaves; what ended it.
fn serve(run: &RunName) -> JoinHandle<Result<(), BridgeError>> {
    let run = run.clone();
    thread::spawn(move || {
        let blob = policy::cartpole(0);
        let policy = Policy::load(&blob).unwrap();
        Server::connect(policy, &blob, &run, NEVER)?.serve()
    })
}

type PlantLink = Link<ObservationMessage, ActionMessage>;

/// A plant that says what it likes.
fn plant(run: &RunName) -> PlantLink {
    Link::connect(run, &handshake(&policy::cartpole(0)), NEVER).unwrap()
}

fn request(seq: u64, kind: u32, len: u32) -> ObservationMessage {
    let mut message = ObservationMessage::empty();
    (message.seq, message.kind, message.len) = (seq, kind, len);
    message
}

/// What the controller says of one request, and how it ends.
fn refused(message: ObservationMessage) -> (ActionMessage, String) {
    within_watchdog(move || {
        let run = RunName::unique();
        let server = serve(&run);
        let link = plant(&run);
        link.send(&message).unwrap();
        let reply = link.receive().unwrap();
        (reply, server.join().unwrap().unwrap_err().to_string())
    })
}

#[test]
fn controller_refuses_garbage_and_says_why() {
    let observe = Request::Observe.code();
    let cases = [
        (
            request(1, 77, 0),
            Refusal::Kind,
            77,
            "plant sent an invalid message: kind of request is 77",
        ),
        (
            request(1, observe, 5),
            Refusal::Length,
            5,
            "plant sent an invalid message: length of observation is 5",
        ),
        (
            request(1, observe, u32::MAX),
            Refusal::Length,
            u32::MAX,
            "plant sent an invalid message: length of observation is 4294967295",
        ),
        (
            request(3, observe, 4),
            Refusal::Sequence,
            3,
            "plant is out of step: message 1 was due, message 3 came",
        ),
    ];
    for (message, refusal, detail, text) in cases {
        let (reply, error) = refused(message);
        assert_eq!(reply.seq, message.seq);
        assert_eq!(reply.kind, Response::Refused.code());
        assert_eq!((reply.refusal, reply.detail), (refusal.code(), detail));
        assert_eq!(error, text);
    }
}

#[test]
fn controller_survives_an_observation_of_garbage() {
    within_watchdog(|| {
        let run = RunName::unique();
        let server = serve(&run);
        let link = plant(&run);
        let mut message = request(1, Request::Observe.code(), 4);
        message.values = [f32::NAN; _];
        link.send(&message).unwrap();
        let reply = link.receive().unwrap();
        assert_eq!(reply.kind, Response::Discrete.code());
        link.send(&request(2, Request::Shutdown.code(), 0)).unwrap();
        assert_eq!(link.receive().unwrap().kind, Response::Ready.code());
        assert!(server.join().unwrap().is_ok());
    });
}

#[test]
fn controller_tells_that_the_plant_left() {
    within_watchdog(|| {
        let run = RunName::unique();
        let server = serve(&run);
        drop(plant(&run));
        let error = server.join().unwrap().unwrap_err();
        assert!(matches!(error, BridgeError::Left { .. }), "{error}");
        assert_eq!(error.status(), Status::Peer);
    });
}

/// As large as an action, of another type.
#[derive(Debug, Clone, Copy, ZeroCopySend)]
#[type_name("someone/else")]
#[repr(C)]
struct Foreign([u64; size_of::<ActionMessage>() / 8]);

impl Message for Foreign {
    const SENDER: Role = Role::Controller;
    const TOPIC: &'static str = ActionMessage::TOPIC;
}

#[test]
fn foreign_messages_are_refused() {
    within_watchdog(|| {
        let run = RunName::unique();
        let handshake = handshake(&policy::cartpole(0));
        let (theirs, name) = (handshake.clone(), run.clone());
        let foreign = thread::spawn(move || {
            let short = Duration::from_millis(500);
            Link::<Foreign, ObservationMessage>::connect(&name, &theirs, short).map(drop)
        });
        let error = PlantLink::connect(&run, &handshake, NEVER).unwrap_err();
        assert!(matches!(error, BridgeError::Foreign { .. }), "{error}");
        assert_eq!(error.status(), Status::Peer);
        assert!(foreign.join().unwrap().is_err());
    });
}

#[cfg(feature = "plant")]
mod plant_side {
    use super::*;
    use tpg_runtime::Reset;
    use tpg_sim_bridge::RemoteController;
    use tpg_tasks::eval::Controller as _;

    /// What the plant says of a controller that spoils a true answer to the first observation.
    fn told(blob: Vec<u8>, spoil: impl Fn(&mut ActionMessage) + Send + 'static) -> String {
        within_watchdog(move || {
            let run = RunName::unique();
            let (name, theirs) = (run.clone(), handshake(&blob));
            let controller = thread::spawn(move || {
                let link =
                    Link::<ActionMessage, ObservationMessage>::connect(&name, &theirs, NEVER)?;
                loop {
                    let request = link.receive()?;
                    let mut reply = ActionMessage::empty();
                    (reply.seq, reply.kind) = (request.seq, Response::Ready.code());
                    if request.kind == Request::Observe.code() {
                        spoil(&mut reply);
                    }
                    link.send(&reply)?;
                }
            });
            let policy = Policy::load(&blob).unwrap();
            let inputs = usize::from(policy.header().observation_len);
            let mut remote = RemoteController::connect(&policy, &blob, &run, NEVER).unwrap();
            remote.reset(Reset::Agent, 1).unwrap();
            let error = remote.decide(&vec![0.0; inputs]).unwrap_err();
            drop(remote);
            let ended: Result<(), BridgeError> = controller.join().unwrap();
            assert!(ended.is_err());
            assert_eq!(error.status(), Status::Peer);
            error.to_string()
        })
    }

    fn continuous(reply: &mut ActionMessage, len: u32, value: f32) {
        (reply.kind, reply.len) = (Response::Continuous.code(), len);
        reply.values[1] = value;
    }

    #[test]
    fn plant_tells_what_is_wrong_with_a_reply() {
        let cartpole = || policy::cartpole(0);
        let text = told(cartpole(), |reply| reply.seq += 5);
        assert_eq!(
            text,
            "controller is out of step: message 2 was due, message 7 came"
        );
        let text = told(cartpole(), |reply| reply.kind = 99);
        assert_eq!(
            text,
            "controller sent an invalid message: kind of reply is 99"
        );
        let text = told(cartpole(), |reply| {
            (reply.kind, reply.index) = (Response::Discrete.code(), 2);
        });
        assert_eq!(
            text,
            "controller sent an invalid message: index of an action is 2"
        );
        let text = told(cartpole(), |reply| {
            reply.kind = Response::Refused.code();
            (reply.refusal, reply.detail) = (Refusal::Length.code(), 4);
        });
        assert!(
            text.contains("refused the request: observation length 4"),
            "{text}"
        );
        let text = told(policy::hopper(), |reply| continuous(reply, 3, f32::NAN));
        assert_eq!(
            text,
            "controller sent an invalid message: value of an action is NaN"
        );
        let text = told(policy::hopper(), |reply| continuous(reply, 3, 1.5));
        assert_eq!(
            text,
            "controller sent an invalid message: value of an action is 1.5"
        );
        let text = told(policy::hopper(), |reply| continuous(reply, 600, 0.0));
        assert_eq!(
            text,
            "controller sent an invalid message: length of an action is 600"
        );
    }
}
