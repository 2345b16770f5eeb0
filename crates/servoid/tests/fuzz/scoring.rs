//! Scores of any bodies in any images.

use nalgebra::{Matrix3, Vector3};
use servoid::camera::{Camera, Channels, ImageView, Mask};
use servoid::fitness::{
    Backend, Differentiable, Fitness, Overlap, OverlapView, Region, RegionView, ScoreMap,
};
use servoid::shape::{Body, Ellipsoid, Projection, Quadric, QuadricGradient, silhouette};

use super::draw::Draw;

pub fn any(draw: &mut Draw) -> Result<(), String> {
    let Some(camera) = draw.camera() else { return Ok(()) };
    if camera.size_px().iter().any(|&side| side > 64) {
        return Ok(());
    }
    let projection = Projection::new(&camera, &draw.pose());
    let count = draw.pick(&[1, 1, 2, 3, 8, 64, 65]);
    let body: Vec<Quadric> = (0..count).map(|_| quadric(draw)).collect();
    region(draw, &camera, projection, &body)?;
    overlap(draw, &camera, projection, &body)?;
    drawn(draw, &camera)
}

/// An ellipsoid in front of the camera, sometimes one that is flat, huge or invalid.
fn quadric(draw: &mut Draw) -> Quadric {
    let place = draw.numbers::<3>();
    let size = draw.pick(&[1e-9, 0.05, 0.1, 0.2, 0.5, 5.0]);
    let center = Vector3::new(0.3 * place[0], 0.3 * place[1], place[2] + draw.pick(&[0.0, 1.5]));
    let mut factor = Matrix3::from_row_slice(&draw.numbers::<9>()) * size;
    if draw.chance(0.1) {
        factor.set_column(0, &Vector3::zeros());
    }
    Quadric { center, factor }
}

fn region(
    draw: &mut Draw,
    camera: &Camera,
    projection: Projection,
    body: &[Quadric],
) -> Result<(), String> {
    let [width, height] = camera.size_px();
    let scores: Vec<f64> = (0..width * height).map(|_| draw.within(-2.0, 2.0)).collect();
    let map = ScoreMap::from_scores(&scores, camera.size_px(), draw.pick(&[1, 2, 3]));
    let view = || RegionView { map: map.clone(), projection, weight: 1.0 };
    let found: Vec<f64> = Backend::available()
        .into_iter()
        .map(|backend| Region::with_backend(vec![view()], backend).score(body))
        .collect();
    if found.iter().any(|score| score.to_bits() != found[0].to_bits()) {
        return Err(format!("backends score {found:?} of {body:?}"));
    }
    if !found[0].is_finite() {
        return Err(format!("the score is {} of {body:?}", found[0]));
    }
    let mut slopes = vec![QuadricGradient::default(); body.len()];
    Region::new(vec![view()]).score_and_gradient(body, &mut slopes);
    Ok(())
}

fn overlap(
    draw: &mut Draw,
    camera: &Camera,
    projection: Projection,
    body: &[Quadric],
) -> Result<(), String> {
    let size_px = camera.size_px();
    let filled = (0..size_px[0] * size_px[1]).map(|_| draw.pick(&[0.0, 0.5, 1.0])).collect();
    let overlap = Overlap::new(vec![OverlapView { filled, size_px, projection }]);
    let score = overlap.score(body);
    if (0.0..=1.0 + 1e-9).contains(&score) {
        return Ok(());
    }
    Err(format!("an overlap of {score} of {body:?}"))
}

fn drawn(draw: &mut Draw, camera: &Camera) -> Result<(), String> {
    let [width, height] = camera.size_px();
    let bytes = draw.bytes(width * height);
    let wrong = [width + draw.below(2), height];
    if let Ok(image) = ImageView::new(&bytes, wrong, Channels::Grey) {
        let _ = Mask::new(image);
    }
    let parts = (0..draw.pick(&[0, 1, 2, 64, 65]))
        .map(|index| Ellipsoid::new(index, draw.numbers(), draw.numbers(), [1.0, 0.0, 0.0, 0.0]))
        .collect::<Result<Vec<_>, _>>();
    let Ok(parts) = parts else { return Ok(()) };
    if let Ok(body) = Body::new(draw.pose(), parts) {
        let pixels = silhouette(&body, camera, &draw.pose());
        if pixels.len() != width * height {
            return Err(format!("a silhouette of {} pixels", pixels.len()));
        }
    }
    Ok(())
}
