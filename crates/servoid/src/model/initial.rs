use crate::parallel::*;
use nalgebra::Vector3;

use super::levels::{CameraFromScene, block_means};
use super::progressive::grow;
use super::progressive::progress::ProgressReporter;
use super::progressive::refine::Objective;
use super::scene::{
    ANISOTROPY_COST, Scene, camera_from_scene, common_point, line_of_sight, mean_radius,
};
use super::settings::workers;
use super::{ModelError, Settings};
use crate::camera::{Camera, Channels, ImageView, Mask, View, check_image_size};
use crate::fitness::{ColorModel, Likelihood, LikelihoodView, RangeSample, Total};
use crate::pose::Pose;
use crate::shape::{Body, Projection, silhouette};

/// An image in which the object is not marked.
#[derive(Debug, Clone, Copy)]
pub struct UnmaskedImage<'a> {
    /// The camera.
    pub camera: Camera,
    /// Its pose.
    pub world_from_camera: Pose,
    /// Its image.
    pub image: ImageView<'a>,
}

impl UnmaskedImage<'_> {
    /// Returns the image if it has the camera's size.
    ///
    /// # Errors
    /// If it has another size.
    pub fn checked(self) -> Result<Self, ModelError> {
        check_image_size(0, self.camera.size_px(), self.image)?;
        Ok(self)
    }
}

/// Length of the object's longer side after shrinking, in pixels.
const EXTENT_PX: f64 = 64.0;
/// Score of a pixel of a mask, in nats.
const MASK_SCORE: f64 = 2.0;
/// Largest score of a colour, in nats.
const COLOR_SCORE: f64 = 3.0;
/// Most views that are used.
const MOST_VIEWS: usize = 24;

/// Computes an initial model from a few images in which the object is marked and others in which it
/// is not: the marked images teach the colours of the object and of its surroundings, by which it
/// is found in the others.
///
/// Measured points of the surface, if there are any, give the object's position. Otherwise it is
/// where the lines of sight to the masks come closest to each other and to the centres of the other
/// images.
///
/// # Errors
/// If the object is marked in no image, its position is not determined, or an image does not have
/// its camera's size.
pub fn initial_body(
    marked: &[(View<'_>, ImageView<'_>)],
    unmasked: &[UnmaskedImage<'_>],
    samples: &[RangeSample],
    settings: &Settings,
) -> Result<Body, ModelError> {
    let settings = settings.checked()?.quick();
    let step = unmasked.len().div_ceil(MOST_VIEWS).max(1);
    let some: Vec<UnmaskedImage<'_>> = unmasked.iter().step_by(step).copied().collect();
    workers(settings.threads)?.install(|| {
        let frame = Frame::new(marked, &some, samples)?;
        let one = Settings { max_ellipsoids: 1, ..settings };
        // What surrounds the one ellipsoid in the other images teaches the background there.
        let coarse = frame.fit(marked, &some, &colors(marked, &[], None)?, &one)?;
        frame.fit(marked, &some, &colors(marked, &some, Some(&coarse))?, &settings)
    })
}

/// Learns colours where the object is marked and, if a body is given, where that body is seen.
fn colors(
    marked: &[(View<'_>, ImageView<'_>)],
    unmasked: &[UnmaskedImage<'_>],
    body: Option<&Body>,
) -> Result<ColorModel, ModelError> {
    let drawn: Vec<(Vec<u8>, &UnmaskedImage<'_>)> = body.map_or_else(Vec::new, |body| {
        let draw = |one: &UnmaskedImage<'_>| silhouette(body, &one.camera, &one.world_from_camera);
        unmasked.par_iter().map(|one| (draw(one), one)).collect()
    });
    let seen: Vec<(ImageView<'_>, Mask<'_>)> = drawn
        .iter()
        .filter_map(|(pixels, one)| Some((one.image, drawn_mask(pixels, one)?)))
        .collect();
    let by_hand = marked.iter().map(|(view, image)| (image, view.mask()));
    let pairs: Vec<_> = by_hand.chain(seen.iter().map(|(image, mask)| (image, mask))).collect();
    Ok(ColorModel::learn(&pairs)?)
}

/// Interprets a silhouette as a mask; none if it lies outside the image, or fills it.
fn drawn_mask<'a>(pixels: &'a [u8], one: &UnmaskedImage<'_>) -> Option<Mask<'a>> {
    let image = ImageView::new(pixels, one.camera.size_px(), Channels::Grey).ok()?;
    Mask::new(image).ok()
}

/// The frame and the unit in which an initial body is fitted.
struct Frame {
    world_from_scene: Pose,
    unit: f64,
}

impl Frame {
    fn new(
        marked: &[(View<'_>, ImageView<'_>)],
        unmasked: &[UnmaskedImage<'_>],
        samples: &[RangeSample],
    ) -> Result<Self, ModelError> {
        for (index, (view, image)) in marked.iter().enumerate() {
            check_image_size(index, view.camera().size_px(), *image)?;
        }
        let views: Vec<View<'_>> = marked.iter().map(|(view, _)| *view).collect();
        let first = views.first().ok_or(ModelError::TooFewViews(0))?;
        let origin = place(&views, unmasked, samples)?;
        let unit = mean_radius(&views, &origin);
        let rotation = first.world_from_camera().rotation();
        Ok(Self { world_from_scene: Pose::from_rotation(rotation, origin), unit })
    }

    fn fit(
        &self,
        marked: &[(View<'_>, ImageView<'_>)],
        unmasked: &[UnmaskedImage<'_>],
        colors: &ColorModel,
        settings: &Settings,
    ) -> Result<Body, ModelError> {
        let from_scene = |pose: &Pose| camera_from_scene(pose, &self.world_from_scene, self.unit);
        let by_hand = marked.par_iter().map(|(view, _)| {
            let image = view.mask().image();
            shrunk(view.camera(), &from_scene(&view.world_from_camera()), |u, v| {
                if image.row(v)[u] == 0 { -MASK_SCORE } else { MASK_SCORE }
            })
        });
        let by_color = unmasked.par_iter().map(|one| {
            shrunk(&one.camera, &from_scene(&one.world_from_camera), |u, v| {
                colors.score(one.image.rgb(u, v)).clamp(-COLOR_SCORE, COLOR_SCORE)
            })
        });
        let parts: Vec<_> = by_hand.chain(by_color).collect();
        let parts = parts.into_iter().collect::<Result<Vec<_>, _>>()?;
        let objective = || {
            let mut total = Total::default();
            total.push(1.0, Likelihood::new(parts.clone()));
            Objective {
                total,
                anisotropy_cost: 10.0 * ANISOTROPY_COST,
                least_gain: 1e-5,
                extent: None,
            }
        };
        let Self { world_from_scene, unit } = *self;
        let scene = Scene { world_from_scene, unit, coarse: objective(), middle: objective() };
        let mut quiet = |_: usize, _: f64, _: f64| true;
        let reporter = ProgressReporter::new(settings, &mut quiet);
        let by_count = grow(&scene, settings, 0, &reporter)?;
        scene.body(&by_count.at(settings.max_ellipsoids).quadrics)
    }
}

/// Estimates the object's position.
fn place(
    views: &[View<'_>],
    unmasked: &[UnmaskedImage<'_>],
    samples: &[RangeSample],
) -> Result<Vector3<f64>, ModelError> {
    if !samples.is_empty() {
        return Ok(samples.iter().map(|s| s.point).sum::<Vector3<f64>>() / samples.len() as f64);
    }
    if views.len() > 1 {
        return common_point(views);
    }
    let view = views.first().ok_or(ModelError::TooFewViews(0))?;
    let (pose, sight) = (view.world_from_camera(), line_of_sight(view));
    let (mut across, mut along) = (0.0, 0.0);
    for other in unmasked {
        let axis = other.world_from_camera.rotation() * Vector3::z();
        let apart = other.world_from_camera.translation() - pose.translation();
        let (side, back) = (sight - axis * axis.dot(&sight), apart - axis * axis.dot(&apart));
        across += side.norm_squared();
        along += side.dot(&back);
    }
    let depth = along / across;
    // The mean squared sine of the angles between the lines of sight.
    let open = !(across / unmasked.len().max(1) as f64 > 1e-6 && depth > 0.0);
    if open { Err(ModelError::NoBaseline) } else { Ok(pose.translation() + sight * depth) }
}

/// Shrinks an image so that the object spans about [`EXTENT_PX`].
fn shrunk(
    camera: &Camera,
    (rotation, translation): &CameraFromScene,
    score: impl Fn(usize, usize) -> f64,
) -> Result<LikelihoodView, ModelError> {
    let extent_px = 2.0 * camera.focal_px()[0] / translation.norm();
    let [width, height] = camera.size_px();
    let shrink = (extent_px / EXTENT_PX).round().clamp(1.0, width.min(height) as f64) as usize;
    let size_px = [width / shrink, height / shrink];
    let calibration = camera.crop([0, 0], size_px, shrink)?.matrix();
    Ok(LikelihoodView {
        scores: block_means(size_px, shrink, score),
        size_px,
        projection: Projection {
            linear: calibration * rotation,
            offset: calibration * translation,
        },
    })
}
