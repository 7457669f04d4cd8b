//! So many connections are served at once at each door. When all places are taken, whoever comes next gets the place of
//! whoever has been silent longest: half a request, or none, keeps nobody out, and a flood of them neither.

use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use tokio::sync::Notify;

/// The places of a door.
#[derive(Clone, Debug)]
pub(super) struct Places(Arc<Shared>);

#[derive(Debug)]
struct Shared {
    count: usize,
    /// In the order in which they became silent last.
    taken: Mutex<Vec<Arc<Seat>>>,
    /// Somebody has left, or become silent.
    freed: Notify,
}

/// One connection.
#[derive(Debug)]
struct Seat {
    /// So many of its requests have been heard as a whole and not answered yet.
    asked: AtomicU64,
    /// It is to leave.
    leave: Notify,
}

/// A place, until it is dropped.
#[derive(Debug)]
pub(super) struct Place {
    of: Places,
    seat: Arc<Seat>,
}

/// A request that has been heard as a whole: its connection keeps its place until this is dropped.
#[derive(Debug)]
pub(super) struct Heard {
    of: Places,
    seat: Arc<Seat>,
}

/// By which a connection keeps its place while it is answered.
#[derive(Clone, Debug)]
pub(super) struct Keeps {
    of: Places,
    seat: Arc<Seat>,
}

impl Places {
    pub(super) fn new(count: usize) -> Self {
        Self(Arc::new(Shared {
            count,
            taken: Mutex::default(),
            freed: Notify::new(),
        }))
    }

    fn taken(&self) -> MutexGuard<'_, Vec<Arc<Seat>>> {
        self.0.taken.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// A place, at once when one is free or somebody silent has one.
    pub(super) async fn take(&self) -> Place {
        loop {
            let freed = self.0.freed.notified();
            if let Some(place) = self.try_take() {
                return place;
            }
            freed.await;
        }
    }

    fn try_take(&self) -> Option<Place> {
        let mut taken = self.taken();
        if taken.len() >= self.0.count {
            let is_silent = |it: &Arc<Seat>| it.asked.load(Ordering::Relaxed) == 0;
            let silent = taken.iter().position(is_silent)?;
            taken.remove(silent).leave.notify_one();
        }
        let seat = Arc::new(Seat {
            asked: AtomicU64::new(0),
            leave: Notify::new(),
        });
        taken.push(Arc::clone(&seat));
        Some(Place {
            of: self.clone(),
            seat,
        })
    }
}

impl Place {
    /// When somebody else gets it.
    pub(super) async fn lost(&self) {
        self.seat.leave.notified().await;
    }

    pub(super) fn keeps(&self) -> Keeps {
        Keeps {
            of: self.of.clone(),
            seat: Arc::clone(&self.seat),
        }
    }
}

impl Drop for Place {
    fn drop(&mut self) {
        self.of.taken().retain(|it| !Arc::ptr_eq(it, &self.seat));
        self.of.0.freed.notify_one();
    }
}

impl Keeps {
    /// A request has been heard as a whole.
    pub(super) fn heard(&self) -> Heard {
        self.seat.asked.fetch_add(1, Ordering::Relaxed);
        Heard {
            of: self.of.clone(),
            seat: Arc::clone(&self.seat),
        }
    }
}

impl Drop for Heard {
    fn drop(&mut self) {
        if self.seat.asked.fetch_sub(1, Ordering::Relaxed) > 1 {
            return;
        }
        let mut taken = self.of.taken();
        // Silent from now on: the last of those who are.
        if let Some(at) = taken.iter().position(|it| Arc::ptr_eq(it, &self.seat)) {
            let seat = taken.remove(at);
            taken.push(seat);
        }
        drop(taken);
        self.of.0.freed.notify_one();
    }
}

#[cfg(test)]
mod tests {
    use futures_util::FutureExt;

    use super::*;

    fn now<T>(future: impl Future<Output = T>) -> Option<T> {
        std::pin::pin!(future).now_or_never()
    }

    #[test]
    fn whoever_has_been_silent_longest_gives_his_place_to_who_comes_next() {
        let places = Places::new(3);
        let [first, second, third] = [(); 3].map(|()| now(places.take()).unwrap());
        let asked = first.keeps().heard();
        drop(second.keeps().heard());
        assert!(now(third.lost()).is_none());
        let fourth = now(places.take()).unwrap();
        assert!(
            now(third.lost()).is_some(),
            "the second has said something since"
        );
        assert!(now(first.lost()).is_none() && now(second.lost()).is_none());
        let fifth = now(places.take()).unwrap();
        assert!(now(second.lost()).is_some());
        // All are being answered: whoever comes next waits.
        let all = [fourth.keeps().heard(), fifth.keeps().heard()];
        assert!(now(places.take()).is_none());
        drop(asked);
        let sixth = now(places.take()).unwrap();
        assert!(now(first.lost()).is_some());
        drop((all, sixth));
        assert!(places.taken().len() <= 3);
    }

    #[test]
    fn a_place_that_was_left_is_free() {
        let places = Places::new(1);
        let first = now(places.take()).unwrap();
        let asked = first.keeps().heard();
        let mut next = std::pin::pin!(places.take());
        assert!(next.as_mut().now_or_never().is_none());
        drop((first, asked));
        assert!(next.now_or_never().is_some(), "who waits is told");
        assert!(places.taken().is_empty());
    }
}
