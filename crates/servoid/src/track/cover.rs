use nalgebra::Vector2;

use crate::fitness::Agreement;

/// Where surface points are recognised that should be, and where something hides them.
#[derive(Debug, Clone, Default)]
pub(super) struct Cover {
    /// Whether the object was there a moment ago: only then is what is not seen thought hidden.
    pub(super) was_there: bool,
    places: Vec<(usize, Vector2<f64>, bool)>,
}

/// Pixels within which surface points say whether a place is hidden.
const AROUND_PX: f64 = 30.0;
/// How many points must say so, and the shares of them that are recognised where the object is
/// hidden, and where it is not.
const LEAST: f64 = 3.0;
const HIDDEN: f64 = 0.4;
const CLEAR: f64 = 0.8;
/// Correlation from which on a point is recognised.
const RECOGNISED: f64 = 0.6;

impl Cover {
    pub(super) fn clear(&mut self) {
        self.places.clear();
    }

    /// Takes a point that a camera should see at a pixel.
    pub(super) fn add(
        &mut self,
        camera: usize,
        pixel: Option<Vector2<f64>>,
        found: Option<&Agreement>,
    ) {
        let nowhere = Vector2::repeat(f64::NAN);
        let recognised = found.is_some_and(|a| a.correlation > RECOGNISED);
        self.places.push((camera, pixel.unwrap_or(nowhere), recognised));
    }

    /// Gives the camera and the pixel of the points, in the order in which they were taken.
    pub(super) fn places(&self) -> impl Iterator<Item = (usize, &Vector2<f64>)> {
        self.places.iter().map(|(camera, pixel, _)| (*camera, pixel))
    }

    /// Says whether most points around a pixel are not where they should be.
    pub(super) fn hides(&self, camera: usize, pixel: &Vector2<f64>) -> bool {
        self.was_there && self.look(camera, pixel) == Some(false)
    }

    /// Says whether nearly all points around a pixel are where they should be, or most are not; None
    /// where neither is clear.
    pub(super) fn look(&self, camera: usize, pixel: &Vector2<f64>) -> Option<bool> {
        let (seen, expected) = self.around(camera, pixel);
        let (seen, expected) = (seen as f64, expected as f64);
        let clear = seen >= CLEAR * expected;
        (expected >= LEAST && (clear || seen < HIDDEN * expected)).then_some(clear)
    }

    fn around(&self, camera: usize, pixel: &Vector2<f64>) -> (usize, usize) {
        let near = |place: &Vector2<f64>| (place - pixel).norm_squared() < AROUND_PX * AROUND_PX;
        let places = self.places.iter().filter(|(of, place, _)| *of == camera && near(place));
        places.fold((0, 0), |(seen, expected), (.., found)| {
            (seen + usize::from(*found), expected + 1)
        })
    }
}
