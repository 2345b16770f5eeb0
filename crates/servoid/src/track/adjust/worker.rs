use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::thread::{self, JoinHandle};

/// Something that is computed beside the tracker. Copies wait for the same result.
#[derive(Debug)]
pub(crate) struct Job<T>(Arc<Mutex<State<T>>>);

#[derive(Debug)]
enum State<T> {
    Running(Option<JoinHandle<T>>),
    Done(Option<T>),
}

impl<T> Clone for Job<T> {
    fn clone(&self) -> Self {
        Self(Arc::clone(&self.0))
    }
}

impl<T: Clone> State<T> {
    fn result(&self) -> Option<T> {
        match self {
            Self::Done(result) => result.clone(),
            Self::Running(_) => None,
        }
    }
}

impl<T: Clone + Send + 'static> Job<T> {
    /// Begins to compute something; at once, where no thread can be had.
    pub(crate) fn new(compute: impl Fn() -> T + Send + Clone + 'static) -> Self {
        let work = compute.clone();
        let state = match thread::Builder::new().name("servoid-worker".into()).spawn(work) {
            Ok(handle) => State::Running(Some(handle)),
            Err(_) => State::Done(Some(compute())),
        };
        Self(Arc::new(Mutex::new(state)))
    }

    /// Waits for the result; none if computing it failed.
    pub(crate) fn result(&self) -> Option<T> {
        self.done().result()
    }

    /// Waits until it is computed.
    pub(crate) fn wait(&self) {
        drop(self.done());
    }

    fn done(&self) -> MutexGuard<'_, State<T>> {
        let mut state = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        if let State::Running(handle) = &mut *state {
            *state = State::Done(handle.take().and_then(|handle| handle.join().ok()));
        }
        state
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn copies_wait_for_the_same_result() {
        let job = Job::new(|| (0..1000).sum::<usize>());
        let copy = job.clone();
        assert_eq!(
            (copy.result(), job.result(), copy.result()),
            (Some(499_500), Some(499_500), Some(499_500))
        );
    }

    #[test]
    fn what_fails_gives_no_result_and_harms_nothing() {
        let job = Job::new(|| -> usize { panic!("on purpose") });
        assert_eq!((job.result(), job.result()), (None, None));
    }
}
