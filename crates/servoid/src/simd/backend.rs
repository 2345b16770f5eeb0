use std::sync::atomic::{AtomicUsize, Ordering};

use super::lanes::RowLanes;
#[cfg(feature = "render")]
use super::lanes::Single;
use super::portable::Eight;
#[cfg(target_arch = "x86_64")]
use super::x86::{Avx2, Avx512};

/// The vector instructions that the kernels use; selected at run time. All give the same bits.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Backend(Kind);

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Kind {
    Portable,
    #[cfg(target_arch = "x86_64")]
    Avx2,
    #[cfg(target_arch = "x86_64")]
    Avx512,
}

/// The requested backend does not exist on this machine.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("no backend '{given}': this machine has {available}")]
pub struct BackendError {
    given: String,
    available: String,
}

/// The backend to be used, as its index in [`Backend::available`] plus one; 0 for the fastest.
static FORCED: AtomicUsize = AtomicUsize::new(0);

impl Backend {
    /// Runs on every processor.
    pub const PORTABLE: Self = Self(Kind::Portable);

    /// Returns the backend in use: the one that was forced last, or the fastest.
    #[must_use]
    pub fn used() -> Self {
        let place = FORCED.load(Ordering::Relaxed);
        place.checked_sub(1).and_then(|at| Self::found().nth(at)).unwrap_or_else(Self::fastest)
    }

    /// Makes this process use this backend from now on, to compare speed, or to check that it
    /// changes nothing else.
    pub fn force(self) {
        let place = Self::found().position(|one| one == self);
        FORCED.store(place.map_or(0, |at| at + 1), Ordering::Relaxed);
    }

    /// Finds a backend of this machine by its name.
    ///
    /// # Errors
    /// If this machine has no backend of that name.
    pub fn named(name: &str) -> Result<Self, BackendError> {
        Self::found().find(|one| one.name() == name).ok_or_else(|| BackendError {
            given: name.into(),
            available: Self::found().map(Self::name).collect::<Vec<_>>().join(", "),
        })
    }

    /// Returns its name: `portable`, `avx2` or `avx512`.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self.0 {
            Kind::Portable => "portable",
            #[cfg(target_arch = "x86_64")]
            Kind::Avx2 => "avx2",
            #[cfg(target_arch = "x86_64")]
            Kind::Avx512 => "avx512",
        }
    }

    /// Returns the fastest backend of this machine.
    #[must_use]
    pub fn fastest() -> Self {
        Self::found().last().unwrap_or(Self::PORTABLE)
    }

    /// Returns all backends of this machine, the fastest last.
    #[must_use]
    pub fn available() -> Vec<Self> {
        Self::found().collect()
    }

    /// Returns the same without allocating memory.
    fn found() -> impl Iterator<Item = Self> {
        #[cfg(not(target_arch = "x86_64"))]
        let vectors: [Option<Kind>; 2] = [None; 2];
        #[cfg(target_arch = "x86_64")]
        let vectors = {
            let avx2 = is_x86_feature_detected!("avx2");
            let avx512 = is_x86_feature_detected!("avx512f")
                && is_x86_feature_detected!("avx512dq")
                && is_x86_feature_detected!("avx512vl");
            [avx2.then_some(Kind::Avx2), (avx2 && avx512).then_some(Kind::Avx512)]
        };
        std::iter::once(Self::PORTABLE).chain(vectors.into_iter().flatten().map(Self))
    }

    /// Runs work on rows with the widest lanes.
    pub(crate) fn run_rows<K: RowKernel>(self, kernel: K) -> K::Output {
        // SAFETY: a backend exists only where `found` found its instructions.
        unsafe {
            match self.0 {
                Kind::Portable => kernel.run::<Eight>(),
                #[cfg(target_arch = "x86_64")]
                Kind::Avx2 => rows_avx2(kernel),
                #[cfg(target_arch = "x86_64")]
                Kind::Avx512 => rows_avx512(kernel),
            }
        }
    }

    /// Runs work on rays, in groups of eight whatever the size of a register.
    #[cfg(feature = "render")]
    pub(crate) fn run_rays<K: RayKernel>(self, kernel: K) -> K::Output {
        match self.0 {
            Kind::Portable => kernel.run::<Eight>(),
            // SAFETY: as above; a processor with AVX-512 has AVX2.
            #[cfg(target_arch = "x86_64")]
            Kind::Avx2 | Kind::Avx512 => unsafe { rays_avx2(kernel) },
        }
    }
}

/// Work that is generic over lanes of rows; `run` must always be inlined.
pub(crate) trait RowKernel {
    type Output;

    /// # Safety
    /// The instructions of `L` must be enabled in the caller.
    unsafe fn run<L: RowLanes>(self) -> Self::Output;
}

/// Work that is generic over lanes of rays; `run` must always be inlined.
#[cfg(feature = "render")]
pub(crate) trait RayKernel {
    type Output;

    fn run<L: Single>(self) -> Self::Output;
}

#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx2")]
unsafe fn rows_avx2<K: RowKernel>(kernel: K) -> K::Output {
    // SAFETY: enabled above.
    unsafe { kernel.run::<Avx2>() }
}

#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx512f,avx512dq,avx512vl,avx2")]
unsafe fn rows_avx512<K: RowKernel>(kernel: K) -> K::Output {
    // SAFETY: enabled above.
    unsafe { kernel.run::<Avx512>() }
}

#[cfg(all(feature = "render", target_arch = "x86_64"))]
#[target_feature(enable = "avx2")]
unsafe fn rays_avx2<K: RayKernel>(kernel: K) -> K::Output {
    kernel.run::<Avx2>()
}
