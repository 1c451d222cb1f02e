//! Messages put together by the rules of CDR: every number stands at a multiple of its size, counted from behind the four bytes of the
//! header, whose second byte is 0 for big-endian and 1 for little-endian.
#![allow(dead_code, reason = "not everybody writes every type")]

/// A message that is being written.
pub struct Cdr {
    is_big: bool,
    pub bytes: Vec<u8>,
}

impl Cdr {
    pub fn new(is_big: bool) -> Cdr {
        Cdr { is_big, bytes: vec![0, u8::from(!is_big), 0, 0] }
    }

    /// In little-endian, with a std_msgs/Header: `stamp` in nanoseconds.
    pub fn stamped(stamp: u64, frame: &str) -> Cdr {
        let mut cdr = Cdr::new(false);
        cdr.header((stamp / 1_000_000_000) as u32, (stamp % 1_000_000_000) as u32, frame);
        cdr
    }

    /// `bytes`: a number, its lowest byte first.
    fn number<const N: usize>(&mut self, mut bytes: [u8; N]) {
        let over = (self.bytes.len() - 4) % N;
        self.bytes.resize(self.bytes.len() + (N - over) % N, 0xee);
        if self.is_big {
            bytes.reverse();
        }
        self.bytes.extend_from_slice(&bytes);
    }

    pub fn byte(&mut self, byte: u8) {
        self.bytes.push(byte);
    }

    pub fn short(&mut self, number: u16) {
        self.number(number.to_le_bytes());
    }

    pub fn int(&mut self, number: u32) {
        self.number(number.to_le_bytes());
    }

    pub fn half(&mut self, number: f32) {
        self.number(number.to_le_bytes());
    }

    pub fn float(&mut self, number: f64) {
        self.number(number.to_le_bytes());
    }

    /// An array of fixed length.
    pub fn floats(&mut self, numbers: &[f64]) {
        numbers.iter().for_each(|number| self.float(*number));
    }

    /// One with its length.
    pub fn sequence(&mut self, numbers: &[f64]) {
        self.int(numbers.len() as u32);
        self.floats(numbers);
    }

    pub fn text(&mut self, text: &str) {
        self.int(text.len() as u32 + 1);
        self.bytes.extend_from_slice(text.as_bytes());
        self.byte(0);
    }

    pub fn header(&mut self, sec: u32, nanosec: u32, frame: &str) {
        self.int(sec);
        self.int(nanosec);
        self.text(frame);
    }
}
