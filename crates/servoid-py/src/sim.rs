use std::borrow::Cow;

use numpy::{
    PyArray1, PyArray2, PyArray3, PyArrayMethods, PyReadonlyArrayDyn, PyUntypedArrayMethods,
};
use pyo3::prelude::*;
use servoid::{pose, render as core};

use crate::camera::lens::Lens;
use crate::errors::{named, raise};
use crate::taking::replace;

/// Appearance of a surface.
///
/// It has a colour in linear RGB, 0 to 1, which multiplies a texture, (H, W, 3) uint8 sRGB, that is
/// repeated a number of times over u and v; gloss is between 0 and 1. Raises SimError.
#[pyclass(frozen, module = "servoid._native", from_py_object)]
#[derive(Clone)]
pub struct Paint(core::Paint);

#[pymethods]
impl Paint {
    #[new]
    #[pyo3(signature = (*, color = None, texture = None, repeat = None, gloss = None))]
    fn new(
        color: Option<[f64; 3]>,
        texture: Option<PyReadonlyArrayDyn<'_, u8>>,
        repeat: Option<(f64, f64)>,
        gloss: Option<f64>,
    ) -> PyResult<Self> {
        let mut paint = core::Paint::default();
        if let Some(color) = color {
            paint = paint.with_color(color).map_err(raise)?;
        }
        if let Some(texture) = &texture {
            paint = paint.with_texture(read_texture(texture)?);
        }
        if let Some((u, v)) = repeat {
            paint = paint.with_repeat([u, v]).map_err(raise)?;
        }
        if let Some(gloss) = gloss {
            paint = paint.with_gloss(gloss).map_err(raise)?;
        }
        Ok(Self(paint))
    }
}

fn read_texture(texture: &PyReadonlyArrayDyn<'_, u8>) -> PyResult<core::Texture> {
    let &[height, width, 3] = texture.shape() else {
        return Err(wrong_shape("texture", "(H, W, 3)", texture.shape()));
    };
    let bytes = match texture.as_slice() {
        Ok(all) => Cow::Borrowed(all),
        Err(_) => texture.as_array().iter().copied().collect(),
    };
    core::Texture::new(&bytes, [width, height]).map_err(raise)
}

/// A distant lamp, and ambient light from above and below.
///
/// It has the direction towards the lamp in the world, and the strengths in linear RGB of the lamp,
/// of the light from above and of the light from below; raises SimError.
#[pyclass(frozen, module = "servoid._native", from_py_object)]
#[derive(Clone)]
pub struct Lighting(core::Lighting);

#[pymethods]
impl Lighting {
    #[new]
    #[pyo3(signature = (*, toward = None, key = None, sky = None, bounce = None, exposure = None))]
    fn new(
        toward: Option<[f64; 3]>,
        key: Option<[f64; 3]>,
        sky: Option<[f64; 3]>,
        bounce: Option<[f64; 3]>,
        exposure: Option<f64>,
    ) -> PyResult<Self> {
        let lighting = core::Lighting::default().with(|it| {
            replace(&mut it.toward, toward);
            replace(&mut it.key, key);
            replace(&mut it.sky, sky);
            replace(&mut it.bounce, bounce);
            replace(&mut it.exposure, exposure);
        });
        lighting.check().map_err(raise)?;
        Ok(Self(lighting))
    }
}

/// Visuals (shapes with paint) that are drawn by ray casting.
///
/// A new scene is empty.
#[pyclass(module = "servoid._native")]
pub struct Scene(core::Scene);

/// Depth (H, W) and indices of visuals (H, W).
type DepthParts<'py> = (Bound<'py, PyArray2<f32>>, Bound<'py, PyArray2<i32>>);

#[pymethods]
impl Scene {
    #[new]
    fn new() -> Self {
        Self(core::Scene::new())
    }

    /// Adds an ellipsoid by its radii in metres and returns its index; raises SimError.
    fn add_ellipsoid(&mut self, radii: [f64; 3], paint: Paint) -> PyResult<usize> {
        self.0.add_ellipsoid(radii, paint.0).map_err(raise)
    }

    /// Adds a capsule along z, in metres, and returns its index; raises SimError.
    fn add_capsule(&mut self, radius: f64, half_length: f64, paint: Paint) -> PyResult<usize> {
        self.0.add_capsule(radius, half_length, paint.0).map_err(raise)
    }

    /// Adds a cylinder with flat ends along z, in metres, and returns its index; raises SimError.
    fn add_cylinder(&mut self, radius: f64, half_length: f64, paint: Paint) -> PyResult<usize> {
        self.0.add_cylinder(radius, half_length, paint.0).map_err(raise)
    }

    /// Adds a box by half its sides in metres and returns its index; raises SimError.
    fn add_box(&mut self, half_size: [f64; 3], paint: Paint) -> PyResult<usize> {
        self.0.add_box(half_size, paint.0).map_err(raise)
    }

    /// Adds a rectangle in the xy plane by half its sides in metres, visible from both sides, and
    /// returns its index; raises SimError.
    fn add_plane(&mut self, half_size: [f64; 2], paint: Paint) -> PyResult<usize> {
        self.0.add_plane(half_size, paint.0).map_err(raise)
    }

    /// Adds triangles, (M, 3) int64, between vertices, (N, 3) float64 in metres, with texture
    /// coordinates, (N, 2) float64 from the corner of the first pixel, and colours, (N, 3) uint8
    /// sRGB; returns its index and raises SimError.
    #[pyo3(signature = (vertices, faces, paint, texture_coordinates = None, colors = None))]
    fn add_mesh(
        &mut self,
        vertices: PyReadonlyArrayDyn<'_, f64>,
        faces: PyReadonlyArrayDyn<'_, i64>,
        paint: Paint,
        texture_coordinates: Option<PyReadonlyArrayDyn<'_, f64>>,
        colors: Option<PyReadonlyArrayDyn<'_, u8>>,
    ) -> PyResult<usize> {
        let vertices = table::<_, 3>(&vertices, "vertices")?;
        let corner = |i: i64| usize::try_from(i).unwrap_or(usize::MAX);
        let faces: Vec<[usize; 3]> =
            table::<_, 3>(&faces, "faces")?.into_iter().map(|face| face.map(corner)).collect();
        let places = texture_coordinates.map(|t| table::<_, 2>(&t, "texture_coordinates"));
        let colors = colors.map(|c| table::<_, 3>(&c, "colors")).transpose()?;
        let places = places.transpose()?;
        let details = core::Details::default().with(|it| {
            it.texture_coordinates = places;
            it.colors = colors;
        });
        self.0.add_mesh(&vertices, &faces, &details, paint.0).map_err(raise)
    }

    /// Number of visuals.
    #[getter]
    fn count(&self) -> usize {
        self.0.count()
    }

    /// Draws an image, (H, W, 3) uint8 sRGB, with poses of the lens, (M, 7), and of all visuals,
    /// (M, T, 7), float64 as (w, x, y, z, tx, ty, tz), at the moments that the samples x samples
    /// rays of a pixel use in turn; noise in grey levels. Raises SimError.
    #[pyo3(signature = (
        *, lens, world_from_lens, world_from_visual, lighting, samples = None, noise = None,
        seed = None, threads = None
    ))]
    #[expect(clippy::too_many_arguments, reason = "named settings of one image")]
    fn render<'py>(
        &self,
        py: Python<'py>,
        lens: Lens,
        world_from_lens: PyReadonlyArrayDyn<'_, f64>,
        world_from_visual: PyReadonlyArrayDyn<'_, f64>,
        lighting: Lighting,
        samples: Option<i64>,
        noise: Option<f64>,
        seed: Option<u64>,
        threads: Option<usize>,
    ) -> PyResult<Bound<'py, PyArray3<u8>>> {
        let exposure = core::Exposure::default().with(|it| {
            // A negative number becomes zero, which the core rejects with a message.
            replace(&mut it.samples, samples.map(|n| usize::try_from(n).unwrap_or(0)));
            replace(&mut it.noise, noise);
            replace(&mut it.seed, seed);
            replace(&mut it.threads, threads);
        });
        let world_from_lens = poses(&world_from_lens, "world_from_lens")?;
        let world_from_visual = pose_sets(&world_from_visual)?;
        let placement = core::Placement {
            lens: lens.core(),
            world_from_lens: &world_from_lens,
            world_from_visual: &world_from_visual,
            lighting: &lighting.0,
        };
        let image = py.detach(|| self.0.render(&placement, &exposure)).map_err(raise)?;
        let [width, height] = lens.core().camera().size_px();
        PyArray1::from_vec(py, image).reshape([height, width, 3])
    }

    /// Returns the depth along the lens's z at each pixel's centre, (H, W) float32 in metres, NaN
    /// where there is nothing, and the indices of the visuals, (H, W) int32, -1 where there is
    /// nothing, for one pose of the lens, (7,), and of all visuals, (T, 7), float64. Raises
    /// SimError.
    #[pyo3(signature = (*, lens, world_from_lens, world_from_visual))]
    fn depth<'py>(
        &self,
        py: Python<'py>,
        lens: Lens,
        world_from_lens: PyReadonlyArrayDyn<'_, f64>,
        world_from_visual: PyReadonlyArrayDyn<'_, f64>,
    ) -> PyResult<DepthParts<'py>> {
        if world_from_lens.shape() != [7] {
            return Err(wrong_shape("world_from_lens", "(7,)", world_from_lens.shape()));
        }
        let numbers: Vec<f64> = world_from_lens.as_array().iter().copied().collect();
        let pose = read_pose(&numbers)?;
        let visuals = poses(&world_from_visual, "world_from_visual")?;
        let found = py.detach(|| self.0.depth(lens.core(), &pose, &visuals)).map_err(raise)?;
        let [width, height] = lens.core().camera().size_px();
        let depth = PyArray1::from_vec(py, found.depth).reshape([height, width])?;
        Ok((depth, PyArray1::from_vec(py, found.visual).reshape([height, width])?))
    }
}

fn wrong_shape(what: &str, wanted: &str, given: &[usize]) -> PyErr {
    named("SimError", format!("{what} must have shape {wanted}, but it is {given:?}"))
}

fn table<T: Copy + numpy::Element, const K: usize>(
    array: &PyReadonlyArrayDyn<'_, T>,
    what: &str,
) -> PyResult<Vec<[T; K]>> {
    if array.ndim() != 2 || array.shape()[1] != K {
        return Err(wrong_shape(what, &format!("(N, {K})"), array.shape()));
    }
    let array = array.as_array();
    Ok(array.rows().into_iter().map(|row| std::array::from_fn(|i| row[i])).collect())
}

fn read_pose(numbers: &[f64]) -> PyResult<pose::Pose> {
    let &[w, x, y, z, tx, ty, tz] = numbers else {
        return Err(wrong_shape("a pose", "(7,)", &[numbers.len()]));
    };
    pose::Pose::from_parts([tx, ty, tz], [w, x, y, z]).map_err(raise)
}

fn poses(array: &PyReadonlyArrayDyn<'_, f64>, what: &str) -> PyResult<Vec<pose::Pose>> {
    let [_, 7] = array.shape() else {
        return Err(wrong_shape(what, "(N, 7)", array.shape()));
    };
    let numbers: Vec<f64> = array.as_array().iter().copied().collect();
    numbers.chunks_exact(7).map(read_pose).collect()
}

fn pose_sets(array: &PyReadonlyArrayDyn<'_, f64>) -> PyResult<Vec<Vec<pose::Pose>>> {
    let &[moments, visuals, 7] = array.shape() else {
        return Err(wrong_shape("world_from_visual", "(M, T, 7)", array.shape()));
    };
    let numbers: Vec<f64> = array.as_array().iter().copied().collect();
    let set = |moment: usize| {
        let part = &numbers[7 * visuals * moment..7 * visuals * (moment + 1)];
        part.chunks_exact(7).map(read_pose).collect()
    };
    (0..moments).map(set).collect()
}
