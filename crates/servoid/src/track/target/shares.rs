use super::colors::Colors;

/// The shares of colours among an object's pixels: bins that are not empty, in ascending order.
#[derive(Debug, Clone, Default, PartialEq)]
pub(crate) struct Shares(pub(crate) Vec<(u32, f32)>);

/// Least share of a colour that is kept of a view.
const LEAST_SHARE: f32 = 1e-3;

impl Shares {
    pub(crate) fn is_empty(&self) -> bool {
        self.0.is_empty()
    }

    /// Makes room for as many as are not rare at most.
    pub(crate) fn with_room() -> Self {
        Self(Vec::with_capacity((1.0 / LEAST_SHARE) as usize))
    }

    /// Takes those of all bins that are not rare.
    pub(crate) fn note(&mut self, bins: &[f32]) {
        let frequent = bins.iter().enumerate().filter(|(_, share)| **share >= LEAST_SHARE);
        self.0.clear();
        self.0.extend(frequent.map(|(bin, share)| (bin as u32, *share)));
    }

    /// Returns the mean of several; none of none.
    pub(crate) fn mean<'a>(all: impl Iterator<Item = &'a Self>) -> Option<Self> {
        let (mut sums, mut count) = (vec![0.0; Colors::BINS], 0.0);
        for (bin, share) in all.inspect(|_| count += 1.0).flat_map(|one| &one.0) {
            if let Some(sum) = sums.get_mut(*bin as usize) {
                *sum += *share;
            }
        }
        let shares = sums.into_iter().map(|sum| sum / count).enumerate();
        let known =
            shares.filter(|(_, share)| *share > 0.0).map(|(bin, share)| (bin as u32, share));
        (count > 0.0).then(|| Self(known.collect()))
    }
}
