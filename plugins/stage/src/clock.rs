/// CPU-seconds of this process so far, user and system, all threads. Where the system has no such
/// clock: wall seconds.
#[must_use]
pub fn cpu_seconds() -> f64 {
    #[cfg(unix)]
    let seconds = read(rustix::time::ClockId::ProcessCPUTime);
    #[cfg(not(unix))]
    let seconds = wall();
    seconds
}

/// CPU-seconds of the thread that asks, for work done aside while others go on. Where the system
/// has no such clock: wall seconds.
#[must_use]
pub fn thread_cpu_seconds() -> f64 {
    #[cfg(unix)]
    let seconds = read(rustix::time::ClockId::ThreadCPUTime);
    #[cfg(not(unix))]
    let seconds = wall();
    seconds
}

#[cfg(unix)]
fn read(clock: rustix::time::ClockId) -> f64 {
    let t = rustix::time::clock_gettime(clock);
    t.tv_sec as f64 + t.tv_nsec as f64 * 1e-9
}

#[cfg(not(unix))]
fn wall() -> f64 {
    use std::{sync::OnceLock, time::Instant};
    static BEGIN: OnceLock<Instant> = OnceLock::new();
    BEGIN.get_or_init(Instant::now).elapsed().as_secs_f64()
}
