use std::sync::{Arc, LazyLock};
use std::thread;

/// A computation beside the tracker whose result is due some observations later. Copies wait for
/// the same result.
#[derive(Debug)]
pub(crate) struct Job<T> {
    result: Arc<Awaited<T>>,
    /// Observations until it is due.
    wait: usize,
}

/// The result of a thread, or of a computation done here; whoever first requests it waits for the
/// thread. None if it failed.
type Awaited<T> = LazyLock<Option<T>, Box<dyn FnOnce() -> Option<T> + Send>>;

impl<T> Clone for Job<T> {
    fn clone(&self) -> Self {
        Self { result: Arc::clone(&self.result), wait: self.wait }
    }
}

impl<T: Clone + Send + Sync + 'static> Job<T> {
    /// Starts a computation that is due `wait` observations later, and that runs after the job
    /// `before`: one core is enough for everything computed beside the tracker. Computes it
    /// immediately if no thread can be started.
    pub(crate) fn new<U: Clone + Send + Sync + 'static>(
        wait: usize,
        before: Option<Job<U>>,
        compute: impl Fn() -> T + Send + Clone + 'static,
    ) -> Self {
        let compute = move || {
            before.iter().for_each(Job::finish);
            compute()
        };
        let work = compute.clone();
        let result: Box<dyn FnOnce() -> Option<T> + Send> =
            match thread::Builder::new().name("servoid-worker".into()).spawn(work) {
                Ok(thread) => Box::new(move || thread.join().ok()),
                Err(_) => {
                    let found = compute();
                    Box::new(move || Some(found))
                }
            };
        Self { result: Arc::new(LazyLock::new(result)), wait }
    }

    /// Counts an observation; returns whether the job is due, however long it takes.
    pub(crate) fn is_due(&mut self) -> bool {
        self.wait = self.wait.saturating_sub(1);
        self.wait == 0
    }

    /// Waits for the result; none if the computation failed.
    pub(crate) fn result(&self) -> Option<T> {
        LazyLock::force(&self.result).clone()
    }

    /// Waits until the job is finished.
    fn finish(&self) {
        LazyLock::force(&self.result);
    }
}

#[cfg(test)]
mod tests {
    use std::sync::Mutex;

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
