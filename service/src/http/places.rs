//! So many connections are served at once at each door. When all places are taken, whoever comes next gets the place of
//! whoever has been silent longest: half a request, or none, keeps nobody out, and a flood of them neither.

use core::time::Duration;
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::Instant;

use tokio::sync::Notify;
use tokio::time::timeout;

/// For so long whoever has come, or was answered, keeps his place although he is silent: what he says is on its way.
const GRACE: Duration = Duration::from_millis(50);

/// The places of a door.
#[derive(Clone, Debug)]
pub(super) struct Places(Arc<Shared>);

#[derive(Debug)]
struct Shared {
    count: usize,
    /// In the order in which they became silent last.
    taken: Mutex<Vec<Taken>>,
    /// Somebody has left, or become silent.
    freed: Notify,
}

/// A connection, and since when it has been silent if it is.
type Taken = (Arc<Seat>, Instant);

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

    fn taken(&self) -> MutexGuard<'_, Vec<Taken>> {
        self.0.taken.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// A place, at once when one is free or somebody has been silent for long enough.
    pub(super) async fn take(&self) -> Place {
        loop {
            let freed = self.0.freed.notified();
            match self.try_take(Instant::now()) {
                Ok(place) => return place,
                Err(Some(wait)) => {
                    let _ = timeout(wait, freed).await;
                }
                Err(None) => freed.await,
            }
        }
    }

    /// # Errors
    /// When none is to be had at `now`: after how long there may be one, if that is known.
    fn try_take(&self, now: Instant) -> Result<Place, Option<Duration>> {
        let mut taken = self.taken();
        if taken.len() >= self.0.count {
            let is_silent = |it: &Taken| it.0.asked.load(Ordering::Relaxed) == 0;
            let silent = taken.iter().position(is_silent).ok_or(None)?;
            let left = GRACE.saturating_sub(now.saturating_duration_since(taken[silent].1));
            if !left.is_zero() {
                return Err(Some(left));
            }
            taken.remove(silent).0.leave.notify_one();
        }
        let seat = Arc::new(Seat {
            asked: AtomicU64::new(0),
            leave: Notify::new(),
        });
        taken.push((Arc::clone(&seat), now));
        Ok(Place {
            of: self.clone(),
            seat,
        })
    }

    /// `seat` is silent from `now` on: the last of those who are.
    fn fall_silent(&self, seat: &Arc<Seat>, now: Instant) {
        let mut taken = self.taken();
        if let Some(at) = taken.iter().position(|it| Arc::ptr_eq(&it.0, seat)) {
            let (seat, _) = taken.remove(at);
            taken.push((seat, now));
        }
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
        let is_other = |it: &Taken| !Arc::ptr_eq(&it.0, &self.seat);
        self.of.taken().retain(is_other);
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
        self.of.fall_silent(&self.seat, Instant::now());
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
        let begun = Instant::now();
        let later = |graces: u32| begun + GRACE * graces;
        let [first, second, third] = [(); 3].map(|()| places.try_take(begun).unwrap());
        let asked = first.keeps().heard();
        places.fall_silent(&second.seat, later(1));
        assert!(now(third.lost()).is_none());
        let fourth = places.try_take(later(1)).unwrap();
        assert!(
            now(third.lost()).is_some(),
            "the second has said something since"
        );
        assert!(now(first.lost()).is_none() && now(second.lost()).is_none());
        let fifth = places.try_take(later(2)).unwrap();
        assert!(now(second.lost()).is_some());
        // All are being answered: whoever comes next waits.
        let all = [fourth.keeps().heard(), fifth.keeps().heard()];
        assert_eq!(places.try_take(later(9)).unwrap_err(), None);
        drop(asked);
        let sixth = places.try_take(later(9)).unwrap();
        assert!(now(first.lost()).is_some());
        drop((all, sixth));
        assert!(places.taken().len() <= 3);
    }

    /// Thousands come at once, and what each says takes a moment to be heard.
    #[test]
    fn whoever_has_just_come_is_heard_before_his_place_is_given_away() {
        let places = Places::new(2);
        let begun = Instant::now();
        let first = places.try_take(begun).unwrap();
        let second = places.try_take(begun + GRACE / 2).unwrap();
        let soon = begun + GRACE / 4;
        assert_eq!(places.try_take(soon).unwrap_err(), Some(GRACE * 3 / 4));
        let _third = places.try_take(begun + GRACE).unwrap();
        assert!(now(first.lost()).is_some() && now(second.lost()).is_none());
        assert!(places.try_take(begun + GRACE).is_err());
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
