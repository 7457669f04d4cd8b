//! The transports on real buses. What needs SocketCAN is ignored unless `tests/run` runs it
//! where there is one (`RIG=vcan`).

mod machine;
mod socketcan;
