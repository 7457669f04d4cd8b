//! Who may command.

use core::time::Duration;
use std::sync::Arc;

use serde_json::json;
use units::Time;

use super::Keeper;
use crate::problem::{Code, Problem};
use crate::request::{Caller, LeaseRequest};
use crate::view::Leased;

/// A lease, until it ends.
#[derive(Debug)]
pub(super) struct Lease {
    pub(super) name: Arc<str>,
    token: String,
    /// How long it lasts after each sign of its holder.
    lasts: Duration,
    pub(super) until: Time,
}

impl Lease {
    fn is_of(&self, caller: &Caller) -> bool {
        caller.lease.as_deref() == Some(&*self.token)
    }
}

impl Keeper {
    /// The lease that holds now.
    pub(super) fn holder(&self, now: Time) -> Option<&Lease> {
        self.lease.as_ref().filter(|it| it.until > now)
    }

    /// Whether `caller` may command.
    pub(super) fn check_lease(&self, now: Time, caller: &Caller) -> Result<(), Problem> {
        match (self.holder(now), &caller.lease) {
            (Some(lease), _) if lease.is_of(caller) => Ok(()),
            (Some(lease), _) => Err(leased_by(&lease.name)),
            (None, Some(_)) => Err(lapsed()),
            (None, None) => Ok(()),
        }
    }

    /// Renews the lease of `caller`: it lasts as long again.
    pub(super) fn keep_lease(&mut self, now: Time, caller: &Caller) {
        let lease = self.lease.as_mut();
        if let Some(lease) = lease.filter(|lease| lease.until > now && lease.is_of(caller)) {
            lease.until = now + lease.lasts;
        }
    }

    /// Gives the lease to `caller`, or renews it.
    pub(super) fn give_lease(
        &mut self,
        now: Time,
        caller: &Caller,
        request: &LeaseRequest,
        token: String,
    ) -> Result<Leased, Problem> {
        let before = self.holder(now);
        let is_own = before.is_some_and(|lease| lease.is_of(caller));
        let lasts = Duration::from_secs(request.seconds.into());
        let mut taken_from = None;
        let token = match before {
            Some(lease) if is_own => lease.token.clone(),
            Some(lease) if !request.force => return Err(leased_by(&lease.name)),
            Some(lease) => {
                taken_from = Some(lease.name.to_string());
                token
            }
            // It would be renewed as if no other could have commanded meanwhile.
            None if caller.lease.is_some() && !request.force => return Err(lapsed()),
            None => token,
        };
        if !is_own {
            let data = json!({"name": request.name, "taken_from": taken_from});
            self.events.push("lease", "", data);
        }
        self.lease = Some(Lease {
            name: request.name.as_str().into(),
            token: token.clone(),
            lasts,
            until: now + lasts,
        });
        Ok(Leased {
            token,
            seconds: request.seconds,
            taken_from,
        })
    }

    /// Takes the lease back from `caller`.
    pub(super) fn release(&mut self, now: Time, caller: &Caller) -> Result<(), Problem> {
        self.check_lease(now, caller)?;
        if let Some(lease) = self.lease.take() {
            let data = json!({"name": null, "released_by": &*lease.name});
            self.events.push("lease", "", data);
        }
        Ok(())
    }
}

fn lapsed() -> Problem {
    Problem::new(
        Code::LeaseLapsed,
        "the lease of this token has lapsed, was given back or taken, or is of an earlier service; others may have \
         commanded meanwhile",
        "look what the machine does, and ask for the lease without the token",
    )
}

fn leased_by(name: &str) -> Problem {
    Problem::new(
        Code::Leased,
        format!("{name} has the lease of this machine; only a stop is taken from others"),
        "wait for its end, ask for the lease, or take it with force",
    )
}
