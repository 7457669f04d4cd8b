//! What became of the SYNCs of each CAN bus since the machine was made: of one SYNC thread after the other, and of the
//! cyclic engine, which sends them itself between two of these.

use std::collections::BTreeMap;

use drivers::transport::SyncStatistics;
use wire::Port;

use crate::parts::Bus;

/// The accounts of all buses. Counting asks for no memory: the cyclic engine counts, too.
#[derive(Debug, Default)]
pub(crate) struct SyncAccount(BTreeMap<Port, Syncs>);

#[derive(Debug, Default)]
struct Syncs {
    /// Of threads that have ended; `None` before the first.
    threads: Option<SyncStatistics>,
    engine: SyncStatistics,
}

impl SyncAccount {
    pub(crate) fn new(buses: &[Bus]) -> Self {
        let syncs = buses.iter().map(|it| (it.port, Syncs::default()));
        Self(syncs.collect())
    }

    /// A thread that did so much on `port` ends.
    pub(crate) fn ended(&mut self, port: Port, thread: &SyncStatistics) {
        if let Some(syncs) = self.0.get_mut(&port) {
            let threads = syncs.threads.get_or_insert_default();
            threads.add(thread);
            threads.scheduling = thread.scheduling;
        }
    }

    /// Where the engine notes its own.
    pub(crate) fn of_engine(&mut self, port: Port) -> Option<&mut SyncStatistics> {
        self.0.get_mut(&port).map(|it| &mut it.engine)
    }

    /// Those of all threads, `running` with what it has done among them; `None` where none ever was, as in simulated time.
    pub(crate) fn of_threads(
        &self,
        port: Port,
        running: Option<SyncStatistics>,
    ) -> Option<SyncStatistics> {
        let ended = self.0.get(&port).and_then(|it| it.threads.as_ref());
        let Some(mut all) = running else {
            return ended.cloned();
        };
        if let Some(ended) = ended {
            all.add(ended);
        }
        Some(all)
    }

    /// `threads` with what the engine has sent at their place.
    pub(crate) fn with_engine(&self, port: Port, mut threads: SyncStatistics) -> SyncStatistics {
        if let Some(syncs) = self.0.get(&port) {
            threads.add(&syncs.engine);
        }
        threads
    }
}

#[cfg(test)]
mod tests {
    use core::time::Duration;

    use drivers::transport::Scheduling;

    use super::*;

    const CAN: Port = Port(3);

    fn of(sent: u64, micros: u64) -> SyncStatistics {
        let mut statistics = SyncStatistics {
            sent,
            scheduling: Scheduling::RealTime,
            ..SyncStatistics::default()
        };
        statistics.lateness.note(Duration::from_micros(micros));
        statistics
    }

    #[test]
    fn what_threads_and_the_engine_did_adds_up_and_never_becomes_less() {
        let mut account = SyncAccount(BTreeMap::from([(CAN, Syncs::default())]));
        assert_eq!(account.of_threads(CAN, None), None, "there never was one");
        assert_eq!(account.of_threads(CAN, Some(of(7, 5))), Some(of(7, 5)));
        account.ended(CAN, &of(9, 5));
        assert_eq!(account.of_threads(CAN, None), Some(of(9, 5)));
        *account.of_engine(CAN).unwrap() = of(100, 30);
        account.ended(CAN, &of(1, 7));
        let threads = account.of_threads(CAN, Some(of(2, 6))).unwrap();
        assert_eq!((threads.sent, threads.lateness.total()), (12, 3));
        let all = account.with_engine(CAN, threads);
        assert_eq!(all.sent, 112);
        assert_eq!(all.lateness.greatest(), Duration::from_micros(30));
        assert_eq!(all.scheduling, Scheduling::RealTime);
    }

    #[test]
    fn a_port_that_is_no_bus_has_no_account() {
        let mut account = SyncAccount::default();
        account.ended(CAN, &of(9, 5));
        assert!(account.of_engine(CAN).is_none());
        assert_eq!(account.of_threads(CAN, None), None);
    }
}
