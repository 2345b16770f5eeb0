use crate::words::s;

/// Why bytes do not make an image or a mask.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum ImageError {
    /// The buffer does not hold width x height x channels bytes.
    #[error(
        "an image of {width}x{height} with {channels} channel{} has {expected} bytes, not {given}",
        s(*channels)
    )]
    Length {
        /// Width in pixels.
        width: usize,
        /// Height in pixels.
        height: usize,
        /// Bytes per pixel.
        channels: usize,
        /// Bytes required.
        expected: usize,
        /// Bytes given.
        given: usize,
    },
    /// The buffer does not hold width x height depths.
    #[error("a depth image of {width}x{height} has one value per pixel, but {given} were given")]
    DepthLength {
        /// Width in pixels.
        width: usize,
        /// Height in pixels.
        height: usize,
        /// Values given.
        given: usize,
    },
    /// A mask must be grey.
    #[error("a mask must have one channel (non-zero = object), but it has three")]
    MaskChannels,
    /// No pixel belongs to the object.
    #[error(
        "the mask is empty: no pixel of its {width}x{height} is non-zero; mark the object's pixels"
    )]
    EmptyMask {
        /// Width in pixels.
        width: usize,
        /// Height in pixels.
        height: usize,
    },
    /// Every pixel belongs to the object.
    #[error(
        "the mask covers the whole image of {width}x{height}: an outline cannot be seen in it; \
         leave the background zero"
    )]
    FullMask {
        /// Width in pixels.
        width: usize,
        /// Height in pixels.
        height: usize,
    },
}

/// How many bytes a pixel has.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[non_exhaustive]
pub enum Channels {
    /// One byte: brightness.
    Grey,
    /// Three bytes: red, green, blue.
    Rgb,
}

impl Channels {
    /// Returns the number of bytes per pixel.
    #[must_use]
    pub fn count(self) -> usize {
        match self {
            Self::Grey => 1,
            Self::Rgb => 3,
        }
    }
}

/// A borrowed 8-bit image, row by row without gaps.
#[derive(Debug, Clone, Copy)]
pub struct ImageView<'a> {
    data: &'a [u8],
    size_px: [usize; 2],
    channels: Channels,
}

impl<'a> ImageView<'a> {
    /// Interprets `data` as an image of (width, height).
    ///
    /// # Errors
    /// If the number of bytes does not fit.
    pub fn new(
        data: &'a [u8],
        size_px: [usize; 2],
        channels: Channels,
    ) -> Result<Self, ImageError> {
        let [width, height] = size_px;
        let expected = width.saturating_mul(height).saturating_mul(channels.count());
        if data.len() != expected {
            let (channels, given) = (channels.count(), data.len());
            return Err(ImageError::Length { width, height, channels, expected, given });
        }
        Ok(Self { data, size_px, channels })
    }

    /// Returns (width, height) in pixels.
    #[must_use]
    pub fn size_px(&self) -> [usize; 2] {
        self.size_px
    }

    /// Returns the kind of its pixels.
    #[must_use]
    pub fn channels(&self) -> Channels {
        self.channels
    }

    /// Returns all bytes, row by row.
    #[must_use]
    pub fn bytes(&self) -> &'a [u8] {
        self.data
    }

    /// Returns the bytes of row `v`, or none if it lies outside the image.
    #[must_use]
    pub fn row(&self, v: usize) -> &'a [u8] {
        let pitch = self.size_px[0] * self.channels.count();
        self.data.get(v * pitch..(v + 1) * pitch).unwrap_or(&[])
    }

    /// Returns the colour of a pixel; a grey value is repeated for red, green and blue.
    #[must_use]
    pub fn rgb(&self, u: usize, v: usize) -> [u8; 3] {
        let row = self.row(v);
        match self.channels {
            Channels::Grey => [row[u]; 3],
            Channels::Rgb => [row[3 * u], row[3 * u + 1], row[3 * u + 2]],
        }
    }
}

/// An owned image, whose memory is reused.
#[derive(Debug, Clone)]
pub(crate) struct ImageBuffer {
    data: Vec<u8>,
    size_px: [usize; 2],
    channels: Channels,
}

impl Default for ImageBuffer {
    fn default() -> Self {
        Self { data: Vec::new(), size_px: [0, 0], channels: Channels::Grey }
    }
}

impl ImageBuffer {
    /// Copies an image.
    pub(crate) fn copy(&mut self, image: &ImageView<'_>) {
        self.data.clear();
        self.data.extend_from_slice(image.data);
        (self.size_px, self.channels) = (image.size_px, image.channels);
    }

    /// Returns the image.
    pub(crate) fn view(&self) -> ImageView<'_> {
        ImageView { data: &self.data, size_px: self.size_px, channels: self.channels }
    }
}

/// An image that marks the object: its pixels are non-zero. Neither none nor all pixels are.
#[derive(Debug, Clone, Copy)]
pub struct Mask<'a> {
    image: ImageView<'a>,
    area_px: usize,
    first_px: [usize; 2],
    last_px: [usize; 2],
}

impl<'a> Mask<'a> {
    /// Interprets a grey image as a mask.
    ///
    /// # Errors
    /// If it is not grey, no pixel is non-zero or every pixel is.
    pub fn new(image: ImageView<'a>) -> Result<Self, ImageError> {
        if image.channels != Channels::Grey {
            return Err(ImageError::MaskChannels);
        }
        let [width, height] = image.size_px;
        let (mut area_px, mut first_px, mut last_px) = (0, [width, height], [0, 0]);
        for v in 0..height {
            let row = image.row(v);
            let count = row.iter().filter(|&&m| m != 0).count();
            if count == 0 {
                continue;
            }
            area_px += count;
            let left = row.iter().position(|&m| m != 0).unwrap_or(0);
            let right = row.iter().rposition(|&m| m != 0).unwrap_or(0);
            first_px = [first_px[0].min(left), first_px[1].min(v)];
            last_px = [last_px[0].max(right), v];
        }
        match area_px {
            0 => Err(ImageError::EmptyMask { width, height }),
            n if n == width * height => Err(ImageError::FullMask { width, height }),
            _ => Ok(Self { image, area_px, first_px, last_px }),
        }
    }

    /// Returns whether the pixel nearest to a position belongs to the object.
    #[must_use]
    pub fn holds(&self, u: f64, v: f64) -> bool {
        let (u, v) = (libm::round(u), libm::round(v));
        let [width, height] = self.image.size_px;
        let inside = (0.0..width as f64).contains(&u) && (0.0..height as f64).contains(&v);
        inside && self.image.row(v as usize)[u as usize] != 0
    }

    /// Returns the pixels as an image.
    #[must_use]
    pub fn image(&self) -> ImageView<'a> {
        self.image
    }

    /// Returns the number of pixels that belong to the object.
    #[must_use]
    pub fn area_px(&self) -> usize {
        self.area_px
    }

    /// Returns the first and last column and row that contain the object: ((u, v), (u, v)).
    #[must_use]
    pub fn bounds_px(&self) -> ([usize; 2], [usize; 2]) {
        (self.first_px, self.last_px)
    }

    /// Returns the mean position of the object's pixels.
    #[must_use]
    pub fn centroid_px(&self) -> [f64; 2] {
        let (mut sum_u, mut sum_v) = (0_u64, 0_u64);
        for v in self.first_px[1]..=self.last_px[1] {
            for (u, _) in self.image.row(v).iter().enumerate().filter(|(_, m)| **m != 0) {
                sum_u += u as u64;
                sum_v += v as u64;
            }
        }
        [sum_u, sum_v].map(|sum| sum as f64 / self.area_px as f64)
    }
}
