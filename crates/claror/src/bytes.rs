//! Numbers and texts as little-endian bytes: what checkpoints and caches are made of.

/// Why bytes do not hold what they should.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
pub enum BytesError {
    /// There are too few bytes.
    #[error("it ends too early")]
    Truncated,
    /// There are too many bytes.
    #[error("something follows its end")]
    TrailingBytes,
    /// A length or size cannot be.
    #[error("a length in it is impossible")]
    BadLength,
    /// A name or value is not text.
    #[error("a text in it is not UTF-8")]
    BadText,
    /// A number cannot be.
    #[error("entry {index} of its {what} is impossible")]
    BadEntry {
        /// The list.
        what: &'static str,
        /// Which one, from 0.
        index: usize,
    },
}

pub(crate) fn put_u32(out: &mut Vec<u8>, value: u32) {
    out.extend_from_slice(&value.to_le_bytes());
}

pub(crate) fn put_u64(out: &mut Vec<u8>, value: u64) {
    out.extend_from_slice(&value.to_le_bytes());
}

pub(crate) fn put_f32(out: &mut Vec<u8>, value: f32) {
    out.extend_from_slice(&value.to_le_bytes());
}

pub(crate) fn put_f64(out: &mut Vec<u8>, value: f64) {
    out.extend_from_slice(&value.to_le_bytes());
}

pub(crate) fn put_text(out: &mut Vec<u8>, text: &str) {
    put_u32(out, text.len() as u32);
    out.extend_from_slice(text.as_bytes());
}

/// Takes values off the front of bytes.
pub(crate) struct Reader<'a> {
    bytes: &'a [u8],
}

impl<'a> Reader<'a> {
    pub(crate) fn new(bytes: &'a [u8]) -> Self {
        Self { bytes }
    }

    /// How many bytes are left.
    pub(crate) fn left(&self) -> u64 {
        self.bytes.len() as u64
    }

    /// An error unless all bytes were taken.
    pub(crate) fn finish(self) -> Result<(), BytesError> {
        if self.bytes.is_empty() { Ok(()) } else { Err(BytesError::TrailingBytes) }
    }

    fn take(&mut self, n: usize) -> Result<&'a [u8], BytesError> {
        let (head, tail) = self.bytes.split_at_checked(n).ok_or(BytesError::Truncated)?;
        self.bytes = tail;
        Ok(head)
    }

    fn array<const N: usize>(&mut self) -> Result<[u8; N], BytesError> {
        self.take(N)?.try_into().map_err(|_| BytesError::Truncated)
    }

    pub(crate) fn u32(&mut self) -> Result<u32, BytesError> {
        self.array().map(u32::from_le_bytes)
    }

    pub(crate) fn u64(&mut self) -> Result<u64, BytesError> {
        self.array().map(u64::from_le_bytes)
    }

    pub(crate) fn f32(&mut self) -> Result<f32, BytesError> {
        self.array().map(f32::from_le_bytes)
    }

    pub(crate) fn f64(&mut self) -> Result<f64, BytesError> {
        self.array().map(f64::from_le_bytes)
    }

    pub(crate) fn text(&mut self) -> Result<String, BytesError> {
        let length = self.u32()? as usize;
        let text = std::str::from_utf8(self.take(length)?).map_err(|_| BytesError::BadText)?;
        Ok(text.to_owned())
    }

    /// The length of a list whose items take `item_bytes` each: no more than there are bytes for.
    pub(crate) fn length(&mut self, item_bytes: usize) -> Result<usize, BytesError> {
        let count = self.u64()?;
        let fits = count.checked_mul(item_bytes as u64).is_some_and(|n| n <= self.left());
        usize::try_from(count).ok().filter(|_| fits).ok_or(BytesError::BadLength)
    }
}
