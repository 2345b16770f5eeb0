//! How callers outside change settings that may grow.

/// Gives types a method `with`. Fields may be added to them (`#[non_exhaustive]`), so that only this
/// crate can write them out; callers outside begin with the defaults.
macro_rules! changeable {
    ($($name:ty),+ $(,)?) => {$(
        impl $name {
            /// Returns the same with a change: `default().with(|it| it.seed = 1)`.
            #[must_use]
            pub fn with(mut self, change: impl FnOnce(&mut Self)) -> Self {
                change(&mut self);
                self
            }
        }
    )+};
}

pub(crate) use changeable;
