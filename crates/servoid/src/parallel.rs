//! Runs work on several threads, or on the caller's thread alone where the feature `parallel` is
//! off. The results have the same bits.

#[cfg(not(feature = "parallel"))]
pub(crate) use sequential::*;
#[cfg(feature = "parallel")]
pub(crate) use threaded::*;

/// Returns the number of the process: another one in a forked child, to which threads do not come.
pub(crate) fn process() -> u32 {
    std::process::id()
}

/// Rayon's parallel iterators, which also work in a forked child.
///
/// Outside an installed pool they run on the threads of the process. A child inherits that pool
/// without its threads and would wait for them forever.
#[cfg(feature = "parallel")]
mod threaded {
    use std::sync::atomic::{AtomicU32, Ordering};

    pub(crate) use rayon::iter::{IndexedParallelIterator, ParallelIterator};
    #[cfg(feature = "render")]
    use rayon::slice::ChunksMut;
    use rayon::slice::{Chunks, ChunksExactMut, Iter};

    /// Threads that run installed work.
    pub(crate) type Pool = rayon::ThreadPool;

    /// The process whose threads rayon's own pool has; 0 as long as it was not used.
    static PROCESS: AtomicU32 = AtomicU32::new(0);

    /// Starts threads, 0 for as many as the machine has; the error is the operating system's reason.
    pub(crate) fn pool(threads: usize) -> Result<Pool, String> {
        let builder = rayon::ThreadPoolBuilder::new().num_threads(threads);
        builder.build().map_err(|error| error.to_string())
    }

    /// Makes the caller a pool of one thread, for good, if the threads of the process stayed behind
    /// in its parent. One, since forked children share the cores, and may fork again.
    fn outlive_a_fork() {
        if rayon::current_thread_index().is_some() {
            return;
        }
        let own = std::process::id();
        let first = PROCESS.compare_exchange(0, own, Ordering::Relaxed, Ordering::Relaxed);
        if first.is_err_and(|first| first != own) {
            // It starts no thread, so that it cannot fail.
            let _ = rayon::ThreadPoolBuilder::new().num_threads(1).use_current_thread().build();
        }
    }

    pub(crate) trait ParallelSlice<T: Sync> {
        fn par_iter(&self) -> Iter<'_, T>;
        fn par_chunks(&self, size: usize) -> Chunks<'_, T>;
    }

    pub(crate) trait ParallelSliceMut<T: Send> {
        #[cfg(feature = "render")]
        fn par_chunks_mut(&mut self, size: usize) -> ChunksMut<'_, T>;
        fn par_chunks_exact_mut(&mut self, size: usize) -> ChunksExactMut<'_, T>;
    }

    pub(crate) trait IntoParallelIterator:
        rayon::iter::IntoParallelIterator + Sized
    {
        fn into_par_iter(self) -> Self::Iter {
            outlive_a_fork();
            rayon::iter::IntoParallelIterator::into_par_iter(self)
        }
    }

    impl<T: Sync> ParallelSlice<T> for [T] {
        fn par_iter(&self) -> Iter<'_, T> {
            outlive_a_fork();
            rayon::iter::IntoParallelIterator::into_par_iter(self)
        }

        fn par_chunks(&self, size: usize) -> Chunks<'_, T> {
            outlive_a_fork();
            rayon::slice::ParallelSlice::par_chunks(self, size)
        }
    }

    impl<T: Send> ParallelSliceMut<T> for [T] {
        #[cfg(feature = "render")]
        fn par_chunks_mut(&mut self, size: usize) -> ChunksMut<'_, T> {
            outlive_a_fork();
            rayon::slice::ParallelSliceMut::par_chunks_mut(self, size)
        }

        fn par_chunks_exact_mut(&mut self, size: usize) -> ChunksExactMut<'_, T> {
            outlive_a_fork();
            rayon::slice::ParallelSliceMut::par_chunks_exact_mut(self, size)
        }
    }

    impl<I: rayon::iter::IntoParallelIterator> IntoParallelIterator for I {}
}

/// Rayon's parallel-iterator names for sequential iterators.
///
/// Nothing else differs without the feature. The tests compare them with rayon's.
#[cfg(any(all(test, feature = "render"), not(feature = "parallel")))]
mod sequential {
    #[cfg(feature = "render")]
    use std::slice::ChunksMut;
    use std::slice::{Chunks, ChunksExactMut, Iter};

    /// The caller's thread, which runs installed work.
    pub(crate) struct Pool;

    /// Returns the caller's thread, whatever number is requested.
    pub(crate) fn pool(_threads: usize) -> Result<Pool, String> {
        Ok(Pool)
    }

    impl Pool {
        /// Does the work.
        pub(crate) fn install<T>(&self, work: impl FnOnce() -> T) -> T {
            work()
        }
    }

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

#[cfg(all(feature = "parallel", feature = "render"))]
#[cfg(test)]
mod tests {
    use super::{sequential, threaded};

    const COUNTS: [usize; 5] = [0, 1, 7, 64, 1000];
    const SIZES: [usize; 4] = [1, 3, 8, 2000];

    /// Everything that the core asks of either module: what comes out, in its order.
    macro_rules! walks {
        ($module:ident, $count:expr, $size:expr) => {{
            use $module::*;
            let (count, size): (usize, usize) = ($count, $size);
            let numbers: Vec<usize> = (0..count).map(|i| i * i % 31).collect();
            let all = || {
                let ranged: Vec<usize> = (0..count).into_par_iter().map(|i| numbers[i]).collect();
                let owned: Vec<usize> = numbers.clone().into_par_iter().map(|n| n + 1).collect();
                let each: Vec<usize> = numbers.par_iter().with_min_len(2).map(|&n| 3 * n).collect();
                let chained: Vec<usize> = numbers
                    .par_iter()
                    .map(|&n| n)
                    .chain(ranged.par_iter().map(|&n| n + 5))
                    .collect();
                let chunks: Vec<Vec<usize>> =
                    numbers.par_chunks(size).with_min_len(16).map(<[usize]>::to_vec).collect();
                let even: Result<Vec<usize>, usize> = numbers
                    .par_iter()
                    .map(|&n| if count < 8 || n % 2 == 0 { Ok(n) } else { Err(0) })
                    .collect();
                let (mut bands, mut others) = (numbers.clone(), numbers.clone());
                let both = bands.par_chunks_mut(size).zip(others.par_chunks_mut(size));
                both.enumerate().for_each(|(band, (one, other))| {
                    one[0] += band;
                    other.reverse();
                });
                let mut rows = numbers.clone();
                rows.par_chunks_exact_mut(size)
                    .enumerate()
                    .for_each(|(row, of_row)| of_row.fill(row));
                (ranged, owned, each, chained, chunks, even, bands, others, rows)
            };
            pool(3).unwrap().install(all)
        }};
    }

    #[test]
    fn one_thread_alone_walks_as_several_do() {
        for count in COUNTS {
            for size in SIZES {
                assert_eq!(
                    walks!(sequential, count, size),
                    walks!(threaded, count, size),
                    "{count} numbers in chunks of {size}"
                );
            }
        }
    }
}
