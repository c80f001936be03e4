//! Requests and replies: repetition, ports, serial numbers, self-test.

use super::*;

#[test]
fn a_repeated_mark_gets_a_reply_without_a_second_train() {
    let Some(board) = start(&free_running()) else {
        return;
    };
    let mut edges = board.edges().unwrap();
    let mut ask = requester(&board);
    ask(Request::Arm { silence_ms: 0 });
    let m = |number| Request::Mark {
        number,
        mark: mark(number),
    };
    let first = ask(m(1));
    assert_eq!(first.outcome, Outcome::Done);
    edges.take(EDGES_PER_TRAIN, TIMEOUT).unwrap();
    assert_eq!(ask(m(1)).data, first.data);
    assert_eq!(ask(m(3)).outcome, Outcome::OutOfOrder);
    assert_eq!(ask(m(0)).outcome, Outcome::OutOfOrder);
    assert_eq!(ask(m(2)).outcome, Outcome::Done);
    without_skew(&edges.take(EDGES_PER_TRAIN, TIMEOUT).unwrap());
    let counters = Counters::parse(&ask(Request::Status).data).unwrap();
    assert_eq!(counters.marks, 2);
}

#[test]
fn the_state_of_each_port_is_reported_with_the_next_step() {
    let Some(board) = start(&paced()) else {
        return;
    };
    let port = board.port().to_str().unwrap().to_owned();
    let ports = [port.clone(), "/dev/no-such-port".to_owned()];
    let found = enumerate(&ports, TIMEOUT);
    assert!(
        matches!(&found[0].state, PortState::Ready(identity) if identity.serial == "TB-0001"),
        "{}",
        found[0].state
    );
    assert!(found[1].state.to_string().contains("connect the box"));
    let device = open(&board, RealClock::start());
    let found = enumerate(&ports[..1], TIMEOUT);
    assert!(
        matches!(found[0].state, PortState::Closed(OpenError::Busy(_))),
        "{}",
        found[0].state
    );
    drop(device);
    let wrong = TriggerBoxConfig {
        serial: Some("TB-0002".to_owned()),
        ..config(&board)
    };
    let Err(error) = SerialTriggerBox::open(wrong, RealClock::start()) else {
        panic!("accepted the wrong box");
    };
    assert!(matches!(error, DeviceError::Refused { .. }), "{error}");
}

#[test]
fn a_new_serial_number_is_stored_and_the_self_test_reads_the_outputs() {
    let Some(mut board) = start(&paced()) else {
        return;
    };
    let mut device = SerialTriggerBox::open(config(&board), RealClock::start()).unwrap();
    let refused = device.set_serial("with blanks").unwrap_err();
    assert!(matches!(refused, DeviceError::Refused { .. }), "{refused}");
    assert!(matches!(device.self_test(), Err(DeviceError::State { .. })));
    device.set_serial("TB-7").unwrap();
    drop(device);
    board.reset(ResetCause::Button).unwrap();
    let mut device = open(&board, RealClock::start());
    assert_eq!(device.identity().serial, "TB-7");
    let mut edges = board.edges().unwrap();
    let test = device.self_test().unwrap();
    assert!(test.rose && test.fell && !test.input_followed);
    assert_eq!(edges.take(6, TIMEOUT).unwrap().len(), 6);
    board.loop_back(100).unwrap();
    assert!(device.self_test().unwrap().input_followed);
}
