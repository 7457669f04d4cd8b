//! Which processors a thread may use, and how two threads get different ones.

use nix::sched::{CpuSet, sched_getaffinity, sched_setaffinity};
use nix::unistd::Pid;

/// The calling thread.
const OWN: Pid = Pid::from_raw(0);

/// The processors that the calling thread may use, in two halves; nothing where there is only one, or nobody knows.
pub(super) fn halves() -> Option<[CpuSet; 2]> {
    let allowed = sched_getaffinity(OWN).ok()?;
    let is_allowed = |processor: &usize| allowed.is_set(*processor) == Ok(true);
    let numbers: Vec<_> = (0..CpuSet::count()).filter(is_allowed).collect();
    let (some, others) = numbers.split_at(numbers.len() / 2);
    (!some.is_empty()).then(|| [set_of(some), set_of(others)])
}

/// Keeps the calling thread to these; a refusal leaves it as free as it was.
pub(super) fn keep_to(processors: &CpuSet) {
    let _ = sched_setaffinity(OWN, processors);
}

fn set_of(numbers: &[usize]) -> CpuSet {
    let mut set = CpuSet::new();
    for number in numbers {
        // It came from such a set.
        let _ = set.set(*number);
    }
    set
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn halves_are_disjoint_and_together_all_that_was_allowed() {
        let allowed = sched_getaffinity(OWN).unwrap();
        let is_in = |set: &CpuSet, processor| set.is_set(processor) == Ok(true);
        let count = (0..CpuSet::count())
            .filter(|it| is_in(&allowed, *it))
            .count();
        let halves = halves();
        assert_eq!(halves.is_some(), count > 1);
        for processor in 0..CpuSet::count() {
            let within = halves.iter().flatten().filter(|it| is_in(it, processor));
            let expected = usize::from(count > 1 && is_in(&allowed, processor));
            assert_eq!(within.count(), expected, "processor {processor}");
        }
    }

    #[test]
    fn a_thread_that_may_use_one_processor_has_nothing_to_halve() {
        let only = std::thread::spawn(|| {
            let Some([some, _]) = halves() else {
                return true;
            };
            let first = (0..CpuSet::count()).find(|it| some.is_set(*it) == Ok(true));
            keep_to(&set_of(&[first.unwrap()]));
            halves().is_none()
        });
        assert!(only.join().unwrap());
    }
}
