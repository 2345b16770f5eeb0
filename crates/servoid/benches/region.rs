//! What one candidate costs: the region score over row intervals beside a pass over the pixels,
//! both in this run, on one thread. `SERVOID_BACKEND` forces the vector instructions by name.

use divan::{Bencher, black_box};
use nalgebra::{Matrix3, UnitQuaternion, Vector3};
use servoid::camera::{Camera, Channels, ImageView, Mask};
use servoid::fitness::{
    Backend, ColorModel, Differentiable, Fitness, Region, RegionView, ScoreMap,
};
use servoid::pose::Pose;
use servoid::shape::{Projection, Quadric, QuadricGradient};

const DEPTH_M: f64 = 0.5;

fn main() {
    if let Ok(name) = std::env::var("SERVOID_BACKEND") {
        match Backend::named(&name) {
            Ok(backend) => backend.force(),
            Err(_) => std::process::abort(),
        }
    }
    divan::main();
}

/// Two parallel cameras 0.1 m apart that see an object of about 100 px, half a metre away.
fn stereo(size_px: [usize; 2], stride: usize, backend: Backend) -> Region {
    let [width, height] = size_px;
    let focal = 0.9 * width as f64;
    let center = [0.5 * (width as f64 - 1.0), 0.5 * (height as f64 - 1.0)];
    let views = [-0.05, 0.05].map(|x| {
        let Ok(camera) = Camera::new(size_px, [focal, focal], center) else {
            std::process::abort()
        };
        let world_from_camera =
            Pose::from_rotation(UnitQuaternion::identity(), Vector3::new(x, 0.0, 0.0));
        let noise = |i: usize| ((i.wrapping_mul(2_654_435_761) >> 7) % 1000) as f64 / 250.0 - 2.0;
        let scores: Vec<f64> = (0..width * height).map(noise).collect();
        RegionView {
            map: ScoreMap::from_scores(&scores, size_px, stride),
            projection: Projection::new(&camera, &world_from_camera),
            weight: 1.0,
        }
    });
    Region::with_backend(views.into(), backend)
}

/// Ellipsoids each `height_px` rows high in a camera of the given focal length, side by side and
/// overlapping.
fn ellipsoids(count: usize, height_px: f64, focal: f64) -> Vec<Quadric> {
    let radius = 0.5 * height_px / focal * DEPTH_M;
    let place = |i: usize| Quadric {
        center: Vector3::new(
            0.7 * radius * (i as f64 - 0.5 * (count as f64 - 1.0)),
            0.5 * radius * (i % 2) as f64,
            DEPTH_M,
        ),
        factor: Matrix3::from_diagonal(&Vector3::new(0.8 * radius, radius, 0.9 * radius)),
    };
    (0..count).map(place).collect()
}

#[divan::bench(args = [1, 5])]
fn candidate(bencher: Bencher<'_, '_>, count: usize) {
    let region = stereo([640, 480], 1, Backend::used());
    let body = ellipsoids(count, 100.0, 576.0);
    bencher.bench_local(|| region.score(black_box(&body)));
}

#[divan::bench(args = [1, 5])]
fn candidate_without_vector_instructions(bencher: Bencher<'_, '_>, count: usize) {
    let region = stereo([640, 480], 1, Backend::PORTABLE);
    let body = ellipsoids(count, 100.0, 576.0);
    bencher.bench_local(|| region.score(black_box(&body)));
}

#[divan::bench(args = [1, 5])]
fn candidate_on_every_fourth_row(bencher: Bencher<'_, '_>, count: usize) {
    let region = stereo([640, 480], 4, Backend::used());
    let body = ellipsoids(count, 100.0, 576.0);
    bencher.bench_local(|| region.score(black_box(&body)));
}

#[divan::bench(args = [1, 5])]
fn candidate_with_gradient(bencher: Bencher<'_, '_>, count: usize) {
    let region = stereo([640, 480], 1, Backend::used());
    let body = ellipsoids(count, 100.0, 576.0);
    let mut gradient = vec![QuadricGradient::default(); count];
    bencher.bench_local(|| region.score_and_gradient(black_box(&body), &mut gradient));
}

/// The same sum taken pixel by pixel within the rows that the outlines reach.
#[divan::bench(args = [1, 5])]
fn candidate_pixel_by_pixel(bencher: Bencher<'_, '_>, count: usize) {
    let region = stereo([640, 480], 1, Backend::used());
    let body = ellipsoids(count, 100.0, 576.0);
    bencher.bench_local(|| region.views().iter().map(|view| by_pixels(view, &body)).sum::<f64>());
}

fn by_pixels(view: &RegionView, body: &[Quadric]) -> f64 {
    let outlines: Vec<_> = body.iter().filter_map(|q| view.projection.outline(q)).collect();
    let mut total = 0.0;
    for row in 0..view.map.rows() {
        let spans: Vec<_> =
            outlines.iter().filter_map(|o| o.mean_interval(row as f64, 1.0)).collect();
        let begin = spans.iter().map(|s| s.0).fold(f64::MAX, f64::min).max(0.0) as usize;
        let end = spans.iter().map(|s| s.1).fold(0.0, f64::max).min(639.0) as usize;
        for u in begin..=end {
            if spans.iter().any(|&(a, b)| a <= u as f64 && u as f64 <= b) {
                total += view.map.score(u, row);
            }
        }
    }
    total
}

/// The object spans the same share of the image at each size: the cost grows with the rows.
#[divan::bench(args = [1, 2, 4])]
fn candidate_in_an_image_times(bencher: Bencher<'_, '_>, scale: usize) {
    let region = stereo([320 * scale, 240 * scale], 1, Backend::used());
    let body = ellipsoids(5, 50.0 * scale as f64, 288.0 * scale as f64);
    bencher.bench_local(|| region.score(black_box(&body)));
}

/// A picture of smooth shades, a little grain and a lighter object: its colours fall
/// into few bins, as those of photographs do.
fn shades(u: usize, v: usize) -> [u8; 3] {
    let grain = ((u * 640 + v).wrapping_mul(2_654_435_761) >> 9) % 12;
    let object = if (200..400).contains(&u) { 90 } else { 0 };
    [u / 8 + grain + object, v / 6 + grain, (u + v) / 12 + grain].map(|c| c.min(255) as u8)
}

/// The worst case: each pixel has any colour.
fn noise(u: usize, v: usize) -> [u8; 3] {
    let any = (u * 640 + v).wrapping_mul(0x9E37_79B9_7F4A_7C15);
    [any >> 20, any >> 32, any >> 44].map(|c| c as u8)
}

fn map_of(bencher: Bencher<'_, '_>, color: fn(usize, usize) -> [u8; 3], stride: usize) {
    let size_px = [640, 480];
    let places = || (0..480).flat_map(|v| (0..640).map(move |u| (u, v)));
    let bytes: Vec<u8> = places().flat_map(|(u, v)| color(u, v)).collect();
    let marks: Vec<u8> = places().map(|(u, _)| u8::from((200..400).contains(&u))).collect();
    let learned = ImageView::new(&marks, size_px, Channels::Grey).and_then(|grey| {
        let image = ImageView::new(&bytes, size_px, Channels::Rgb)?;
        Ok((image, Mask::new(grey)?))
    });
    let Ok((image, mask)) = learned else { std::process::abort() };
    let Ok(model) = ColorModel::learn(&[(&image, &mask)]) else { std::process::abort() };
    let mut map = ScoreMap::from_colors(&image, &model, stride);
    bencher.bench_local(|| map.recolor(black_box(&image), &model));
}

#[divan::bench(args = [1, 4])]
fn map_of_a_photograph_with_row_stride(bencher: Bencher<'_, '_>, stride: usize) {
    map_of(bencher, shades, stride);
}

#[divan::bench(args = [1, 4])]
fn map_of_noise_with_row_stride(bencher: Bencher<'_, '_>, stride: usize) {
    map_of(bencher, noise, stride);
}
