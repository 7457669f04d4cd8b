//! How much of a count a run takes.

/// `part` in every run, `whole` where the environment's `TRUESTAGE_WHOLE` is set, as `tests/run --soak` does: what is
/// counted over many machines, places or moments takes longer than everybody's check may.
pub fn in_every_run<T>(part: T, whole: T) -> T {
    if std::env::var_os("TRUESTAGE_WHOLE").is_some() {
        whole
    } else {
        part
    }
}
