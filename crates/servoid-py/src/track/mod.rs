pub(crate) mod estimate;
pub(crate) mod from_masks;
mod kinds;
pub(crate) mod one_step;
pub(crate) mod settings;

use numpy::{
    PyArray1, PyArray2, PyArrayDescrMethods, PyArrayMethods, PyReadonlyArray2, PyUntypedArray,
    PyUntypedArrayMethods,
};
use pyo3::prelude::*;
use pyo3::types::PyBytes;
use servoid::camera::{DepthView, Mask, Observation};
use servoid::track as core;

use crate::camera::{Camera, Pixels};
use crate::errors::{named, raise};
use crate::given_images::{GivenMask, Picture, is_masked, masked};
use crate::held::Held;
use crate::pose::{Pose, read_poses, rows};
use crate::shape::Body;
use crate::taking::{Listed, Seconds, Wanted, described, read_whole};
use crate::track::estimate::Estimate;
use crate::track::kinds::Kinds;
use crate::track::settings::TrackSettings;

/// Images from Python, None where a camera delivered nothing.
pub type Pictures<'py> = Listed<Option<Picture<'py>>>;

/// Masks from Python, None where there is none.
pub type Masks<'py> = Listed<Option<GivenMask<'py>>>;

/// Depth images from Python, None where a camera measured nothing.
type Depths<'py> = Listed<Option<Metres>>;

const NO_APPEARANCE: &str = "there is no appearance to recall: the body's file was saved without \
    one; start the tracker at a pose, or learn the appearance with servoid.track.learn_appearance";

/// Tracks a body in six degrees of freedom from observation to observation.
///
/// It is constructed from cameras and a body; raises TrackError. It takes one call at a time: while
/// one thread calls it, the calls of others raise TrackError.
#[pyclass(frozen, module = "servoid.track")]
pub struct Tracker(Held<core::Tracker>, Kinds);

#[pymethods]
impl Tracker {
    /// States that observations may contain depth images.
    #[classattr]
    const TAKES_DEPTHS: bool = true;

    #[new]
    #[pyo3(signature = (cameras, body, settings=None))]
    #[allow(clippy::needless_pass_by_value, reason = "as Python hands it over")]
    fn new(cameras: Listed<Camera>, body: Body, settings: Option<TrackSettings>) -> PyResult<Self> {
        let cameras: Vec<_> = cameras.0.iter().map(|camera| camera.0).collect();
        let settings = settings.map(|settings| settings.0).unwrap_or_default();
        let tracker = core::Tracker::new(&cameras, &body.0, settings).map_err(raise)?;
        Ok(Self(Held::new(tracker), Kinds::default()))
    }

    /// Learns colours and surface points from images in which the object's pose is known; masks,
    /// (H, W) uint8 and None where there is none, mark its pixels. Masks that lie elsewhere are
    /// reported in `notices` and not used. Raises TrackError.
    #[pyo3(signature = (time_s, world_from_camera, images, world_from_object, masks=None, depths=None))]
    #[allow(clippy::too_many_arguments, reason = "an observation has four parts")]
    #[allow(clippy::needless_pass_by_value, reason = "as Python hands it over")]
    fn start(
        &self,
        py: Python<'_>,
        time_s: Seconds,
        world_from_camera: Listed<Pose>,
        images: Pictures<'_>,
        world_from_object: Pose,
        masks: Option<Masks<'_>>,
        depths: Option<Depths<'_>>,
    ) -> PyResult<Estimate> {
        self.1.forget();
        let (images, depths) = (self.1.read(&images)?, depths.unwrap_or_default().0);
        let masks = masks.unwrap_or_default();
        let masks = read_masks(&masks)?;
        let observation = observation(time_s.0, &world_from_camera.0, &images, &depths)?;
        let masks = masks.iter().map(mask).collect::<PyResult<Vec<_>>>()?;
        let tracker = &mut *self.0.write()?;
        let started = py.detach(|| tracker.start(&observation, world_from_object.0, &masks));
        started.map(Estimate::from).map_err(raise)
    }

    /// Estimates the object's pose in the next images, None where a camera delivered nothing;
    /// `depths` are depth images with the same pixels, (H, W) float32, metres along z. Raises
    /// TrackError.
    #[pyo3(signature = (time_s, world_from_camera, images, depths=None))]
    #[allow(clippy::needless_pass_by_value, reason = "as Python hands it over")]
    fn step(
        &self,
        py: Python<'_>,
        time_s: Seconds,
        world_from_camera: Listed<Pose>,
        images: Pictures<'_>,
        depths: Option<Depths<'_>>,
    ) -> PyResult<Estimate> {
        let (images, depths) = (self.1.read(&images)?, depths.unwrap_or_default().0);
        let observation = observation(time_s.0, &world_from_camera.0, &images, &depths)?;
        let tracker = &mut *self.0.write()?;
        py.detach(|| tracker.step(&observation)).map(Estimate::from).map_err(raise)
    }

    /// Searches for the object with all that is known of it, near a pose if one is given, and
    /// continues tracking from there. Raises TrackError.
    #[pyo3(signature = (time_s, world_from_camera, images, near=None, depths=None))]
    #[allow(clippy::too_many_arguments, reason = "an observation has four parts")]
    #[allow(clippy::needless_pass_by_value, reason = "as Python hands it over")]
    fn find(
        &self,
        py: Python<'_>,
        time_s: Seconds,
        world_from_camera: Listed<Pose>,
        images: Pictures<'_>,
        near: Option<Pose>,
        depths: Option<Depths<'_>>,
    ) -> PyResult<Estimate> {
        let (images, depths) = (self.1.read(&images)?, depths.unwrap_or_default().0);
        let observation = observation(time_s.0, &world_from_camera.0, &images, &depths)?;
        let near = near.map(|pose| pose.0);
        let tracker = &mut *self.0.write()?;
        py.detach(|| tracker.find(&observation, near)).map(Estimate::from).map_err(raise)
    }

    /// Scores poses in images by what was learned so far: poses (N, 7) float64, world_from_object
    /// as (w, x, y, z, tx, ty, tz). Returns (N, 2) float64, the scores by regions and by surface
    /// points, whose sum is the total. Surface points are compared at a `resolution`, 0 for the
    /// image's own, 2 for the coarsest. Nothing is learned. Raises TrackError, PoseError.
    #[pyo3(signature = (time_s, world_from_camera, images, poses, *, resolution=0, threads=0))]
    #[allow(clippy::too_many_arguments, reason = "an observation has three parts")]
    #[allow(clippy::needless_pass_by_value, reason = "as Python hands it over")]
    fn score_terms<'py>(
        &self,
        py: Python<'py>,
        time_s: Seconds,
        world_from_camera: Listed<Pose>,
        images: Pictures<'py>,
        poses: &Bound<'py, PyAny>,
        #[pyo3(from_py_with = whole_resolution)] resolution: usize,
        #[pyo3(from_py_with = whole_threads)] threads: usize,
    ) -> PyResult<Bound<'py, PyArray2<f64>>> {
        let images = self.1.read(&images)?;
        let observation = observation(time_s.0, &world_from_camera.0, &images, &[])?;
        let poses = read_poses(poses)?;
        let tracker = &*self.0.read()?;
        let weighed = py.detach(|| tracker.score_terms(&observation, &poses, resolution, threads));
        let weighed = weighed.map_err(raise)?;
        let values: Vec<f64> = weighed.iter().flat_map(|one| [one.region, one.surface]).collect();
        Ok(rows(py, &values, 2))
    }

    /// The object's appearance as far as it was learned, as bytes. Raises TrackError.
    fn appearance<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyBytes>> {
        Ok(PyBytes::new(py, &self.0.read()?.appearance().to_bytes()))
    }

    /// Restores the appearance of an object, as returned by `appearance`. Raises TrackError, also
    /// for None, which `look` of a body's file is if it was saved without an appearance.
    fn recall(&self, appearance: Option<&[u8]>) -> PyResult<()> {
        let appearance =
            appearance.ok_or_else(|| named("TrackError", NO_APPEARANCE.to_string()))?;
        let appearance = core::Appearance::from_bytes(appearance).map_err(raise)?;
        self.0.write()?.recall(&appearance).map_err(raise)
    }

    /// Sets where other tracked objects are now, as bodies at their poses: from now on a search does
    /// not find this one there. Raises TrackError.
    #[allow(clippy::needless_pass_by_value, reason = "as Python hands it over")]
    fn avoid(&self, others: Listed<Body>) -> PyResult<()> {
        self.0.write()?.avoid(others.0.into_iter().map(|body| body.0).collect());
        Ok(())
    }

    /// Starts to evolve the body by the sides that were seen, in a separate thread; returns whether
    /// there is anything new. The fifth estimate after this call reports that it has `evolved`.
    /// Raises TrackError.
    fn begin_evolving(&self) -> PyResult<bool> {
        Ok(self.0.write()?.begin_evolving())
    }

    /// Evolves the body by the sides that were seen, between images, and waits for the result;
    /// returns whether it changed. Raises TrackError, ModelError.
    fn evolve(&self, py: Python<'_>) -> PyResult<bool> {
        let tracker = &mut *self.0.write()?;
        py.detach(|| tracker.evolve()).map_err(raise)
    }

    /// Returns the pose of the object at a keyframe, by its number in `Estimate.keyframes`, as
    /// currently estimated; None if there was none. Raises TrackError.
    fn keyframe_pose(
        &self,
        #[pyo3(from_py_with = whole_number)] number: usize,
    ) -> PyResult<Option<Pose>> {
        Ok(self.0.read()?.keyframe_pose(number).map(Pose))
    }

    /// The body at its latest pose.
    #[getter]
    fn body(&self) -> PyResult<Body> {
        self.0.read()?.body().map(Body).map_err(raise)
    }

    /// The surface points, edgels included: (N, 3) float64 in metres and their normals (N, 3)
    /// float64, in the object's frame, and their colours (N, 3) uint8.
    #[getter]
    fn surface<'py>(&self, py: Python<'py>) -> PyResult<Surface<'py>> {
        let tracker = self.0.read()?;
        let points: Vec<f64> =
            tracker.surface().flat_map(|p| <[f64; 3]>::from(p.position)).collect();
        let normals: Vec<f64> =
            tracker.surface().flat_map(|p| <[f64; 3]>::from(p.normal)).collect();
        let colors: Vec<[u8; 3]> = tracker.surface().map(|p| p.color).collect();
        let count = colors.len();
        let colors = PyArray1::from_vec(py, colors.concat());
        let colors = PyArrayMethods::reshape(&colors, [count, 3])?;
        Ok((rows(py, &points, 3), rows(py, &normals, 3), colors))
    }
}

const fn whole(name: &'static str) -> Wanted {
    Wanted { name, what: "a whole number, 0 or more", class: "TrackError" }
}

fn whole_resolution(given: &Bound<'_, PyAny>) -> PyResult<usize> {
    read_whole(given, whole("resolution"))
}

fn whole_threads(given: &Bound<'_, PyAny>) -> PyResult<usize> {
    read_whole(given, whole("threads"))
}

fn whole_number(given: &Bound<'_, PyAny>) -> PyResult<usize> {
    read_whole(given, whole("number"))
}

type Surface<'py> =
    (Bound<'py, PyArray2<f64>>, Bound<'py, PyArray2<f64>>, Bound<'py, PyArray2<u8>>);

pub fn read<'a>(pictures: &'a Pictures<'_>) -> PyResult<Vec<Option<Pixels<'a>>>> {
    let pixels = |picture: &'a Option<Picture<'_>>| {
        picture.as_ref().map(|picture| Pixels::new(&picture.0)).transpose()
    };
    pictures.0.iter().map(pixels).collect()
}

pub fn read_masks<'a>(masks: &'a Masks<'_>) -> PyResult<Vec<Option<Pixels<'a>>>> {
    let pixels = |mask: &'a Option<GivenMask<'_>>| {
        mask.as_ref().map(|mask| Pixels::new(&mask.0)).transpose()
    };
    masks.0.iter().map(pixels).collect()
}

pub fn mask<'a>(pixels: &'a Option<Pixels<'_>>) -> PyResult<Option<Mask<'a>>> {
    let Some(pixels) = pixels else { return Ok(None) };
    Mask::new(pixels.view()?).map(Some).map_err(raise)
}

pub fn observation<'a>(
    time_s: f64,
    world_from_camera: &[Pose],
    images: &'a [Option<Pixels<'_>>],
    depths: &'a [Option<Metres>],
) -> PyResult<Observation<'a>> {
    let view = |pixels: &'a Option<Pixels<'_>>| pixels.as_ref().map(Pixels::view).transpose();
    let depth = |metres: &'a Option<Metres>| metres.as_ref().map(Metres::view).transpose();
    Ok(Observation {
        time_s,
        world_from_camera: world_from_camera.iter().map(|pose| pose.0).collect(),
        images: images.iter().map(view).collect::<PyResult<_>>()?,
        depths: depths.iter().map(depth).collect::<PyResult<_>>()?,
    })
}

/// A depth image, row by row without gaps.
pub struct Metres {
    data: Vec<f32>,
    size_px: [usize; 2],
}

impl<'a, 'py> FromPyObject<'a, 'py> for Metres {
    type Error = PyErr;

    fn extract(given: Borrowed<'a, 'py, PyAny>) -> PyResult<Self> {
        if is_masked(&given) {
            return Err(masked("a depth image", &given, "ImageError"));
        }
        let kind = given.cast::<PyUntypedArray>().ok().filter(|array| array.ndim() == 2);
        if kind.map(|array| array.dtype().kind()) != Some(b'f') {
            let message = format!(
                "a depth image has shape (H, W) of float32, in metres, but {} was given; convert \
                 it, such as millimetres by (depth * 0.001).astype(numpy.float32)",
                described(&given)
            );
            return Err(named("ImageError", message));
        }
        let depth = given.call_method1("astype", ("float32",))?;
        let depth: PyReadonlyArray2<'_, f32> = depth.extract()?;
        let pixels = depth.as_array();
        let (height, width) = pixels.dim();
        Ok(Self { data: pixels.iter().copied().collect(), size_px: [width, height] })
    }
}

impl Metres {
    fn view(&self) -> PyResult<DepthView<'_>> {
        DepthView::new(&self.data, self.size_px).map_err(raise)
    }
}

/// Converts a depth image, (H, W) of floats, metres along z, to float32; raises ImageError.
#[pyfunction]
pub fn taken_depth(py: Python<'_>, depth: Metres) -> PyResult<Bound<'_, PyArray2<f32>>> {
    let [width, height] = depth.size_px;
    PyArray1::from_vec(py, depth.data).reshape([height, width])
}
