use numpy::{PyArray1, PyArray2, PyArrayMethods, PyReadonlyArray2};
use pyo3::prelude::*;
use servoid::shape as core;

use crate::errors::{named, raise};
use crate::observe::Camera;
use crate::pose::{Pose, read_rows, rows};

/// A rigid set of ellipsoids in the object's frame, and where that frame is in the world.
#[pyclass(frozen, module = "servoid", from_py_object)]
#[derive(Clone)]
pub struct Body(pub core::Body);

/// A closed surface of triangles.
#[pyclass(frozen, module = "servoid", from_py_object)]
#[derive(Clone)]
pub struct Mesh(pub core::Mesh);

#[pymethods]
impl Mesh {
    /// Joins corners (V, 3) float64, in metres, and triangles (F, 3) int64 that name them, counted
    /// from 0, counter-clockwise seen from outside; raises BodyError if the surface is not closed.
    #[new]
    #[pyo3(signature = (*, vertices, faces))]
    fn new(
        vertices: PyReadonlyArray2<'_, f64>,
        faces: PyReadonlyArray2<'_, i64>,
    ) -> PyResult<Self> {
        let vertices = read_rows::<_, 3>(&vertices, "vertices")?;
        let corner = |i: i64| usize::try_from(i).unwrap_or(usize::MAX);
        let faces = read_rows::<_, 3>(&faces, "faces")?;
        let faces = faces.into_iter().map(|face| face.map(corner)).collect();
        core::Mesh::new(vertices, faces).map(Self).map_err(raise)
    }

    /// The volume in cubic metres.
    #[getter]
    fn volume(&self) -> f64 {
        self.0.volume()
    }
}

/// Centre (2,) and 2x2 matrix of an outline.
type Ellipse<'py> = (Bound<'py, PyArray1<f64>>, Bound<'py, PyArray2<f64>>);

/// Volume, centroid (3,) and inertia (3, 3).
type MassParts<'py> = (f64, Bound<'py, PyArray1<f64>>, Bound<'py, PyArray2<f64>>);

#[pymethods]
impl Body {
    /// Joins ellipsoids: centers (K, 3) and radii (K, 3) in metres, rotations (K, 4) as
    /// (w, x, y, z), float64; raises BodyError.
    #[new]
    #[pyo3(signature = (*, world_from_object, centers, radii, rotations))]
    fn new(
        world_from_object: Pose,
        centers: PyReadonlyArray2<'_, f64>,
        radii: PyReadonlyArray2<'_, f64>,
        rotations: PyReadonlyArray2<'_, f64>,
    ) -> PyResult<Self> {
        let centers = read_rows::<_, 3>(&centers, "centers")?;
        let radii = read_rows::<_, 3>(&radii, "radii")?;
        let rotations = read_rows::<_, 4>(&rotations, "rotations")?;
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

    /// Gives each ellipsoid's outline as centre (2,) and matrix S (2, 2) of the ellipse
    /// (x - c)ᵀ S⁻¹ (x - c) = 1, in pixels; None for one not wholly in front of the camera.
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

    /// Gives volume, centroid (3,) and inertia about it (3, 3) of the union at unit density, in
    /// the object's frame: m³, m and m⁵.
    fn mass_properties<'py>(&self, py: Python<'py>) -> MassParts<'py> {
        let mass = py.detach(|| self.0.mass_properties());
        let centroid = PyArray1::from_slice(py, mass.centroid.as_slice());
        (mass.volume, centroid, rows(py, mass.inertia.as_slice(), 3))
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
        format!(
            "Body of {} ellipsoids at {:?}",
            self.__len__(),
            self.0.world_from_object().translation()
        )
    }
}

impl Body {
    fn table<'py, const K: usize>(
        &self,
        py: Python<'py>,
        row: impl Fn(&core::Ellipsoid) -> [f64; K],
    ) -> Bound<'py, PyArray2<f64>> {
        rows(py, &self.0.ellipsoids().iter().flat_map(row).collect::<Vec<_>>(), K)
    }
}
