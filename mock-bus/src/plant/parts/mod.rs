//! What directions of machines are made of, whatever they are: drive trains, encoders, switches, errors.

pub(super) mod actuator;
pub(super) mod deviation;
pub(super) mod drive_train;
pub(super) mod encoder;
pub(super) mod index_mark;
pub(super) mod limit_switch;
pub(super) mod pulse;
pub(super) mod servo;
pub(super) mod travel;
pub(super) mod weight;
