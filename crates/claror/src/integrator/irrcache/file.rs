//! A cache as bytes: records, how they were made, and the hash for rays where no record serves.

use super::{CacheStatistics, IrrCacheSettings, IrradianceCache, IrradianceHash};
use crate::bytes::{BytesError, Reader, put_f32, put_u32, put_u64};
use crate::irradiance::Record;
use crate::math::Vec3;
use crate::spectrum::Rgb;

/// What a cache holds, without what is derived from it for look-ups.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct CacheContents {
    /// The records, in the order in which they were inserted.
    pub records: Vec<Record>,
    /// How they were made.
    pub statistics: CacheStatistics,
    hash: Option<IrradianceHash>,
}

/// Bytes of one [`Record`].
const RECORD_BYTES: usize = 8 + 4 * (3 * 9 + 3 + 2 + 3 + 1);
/// How far squared lengths of unit vectors, and cosines of right angles, may be off. Rounding
/// alone is below 10⁻⁶; a vector that is wrong on purpose or by damage is farther off than this.
const NOT_UNIT: f32 = 1e-4;

impl CacheContents {
    /// As bytes, little-endian; the layout belongs to this version of the crate.
    pub fn to_bytes(&self) -> Vec<u8> {
        put_cache(&self.records, &self.statistics, self.hash.as_ref())
    }

    /// From what [`CacheContents::to_bytes`] made. Takes no more memory than a small multiple of
    /// the bytes' number, whatever they say, and what it accepts is fit for look-ups.
    pub fn from_bytes(bytes: &[u8]) -> Result<Self, BytesError> {
        let mut reader = Reader::new(bytes);
        let mut statistics = [0_usize; 4];
        for count in &mut statistics {
            *count = usize::try_from(reader.u64()?).map_err(|_| BytesError::BadLength)?;
        }
        let [discarded, invalid, raised, crevices] = statistics;
        let rays = reader.u64()?;
        let count = reader.length(RECORD_BYTES)?;
        // Indices of records have 32 bits, one of them taken.
        if count >= 1 << 31 {
            return Err(BytesError::BadLength);
        }
        let mut records = Vec::with_capacity(count);
        for index in 0..count {
            let record = read_record(&mut reader)?;
            if !is_sound(&record) {
                return Err(BytesError::BadEntry { what: "records", index });
            }
            records.push(record);
        }
        let hash = match reader.u32()? {
            0 => None,
            1 => Some(IrradianceHash::read(&mut reader)?),
            _ => return Err(BytesError::BadLength),
        };
        reader.finish()?;
        let statistics =
            CacheStatistics { records: count, discarded, invalid, raised, crevices, rays };
        Ok(Self { records, statistics, hash })
    }

    /// Cells of the hash; `None` where there is no hash.
    pub fn hash_cells(&self) -> Option<usize> {
        self.hash.as_ref().map(IrradianceHash::cells)
    }

    /// Memory that it takes, without an index, bytes.
    pub fn memory_bytes(&self) -> usize {
        size_of_val(&self.records[..]) + self.hash.as_ref().map_or(0, IrradianceHash::memory_bytes)
    }

    /// Ready for look-ups.
    pub fn freeze(self, settings: &IrrCacheSettings) -> IrradianceCache {
        IrradianceCache::new(self.records, self.statistics, settings, self.hash)
    }
}

impl IrradianceCache {
    /// What [`CacheContents::from_bytes`] reads.
    pub fn to_bytes(&self) -> Vec<u8> {
        put_cache(&self.records, &self.statistics, self.hash.as_ref())
    }

    /// A number that differs when what is looked up differs, 64-bit FNV-1a of the bytes without
    /// the statistics.
    pub fn content_hash(&self) -> u64 {
        let bytes = put_cache(&self.records, &CacheStatistics::default(), self.hash.as_ref());
        bytes.iter().fold(0xcbf2_9ce4_8422_2325, |hash, &byte| {
            (hash ^ u64::from(byte)).wrapping_mul(0x0100_0000_01b3)
        })
    }
}

fn put_cache(
    records: &[Record],
    statistics: &CacheStatistics,
    hash: Option<&IrradianceHash>,
) -> Vec<u8> {
    let mut out = Vec::new();
    // As many records as there are.
    let CacheStatistics { records: _, discarded, invalid, raised, crevices, rays } = *statistics;
    for count in [discarded, invalid, raised, crevices] {
        put_u64(&mut out, count as u64);
    }
    put_u64(&mut out, rays);
    put_u64(&mut out, records.len() as u64);
    out.reserve(records.len() * RECORD_BYTES);
    records.iter().for_each(|record| put_record(&mut out, record));
    put_u32(&mut out, u32::from(hash.is_some()));
    if let Some(hash) = hash {
        hash.put(&mut out);
    }
    out
}

fn put_record(out: &mut Vec<u8>, record: &Record) {
    put_u64(out, record.key);
    let vectors = [record.position, record.normal, record.axis];
    for vector in vectors.iter().chain(&record.translational).chain(&record.rotational) {
        vector.to_array().into_iter().for_each(|x| put_f32(out, x));
    }
    let rest = [record.max_angle, record.harmonic_mean_distance, record.natural_radius];
    for x in record.irradiance.to_array().into_iter().chain(record.radii).chain(rest) {
        put_f32(out, x);
    }
    put_u32(out, record.flags);
}

fn read_record(reader: &mut Reader) -> Result<Record, BytesError> {
    let key = reader.u64()?;
    let mut vectors = [Vec3::ZERO; 9];
    for vector in &mut vectors {
        *vector = Vec3::new(reader.f32()?, reader.f32()?, reader.f32()?);
    }
    let [position, normal, axis, tx, ty, tz, rx, ry, rz] = vectors;
    Ok(Record {
        key,
        position,
        normal,
        axis,
        translational: [tx, ty, tz],
        rotational: [rx, ry, rz],
        irradiance: Rgb::from([reader.f32()?, reader.f32()?, reader.f32()?]),
        radii: [reader.f32()?, reader.f32()?],
        max_angle: reader.f32()?,
        harmonic_mean_distance: reader.f32()?,
        natural_radius: reader.f32()?,
        flags: reader.u32()?,
    })
}

/// Whether look-ups can rely on it.
fn is_sound(record: &Record) -> bool {
    let is_unit = |v: Vec3| (v.length_squared() - 1.0).abs() <= NOT_UNIT;
    record.is_valid()
        && record.max_angle.is_finite()
        && is_unit(record.normal)
        && is_unit(record.axis)
        && record.normal.dot(record.axis).abs() <= NOT_UNIT
}
