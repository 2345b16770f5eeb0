use std::hash::{Hash, Hasher};

use nalgebra::{Matrix4, Quaternion, UnitQuaternion, Vector3, Vector6};
use numpy::{PyArray1, PyArray2, PyArrayMethods, PyUntypedArray, PyUntypedArrayMethods};
use pyo3::prelude::*;
use pyo3::types::{PyList, PyTuple, PyType};
use servoid::pose as core;

use crate::errors::{named, raise};
use crate::taking::{
    Wanted, described, floats, hash_numbers, read_numbers, read_rows, shorts, taken_in_words,
};

/// A rigid motion, an element of SE(3): `a_from_b` maps coordinates in `b` to coordinates in `a`.
///
/// It is constructed from a homogeneous matrix, (4, 4); PoseError is raised if that is not a rigid
/// motion. `a_from_b @ b_from_c` is `a_from_c`.
#[pyclass(frozen, eq, hash, module = "servoid.pose")]
#[derive(Clone, PartialEq)]
pub struct Pose(pub core::Pose);

taken_in_words!(
    Pose,
    "PoseError",
    "a pose",
    "make one with servoid.pose.Pose(matrix) of a 4x4 matrix, or Pose.from_parts"
);

impl Hash for Pose {
    fn hash<H: Hasher>(&self, state: &mut H) {
        hash_numbers(self.0.translation().as_slice(), state);
        // A quaternion and its negative are the same rotation.
        let quaternion = self.0.quaternion();
        let first = quaternion.iter().find(|&&x| x != 0.0).copied().unwrap_or(1.0);
        hash_numbers(&quaternion.map(|x| x * first.signum()), state);
    }
}

const fn wanted(name: &'static str, what: &'static str) -> Wanted {
    Wanted { name, what, class: "PoseError" }
}

/// No one means more turns than two; degrees that are taken for radians are most often more.
const MOST_TURN_RAD: f64 = 4.0 * std::f64::consts::PI;

const TRANSLATION: Wanted = wanted("translation", "3 numbers (x, y, z) in metres");

#[pymethods]
impl Pose {
    /// Makes arrays leave `@` to poses.
    #[classattr]
    #[pyo3(name = "__array_ufunc__")]
    const ARRAY_UFUNC: Option<bool> = None;

    #[new]
    fn new(matrix: &Bound<'_, PyAny>) -> PyResult<Self> {
        let wanted = wanted("the matrix of a pose", "a 4x4 array of numbers");
        let array = floats(matrix, wanted)?;
        if array.shape() != [4, 4] {
            let given = described(matrix);
            let message = format!("a pose is a 4x4 matrix, but {given} was given; {NOT_A_MATRIX}");
            return Err(named("PoseError", message));
        }
        let array = array.as_array();
        let matrix = Matrix4::from_fn(|row, column| array[[row, column]]);
        core::Pose::from_matrix(&matrix).map(Self).map_err(raise)
    }

    /// Returns the identity.
    #[staticmethod]
    fn identity() -> Self {
        Self(core::Pose::identity())
    }

    /// Makes a pose of a translation (x, y, z) in metres and a unit quaternion (w, x, y, z). Raises
    /// PoseError.
    #[staticmethod]
    fn from_parts(translation: &Bound<'_, PyAny>, quaternion: &Bound<'_, PyAny>) -> PyResult<Self> {
        let quaternion = read_numbers(quaternion, wanted("quaternion", "4 numbers (w, x, y, z)"))?;
        let translation = read_numbers(translation, TRANSLATION)?;
        core::Pose::from_parts(translation, quaternion).map(Self).map_err(raise)
    }

    /// Makes a pose of a translation (x, y, z) in metres and a unit quaternion (x, y, z, w), in the
    /// order of ROS and SciPy. Raises PoseError.
    #[staticmethod]
    fn from_xyzw(translation: &Bound<'_, PyAny>, xyzw: &Bound<'_, PyAny>) -> PyResult<Self> {
        let [x, y, z, w] = read_numbers(xyzw, wanted("xyzw", "4 numbers (x, y, z, w)"))?;
        let translation = read_numbers(translation, TRANSLATION)?;
        core::Pose::from_parts(translation, [w, x, y, z]).map(Self).map_err(raise)
    }

    /// Makes a pose of OpenCV's rotation vector and translation, 3 numbers each, as `solvePnP`
    /// returns them, in radians and metres: for a camera they are camera_from_object. Raises
    /// PoseError, also for a rotation of more than two turns, as degrees are.
    #[staticmethod]
    fn from_rvec_tvec(rvec: &Bound<'_, PyAny>, tvec: &Bound<'_, PyAny>) -> PyResult<Self> {
        let rvec: [f64; 3] = read_numbers(rvec, wanted("rvec", "3 numbers in radians"))?;
        let tvec: [f64; 3] = read_numbers(tvec, wanted("tvec", "3 numbers in metres"))?;
        checked(&[&rvec, &tvec])?;
        let rvec = Vector3::from(rvec);
        check_radians("the length of rvec", rvec.norm(), "np.radians(rvec)")?;
        let rotation = UnitQuaternion::from_scaled_axis(rvec);
        Ok(Self(core::Pose::from_rotation(rotation, tvec.into())))
    }

    /// Makes a pose of a rotation by angles in radians, or in degrees if so given, and a
    /// translation (x, y, z) in metres. The sequence names one to three axes as in SciPy: "xyz" in
    /// lower case rotates about fixed axes, x first; "XYZ" in upper case about axes that rotate
    /// with the object. Raises PoseError, also for radians of more than two turns, as degrees are.
    #[staticmethod]
    #[pyo3(signature = (sequence, angles, translation=None, *, degrees=false))]
    fn from_euler(
        sequence: &str,
        angles: &Bound<'_, PyAny>,
        translation: Option<&Bound<'_, PyAny>>,
        degrees: bool,
    ) -> PyResult<Self> {
        let sequence = core::EulerSequence::from_name(sequence).map_err(raise)?;
        let wanted = wanted("angles", "as many numbers as the sequence has axes");
        let given = floats(angles, wanted)?;
        let mut numbers: Vec<f64> = given.as_array().iter().copied().collect();
        if numbers.len() != sequence.count() || given.ndim() > 1 {
            let axes = if sequence.count() == 1 { "axis" } else { "axes" };
            let message = format!(
                "the sequence has {} {axes}, but angles are {}; give one for each axis",
                sequence.count(),
                described(angles)
            );
            return Err(named("PoseError", message));
        }
        let translation = translation.map_or(Ok([0.0; 3]), |t| read_numbers(t, TRANSLATION))?;
        checked(&[&numbers, &translation])?;
        if degrees {
            numbers.iter_mut().for_each(|angle| *angle = angle.to_radians());
        } else {
            let largest = numbers.iter().fold(0.0_f64, |most, angle| most.max(angle.abs()));
            check_radians("an angle", largest, "degrees=True")?;
        }
        let rotation = sequence.rotation(&numbers);
        Ok(Self(core::Pose::from_rotation(rotation, translation.into())))
    }

    /// Integrates a twist (linear, angular), 6 numbers, over unit time. Raises PoseError.
    #[staticmethod]
    fn exp(twist: &Bound<'_, PyAny>) -> PyResult<Self> {
        let twist = read_numbers::<6>(twist, wanted("twist", "6 numbers (linear, angular)"))?;
        checked(&[&twist[..3], &twist[3..]])?;
        Ok(Self(core::Pose::exp(&Vector6::from(twist))))
    }

    /// Returns the twist (linear, angular), (6,) float64, whose exponential is this pose.
    fn log<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        PyArray1::from_slice(py, self.0.log().as_slice())
    }

    /// Returns the adjoint, (6, 6) float64, which transforms twists (linear, angular).
    fn adjoint<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray2<f64>> {
        rows(py, self.0.adjoint().transpose().as_slice(), 6)
    }

    /// Returns the inverse motion.
    fn inverse(&self) -> Self {
        Self(self.0.inverse())
    }

    /// Returns the homogeneous matrix, (4, 4) float64.
    fn matrix<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray2<f64>> {
        rows(py, self.0.matrix().transpose().as_slice(), 4)
    }

    /// Returns OpenCV's rotation vector and translation, (3,) float64 each, in radians and metres.
    fn rvec_tvec<'py>(&self, py: Python<'py>) -> (Vector<'py>, Vector<'py>) {
        let rvec = self.0.rotation().scaled_axis();
        let tvec = self.0.translation();
        (PyArray1::from_slice(py, rvec.as_slice()), PyArray1::from_slice(py, tvec.as_slice()))
    }

    /// Returns the three angles in radians, or in degrees if so asked, about the axes of a
    /// sequence, named as in `from_euler`: (3,) float64. The second is in -π/2 to π/2, or in 0 to π
    /// if the first and the last axis are the same. Where only the sum of the first and the last
    /// angle is determined, the last one is 0. Raises PoseError.
    #[pyo3(signature = (sequence, *, degrees=false))]
    fn euler<'py>(&self, py: Python<'py>, sequence: &str, degrees: bool) -> PyResult<Vector<'py>> {
        let sequence = core::EulerSequence::from_name(sequence).map_err(raise)?;
        let angles = sequence.angles(&self.0).map_err(raise)?;
        let angles = if degrees { angles.map(f64::to_degrees) } else { angles };
        Ok(PyArray1::from_slice(py, &angles))
    }

    /// Translation (x, y, z) in metres.
    #[getter]
    fn translation(&self) -> (f64, f64, f64) {
        let t = self.0.translation();
        (t.x, t.y, t.z)
    }

    /// Unit quaternion (w, x, y, z) with w >= 0.
    #[getter]
    fn quaternion(&self) -> (f64, f64, f64, f64) {
        self.0.quaternion().into()
    }

    /// The same unit quaternion as (x, y, z, w), as ROS and SciPy order it.
    #[getter]
    fn xyzw(&self) -> (f64, f64, f64, f64) {
        let [w, x, y, z] = self.0.quaternion();
        (x, y, z, w)
    }

    /// Transforms points, (N, 3), or one point, (3,), in metres: float64 of the same shape. Raises
    /// PoseError.
    fn transform<'py>(
        &self,
        py: Python<'py>,
        points: &Bound<'py, PyAny>,
    ) -> PyResult<Bound<'py, PyAny>> {
        let moved = |p: [f64; 3]| <[f64; 3]>::from(self.0.transform(&Vector3::from(p)));
        let wanted = wanted("points", "numbers of shape (N, 3) or (3,), in metres");
        if floats(points, wanted)?.shape() == [3] {
            let point = moved(read_numbers(points, wanted)?);
            return Ok(PyArray1::from_slice(py, &point).into_any());
        }
        let points = read_rows::<3>(points, wanted)?;
        let moved: Vec<f64> = points.into_iter().flat_map(moved).collect();
        Ok(rows(py, &moved, 3).into_any())
    }

    fn __matmul__<'py>(&self, py: Python<'py>, other: &Bound<'py, PyAny>) -> PyResult<Py<PyAny>> {
        let Ok(other) = other.cast::<Self>() else {
            return not_joined(py, other);
        };
        let product = self.0 * other.get().0;
        checked(&[product.translation().as_slice()])?;
        Ok(Self(product).into_pyobject(py)?.into_any().unbind())
    }

    fn __rmatmul__<'py>(&self, py: Python<'py>, other: &Bound<'py, PyAny>) -> PyResult<Py<PyAny>> {
        not_joined(py, other)
    }

    fn __repr__(&self) -> String {
        let translation = shorts(self.0.translation().as_slice());
        format!("Pose(translation={translation}, quaternion={})", shorts(&self.0.quaternion()))
    }

    fn __reduce__<'py>(slf: &Bound<'py, Self>) -> PyResult<(Bound<'py, PyAny>, Numbers)> {
        let pose = &slf.get().0;
        let q = pose.rotation().into_inner();
        let parts = (pose.translation().into(), [q.w, q.i, q.j, q.k]);
        Ok((slf.getattr("_of_parts")?, parts))
    }

    /// Restores a pose from its parts, to the last bit.
    #[classmethod]
    fn _of_parts(
        _class: &Bound<'_, PyType>,
        translation: [f64; 3],
        quaternion: [f64; 4],
    ) -> PyResult<Self> {
        core::Pose::from_parts(translation, quaternion).map_err(raise)?;
        Ok(Self(core::Pose::from_rotation(as_it_was(quaternion), translation.into())))
    }
}

type Vector<'py> = Bound<'py, PyArray1<f64>>;

/// Translation and quaternion.
type Numbers = ([f64; 3], [f64; 4]);

const NOT_A_MATRIX: &str = "a translation and a quaternion are joined by Pose.from_parts or \
                            Pose.from_xyzw, OpenCV's rvec and tvec by Pose.from_rvec_tvec";

/// Makes a rotation of a quaternion (w, x, y, z) known to have unit length, to the last bit.
pub fn as_it_was(quaternion: [f64; 4]) -> UnitQuaternion<f64> {
    let [w, x, y, z] = quaternion;
    UnitQuaternion::new_unchecked(Quaternion::new(w, x, y, z))
}

/// Rejects vectors that poses cannot be computed with.
fn checked(vectors: &[&[f64]]) -> PyResult<()> {
    vectors.iter().try_for_each(|vector| core::check_vector(vector)).map_err(raise)
}

/// Raises an error for an angle that is given in degrees where radians are meant.
fn check_radians(name: &str, angle: f64, remedy: &str) -> PyResult<()> {
    if angle <= MOST_TURN_RAD {
        return Ok(());
    }
    let message = format!(
        "{name} is {angle:.1}, but it is in radians, at most two turns (12.57); for degrees, give \
         {remedy}"
    );
    Err(named("PoseError", message))
}

/// Raises an error for a pose and points; other types may implement the operation themselves.
fn not_joined(py: Python<'_>, other: &Bound<'_, PyAny>) -> PyResult<Py<PyAny>> {
    let points = other.is_instance_of::<PyUntypedArray>()
        || other.is_instance_of::<PyList>()
        || other.is_instance_of::<PyTuple>();
    if !points {
        return Ok(py.NotImplemented());
    }
    let message = format!(
        "@ joins two poses, but {} was given; move points with pose.transform(points), and make a \
         pose of a matrix with Pose(matrix)",
        described(other)
    );
    Err(named("PoseError", message))
}

/// Returns a float64 array of rows of a given length.
pub fn rows<'py>(py: Python<'py>, values: &[f64], length: usize) -> Bound<'py, PyArray2<f64>> {
    let array = PyArray2::zeros(py, [values.len() / length, length], false);
    // SAFETY: the array was just created and has no other references.
    unsafe {
        if let Ok(place) = array.as_slice_mut() {
            place.copy_from_slice(values);
        }
    }
    array
}

/// Reads poses, (N, 7), as (w, x, y, z, tx, ty, tz).
pub fn read_poses(array: &Bound<'_, PyAny>) -> PyResult<Vec<core::Pose>> {
    let rows = read_rows::<7>(array, wanted("poses", "(N, 7) as (w, x, y, z, tx, ty, tz)"))?;
    let pose = |&[w, i, j, k, x, y, z]: &[f64; 7]| core::Pose::from_parts([x, y, z], [w, i, j, k]);
    rows.iter().map(pose).collect::<Result<_, _>>().map_err(raise)
}
