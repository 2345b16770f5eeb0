use super::boundary::{OutlineGradients, union_gradients};
use super::lanes::Portable;
#[cfg(target_arch = "x86_64")]
use super::lanes_x86::{Avx2, Avx512};
use super::map::ScoreMap;
use super::rows::{RowOutlines, Sums};
use super::sweep::union_sums;

/// Which vector instructions the row kernels use; chosen at run time.
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

impl Backend {
    /// Runs everywhere.
    pub const PORTABLE: Self = Self(Kind::Portable);

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

    /// Gives the same without taking memory.
    fn found() -> impl Iterator<Item = Self> {
        #[cfg(not(target_arch = "x86_64"))]
        let vectors: [Option<Kind>; 2] = [None; 2];
        #[cfg(target_arch = "x86_64")]
        let vectors = {
            let avx2 = is_x86_feature_detected!("avx2") && is_x86_feature_detected!("fma");
            let avx512 = is_x86_feature_detected!("avx512f")
                && is_x86_feature_detected!("avx512dq")
                && is_x86_feature_detected!("avx512vl");
            [avx2.then_some(Kind::Avx2), (avx2 && avx512).then_some(Kind::Avx512)]
        };
        std::iter::once(Self::PORTABLE).chain(vectors.into_iter().flatten().map(Self))
    }

    pub(super) fn sums(self, map: &ScoreMap, outlines: &RowOutlines) -> Sums {
        // SAFETY: a back end exists only where `available` found its instructions.
        unsafe {
            match self.0 {
                Kind::Portable => union_sums::<Portable>(map, outlines),
                #[cfg(target_arch = "x86_64")]
                Kind::Avx2 => sums_avx2(map, outlines),
                #[cfg(target_arch = "x86_64")]
                Kind::Avx512 => sums_avx512(map, outlines),
            }
        }
    }

    pub(super) fn gradients(
        self,
        map: &ScoreMap,
        outlines: &RowOutlines,
        gradients: &mut [OutlineGradients],
    ) -> Sums {
        // SAFETY: as above.
        unsafe {
            match self.0 {
                Kind::Portable => union_gradients::<Portable>(map, outlines, gradients),
                #[cfg(target_arch = "x86_64")]
                Kind::Avx2 => gradients_avx2(map, outlines, gradients),
                #[cfg(target_arch = "x86_64")]
                Kind::Avx512 => gradients_avx512(map, outlines, gradients),
            }
        }
    }
}

#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx2,fma")]
unsafe fn sums_avx2(map: &ScoreMap, outlines: &RowOutlines) -> Sums {
    // SAFETY: enabled above.
    unsafe { union_sums::<Avx2>(map, outlines) }
}

#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx512f,avx512dq,avx512vl,avx2,fma")]
unsafe fn sums_avx512(map: &ScoreMap, outlines: &RowOutlines) -> Sums {
    // SAFETY: enabled above.
    unsafe { union_sums::<Avx512>(map, outlines) }
}

#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx2,fma")]
unsafe fn gradients_avx2(
    map: &ScoreMap,
    outlines: &RowOutlines,
    gradients: &mut [OutlineGradients],
) -> Sums {
    // SAFETY: enabled above.
    unsafe { union_gradients::<Avx2>(map, outlines, gradients) }
}

#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx512f,avx512dq,avx512vl,avx2,fma")]
unsafe fn gradients_avx512(
    map: &ScoreMap,
    outlines: &RowOutlines,
    gradients: &mut [OutlineGradients],
) -> Sums {
    // SAFETY: enabled above.
    unsafe { union_gradients::<Avx512>(map, outlines, gradients) }
}
