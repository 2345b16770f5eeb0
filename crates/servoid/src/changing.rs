//! How other crates change settings that may get further fields.

/// Adds a method `with` to types. They are `#[non_exhaustive]`, since fields may be added, so only
/// this crate can construct them with a struct expression; other crates begin with the defaults.
macro_rules! changeable {
    ($($name:ty),+ $(,)?) => {$(
        impl $name {
            /// Returns the settings with a change: `default().with(|it| it.seed = 1)`.
            #[must_use]
            pub fn with(mut self, change: impl FnOnce(&mut Self)) -> Self {
                change(&mut self);
                self
            }
        }
    )+};
}

pub(crate) use changeable;
