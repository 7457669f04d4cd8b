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
