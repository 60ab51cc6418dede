//! A cache as bytes: records, how they were made, and the hash for rays where no record serves.

use super::{CacheStatistics, IrrCacheSettings, IrradianceCache, IrradianceHash};
use crate::bytes::{BytesError, Reader, put_f32, put_u32, put_u64};
use crate::irradiance::{Record, Surroundings};
use crate::math::{Bounds3, Vec3};
use crate::spectrum::Rgb;

/// What a cache holds, without what is derived from it for look-ups.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct CacheContents {
    /// The records, in the order in which they were inserted.
    pub records: Vec<Record>,
    /// What these saw, one by one, or nothing.
    pub(super) surroundings: Vec<Surroundings>,
    /// How they were made.
    pub statistics: CacheStatistics,
    pub(super) hash: Option<IrradianceHash>,
}

/// Bytes of one [`Record`].
const RECORD_BYTES: usize = 8 + 4 * (3 * 9 + 3 + 2 + 3 + 3);
/// How far squared lengths of unit vectors, and cosines of right angles, may be off. Rounding
/// alone is below 10⁻⁶; a vector that is wrong on purpose or by damage is farther off than this.
const NOT_UNIT: f32 = 1e-4;

impl CacheContents {
    /// As bytes, little-endian; the layout belongs to this version of the crate.
    pub fn to_bytes(&self) -> Vec<u8> {
        put_cache(&self.records, &self.surroundings, &self.statistics, self.hash.as_ref())
    }

    /// From what [`CacheContents::to_bytes`] made. Takes no more memory than a small multiple of
    /// the bytes' number, whatever they say, and what it accepts is fit for look-ups.
    pub fn from_bytes(bytes: &[u8]) -> Result<Self, BytesError> {
        let mut reader = Reader::new(bytes);
        let mut statistics = read_statistics(&mut reader)?;
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
        let surroundings = read_surroundings(&mut reader, count)?;
        let hash = match reader.u32()? {
            0 => None,
            1 => Some(IrradianceHash::read(&mut reader)?),
            _ => return Err(BytesError::BadLength),
        };
        reader.finish()?;
        statistics.records = count;
        Ok(Self { records, surroundings, statistics, hash })
    }

    /// Cells of the hash; `None` where there is no hash.
    pub fn hash_cells(&self) -> Option<usize> {
        self.hash.as_ref().map(IrradianceHash::cells)
    }

    /// Memory that what the records saw takes, bytes; 0 where nobody asks for it.
    pub fn surroundings_bytes(&self) -> usize {
        size_of_val(&self.surroundings[..])
    }

    /// Memory that it takes, without an index, bytes.
    pub fn memory_bytes(&self) -> usize {
        size_of_val(&self.records[..])
            + self.surroundings_bytes()
            + self.hash.as_ref().map_or(0, IrradianceHash::memory_bytes)
    }

    /// Ready for look-ups in a scene with these bounds, which some indices are made around.
    pub fn freeze(self, settings: &IrrCacheSettings, bounds: Bounds3) -> IrradianceCache {
        IrradianceCache::new(self, settings, bounds)
    }
}

impl IrradianceCache {
    /// What [`CacheContents::from_bytes`] reads.
    pub fn to_bytes(&self) -> Vec<u8> {
        put_cache(&self.records, &self.surroundings, &self.statistics, self.hash.as_ref())
    }

    /// A number that differs when what is looked up differs, 64-bit FNV-1a of the bytes without
    /// the statistics.
    pub fn content_hash(&self) -> u64 {
        let nothing = CacheStatistics::default();
        let bytes = put_cache(&self.records, &self.surroundings, &nothing, self.hash.as_ref());
        bytes.iter().fold(0xcbf2_9ce4_8422_2325, |hash, &byte| {
            (hash ^ u64::from(byte)).wrapping_mul(0x0100_0000_01b3)
        })
    }
}

fn put_cache(
    records: &[Record],
    surroundings: &[Surroundings],
    statistics: &CacheStatistics,
    hash: Option<&IrradianceHash>,
) -> Vec<u8> {
    let mut out = Vec::new();
    put_statistics(&mut out, statistics);
    put_u64(&mut out, records.len() as u64);
    out.reserve(records.len() * RECORD_BYTES);
    records.iter().for_each(|record| put_record(&mut out, record));
    put_u32(&mut out, u32::from(!surroundings.is_empty()));
    out.reserve(size_of_val(surroundings));
    surroundings.iter().for_each(|one| one.put(&mut out));
    put_u32(&mut out, u32::from(hash.is_some()));
    if let Some(hash) = hash {
        hash.put(&mut out);
    }
    out
}

fn put_statistics(out: &mut Vec<u8>, statistics: &CacheStatistics) {
    let CacheStatistics {
        // As many as there are.
        records: _,
        discarded,
        invalid,
        raised,
        lowered,
        gradient_limited,
        ratio_limited,
        crevices,
        walks,
        rays,
        levels,
    } = *statistics;
    let counts =
        [discarded, invalid, raised, lowered, gradient_limited, ratio_limited, crevices, walks];
    counts.into_iter().chain(levels).for_each(|count| put_u64(out, count as u64));
    put_u64(out, rays);
}

fn read_statistics(reader: &mut Reader) -> Result<CacheStatistics, BytesError> {
    let mut count = || usize::try_from(reader.u64()?).map_err(|_| BytesError::BadLength);
    let mut statistics = CacheStatistics {
        records: 0,
        discarded: count()?,
        invalid: count()?,
        raised: count()?,
        lowered: count()?,
        gradient_limited: count()?,
        ratio_limited: count()?,
        crevices: count()?,
        walks: count()?,
        rays: 0,
        levels: [0; CacheStatistics::LEVELS],
    };
    for level in &mut statistics.levels {
        *level = count()?;
    }
    statistics.rays = reader.u64()?;
    Ok(statistics)
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
    put_u32(out, record.corral);
    put_f32(out, record.corral_distance);
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
        corral: reader.u32()?,
        corral_distance: reader.f32()?,
    })
}

/// Those of all records, or of none.
fn read_surroundings(reader: &mut Reader, count: usize) -> Result<Vec<Surroundings>, BytesError> {
    let count = match reader.u32()? {
        0 => 0,
        1 => count,
        _ => return Err(BytesError::BadLength),
    };
    let one = |index| {
        let found = Surroundings::read(reader)?;
        found.ok_or(BytesError::BadEntry { what: "surroundings", index })
    };
    (0..count).map(one).collect()
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::integrator::{IntegratorKind, IntegratorSettings};
    use crate::irradiance::Query;
    use crate::scene::test_scene::mixed_room;

    fn settings() -> IrrCacheSettings {
        IrrCacheSettings {
            gather_samples: Some(64),
            noise: Some(1.0),
            error: 1.0,
            ..Default::default()
        }
    }

    fn cache() -> IrradianceCache {
        let mut t = mixed_room(8);
        t.tables.integrator = IntegratorSettings {
            kind: IntegratorKind::IrradianceCache,
            cache: settings(),
            ..Default::default()
        };
        let scene = t.build();
        IrradianceCache::build(&scene, &scene.tables.sensors[0], &|| false).unwrap()
    }

    /// Three records and five cells of a real cache: small enough to try every byte.
    fn small() -> CacheContents {
        let mut contents = CacheContents::from_bytes(&cache().to_bytes()).unwrap();
        contents.records.truncate(3);
        contents.surroundings.truncate(3);
        contents.statistics.records = 3;
        contents.hash.as_mut().unwrap().keep(5);
        contents
    }

    #[test]
    fn what_is_read_is_what_was_written() {
        let cache = cache();
        assert!(cache.records.len() >= 8 && cache.hash.is_some(), "{:?}", cache.statistics);
        let bytes = cache.to_bytes();
        let contents = CacheContents::from_bytes(&bytes).unwrap();
        assert_eq!(contents.records, cache.records);
        assert_eq!(contents.surroundings, cache.surroundings);
        assert_eq!(contents.surroundings.len(), contents.records.len());
        assert_eq!(contents.statistics, cache.statistics);
        assert_eq!(contents.hash, cache.hash);
        assert_eq!(contents.to_bytes(), bytes);
        let again = contents.freeze(&settings(), Bounds3::EMPTY);
        assert_eq!(again.content_hash(), cache.content_hash());
        let mut found = 0;
        for record in &cache.records {
            for step in [0.0, 0.3, 0.9, 1.3] {
                let p = record.position + record.axis * (step * record.radii[0]);
                let query = Query { p, n_smooth: record.normal, n_shading: record.normal };
                assert_eq!(again.lookup(&query), cache.lookup(&query));
                found += usize::from(cache.lookup(&query).is_some());
            }
        }
        assert!(found > cache.records.len());
    }

    #[test]
    fn a_cache_may_have_no_hash_and_no_records() {
        let empty = CacheContents::default();
        assert_eq!(CacheContents::from_bytes(&empty.to_bytes()), Ok(empty));
    }

    #[test]
    fn the_content_hash_sees_records_and_hash_alone() {
        let hash = |contents: &CacheContents| {
            contents.clone().freeze(&settings(), Bounds3::EMPTY).content_hash()
        };
        let whole = small();
        let mut other = whole.clone();
        other.statistics.rays += 1;
        assert_eq!(hash(&other), hash(&whole));
        other.records[2].irradiance.g *= 1.0 + f32::EPSILON;
        assert_ne!(hash(&other), hash(&whole));
        let mut other = whole.clone();
        other.records[0].corral ^= 1 << 31;
        assert_ne!(hash(&other), hash(&whole));
        let other = CacheContents { hash: None, ..whole.clone() };
        assert_ne!(hash(&other), hash(&whole));
        let other = CacheContents { surroundings: Vec::new(), ..whole.clone() };
        assert_ne!(hash(&other), hash(&whole));
    }

    /// No cut is accepted; no changed byte makes anything panic, and what is accepted can be used.
    #[test]
    fn cut_and_changed_bytes_are_survived() {
        let contents = small();
        let bytes = contents.to_bytes();
        for end in 0..bytes.len() {
            assert!(CacheContents::from_bytes(&bytes[..end]).is_err(), "cut at {end}");
        }
        let long = [bytes.as_slice(), &[0]].concat();
        assert_eq!(CacheContents::from_bytes(&long), Err(BytesError::TrailingBytes));
        let query = Query {
            p: contents.records[0].position,
            n_smooth: contents.records[0].normal,
            n_shading: contents.records[0].normal,
        };
        for at in 0..bytes.len() {
            for bit in [1, 0x20, 0x80, 0xff] {
                let mut changed = bytes.clone();
                changed[at] ^= bit;
                if let Ok(contents) = CacheContents::from_bytes(&changed) {
                    contents.freeze(&settings(), Bounds3::EMPTY).lookup(&query);
                }
            }
        }
    }

    #[test]
    fn unsound_records_are_refused() {
        let with = |change: fn(&mut Record)| {
            let mut contents = small();
            change(&mut contents.records[1]);
            CacheContents::from_bytes(&contents.to_bytes()).map(|c| c.records.len())
        };
        assert_eq!(with(|_| ()), Ok(3));
        assert_eq!(with(|r| r.harmonic_mean_distance = f32::INFINITY), Ok(3), "sees nothing");
        let changes: [fn(&mut Record); 13] = [
            |r| r.corral_distance = f32::NAN,
            |r| r.position.x = f32::NAN,
            |r| r.irradiance.b = f32::INFINITY,
            |r| r.translational[2].y = f32::NAN,
            |r| r.rotational[0].z = f32::NEG_INFINITY,
            |r| r.normal *= 1.001,
            |r| r.axis *= 0.999,
            |r| r.axis = r.normal,
            |r| r.radii = [0.0; 2],
            |r| r.radii[0] = -r.radii[0],
            |r| r.radii[1] = 0.5 * r.radii[0],
            |r| r.max_angle = f32::NAN,
            |r| r.harmonic_mean_distance = f32::NAN,
        ];
        for (number, change) in changes.into_iter().enumerate() {
            let error = BytesError::BadEntry { what: "records", index: 1 };
            assert_eq!(with(change), Err(error), "change {number}");
        }
    }

    /// Lengths that the bytes cannot have, and keys that would take hours to store.
    #[test]
    fn made_up_lengths_and_keys_are_refused() {
        let mut bytes = CacheContents::default().to_bytes();
        let at = 8 * (9 + CacheStatistics::LEVELS);
        bytes[at..at + 8].fill(0xff);
        assert_eq!(CacheContents::from_bytes(&bytes), Err(BytesError::BadLength));

        let with_keys = |keys: &mut dyn Iterator<Item = u64>| {
            let mut bytes = CacheContents::default().to_bytes();
            let at = bytes.len() - 4;
            bytes[at] = 1;
            [1.0; 2].into_iter().for_each(|x| put_f32(&mut bytes, x));
            let keys: Vec<u64> = keys.collect();
            put_u64(&mut bytes, keys.len() as u64);
            for key in keys {
                put_u64(&mut bytes, key);
                [0.5; 6].into_iter().for_each(|x| put_f32(&mut bytes, x));
            }
            CacheContents::from_bytes(&bytes).map(|c| c.hash_cells())
        };
        assert_eq!(with_keys(&mut (1..1000)), Ok(Some(999)));
        let alike = with_keys(&mut (1..100_000).map(|i| i << 32));
        assert_eq!(alike, Err(BytesError::BadLength));
        let bad = |index| Err(BytesError::BadEntry { what: "hash", index });
        assert_eq!(with_keys(&mut [0, 1].into_iter()), bad(0));
        assert_eq!(with_keys(&mut [2, 2].into_iter()), bad(1));
    }
}
