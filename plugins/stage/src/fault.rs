//! Panics as values: whoever runs another's work says what broke, and goes on.

use std::{
    any::Any,
    cell::Cell,
    collections::VecDeque,
    panic::{AssertUnwindSafe, catch_unwind, set_hook, take_hook},
    sync::{Mutex, Once, PoisonError},
};

/// What a panic said. An error of the program, not of the user.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("internal error: {what}")]
pub struct Fault {
    /// Its message, one line.
    pub what: String,
    /// File and line, where they are known: for whoever mends it.
    pub place: Option<String>,
}

/// The last panics of the process: only a hook learns their places, and they may happen on threads
/// of a pool that hand them on.
static LAST: Mutex<VecDeque<Fault>> = Mutex::new(VecDeque::new());
/// How many of them: those of other threads may come in between.
const KEPT: usize = 64;

thread_local! {
    /// Whether a panic of this thread is expected and said by whoever catches it.
    static QUIET: Cell<bool> = const { Cell::new(false) };
}

/// [`catch`] of what may panic on a damaged file: the panic itself prints nothing.
pub(crate) fn catch_quietly<T>(work: impl FnOnce() -> T) -> Result<T, Fault> {
    let before = QUIET.replace(true);
    let done = catch(work);
    QUIET.set(before);
    done
}

/// Does `work`; a panic in it becomes a [`Fault`]. What `work` was changing may be half changed
/// then: use nothing of it that does not say otherwise.
///
/// # Errors
/// `work` panicked.
///
/// ```
/// use intrados_stage::catch;
/// assert_eq!(catch(|| 3), Ok(3));
/// let fault = catch(|| -> u8 { panic!("on purpose") }).unwrap_err();
/// assert_eq!(fault.what, "on purpose");
/// ```
pub fn catch<T>(work: impl FnOnce() -> T) -> Result<T, Fault> {
    listen();
    catch_unwind(AssertUnwindSafe(work)).map_err(|payload| {
        let what = said(&*payload);
        let last = LAST.lock().unwrap_or_else(PoisonError::into_inner);
        last.iter()
            .rev()
            .find(|last| last.what == what)
            .cloned()
            .unwrap_or(Fault { what, place: None })
    })
}

/// Notes the place of every panic from now on, besides what is done about it anyway.
fn listen() {
    static LISTENS: Once = Once::new();
    LISTENS.call_once(|| {
        let usual = take_hook();
        set_hook(Box::new(move |panic| {
            let fault = Fault {
                what: said(panic.payload()),
                place: panic.location().map(ToString::to_string),
            };
            let mut last = LAST.lock().unwrap_or_else(PoisonError::into_inner);
            last.push_back(fault);
            if last.len() > KEPT {
                last.pop_front();
            }
            drop(last);
            // A thread that is just ending has no such flag any more.
            if !QUIET.try_with(Cell::get).unwrap_or(false) {
                usual(panic);
            }
        }));
    });
}

fn said(payload: &(dyn Any + Send)) -> String {
    let text = payload
        .downcast_ref::<&str>()
        .copied()
        .or_else(|| payload.downcast_ref::<String>().map(String::as_str));
    text.map_or_else(
        || "a panic without a message".into(),
        |text| text.split_whitespace().collect::<Vec<_>>().join(" "),
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_panic_on_a_thread_of_a_pool_keeps_its_message_and_place() {
        let fault = catch(|| rayon::join(|| 1, || -> u8 { panic!("two\n  lines of {}", "it") }))
            .unwrap_err();
        assert_eq!(fault.what, "two lines of it");
        assert!(fault.place.is_some_and(|place| place.contains("fault.rs")));
    }

    #[test]
    fn a_payload_that_is_no_text_is_a_fault_all_the_same() {
        let fault = catch(|| std::panic::panic_any(7_u8)).unwrap_err();
        assert_eq!(fault.what, "a panic without a message");
    }
}
