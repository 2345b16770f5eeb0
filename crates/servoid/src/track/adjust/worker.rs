use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::thread::{self, JoinHandle};

/// Something that is computed beside the tracker, and due some observations later. Copies wait for the same
/// result.
#[derive(Debug)]
pub(crate) struct Job<T> {
    state: Arc<Mutex<State<T>>>,
    /// Observations until it is due.
    wait: usize,
}

#[derive(Debug)]
enum State<T> {
    Running(Option<JoinHandle<T>>),
    Done(Option<T>),
}

impl<T> Clone for Job<T> {
    fn clone(&self) -> Self {
        Self { state: Arc::clone(&self.state), wait: self.wait }
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
    /// Begins to compute something that is due so many observations later, once what is under way `before`
    /// is done: one core is enough for all that is computed beside the tracker. Computes it at once, where no
    /// thread can be had.
    pub(crate) fn new<U: Clone + Send + 'static>(
        wait: usize,
        before: Option<Job<U>>,
        compute: impl Fn() -> T + Send + Clone + 'static,
    ) -> Self {
        let compute = move || {
            before.iter().for_each(Job::finish);
            compute()
        };
        let work = compute.clone();
        let state = match thread::Builder::new().name("servoid-worker".into()).spawn(work) {
            Ok(handle) => State::Running(Some(handle)),
            Err(_) => State::Done(Some(compute())),
        };
        Self { state: Arc::new(Mutex::new(state)), wait }
    }

    /// Counts an observation; says whether it is due, however long it takes.
    pub(crate) fn is_due(&mut self) -> bool {
        self.wait = self.wait.saturating_sub(1);
        self.wait == 0
    }

    /// Waits for the result; none if computing it failed.
    pub(crate) fn result(&self) -> Option<T> {
        self.done().result()
    }

    /// Waits until it is computed.
    fn finish(&self) {
        drop(self.done());
    }

    fn done(&self) -> MutexGuard<'_, State<T>> {
        let mut state = self.state.lock().unwrap_or_else(PoisonError::into_inner);
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
        let job = Job::new(0, None::<Job<()>>, || (0..1000).sum::<usize>());
        let copy = job.clone();
        assert_eq!(
            (copy.result(), job.result(), copy.result()),
            (Some(499_500), Some(499_500), Some(499_500))
        );
    }

    #[test]
    fn what_fails_gives_no_result_and_harms_nothing() {
        let job = Job::new(0, None::<Job<()>>, || -> usize { panic!("on purpose") });
        assert_eq!((job.result(), job.result()), (None, None));
        assert_eq!(Job::new(0, Some(job), || 7).result(), Some(7));
    }

    #[test]
    fn what_comes_after_another_waits_until_that_is_done() {
        let first = Arc::new(Mutex::new(0));
        let (sets, reads) = (Arc::clone(&first), Arc::clone(&first));
        let begun = Job::new(0, None::<Job<()>>, move || {
            thread::sleep(std::time::Duration::from_millis(20));
            *sets.lock().unwrap() = 1;
        });
        assert_eq!(Job::new(0, Some(begun), move || *reads.lock().unwrap()).result(), Some(1));
    }

    #[test]
    fn it_is_due_after_so_many_observations_and_from_then_on() {
        let mut job = Job::new(3, None::<Job<()>>, || ());
        assert_eq!([(); 4].map(|()| job.is_due()), [false, false, true, true]);
    }
}
