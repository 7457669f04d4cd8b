use super::*;
use proptest::prelude::*;

fn at(node: u8) -> Address {
    Address::node(node).unwrap()
}

const fn set(parameter: Parameter, value: i64) -> Command {
    Command::Set {
        bank: Bank::Ram,
        parameter,
        value,
    }
}

const fn get(bank: Bank, parameter: Parameter) -> Command {
    Command::Get { bank, parameter }
}

#[track_caller]
fn check_request(line: &str, address: Address, command: Command) {
    let request = Request { address, command };
    assert_eq!(String::from_utf8_lossy(&request.emit()), line);
    assert_eq!(Request::parse(line.trim_end().as_bytes()), Ok(request));
}

/// The guide's examples: p. 10, 11, 13, 15, 29, 39, 42, 47.
#[test]
fn commands_are_those_of_the_guide() {
    let gateway = Address::GATEWAY;
    let move_to = set(Parameter::POSITION_COMMAND, 40_000);
    check_request("s r0xca 40000\r", gateway, move_to);
    check_request("s r0xcb 70000\r", gateway, set(Parameter::SPEED, 70_000));
    check_request("s r0xc2 544\r", gateway, set(Parameter::HOMING_METHOD, 544));
    check_request("s r0x24 21\r", gateway, set(Parameter::DESIRED_STATE, 21));
    check_request("s r0x90 19200\r", gateway, set(Parameter::BAUD, 19_200));
    check_request(
        "g r0x32\r",
        gateway,
        get(Bank::Ram, Parameter::MOTOR_POSITION),
    );
    check_request(
        "g r0xa0\r",
        gateway,
        get(Bank::Ram, Parameter::EVENT_STATUS),
    );
    check_request("g f0x17\r", gateway, get(Bank::Flash, Parameter::POSITION));
    check_request("t 1\r", gateway, Command::Trajectory(Trajectory::Move));
    check_request("t 2\r", gateway, Command::Trajectory(Trajectory::Home));
    check_request("t 0\r", gateway, Command::Trajectory(Trajectory::Abort));
    check_request("r\r", gateway, Command::Reset);
    check_request("3 r\r", at(3), Command::Reset);
    check_request("3 g r0x30\r", at(3), get(Bank::Ram, Parameter(0x30)));
    let position_gain = Command::Set {
        bank: Bank::Flash,
        parameter: Parameter(0x30),
        value: 1200,
    };
    check_request("3 s f0x30 1200\r", at(3), position_gain);
    check_request(
        ".b s f0x30 1200\r",
        gateway.axis('b').unwrap(),
        position_gain,
    );
}

#[test]
fn numbers_may_be_hexadecimal_and_letters_large() {
    let expected = Request {
        address: at(127).axis('d').unwrap(),
        command: set(Parameter(0xC2), 0x214),
    };
    for line in ["127.d s r0xc2 0x214", "127.D S R194 532"] {
        assert_eq!(Request::parse(line.as_bytes()), Ok(expected), "{line}");
    }
}

#[track_caller]
fn check_refused(line: &[u8], code: ErrorCode) {
    let refused = Request::parse(line).map_err(|refused| refused.code);
    assert_eq!(refused, Err(code), "{:?}", String::from_utf8_lossy(line));
}

/// The first two stand in the guide (p. 10, 15).
#[test]
fn what_is_no_command_has_the_error_number_of_the_guide() {
    check_refused(b"s r 0x30 1000", ErrorCode::Syntax);
    check_refused(b"t2", ErrorCode::Syntax);
    check_refused(b"", ErrorCode::Syntax);
    check_refused(b"3", ErrorCode::Syntax);
    check_refused(b"s r0xca", ErrorCode::TooLittleData);
    check_refused(b"s r0xca 1 2", ErrorCode::SurplusData);
    check_refused(b"s r0xca +-1", ErrorCode::Syntax);
    check_refused(b"s r0xca 1,5", ErrorCode::Syntax);
    check_refused(b"g r0x10000", ErrorCode::UnknownParameter);
    check_refused(b"t 7", ErrorCode::OutOfRange);
    check_refused(b"x 1", ErrorCode::UnknownCommand);
    check_refused(b"200 g r0xa0", ErrorCode::ForwardingNode);
    check_refused(b"3.e g r0xa0", ErrorCode::AxisLetter);
    check_refused(b"3. g r0xa0", ErrorCode::AxisLetter);
    check_refused(b"\xFF\xFEg r0xa0", ErrorCode::Syntax);
}

#[test]
fn a_refused_line_still_says_whom_it_was_for() {
    let refused = Request::parse(b"5 x 1").unwrap_err();
    assert_eq!((refused.address, refused.code.raw()), (at(5), 3));
}

#[track_caller]
fn check_reply(line: &str, reply: &Reply) {
    assert_eq!(Reply::parse(line.as_bytes()).as_ref(), Ok(reply));
    assert_eq!(reply.emit(), format!("{line}\r").as_bytes());
}

/// The guide's examples: p. 10, 11, 16, 29, 45.
#[test]
fn replies_are_those_of_the_guide() {
    check_reply("ok", &Reply::Ok);
    check_reply("v 1200", &Reply::Value("1200".into()));
    check_reply("v 134217728", &Reply::Value("134217728".into()));
    check_reply("v 0x4000f800", &Reply::Value("0x4000f800".into()));
    check_reply(
        "v -7936 200 0 775 1550",
        &Reply::Value("-7936 200 0 775 1550".into()),
    );
    check_reply("r 15", &Reply::Register("15".into()));
    check_reply("e 33", &Reply::Error(ErrorCode::Syntax));
    check_reply("e 15", &Reply::Error(ErrorCode::NotInThisBank));
    check_reply("e 77", &Reply::Error(ErrorCode::Unknown(77)));
}

#[test]
fn what_is_no_reply_is_never_taken_for_one() {
    for line in [
        &b""[..],
        b"k",
        b"o",
        b"okk",
        b"OK ",
        b"v",
        b"e",
        b"e x",
        b"e -1",
        b"\xFFok",
        b"ok\n\x80",
        b"s r0xca 1",
        b"w 12",
    ] {
        let reply = Reply::parse(line);
        assert_eq!(reply, Err(NotAReply), "{:?}", String::from_utf8_lossy(line));
    }
}

#[test]
fn only_one_number_is_a_number() {
    let number = |value: &str| Reply::Value(value.into()).number();
    assert_eq!(number("-1200"), Some(-1200));
    assert_eq!(number("0x4000f800"), Some(0x4000_F800));
    assert_eq!(number("1 2"), None);
    assert_eq!(number("ACJ-055-18"), None);
    assert_eq!(number("1f"), None);
    assert_eq!(number("-"), None);
    assert_eq!(Reply::Ok.number(), None);
}

/// The guide's example: 134217728 is "in motion", 4096 is "referenced, not aborted" (p. 29).
#[test]
fn the_bits_stand_where_the_guide_has_them() {
    assert_eq!(
        EventStatus::from_bits_retain(134_217_728),
        EventStatus::IN_MOTION
    );
    assert_eq!(
        TrajectoryStatus::from_bits_retain(4096),
        TrajectoryStatus::REFERENCED
    );
    let homed = TrajectoryStatus::REFERENCED | TrajectoryStatus::ABORTED;
    assert_eq!(TrajectoryStatus::from_bits_retain(20_480), homed);
    assert_eq!(EventStatus::TRACKING_ERROR.bits(), 1 << 18);
    assert_eq!(Faults::FOLLOWING_ERROR.bits(), 512);
}

#[test]
fn faults_are_told_by_name_and_unknown_ones_by_bit() {
    let both = Faults::FOLLOWING_ERROR | Faults::MOTOR_HOT;
    assert_eq!(both.to_string(), "motor too hot, following error");
    let odd = Faults::SHORT_CIRCUIT | Faults::from_bits_retain(1 << 13);
    assert_eq!(odd.to_string(), "short circuit, bits 0x2000");
    assert_eq!(Faults::empty().to_string(), "no fault");
}

#[test]
fn error_numbers_and_names_belong_together() {
    let numbers: Vec<u16> = ErrorCode::KNOWN.iter().map(|code| code.raw()).collect();
    assert_eq!(
        numbers,
        [
            1, 3, 4, 5, 9, 10, 11, 14, 15, 16, 18, 19, 20, 21, 22, 25, 27, 31, 32, 33, 36, 46, 48
        ]
    );
    for raw in 0..100 {
        assert_eq!(ErrorCode::from_raw(raw).raw(), raw);
    }
    assert_eq!(ErrorCode::from_raw(2), ErrorCode::Unknown(2));
    assert_eq!(
        ErrorCode::from_raw(18).to_string(),
        "error 18 (the axis is already moving)"
    );
}

fn any_command() -> impl Strategy<Value = Command> {
    let bank = prop_oneof![Just(Bank::Ram), Just(Bank::Flash)];
    let place = (bank, any::<u16>().prop_map(Parameter));
    prop_oneof![
        (place.clone(), any::<i32>()).prop_map(|((bank, parameter), value)| Command::Set {
            bank,
            parameter,
            value: value.into(),
        }),
        place.prop_map(|(bank, parameter)| Command::Get { bank, parameter }),
        Just(Command::Trajectory(Trajectory::Abort)),
        Just(Command::Trajectory(Trajectory::Move)),
        Just(Command::Trajectory(Trajectory::Home)),
        Just(Command::Reset),
    ]
}

proptest! {
    #[test]
    fn every_command_comes_back(
        node in 0u8..=127,
        letter in prop::option::of(prop::char::range('a', 'd')),
        command in any_command(),
    ) {
        let address = letter.map_or(at(node), |letter| at(node).axis(letter).unwrap());
        let request = Request { address, command };
        let line = request.emit();
        prop_assert_eq!(line.last(), Some(&CR));
        prop_assert_eq!(Request::parse(&line[..line.len() - 1]), Ok(request));
    }

    #[test]
    fn no_bytes_make_it_panic(line in prop::collection::vec(any::<u8>(), 0..80)) {
        let _ = Request::parse(&line);
        if let Ok(reply) = Reply::parse(&line) {
            let _ = reply.number();
            let emitted = reply.emit();
            prop_assert_eq!(Reply::parse(&emitted[..emitted.len() - 1]), Ok(reply));
        }
    }

    #[test]
    fn a_number_is_read_as_written(value in any::<i64>()) {
        prop_assume!(value != i64::MIN);
        prop_assert_eq!(Reply::Value(value.to_string()).number(), Some(value));
    }
}
