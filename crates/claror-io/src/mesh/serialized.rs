//! Mitsuba's own mesh format, versions 3 and 4.
//!
//! A file holds several meshes, each with a header and a zlib stream, and ends with a table of
//! their offsets. All numbers are little-endian. The flag for face normals is ignored, as Mitsuba 3
//! does; vertex colours, which Mitsuba 3 skips, become `vertex_color`.

use std::io::Read;

use claror::math::{Vec2, Vec3};
use claror::shape::MeshAttribute;
use flate2::bufread::ZlibDecoder;

use super::finish::RawMesh;
use crate::diagnostic::ReadError;
use crate::limits::Limits;
use crate::source::Source;

const MAGIC: u16 = 0x041c;
const HAS_NORMALS: u32 = 0x0001;
const HAS_UVS: u32 = 0x0002;
const HAS_COLORS: u32 = 0x0008;
const DOUBLE_PRECISION: u32 = 0x2000;

/// The longest name of a mesh.
const MAX_NAME: usize = 1 << 16;

/// zlib cannot shrink by more than 1 : 1032.
const MAX_COMPRESSION: u64 = 1032;

pub(super) fn parse(
    bytes: &[u8],
    shape_index: usize,
    source: Source<'_>,
    limits: &Limits,
) -> Result<RawMesh, ReadError> {
    let (version, _) = mesh_header(bytes, source)?;
    let stream = match shape_index {
        0 => bytes,
        index => &bytes[mesh_offset(bytes, version, index, source)?..],
    };
    let (version, packed) = mesh_header(stream, source)?;
    let mut body = Stream {
        decoder: ZlibDecoder::new(packed),
        left: (packed.len() as u64).saturating_mul(MAX_COMPRESSION),
        source,
    };
    let flags = u32::from_le_bytes(body.array("flags")?);
    if version == 4 {
        body.skip_name()?;
    }
    let vertices = u64::from_le_bytes(body.array("vertex count")?);
    let triangles = u64::from_le_bytes(body.array("triangle count")?);
    source.check_limit("vertices", vertices, limits.max_mesh_elements)?;
    source.check_limit("triangles", triangles, limits.max_mesh_elements)?;

    let mut raw = RawMesh::default();
    let double = flags & DOUBLE_PRECISION != 0;
    raw.positions = body.vectors("positions", vertices, double, Vec3::from_array)?;
    if flags & HAS_NORMALS != 0 {
        raw.normals = body.vectors("normals", vertices, double, Vec3::from_array)?;
    }
    if flags & HAS_UVS != 0 {
        raw.uvs = body.vectors("texture coordinates", vertices, double, Vec2::from_array)?;
    }
    if flags & HAS_COLORS != 0 {
        let colors: Vec<[f32; 3]> = body.vectors("colours", vertices, double, |c| c)?;
        raw.attributes.push(MeshAttribute {
            name: "vertex_color".into(),
            per_face: false,
            channels: 3,
            data: colors.into_flattened(),
        });
    }
    raw.triangles = body.triangles(triangles, vertices)?;
    Ok(raw)
}

/// Version and what follows the header.
fn mesh_header<'a>(bytes: &'a [u8], source: Source<'_>) -> Result<(u16, &'a [u8]), ReadError> {
    let Some(([m0, m1, v0, v1], rest)) = bytes.split_first_chunk() else {
        return Err(source.error("the file is cut: there is no room for a mesh header"));
    };
    if u16::from_le_bytes([*m0, *m1]) != MAGIC {
        return Err(source.error("this is not a serialized mesh"));
    }
    match u16::from_le_bytes([*v0, *v1]) {
        version @ (3 | 4) => Ok((version, rest)),
        version => Err(source.error(format!("version {version} of the format is not supported"))),
    }
}

/// From the table at the end: offsets (4 bytes in version 3, 8 in version 4), then their number.
fn mesh_offset(
    bytes: &[u8],
    version: u16,
    index: usize,
    source: Source<'_>,
) -> Result<usize, ReadError> {
    let cut = || source.error("the table of meshes at the end of the file is damaged");
    let (rest, count) = bytes.split_last_chunk().ok_or_else(cut)?;
    let count = u32::from_le_bytes(*count) as usize;
    if index >= count {
        return Err(source.error(format!("there is no mesh {index}: the file holds {count}")));
    }
    let entry = if version == 4 { 8 } else { 4 };
    let table = count.checked_mul(entry).filter(|&n| n <= rest.len()).ok_or_else(cut)?;
    let at = rest.len() - table + index * entry;
    let mut offset = [0; 8];
    offset[..entry].copy_from_slice(&rest[at..at + entry]);
    usize::try_from(u64::from_le_bytes(offset)).ok().filter(|&o| o < rest.len()).ok_or_else(cut)
}

/// The decompressed numbers.
struct Stream<'a> {
    decoder: ZlibDecoder<&'a [u8]>,
    /// Upper bound of the bytes to come.
    left: u64,
    source: Source<'a>,
}

impl Stream<'_> {
    fn fill(&mut self, buffer: &mut [u8], what: &str) -> Result<(), ReadError> {
        self.left = self.left.saturating_sub(buffer.len() as u64);
        self.decoder.read_exact(buffer).map_err(|e| match e.kind() {
            std::io::ErrorKind::UnexpectedEof => {
                self.source.error(format!("the file is cut in the mesh's {what}"))
            }
            _ => self.source.error(format!("the mesh's {what} cannot be decompressed")),
        })
    }

    fn array<const N: usize>(&mut self, what: &str) -> Result<[u8; N], ReadError> {
        let mut buffer = [0; N];
        self.fill(&mut buffer, what)?;
        Ok(buffer)
    }

    fn skip_name(&mut self) -> Result<(), ReadError> {
        for _ in 0..MAX_NAME {
            if self.array::<1>("name")? == [0] {
                return Ok(());
            }
        }
        Err(self.source.error("the name of the mesh does not end"))
    }

    /// Room for `count` values of `bytes` bytes each, if the file can hold so many.
    fn reserve<T>(&self, count: u64, bytes: u64, what: &str) -> Result<Vec<T>, ReadError> {
        if count.saturating_mul(bytes) > self.left {
            return Err(self.source.error(format!("the file is too short for {count} {what}")));
        }
        self.source.reserve(count, what)
    }

    fn vectors<T, const N: usize>(
        &mut self,
        what: &str,
        count: u64,
        double: bool,
        make: impl Fn([f32; N]) -> T,
    ) -> Result<Vec<T>, ReadError> {
        let size = if double { 8 } else { 4 };
        let mut values = self.reserve(count, (N * size) as u64, what)?;
        let mut block = vec![0; BLOCK * N * size];
        for rows in blocks(count) {
            let bytes = &mut block[..rows * N * size];
            self.fill(bytes, what)?;
            for row in bytes.chunks_exact(N * size) {
                let mut numbers = row.chunks_exact(size);
                values.push(make(std::array::from_fn(|_| number(numbers.next()))));
            }
        }
        Ok(values)
    }

    fn triangles(&mut self, count: u64, vertices: u64) -> Result<Vec<[u32; 3]>, ReadError> {
        let mut triangles = self.reserve(count, 12, "triangles")?;
        let mut block = vec![0; BLOCK * 12];
        for rows in blocks(count) {
            let bytes = &mut block[..rows * 12];
            self.fill(bytes, "triangles")?;
            let (indices, _) = bytes.as_chunks::<4>();
            let (rows, _) = indices.as_chunks::<3>();
            for row in rows {
                let triangle = row.map(u32::from_le_bytes);
                if let Some(index) = triangle.iter().find(|&&i| u64::from(i) >= vertices) {
                    let i = triangles.len();
                    return Err(self.source.error(format!(
                        "vertex index {index} of triangle {i} is out of range: there are {vertices}"
                    )));
                }
                triangles.push(triangle);
            }
        }
        Ok(triangles)
    }
}

/// Rows that are decompressed together.
const BLOCK: usize = 4096;

/// The sizes of the blocks of `count` rows.
fn blocks(count: u64) -> impl Iterator<Item = usize> {
    let full = count / BLOCK as u64;
    let rest = (count % BLOCK as u64) as usize;
    (0..full).map(|_| BLOCK).chain((rest > 0).then_some(rest))
}

/// 4 or 8 little-endian bytes.
fn number(bytes: Option<&[u8]>) -> f32 {
    match bytes {
        Some(&[a, b, c, d]) => f32::from_le_bytes([a, b, c, d]),
        Some(&[a, b, c, d, e, f, g, h]) => f64::from_le_bytes([a, b, c, d, e, f, g, h]) as f32,
        _ => f32::NAN,
    }
}
