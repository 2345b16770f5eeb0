use super::{OneStepError, UsableImage};
use crate::camera::{Channels, ImageView, Mask};
use crate::fitness::ColorModel;
use crate::shape::{Body, silhouette};

/// The object's colours, learned from the first observation.
pub(super) struct Colors {
    pub model: ColorModel,
    /// Mean certainty inside the object when they were learned.
    reference: f64,
}

impl Colors {
    /// Learns from the masks, or, where an image has none, from the body's outline at its pose.
    pub fn learn(
        usable: &[UsableImage<'_>],
        body: &Body,
        masks: &[Option<Mask<'_>>],
    ) -> Result<Self, OneStepError> {
        let drawn: Vec<_> = usable.iter().map(|one| one.silhouette(body)).collect();
        let mut pairs = Vec::with_capacity(usable.len());
        for (one, outline) in usable.iter().zip(&drawn) {
            let outline = ImageView::new(outline, one.image.size_px(), Channels::Grey)?;
            let mask = masks.get(one.index).copied().flatten();
            // An outline that is empty or fills the image cannot be learned from.
            if let Some(mask) = mask.or(Mask::new(outline).ok()) {
                pairs.push((&one.image, mask));
            }
        }
        if pairs.is_empty() {
            return Err(OneStepError::Unseen { images: usable.len() });
        }
        let borrowed: Vec<_> = pairs.iter().map(|(image, mask)| (*image, mask)).collect();
        let model = ColorModel::learn(&borrowed)?;
        let inside = pairs.iter().map(|(image, mask)| uncertainty(&model, image, &mask.image()));
        let (sum, area) = inside.fold((0.0, 0), |all, one| (all.0 + one.0, all.1 + one.1));
        Ok(Self { model, reference: sum / f64::from(area.max(1)) })
    }

    /// Marks pixels whose colour is likelier on the object than beside it with 1.
    pub fn matches(&self, image: &ImageView<'_>) -> Vec<u8> {
        let [width, height] = image.size_px();
        let pixels = (0..height).flat_map(|v| (0..width).map(move |u| image.rgb(u, v)));
        pixels.map(|rgb| u8::from(self.model.score(rgb) > 0.0)).collect()
    }

    /// Returns the share of what should be visible of the object that the images confirm, and the
    /// images that show nothing of it.
    pub fn confidence(&self, usable: &[UsableImage<'_>], body: &Body) -> (f64, Vec<usize>) {
        let (mut sum, mut area, mut outside) = (0.0, 0, vec![]);
        for one in usable {
            let drawn = one.silhouette(body);
            let outline = ImageView::new(&drawn, one.image.size_px(), Channels::Grey);
            let inside = outline.map(|outline| uncertainty(&self.model, &one.image, &outline));
            let (gain, pixels) = inside.unwrap_or_default();
            if pixels == 0 {
                outside.push(one.index);
            }
            sum += gain;
            area += pixels;
        }
        let expected = self.reference * f64::from(area);
        let share = if expected > 0.0 { sum / expected } else { 0.0 };
        (share.clamp(0.0, 1.0), outside)
    }
}

impl UsableImage<'_> {
    fn silhouette(&self, body: &Body) -> Vec<u8> {
        silhouette(body, &self.camera, &self.world_from_camera)
    }
}

/// Sums the certainty of the marked pixels, and counts them. The certainty is 2 p - 1 of the
/// posterior p at even odds, so a colour without information adds nothing.
fn uncertainty(model: &ColorModel, image: &ImageView<'_>, marked: &ImageView<'_>) -> (f64, u32) {
    let (mut sum, mut count) = (0.0, 0);
    for v in 0..image.size_px()[1] {
        for (u, _) in marked.row(v).iter().enumerate().filter(|(_, m)| **m != 0) {
            sum += libm::tanh(0.5 * model.score(image.rgb(u, v))).max(0.0);
            count += 1;
        }
    }
    (sum, count)
}
