//! Runs work on several threads, or on the caller's thread alone where the feature `parallel` is
//! off. The results have the same bits.

#[cfg(feature = "parallel")]
pub(crate) use rayon::prelude::*;
#[cfg(not(feature = "parallel"))]
pub(crate) use sequential::*;

/// Threads that run installed work.
#[cfg(feature = "parallel")]
pub(crate) type Pool = rayon::ThreadPool;
/// The caller's thread, which runs installed work.
#[cfg(not(feature = "parallel"))]
pub(crate) struct Pool;

/// Starts threads, 0 for as many as the machine has; the error is the operating system's reason.
#[cfg(feature = "parallel")]
pub(crate) fn pool(threads: usize) -> Result<Pool, String> {
    rayon::ThreadPoolBuilder::new().num_threads(threads).build().map_err(|error| error.to_string())
}

/// Returns the caller's thread, whatever number is requested.
#[cfg(not(feature = "parallel"))]
pub(crate) fn pool(_threads: usize) -> Result<Pool, String> {
    Ok(Pool)
}

#[cfg(not(feature = "parallel"))]
impl Pool {
    /// Does the work.
    pub(crate) fn install<T>(&self, work: impl FnOnce() -> T) -> T {
        work()
    }
}

/// Rayon's parallel-iterator names for sequential iterators.
#[cfg(not(feature = "parallel"))]
mod sequential {
    #[cfg(feature = "render")]
    use std::slice::ChunksMut;
    use std::slice::{Chunks, ChunksExactMut, Iter};

    pub(crate) trait ParallelSlice<T> {
        fn par_iter(&self) -> Iter<'_, T>;
        fn par_chunks(&self, size: usize) -> Chunks<'_, T>;
    }

    pub(crate) trait ParallelSliceMut<T> {
        #[cfg(feature = "render")]
        fn par_chunks_mut(&mut self, size: usize) -> ChunksMut<'_, T>;
        fn par_chunks_exact_mut(&mut self, size: usize) -> ChunksExactMut<'_, T>;
    }

    pub(crate) trait IntoParallelIterator: IntoIterator + Sized {
        fn into_par_iter(self) -> Self::IntoIter {
            self.into_iter()
        }
    }

    pub(crate) trait IndexedParallelIterator: Iterator + Sized {
        fn with_min_len(self, _least: usize) -> Self {
            self
        }
    }

    impl<T> ParallelSlice<T> for [T] {
        fn par_iter(&self) -> Iter<'_, T> {
            self.iter()
        }

        fn par_chunks(&self, size: usize) -> Chunks<'_, T> {
            self.chunks(size)
        }
    }

    impl<T> ParallelSliceMut<T> for [T] {
        #[cfg(feature = "render")]
        fn par_chunks_mut(&mut self, size: usize) -> ChunksMut<'_, T> {
            self.chunks_mut(size)
        }

        fn par_chunks_exact_mut(&mut self, size: usize) -> ChunksExactMut<'_, T> {
            self.chunks_exact_mut(size)
        }
    }

    impl<I: IntoIterator> IntoParallelIterator for I {}

    impl<I: Iterator> IndexedParallelIterator for I {}
}
