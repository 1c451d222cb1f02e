//! Images of brightness alone.
use image::{ImageFormat, ImageReader, Limits};
use std::io::Cursor;

/// An image of 8 bits a pixel, row by row. Pixel (0, 0) is the centre of the top-left one.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Gray {
    /// [px]
    pub width: usize,
    /// [px]
    pub height: usize,
    /// `width * height` of them.
    pub pixels: Vec<u8>,
}

/// Longest side of an image [px]: a longer one is a damaged header.
const LONGEST: u32 = 1 << 15;

impl Gray {
    /// Decodes a PNG or JPEG file.
    ///
    /// Errors: what is wrong with the bytes, in words.
    pub fn decode(bytes: &[u8]) -> Result<Gray, String> {
        let mut reader =
            ImageReader::new(Cursor::new(bytes)).with_guessed_format().map_err(|error| error.to_string())?;
        if !matches!(reader.format(), Some(ImageFormat::Png | ImageFormat::Jpeg)) {
            return Err("is neither PNG nor JPEG".to_owned());
        }
        let mut limits = Limits::default();
        (limits.max_image_width, limits.max_image_height) = (Some(LONGEST), Some(LONGEST));
        reader.limits(limits);
        let image = reader.decode().map_err(|error| format!("cannot be decoded: {error}"))?.into_luma8();
        Ok(Gray { width: image.width() as usize, height: image.height() as usize, pixels: image.into_raw() })
    }

    /// Width and height [px].
    pub fn size(&self) -> [u32; 2] {
        [self.width as u32, self.height as u32]
    }

    pub(super) fn at(&self, x: usize, y: usize) -> u8 {
        self.pixels[y * self.width + x]
    }

    /// Brightness between pixels (bilinear); `None` outside of the image.
    pub(super) fn sample(&self, [x, y]: [f64; 2]) -> Option<f64> {
        if !(x >= 0.0 && y >= 0.0) {
            return None;
        }
        let (left, top) = (x as usize, y as usize);
        if left + 1 >= self.width || top + 1 >= self.height {
            return None;
        }
        let (right, down) = (x - left as f64, y - top as f64);
        let [a, b] = [self.at(left, top), self.at(left + 1, top)].map(f64::from);
        let [c, d] = [self.at(left, top + 1), self.at(left + 1, top + 1)].map(f64::from);
        Some((a * (1.0 - right) + b * right) * (1.0 - down) + (c * (1.0 - right) + d * right) * down)
    }
}
