//! The machine as a whole: who may command, what is told.

use service::{AxisState, Caller, Code, LeaseRequest, MotionState, StopMode};

use super::{anna, bert, slowly, to, with_zeroed_stage};

fn lease(name: &str, force: bool) -> LeaseRequest {
    LeaseRequest {
        name: name.into(),
        seconds: 3600,
        force,
    }
}

#[test]
fn only_the_holder_of_the_lease_commands_and_anybody_stops() {
    with_zeroed_stage(|bed| {
        let leased = bed.client.lease(&anna(), &lease("anna", false)).unwrap();
        let holder = Caller {
            lease: Some(leased.token.clone()),
            ..anna()
        };
        let refused = bed.client.begin(&bert(), &to("x", 1.0), None).unwrap_err();
        assert_eq!(refused.code, Code::Leased, "{refused}");
        assert!(refused.detail().contains("anna"));
        let id = bed.client.begin(&holder, &slowly("x", 30.0), None).unwrap();
        bed.under_way(&id);
        bed.client.stop(&bert(), StopMode::Controlled).unwrap();
        assert_eq!(bed.ended(&id).state, MotionState::Stopped);

        let refused = bed
            .client
            .lease(&bert(), &lease("bert", false))
            .unwrap_err();
        assert_eq!(refused.code, Code::Leased);
        let taken = bed.client.lease(&bert(), &lease("bert", true)).unwrap();
        assert_eq!(taken.taken_from.as_deref(), Some("anna"));
        let told = bed.client.events(0);
        let told = told.iter().rfind(|it| it.kind == "lease").unwrap();
        assert_eq!(told.data["taken_from"], "anna");
        let refused = bed.client.begin(&holder, &to("x", 1.0), None).unwrap_err();
        assert_eq!(refused.code, Code::Leased, "the old token is worth nothing");
        let holder = Caller {
            lease: Some(taken.token),
            ..bert()
        };
        bed.client.release(&holder).unwrap();
        let id = bed.begin(&to("x", 1.0));
        assert_eq!(bed.ended(&id).state, MotionState::Done);
    });
}

#[test]
fn an_axis_is_switched_off_and_on_and_keeps_its_zero() {
    with_zeroed_stage(|bed| {
        bed.client.power(&anna(), "x", false).unwrap();
        let axis = bed.client.axis("x").unwrap();
        assert_eq!((axis.state, axis.homed), (AxisState::Disabled, true));
        bed.client.power(&anna(), "x", true).unwrap();
        let axis = bed.client.axis("x").unwrap();
        assert_eq!((axis.state, axis.homed), (AxisState::Standstill, true));
        let unknown = bed.client.power(&anna(), "q", true).unwrap_err();
        assert_eq!(unknown.code, Code::NoSuchAxis);
    });
}

#[test]
fn events_are_numbered_without_a_gap() {
    with_zeroed_stage(|bed| {
        let events = bed.client.events(0);
        assert!(events.len() > 5, "{events:?}");
        assert!(events.windows(2).all(|it| it[1].id == it[0].id + 1));
        let newest = bed.client.machine().newest_event;
        assert_eq!(bed.client.events(newest), []);
        assert_eq!(bed.client.events(newest - 2).len(), 2);
    });
}

/// Whose lease it is by `token`.
fn with(token: &str) -> Caller {
    Caller {
        lease: Some(token.to_owned()),
        ..anna()
    }
}

fn brief(seconds: u32) -> LeaseRequest {
    LeaseRequest {
        seconds,
        ..lease("anna", false)
    }
}

#[test]
fn a_token_that_lapsed_or_is_unknown_is_refused() {
    with_zeroed_stage(|bed| {
        let leased = bed.client.lease(&anna(), &brief(1)).unwrap();
        let begun = bed.client.machine().clock_s;
        let id = bed
            .client
            .begin(&with(&leased.token), &slowly("x", 3.0), None)
            .unwrap();
        bed.ended(&id);
        assert!(bed.client.machine().clock_s > begun + 1.0);
        assert_eq!(bed.client.machine().lease, None);
        for token in [&*leased.token, "0123456789abcdef0123456789abcdef"] {
            let caller = with(token);
            let refused = bed.client.begin(&caller, &to("x", 1.0), None).unwrap_err();
            assert_eq!(refused.code, Code::LeaseLapsed, "{refused}");
            let refused = bed.client.lease(&caller, &brief(1)).unwrap_err();
            assert_eq!(refused.code, Code::LeaseLapsed, "{refused}");
            let refused = bed.client.release(&caller).unwrap_err();
            assert_eq!(refused.code, Code::LeaseLapsed, "{refused}");
            bed.client.stop(&caller, StopMode::Controlled).unwrap();
        }
        let again = bed.client.lease(&anna(), &brief(60)).unwrap();
        assert_ne!(again.token, leased.token);
        bed.client.release(&with(&again.token)).unwrap();
    });
}

#[test]
fn each_order_of_its_holder_renews_a_lease() {
    with_zeroed_stage(|bed| {
        let leased = bed.client.lease(&anna(), &brief(3600)).unwrap();
        let holder = with(&leased.token);
        let seconds_left = || bed.client.machine().lease.expect("it is held").seconds_left;
        let id = bed.client.begin(&holder, &to("x", 30.0), None).unwrap();
        assert_eq!(bed.ended(&id).state, MotionState::Done);
        // Without an order it only becomes less.
        let before = seconds_left();
        assert!(before < 3600.0, "{before}");
        let id = bed.client.begin(&holder, &to("x", 30.0), None).unwrap();
        let after = seconds_left();
        assert!(after > before, "{after} after {before}");
        bed.ended(&id);
        bed.client.release(&holder).unwrap();
    });
}
