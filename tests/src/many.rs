//! The same of many seeds, on every core.

use std::sync::Mutex;
use std::thread;

/// What `of` makes of each seed, in the order of the seeds, on as many threads as there are processors.
///
/// # Panics
/// When `of` does.
pub fn of_each<T: Send>(
    seeds: impl Iterator<Item = u64> + Send,
    of: &(dyn Fn(u64) -> T + Sync),
) -> Vec<(u64, T)> {
    let seeds = Mutex::new(seeds);
    let made = Mutex::new(Vec::new());
    let threads = thread::available_parallelism().map_or(1, usize::from);
    thread::scope(|scope| {
        for _ in 0..threads {
            scope.spawn(|| {
                let next = || seeds.lock().expect("no thread panicked").next();
                while let Some(seed) = next() {
                    let it = of(seed);
                    made.lock().expect("no thread panicked").push((seed, it));
                }
            });
        }
    });
    let mut made = made.into_inner().expect("no thread panicked");
    made.sort_by_key(|(seed, _)| *seed);
    made
}

/// The same of what may fail: what became of those that did not; the others are told.
///
/// # Panics
/// When `of` does.
pub fn judged_of_each<T: Send, E: core::fmt::Display + Send>(
    seeds: impl Iterator<Item = u64> + Send,
    of: &(dyn Fn(u64) -> Result<T, E> + Sync),
) -> Vec<T> {
    let all = of_each(seeds, of);
    let judged = all.into_iter().filter_map(|(seed, it)| match it {
        Ok(it) => Some(it),
        Err(failure) => {
            println!("seed {seed} is not judged: {failure}");
            None
        }
    });
    judged.collect()
}
