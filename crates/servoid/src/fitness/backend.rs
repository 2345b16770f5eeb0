use std::sync::atomic::{AtomicUsize, Ordering};

use super::boundary::{OutlineGradients, union_gradients};
use super::lanes::Portable;
#[cfg(target_arch = "x86_64")]
use super::lanes_x86::{Avx2, Avx512};
use super::map::ScoreMap;
use super::rows::{RowOutlines, Sums};
use super::sweep::union_sums;
use crate::shape::Body;

/// So many outlines are worked on in a small room: a large one costs as much as their sums.
const FEW: usize = 8;

/// Which vector instructions the kernels use; chosen at run time. All give the same bits.
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

/// A back end is asked for that is not there.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("no back end '{given}': this machine has {available}")]
pub struct BackendError {
    given: String,
    available: String,
}

/// The back end that is to be used, one more than its place in [`Backend::available`]; 0 for the
/// fastest.
static FORCED: AtomicUsize = AtomicUsize::new(0);

impl Backend {
    /// Runs everywhere.
    pub const PORTABLE: Self = Self(Kind::Portable);

    /// Gives the one that is used: that which was forced last, or the fastest.
    #[must_use]
    pub fn used() -> Self {
        let place = FORCED.load(Ordering::Relaxed);
        place.checked_sub(1).and_then(|at| Self::found().nth(at)).unwrap_or_else(Self::fastest)
    }

    /// Lets this process use this back end from now on, to compare speed, or to see that it changes
    /// nothing else.
    pub fn force(self) {
        let place = Self::found().position(|one| one == self);
        FORCED.store(place.map_or(0, |at| at + 1), Ordering::Relaxed);
    }

    /// Finds a back end of this machine by its name.
    ///
    /// # Errors
    /// If this machine has none of that name.
    pub fn named(name: &str) -> Result<Self, BackendError> {
        Self::found().find(|one| one.name() == name).ok_or_else(|| BackendError {
            given: name.into(),
            available: Self::found().map(Self::name).collect::<Vec<_>>().join(", "),
        })
    }

    /// Gives its name: `portable`, `avx2` or `avx512`.
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

    /// Gives the fastest one that this machine has.
    #[must_use]
    pub fn fastest() -> Self {
        Self::found().last().unwrap_or(Self::PORTABLE)
    }

    /// Gives all that this machine has, the fastest last.
    #[must_use]
    pub fn available() -> Vec<Self> {
        Self::found().collect()
    }

    /// Says whether rays may be cast with AVX2.
    #[cfg(all(feature = "render", target_arch = "x86_64"))]
    pub(crate) fn has_avx2(self) -> bool {
        self != Self::PORTABLE
    }

    /// Gives the same without taking memory.
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

    pub(super) fn sums(self, map: &ScoreMap, outlines: &RowOutlines) -> Sums {
        if outlines.as_slice().len() <= FEW {
            self.sums_in::<FEW>(map, outlines)
        } else {
            self.sums_in::<{ Body::MAX_ELLIPSOIDS }>(map, outlines)
        }
    }

    fn sums_in<const ROOM: usize>(self, map: &ScoreMap, outlines: &RowOutlines) -> Sums {
        // SAFETY: a back end exists only where `found` found its instructions.
        unsafe {
            match self.0 {
                Kind::Portable => union_sums::<Portable, ROOM>(map, outlines),
                #[cfg(target_arch = "x86_64")]
                Kind::Avx2 => sums_avx2::<ROOM>(map, outlines),
                #[cfg(target_arch = "x86_64")]
                Kind::Avx512 => sums_avx512::<ROOM>(map, outlines),
            }
        }
    }

    pub(super) fn gradients(
        self,
        map: &ScoreMap,
        outlines: &RowOutlines,
        gradients: &mut [OutlineGradients],
    ) -> Sums {
        if outlines.as_slice().len() <= FEW {
            self.gradients_in::<FEW>(map, outlines, gradients)
        } else {
            self.gradients_in::<{ Body::MAX_ELLIPSOIDS }>(map, outlines, gradients)
        }
    }

    fn gradients_in<const ROOM: usize>(
        self,
        map: &ScoreMap,
        outlines: &RowOutlines,
        gradients: &mut [OutlineGradients],
    ) -> Sums {
        // SAFETY: as above.
        unsafe {
            match self.0 {
                Kind::Portable => union_gradients::<Portable, ROOM>(map, outlines, gradients),
                #[cfg(target_arch = "x86_64")]
                Kind::Avx2 => gradients_avx2::<ROOM>(map, outlines, gradients),
                #[cfg(target_arch = "x86_64")]
                Kind::Avx512 => gradients_avx512::<ROOM>(map, outlines, gradients),
            }
        }
    }
}

#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx2")]
unsafe fn sums_avx2<const ROOM: usize>(map: &ScoreMap, outlines: &RowOutlines) -> Sums {
    // SAFETY: enabled above.
    unsafe { union_sums::<Avx2, ROOM>(map, outlines) }
}

#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx2")]
unsafe fn gradients_avx2<const ROOM: usize>(
    map: &ScoreMap,
    outlines: &RowOutlines,
    gradients: &mut [OutlineGradients],
) -> Sums {
    // SAFETY: enabled above.
    unsafe { union_gradients::<Avx2, ROOM>(map, outlines, gradients) }
}

#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx512f,avx512dq,avx512vl,avx2")]
unsafe fn sums_avx512<const ROOM: usize>(map: &ScoreMap, outlines: &RowOutlines) -> Sums {
    // SAFETY: enabled above.
    unsafe { union_sums::<Avx512, ROOM>(map, outlines) }
}

#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx512f,avx512dq,avx512vl,avx2")]
unsafe fn gradients_avx512<const ROOM: usize>(
    map: &ScoreMap,
    outlines: &RowOutlines,
    gradients: &mut [OutlineGradients],
) -> Sums {
    // SAFETY: enabled above.
    unsafe { union_gradients::<Avx512, ROOM>(map, outlines, gradients) }
}
