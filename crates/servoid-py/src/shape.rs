use std::hash::{Hash, Hasher};

use numpy::{PyArray1, PyArray2, PyArrayMethods};
use pyo3::prelude::*;
use pyo3::types::PyType;
use servoid::shape as core;

use crate::camera::Camera;
use crate::errors::{named, raise};
use crate::pose::{Pose, as_it_was, rows};
use crate::taking::{
    Wanted, hash_numbers, read_index_rows, read_rows, read_whole, shorts, taken_in_words,
};

/// A rigid set of ellipsoids in the object's frame, and the pose of that frame in the world.
///
/// It is constructed from centers (K, 3) and radii (K, 3) in metres and rotations (K, 4) as (w, x,
/// y, z), all in the object's frame; BodyError is raised if they do not make a body.
#[pyclass(frozen, eq, hash, module = "servoid.shape")]
#[derive(Clone, PartialEq)]
pub struct Body(pub core::Body);

taken_in_words!(
    Body,
    "BodyError",
    "a body",
    "of a file it is servoid.shape.load_body(path).body(), of a model result.body"
);

impl Hash for Body {
    fn hash<H: Hasher>(&self, state: &mut H) {
        Pose(self.0.world_from_object()).hash(state);
        for ellipsoid in self.0.ellipsoids() {
            hash_numbers(ellipsoid.center().as_slice(), state);
            hash_numbers(ellipsoid.radii().as_slice(), state);
        }
    }
}

const fn wanted(name: &'static str, what: &'static str) -> Wanted {
    Wanted { name, what, class: "BodyError" }
}

const METRES: &str = "numbers of shape (N, 3), in metres";

/// A closed surface of triangles.
///
/// It is constructed from vertices (V, 3) in metres, and triangles (F, 3) of whole numbers that
/// refer to them, counted from 0, counter-clockwise seen from outside; BodyError is raised if it is
/// not closed.
#[pyclass(frozen, module = "servoid._native")]
#[derive(Clone)]
pub struct Mesh(pub core::Mesh);

taken_in_words!(Mesh, "BodyError", "a mesh", "give vertices and faces");

#[pymethods]
impl Mesh {
    #[new]
    #[pyo3(signature = (*, vertices, faces))]
    fn new(vertices: &Bound<'_, PyAny>, faces: &Bound<'_, PyAny>) -> PyResult<Self> {
        let vertices = read_rows::<3>(vertices, wanted("vertices", METRES))?;
        core::Mesh::new(vertices, read_faces(faces)?).map(Self).map_err(raise)
    }

    /// Volume in cubic metres.
    #[getter]
    fn volume(&self) -> f64 {
        self.0.volume()
    }
}

/// Triangles that need not be closed or consistently oriented.
///
/// It is constructed from vertices (V, 3) in metres, and triangles (F, 3) of whole numbers that
/// refer to them, counted from 0; BodyError is raised if one refers to a vertex that does not
/// exist.
#[pyclass(frozen, module = "servoid._native")]
pub struct Soup(core::Soup);

/// Vertices (V, 3), triangles (F, 3), the jumps of the winding number (V,), and the side of a cell.
type Rebuilt<'py> =
    (Bound<'py, PyArray2<f64>>, Bound<'py, PyArray2<i64>>, Bound<'py, PyArray1<f64>>, f64);

fn read_faces(faces: &Bound<'_, PyAny>) -> PyResult<Vec<[usize; 3]>> {
    let corner = |i: i64| usize::try_from(i).unwrap_or(usize::MAX);
    let what = "whole numbers of shape (F, 3) that count vertices from 0";
    let faces = read_index_rows::<3>(faces, wanted("faces", what))?;
    Ok(faces.into_iter().map(|face| face.map(corner)).collect())
}

#[pymethods]
impl Soup {
    #[new]
    #[pyo3(signature = (*, vertices, faces))]
    fn new(vertices: &Bound<'_, PyAny>, faces: &Bound<'_, PyAny>) -> PyResult<Self> {
        let vertices = read_rows::<3>(vertices, wanted("vertices", METRES))?;
        core::Soup::new(&vertices, &read_faces(faces)?).map(Self).map_err(raise)
    }

    /// Return the winding numbers of the triangles around points (N, 3) in metres, (N,) float64.
    ///
    /// A winding number is 1 inside a closed surface, 0 outside, and a value in between where it
    /// has holes.
    fn windings<'py>(
        &self,
        py: Python<'py>,
        points: &Bound<'_, PyAny>,
    ) -> PyResult<Bound<'py, PyArray1<f64>>> {
        let points = read_rows::<3>(points, wanted("points", METRES))?;
        let points: Vec<_> = points.into_iter().map(Into::into).collect();
        Ok(PyArray1::from_vec(py, py.detach(|| self.0.windings(&points))))
    }

    /// Return, from -1 to 1, how much more of the sky the fronts of some triangles (F, 3) see than
    /// their backs.
    ///
    /// Raises:
    ///     BodyError: a triangle refers to a vertex that does not exist.
    fn openness(&self, py: Python<'_>, faces: &Bound<'_, PyAny>) -> PyResult<f64> {
        let faces = read_faces(faces)?;
        py.detach(|| self.0.openness(&faces)).map_err(raise)
    }

    /// Rebuild a closed surface where the winding number is a half, on a grid with this many cells
    /// along the longest side; None if the triangles enclose nothing.
    ///
    /// Return vertices (V, 3) in metres, triangles (F, 3), the jump of the winding number across
    /// the surface at each vertex, (V,), about 1 on the given triangles and less where the surface
    /// is interpolated, and the side of a cell in metres.
    ///
    /// Raises:
    ///     BodyError: there are too many cells.
    fn rebuilt<'py>(
        &self,
        py: Python<'py>,
        cells: &Bound<'py, PyAny>,
    ) -> PyResult<Option<Rebuilt<'py>>> {
        let cells = read_whole(cells, wanted("cells", "a whole number, 0 or more"))?;
        let found = py.detach(|| self.0.rebuilt(cells)).map_err(raise)?;
        let Some(found) = found else { return Ok(None) };
        let faces: Vec<i64> = found.faces.iter().flatten().map(|&i| i as i64).collect();
        let count = found.faces.len();
        let corners = found.vertices.len();
        Ok(Some((
            PyArray1::from_vec(py, found.vertices.concat()).reshape([corners, 3])?,
            PyArray1::from_vec(py, faces).reshape([count, 3])?,
            PyArray1::from_vec(py, found.leaps),
            found.cell,
        )))
    }
}

/// Centre (2,) and 2x2 matrix of an outline.
type Ellipse<'py> = (Bound<'py, PyArray1<f64>>, Bound<'py, PyArray2<f64>>);

/// Volume, centroid (3,) and inertia (3, 3).
type MassParts<'py> = (f64, Bound<'py, PyArray1<f64>>, Bound<'py, PyArray2<f64>>);

#[pymethods]
impl Body {
    /// Most ellipsoids in a body.
    #[classattr]
    const MAX_ELLIPSOIDS: usize = core::Body::MAX_ELLIPSOIDS;

    #[new]
    #[pyo3(signature = (*, world_from_object, centers, radii, rotations))]
    fn new(
        world_from_object: Pose,
        centers: &Bound<'_, PyAny>,
        radii: &Bound<'_, PyAny>,
        rotations: &Bound<'_, PyAny>,
    ) -> PyResult<Self> {
        let centers = read_rows::<3>(centers, wanted("centers", METRES))?;
        let radii = read_rows::<3>(radii, wanted("radii", METRES))?;
        let turns = "quaternions (w, x, y, z) of shape (N, 4)";
        let rotations = read_rows::<4>(rotations, wanted("rotations", turns))?;
        if centers.len() != radii.len() || centers.len() != rotations.len() {
            let message = format!(
                "centers, radii and rotations must have equal lengths, but have {}, {} and {}",
                centers.len(),
                radii.len(),
                rotations.len()
            );
            return Err(named("BodyError", message));
        }
        let parts = centers.into_iter().zip(radii).zip(rotations).enumerate();
        let ellipsoids = parts
            .map(|(index, ((center, radii), rotation))| {
                core::Ellipsoid::new(index, center, radii, rotation)
            })
            .collect::<Result<_, _>>()
            .map_err(raise)?;
        core::Body::new(world_from_object.0, ellipsoids).map(Self).map_err(raise)
    }

    /// Pose of the object in the world.
    #[getter]
    fn world_from_object(&self) -> Pose {
        Pose(self.0.world_from_object())
    }

    /// Centres in the object's frame, (K, 3) float64, in metres.
    #[getter]
    fn centers<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray2<f64>> {
        self.table(py, |ellipsoid| ellipsoid.center().into())
    }

    /// Radii, (K, 3) float64, in metres.
    #[getter]
    fn radii<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray2<f64>> {
        self.table(py, |ellipsoid| ellipsoid.radii().into())
    }

    /// Orientations in the object's frame, (K, 4) float64, as (w, x, y, z).
    #[getter]
    fn rotations<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray2<f64>> {
        self.table(py, core::Ellipsoid::quaternion)
    }

    fn __len__(&self) -> usize {
        self.0.ellipsoids().len()
    }

    /// Returns each ellipsoid's outline as centre (2,) and matrix S (2, 2) of the ellipse (x - c)ᵀ
    /// S⁻¹ (x - c) = 1, in pixels; None for an ellipsoid not completely in front of the camera.
    fn outlines<'py>(
        &self,
        py: Python<'py>,
        camera: Camera,
        world_from_camera: Pose,
    ) -> Vec<Option<Ellipse<'py>>> {
        let projection = core::Projection::new(&camera.0, &world_from_camera.0);
        let ellipse = |ellipsoid: &core::Ellipsoid| {
            let outline = projection.outline(&ellipsoid.quadric())?;
            let center = PyArray1::from_slice(py, outline.center_px().as_slice());
            Some((center, rows(py, outline.covariance_px().as_slice(), 2)))
        };
        self.0.in_world().iter().map(ellipse).collect()
    }

    /// Returns volume, centroid (3,) and inertia about the centroid (3, 3) of the union at unit
    /// density, in the object's frame: m³, m and m⁵.
    fn mass_properties<'py>(&self, py: Python<'py>) -> MassParts<'py> {
        let mass = py.detach(|| self.0.mass_properties());
        let centroid = PyArray1::from_slice(py, mass.centroid.as_slice());
        (mass.volume, centroid, rows(py, mass.inertia.as_slice(), 3))
    }

    /// Returns whether two bodies are at one place, as two solid objects never are: each has 0.4 of
    /// its volume or more inside the other.
    fn shares_place(&self, other: Self) -> bool {
        self.0.shares_place(&other.0)
    }

    /// Draws the silhouette, (H, W) uint8: 255 where an ellipsoid covers the pixel's centre.
    fn silhouette<'py>(
        &self,
        py: Python<'py>,
        camera: Camera,
        world_from_camera: Pose,
    ) -> PyResult<Bound<'py, PyArray2<u8>>> {
        let pixels = py.detach(|| core::silhouette(&self.0, &camera.0, &world_from_camera.0));
        let [width, height] = camera.0.size_px();
        PyArray1::from_vec(py, pixels).reshape([height, width])
    }

    fn __repr__(&self) -> String {
        let place = shorts(self.0.world_from_object().translation().as_slice());
        format!("Body({} ellipsoids at {place})", self.__len__())
    }

    fn __reduce__<'py>(slf: &Bound<'py, Self>) -> PyResult<(Bound<'py, PyAny>, Parts)> {
        let body = &slf.get().0;
        let part = |ellipsoid: &core::Ellipsoid| {
            let q = ellipsoid.rotation().into_inner();
            let (center, radii) = (ellipsoid.center().into(), ellipsoid.radii().into());
            (center, radii, [q.w, q.i, q.j, q.k])
        };
        let parts = body.ellipsoids().iter().map(part).collect();
        Ok((slf.getattr("_of_parts")?, (Pose(body.world_from_object()), parts)))
    }

    /// Restores a body from its parts, to the last bit.
    #[classmethod]
    fn _of_parts(
        _class: &Bound<'_, PyType>,
        world_from_object: Pose,
        parts: Vec<Part>,
    ) -> PyResult<Self> {
        let made = |(index, (center, radii, rotation)): (usize, Part)| {
            let ellipsoid = core::Ellipsoid::new(index, center, radii, rotation);
            ellipsoid.map(|it| it.turned_to(as_it_was(rotation)))
        };
        let ellipsoids = parts.into_iter().enumerate().map(made).collect::<Result<_, _>>();
        let body = core::Body::new(world_from_object.0, ellipsoids.map_err(raise)?);
        body.map(Self).map_err(raise)
    }
}

/// Centre, radii and quaternion of an ellipsoid.
type Part = ([f64; 3], [f64; 3], [f64; 4]);

/// Pose and ellipsoids.
type Parts = (Pose, Vec<Part>);

impl Body {
    fn table<'py, const K: usize>(
        &self,
        py: Python<'py>,
        row: impl Fn(&core::Ellipsoid) -> [f64; K],
    ) -> Bound<'py, PyArray2<f64>> {
        rows(py, &self.0.ellipsoids().iter().flat_map(row).collect::<Vec<_>>(), K)
    }
}
