//! PLY, the Stanford polygon format: ascii and binary of either byte order.
//!
//! Properties of any numeric type in any order; faces may be polygons, which become fans; elements
//! other than `vertex` and `face` are skipped. Further vertex and face properties become mesh
//! attributes under the names that Mitsuba gives them (see [`attributes`]).

mod attributes;
mod header;
mod values;

use claror::math::{Vec2, Vec3};

use self::attributes::AttributeReader;
use self::header::{Element, Encoding, Header, Property, PropertyKind};
use self::values::{AsciiValues, BinaryValues, ValueError, Values};
use super::finish::RawMesh;
use crate::diagnostic::ReadError;
use crate::limits::Limits;
use crate::source::Source;

pub(super) fn parse(
    bytes: &[u8],
    source: Source<'_>,
    limits: &Limits,
) -> Result<RawMesh, ReadError> {
    let header = Header::parse(bytes, source)?;
    let body = Body { source, limits, header: &header };
    match header.encoding {
        Encoding::Ascii => body.read(AsciiValues::new(bytes, header.body_start, header.body_line)),
        Encoding::LittleEndian => body.read(BinaryValues::<false>::new(bytes, header.body_start)),
        Encoding::BigEndian => body.read(BinaryValues::<true>::new(bytes, header.body_start)),
    }
}

/// Everything after the header.
struct Body<'a> {
    source: Source<'a>,
    limits: &'a Limits,
    header: &'a Header,
}

/// What becomes of a scalar property.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Target {
    Position(usize),
    Normal(usize),
    Uv(usize),
    Attribute(usize),
    Skip,
}

/// Names of the two texture coordinates in use; the first pair that is there wins, as in Mitsuba.
const UV_NAMES: [[&str; 2]; 4] =
    [["u", "v"], ["s", "t"], ["texture_u", "texture_v"], ["texture_s", "texture_t"]];

impl Body<'_> {
    fn read<V: Values>(&self, mut values: V) -> Result<RawMesh, ReadError> {
        let mut raw = RawMesh { warnings: self.header.warnings.clone(), ..RawMesh::default() };
        let mut seen = (false, false);
        for element in &self.header.elements {
            self.check_size(element, &values)?;
            match element.name.as_str() {
                "vertex" if !seen.0 => {
                    seen.0 = true;
                    self.vertices(element, &mut values, &mut raw)?;
                }
                "face" if !seen.1 => {
                    seen.1 = true;
                    self.faces(element, &mut values, &mut raw)?;
                }
                _ => self.skip(element, &mut values)?,
            }
        }
        if !seen.0 || !seen.1 {
            let missing = if seen.0 { "face" } else { "vertex" };
            return Err(self.source.error(format!("the file has no element \"{missing}\"")));
        }
        if values.has_more() {
            raw.warnings.push("something follows the last element of the file".into());
        }
        let count = raw.positions.len();
        for (i, triangle) in raw.triangles.iter().enumerate() {
            if let Some(&index) = triangle.iter().find(|&&index| index as usize >= count) {
                let message = format!(
                    "vertex index {index} of triangle {i} is out of range: there are {count}"
                );
                return Err(self.source.error(message));
            }
        }
        Ok(raw)
    }

    /// Refuses a row count that the rest of the file cannot hold, before anything is allocated.
    fn check_size<V: Values>(&self, element: &Element, values: &V) -> Result<(), ReadError> {
        let needed = V::MIN_BYTES.needed(element).saturating_mul(element.count);
        if needed <= values.remaining() as u64 {
            return Ok(());
        }
        Err(self.source.error(format!(
            "the file is cut: {} rows of element \"{}\" need {needed} bytes, {} are left",
            element.count,
            element.name,
            values.remaining()
        )))
    }

    fn vertices<V: Values>(
        &self,
        element: &Element,
        values: &mut V,
        raw: &mut RawMesh,
    ) -> Result<(), ReadError> {
        self.source.check_limit("vertices", element.count, self.limits.max_mesh_elements)?;
        let mut attributes = AttributeReader::new(element, "vertex", &mut raw.warnings);
        let targets = vertex_targets(element, &attributes);
        let has = |wanted: Target| targets.contains(&wanted);
        if !(0..3).all(|axis| has(Target::Position(axis))) {
            return Err(self.source.error("element \"vertex\" has no properties x, y and z"));
        }
        let has_normals = (0..3).all(|axis| has(Target::Normal(axis)));
        let has_uvs = (0..2).all(|axis| has(Target::Uv(axis)));
        let rows = element.count;
        raw.positions = self.source.reserve(rows, "the vertices")?;
        raw.normals = self.source.reserve(if has_normals { rows } else { 0 }, "the normals")?;
        raw.uvs = self.source.reserve(if has_uvs { rows } else { 0 }, "the texture coordinates")?;
        attributes.reserve(rows, self.source)?;
        for row in 0..rows {
            let (mut p, mut n, mut uv) = (Vec3::ZERO, Vec3::ZERO, Vec2::ZERO);
            for (property, target) in element.properties.iter().zip(&targets) {
                let value = self.scalar(element, row, property, values)?;
                match *target {
                    Target::Position(axis) => p[axis] = value as f32,
                    Target::Normal(axis) => n[axis] = value as f32,
                    Target::Uv(axis) => uv[axis] = value as f32,
                    Target::Attribute(slot) => attributes.set(slot, value as f32),
                    Target::Skip => {}
                }
            }
            if !p.is_finite() {
                return Err(self.not_finite(element, row, "position", values));
            }
            raw.positions.push(p);
            if has_normals {
                raw.normals.push(n);
            }
            if has_uvs {
                raw.uvs.push(uv);
            }
            attributes.push_row();
        }
        raw.attributes.extend(attributes.finish());
        Ok(())
    }

    fn faces<V: Values>(
        &self,
        element: &Element,
        values: &mut V,
        raw: &mut RawMesh,
    ) -> Result<(), ReadError> {
        self.source.check_limit("faces", element.count, self.limits.max_mesh_elements)?;
        let is_indices =
            |p: &Property| matches!(p.name.as_str(), "vertex_indices" | "vertex_index");
        let Some(indices) = element.properties.iter().position(is_indices) else {
            return Err(self.source.error("element \"face\" has no list \"vertex_indices\""));
        };
        if matches!(element.properties[indices].kind, PropertyKind::Scalar(_)) {
            return Err(self.source.error("property \"vertex_indices\" is not a list"));
        }
        let mut attributes = AttributeReader::new(element, "face", &mut raw.warnings);
        let targets = face_targets(element, &attributes);
        let rows = element.count;
        raw.triangles = self.source.reserve(rows, "the triangles")?;
        attributes.reserve(rows, self.source)?;
        let mut polygon = Vec::new();
        let mut skipped = 0_u64;
        for row in 0..rows {
            for (i, (property, target)) in element.properties.iter().zip(&targets).enumerate() {
                if i == indices {
                    self.polygon(element, row, property, values, &mut polygon)?;
                } else {
                    let value = self.scalar(element, row, property, values)?;
                    if let Target::Attribute(slot) = *target {
                        attributes.set(slot, value as f32);
                    }
                }
            }
            skipped += u64::from(polygon.len() < 3);
            for pair in polygon.windows(2).skip(1) {
                raw.triangles.push([polygon[0], pair[0], pair[1]]);
                attributes.push_row();
            }
            let count = raw.triangles.len() as u64;
            self.source.check_limit("triangles", count, self.limits.max_mesh_elements)?;
        }
        if skipped > 0 {
            raw.warnings.push(format!("{skipped} faces with fewer than 3 vertices were skipped"));
        }
        raw.attributes.extend(attributes.finish());
        Ok(())
    }

    /// The vertex indices of a face. Only the sign is checked here: the vertices may come later.
    fn polygon<V: Values>(
        &self,
        element: &Element,
        row: u64,
        property: &Property,
        values: &mut V,
        polygon: &mut Vec<u32>,
    ) -> Result<(), ReadError> {
        let PropertyKind::List { count, item } = property.kind else { return Ok(()) };
        let at = |e| self.value_error(element, row, property, e);
        polygon.clear();
        let length = values.integer(count).map_err(at)?;
        for _ in 0..self.list_length(element, row, property, length, values)? {
            let index = values.integer(item).map_err(at)?;
            match u32::try_from(index) {
                Ok(index) => polygon.push(index),
                Err(_) => {
                    let message = format!(
                        "vertex index {index} of face {row} is out of range{}",
                        values.place()
                    );
                    return Err(self.source.error(message));
                }
            }
        }
        Ok(())
    }

    /// A list length that the rest of the file can hold.
    fn list_length<V: Values>(
        &self,
        element: &Element,
        row: u64,
        property: &Property,
        length: i64,
        values: &V,
    ) -> Result<u64, ReadError> {
        let PropertyKind::List { item, .. } = property.kind else { return Ok(0) };
        let Ok(count) = u64::try_from(length) else {
            return Err(self.source.error(format!(
                "list \"{}\" of {} {row} has the length {length}{}",
                property.name,
                element.name,
                values.place()
            )));
        };
        if count.saturating_mul(V::MIN_BYTES.value(item)) > values.remaining() as u64 + 1 {
            return Err(self.value_error(element, row, property, ValueError::End));
        }
        Ok(count)
    }

    /// A scalar, or 0 for a list, which is skipped.
    fn scalar<V: Values>(
        &self,
        element: &Element,
        row: u64,
        property: &Property,
        values: &mut V,
    ) -> Result<f64, ReadError> {
        let at = |e| self.value_error(element, row, property, e);
        match property.kind {
            PropertyKind::Scalar(kind) => values.number(kind).map_err(at),
            PropertyKind::List { count, item } => {
                let length = values.integer(count).map_err(at)?;
                for _ in 0..self.list_length(element, row, property, length, values)? {
                    values.number(item).map_err(at)?;
                }
                Ok(0.0)
            }
        }
    }

    fn skip<V: Values>(&self, element: &Element, values: &mut V) -> Result<(), ReadError> {
        if element.properties.is_empty() {
            return Ok(());
        }
        for row in 0..element.count {
            for property in &element.properties {
                self.scalar(element, row, property, values)?;
            }
        }
        Ok(())
    }

    fn value_error(
        &self,
        element: &Element,
        row: u64,
        property: &Property,
        error: ValueError,
    ) -> ReadError {
        let (line, what) = match error {
            ValueError::End => (None, "the file is cut in".to_owned()),
            ValueError::NotANumber { line, word } => {
                (Some(line), format!("\"{word}\" is not a valid number for"))
            }
        };
        let message = format!("{what} property \"{}\" of {} {row}", property.name, element.name);
        match line {
            Some(line) => self.source.error_at(line, message),
            None => self.source.error(message),
        }
    }

    fn not_finite<V: Values>(
        &self,
        element: &Element,
        row: u64,
        what: &str,
        values: &V,
    ) -> ReadError {
        let place = values.place();
        self.source.error(format!("the {what} of {} {row} is not finite{place}", element.name))
    }
}

fn vertex_targets(element: &Element, attributes: &AttributeReader) -> Vec<Target> {
    let names: Vec<&str> = element.properties.iter().map(|p| p.name.as_str()).collect();
    let uv = UV_NAMES.iter().find(|pair| pair.iter().all(|name| names.contains(name)));
    let target = |(i, property): (usize, &Property)| {
        if matches!(property.kind, PropertyKind::List { .. }) {
            return Target::Skip;
        }
        let axis = |names: &[&str]| names.iter().position(|&name| name == property.name);
        if let Some(axis) = axis(&["x", "y", "z"]) {
            Target::Position(axis)
        } else if let Some(axis) = axis(&["nx", "ny", "nz"]) {
            Target::Normal(axis)
        } else if let Some(axis) = uv.and_then(|pair| axis(pair)) {
            Target::Uv(axis)
        } else {
            attributes.slot(i).map_or(Target::Skip, Target::Attribute)
        }
    };
    element.properties.iter().enumerate().map(target).collect()
}

fn face_targets(element: &Element, attributes: &AttributeReader) -> Vec<Target> {
    let slot = |i| attributes.slot(i).map_or(Target::Skip, Target::Attribute);
    (0..element.properties.len()).map(slot).collect()
}
