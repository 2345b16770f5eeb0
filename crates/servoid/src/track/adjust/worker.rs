use std::fmt;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::{Arc, LazyLock, mpsc};
use std::thread;

use crate::parallel::process;

/// A computation beside the tracker whose result is due some observations later. Copies wait for
/// the same result.
pub(crate) struct Job<T> {
    result: Arc<Awaited<T>>,
    /// Computes the result again in a forked child, to which its parent's threads do not come.
    compute: Arc<dyn Fn() -> T + Send + Sync>,
    /// The process that has the thread.
    process: u32,
    /// Observations until it is due.
    wait: usize,
}

/// The result of a thread, or of a computation done here; whoever first requests it waits for the
/// thread. None if it failed.
type Awaited<T> = LazyLock<Option<T>, Box<dyn FnOnce() -> Option<T> + Send>>;

impl<T> Clone for Job<T> {
    fn clone(&self) -> Self {
        let (result, compute) = (Arc::clone(&self.result), Arc::clone(&self.compute));
        Self { result, compute, process: self.process, wait: self.wait }
    }
}

impl<T> fmt::Debug for Job<T> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Job").field("wait", &self.wait).finish_non_exhaustive()
    }
}

impl<T: Clone + Send + Sync + 'static> Job<T> {
    /// Starts a computation that is due `wait` observations later, and that runs after the job
    /// `before`: one core is enough for everything computed beside the tracker. Computes it
    /// immediately if no thread can be started.
    pub(crate) fn new<U: Clone + Send + Sync + 'static>(
        wait: usize,
        before: Option<Job<U>>,
        compute: impl Fn() -> T + Send + Sync + 'static,
    ) -> Self {
        let compute: Arc<dyn Fn() -> T + Send + Sync> = Arc::new(move || {
            before.iter().for_each(Job::finish);
            compute()
        });
        let work = Arc::clone(&compute);
        // A channel, not a handle to join: a forked child may drop it.
        let (sender, receiver) = mpsc::channel();
        let begun = thread::Builder::new().name("servoid-worker".into()).spawn(move || {
            let _ = sender.send(work());
        });
        let result: Box<dyn FnOnce() -> Option<T> + Send> = if begun.is_ok() {
            Box::new(move || receiver.recv().ok())
        } else {
            let found = compute();
            Box::new(move || Some(found))
        };
        Self { result: Arc::new(LazyLock::new(result)), compute, process: process(), wait }
    }

    /// Counts an observation; returns whether the job is due, however long it takes.
    pub(crate) fn is_due(&mut self) -> bool {
        self.wait = self.wait.saturating_sub(1);
        self.wait == 0
    }

    /// Waits for the result; none if the computation failed.
    pub(crate) fn result(&self) -> Option<T> {
        if self.is_inherited() {
            return catch_unwind(AssertUnwindSafe(|| (self.compute)())).ok();
        }
        LazyLock::force(&self.result).clone()
    }

    /// Waits until the job is finished.
    fn finish(&self) {
        if !self.is_inherited() {
            LazyLock::force(&self.result);
        }
    }

    /// Returns whether this is a forked child: it has no thread to wait for.
    fn is_inherited(&self) -> bool {
        self.process != process()
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
    fn a_forked_child_computes_what_its_parent_began() {
        let begun = Job::new(0, None::<Job<()>>, || thread::current().id());
        // A process has no number 0: as in a child, the job belongs to another one.
        let inherited = Job { process: 0, ..begun.clone() };
        let after = Job::new(0, Some(inherited.clone()), || 7);
        let here = thread::current().id();
        assert!(begun.result().is_some_and(|place| place != here));
        assert_eq!((inherited.result(), after.result()), (Some(here), Some(7)));
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
