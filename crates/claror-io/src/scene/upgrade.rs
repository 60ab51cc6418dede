//! Files of Mitsuba 0.x and 1.x, made to say the same in today's words.

use claror::math::{DMat4, DVec3};

use super::description::{Description, Object, Property, Tag, Value};
use super::source::Log;

/// Parameters of old files that have lost their meaning.
const OBSOLETE: [(Tag, &str); 12] = [
    (Tag::Film, "banner"),
    (Tag::Film, "attach_log"),
    (Tag::Film, "high_quality_edges"),
    (Tag::Film, "metadata"),
    (Tag::Film, "label"),
    (Tag::Sampler, "dimension"),
    (Tag::Sampler, "scramble"),
    (Tag::Integrator, "strict_normals"),
    (Tag::Texture, "cache"),
    (Tag::Texture, "max_anisotropy"),
    (Tag::Shape, "max_smooth_angle"),
    (Tag::Sensor, "kc"),
];

/// `toWorld` → `to_world`, `intIOR` → `int_ior`.
pub(super) fn camel_to_snake(name: &str) -> String {
    let mut out = String::with_capacity(name.len() + 4);
    let mut after_lower = false;
    // Within a run of capitals that began a word all become small.
    let mut in_word = false;
    for c in name.chars() {
        if c.is_ascii_uppercase() && (after_lower || in_word) {
            if after_lower {
                out.push('_');
            }
            out.push(c.to_ascii_lowercase());
            in_word = true;
        } else {
            out.push(c);
            in_word = false;
        }
        after_lower = c.is_ascii_lowercase();
    }
    out
}

/// Upgrades all objects that come from old files.
pub(super) fn upgrade(description: &mut Description, log: &Log) {
    for object in description.objects.iter_mut().filter(|o| o.old) {
        for property in &mut object.properties {
            property.name = camel_to_snake(&property.name);
        }
        rename(object, "diffuse", "diffuse_reflectance", "reflectance");
        old_texture_coordinates(object);
        old_filters(object);
        drop_obsolete(object, log);
    }
}

fn rename(object: &mut Object, plugin: &str, from: &str, to: &str) {
    if object.plugin == plugin && !object.properties.iter().any(|p| p.name == to) {
        for property in object.properties.iter_mut().filter(|p| p.name == from) {
            to.clone_into(&mut property.name);
        }
    }
}

/// `uoffset`, `voffset`, `uscale`, `vscale` → `to_uv`: the offset first, then the scale.
fn old_texture_coordinates(object: &mut Object) {
    let mut offset = DVec3::ZERO;
    let mut scale = DVec3::ONE;
    let mut place = None;
    object.properties.retain(|p| {
        let number = match p.value {
            Value::Float(v) => v,
            #[expect(clippy::cast_precision_loss, reason = "offsets are small numbers")]
            Value::Integer(v) => v as f64,
            _ => return true,
        };
        let target = match p.name.as_str() {
            "uoffset" => &mut offset.x,
            "voffset" => &mut offset.y,
            "uscale" => &mut scale.x,
            "vscale" => &mut scale.y,
            _ => return true,
        };
        *target = number;
        place = Some(p.span);
        false
    });
    if let Some(span) = place {
        let matrix = DMat4::from_scale(scale) * DMat4::from_translation(offset);
        let value = Value::Transform(Box::new(matrix));
        object.properties.push(Property { name: "to_uv".to_owned(), value, span });
    }
}

/// `trilinear` and `ewa` are answered by the bilinear filter: there are no MIP maps.
fn old_filters(object: &mut Object) {
    if object.tag != Tag::Texture {
        return;
    }
    for property in object.properties.iter_mut().filter(|p| p.name == "filter_type") {
        if let Value::String(name) = &mut property.value
            && matches!(name.as_str(), "trilinear" | "ewa")
        {
            "bilinear".clone_into(name);
        }
    }
}

fn drop_obsolete(object: &mut Object, log: &Log) {
    let Object { tag, plugin, properties, .. } = object;
    properties.retain(|p| {
        let is_obsolete = OBSOLETE.iter().any(|(t, n)| t == tag && *n == p.name);
        if is_obsolete {
            let message = format!("\"{}\" of \"{plugin}\" has no meaning any more", p.name);
            log.warning(p.span, message, None);
        }
        !is_obsolete
    });
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn camel_case_becomes_snake_case() {
        for (old, new) in [
            ("toWorld", "to_world"),
            ("intIOR", "int_ior"),
            ("maxDepth", "max_depth"),
            ("specularReflectance", "specular_reflectance"),
            ("already_good", "already_good"),
            ("fov", "fov"),
            ("alphaU", "alpha_u"),
        ] {
            assert_eq!(camel_to_snake(old), new);
        }
    }
}
