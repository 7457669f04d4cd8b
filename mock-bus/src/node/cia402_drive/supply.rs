//! What becomes of a drive whose power comes and goes.

use units::Time;
use wire::cia402::{Controlword, HomingStatus};

use super::Drive;
use super::mechanism::Mechanism;
use super::positioning::Positioning;
use super::power::Power;
use crate::node::profile::Profile;

impl Drive {
    /// The processor starts: everything volatile has its power-on value, also the position
    /// counter, which knows no origin.
    pub(super) fn boot(&mut self, m: &mut impl Mechanism) {
        self.switch_off(m);
        self.power = Power::NotReady;
        self.command = None;
        self.controlword = Controlword::empty();
        self.mode_due = Time::NEVER;
        if !self.config.absolute_encoder {
            self.homed = false;
            self.offset = -self.sign() * m.counts();
            self.counted_from = m.counts();
        }
        self.profile = Profile::resting(0.0);
        self.positioning = Positioning::default();
        self.homing = HomingStatus::NotStarted;
        self.internal_limit = false;
        self.fault = None;
        self.heartbeat_lost = false;
        self.following_since = None;
        self.in_window_since = None;
        self.server.set(0x6040, 0, 0);
        self.mode = self.server.get(0x6060, 0);
        self.remember_nothing();
        self.show_mode();
        self.look_now();
    }

    pub(super) fn power_on(&mut self, now: Time, m: &mut impl Mechanism) {
        self.encoder_power(m, true);
        self.server.power_on(now);
        self.boot(m);
    }

    pub(super) fn power_off(&mut self, m: &mut impl Mechanism) {
        self.switch_off(m);
        self.power = Power::NotReady;
        self.encoder_power(m, false);
        self.server.power_off();
    }

    /// An absolute encoder has nothing to lose: to the plant it is one whose power stays on.
    fn encoder_power(&mut self, m: &mut impl Mechanism, on: bool) {
        let stays = self.config.absolute_encoder && self.encoder_runs;
        if !stays {
            m.encoder_power(on);
            self.encoder_runs = on;
        }
    }
}
