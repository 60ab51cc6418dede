//! A fingerprint of a scene, by which checkpoints know theirs.

use claror::scene::SceneTables;
use claror::shape::Mesh;
use xxhash_rust::xxh3::Xxh3;

/// A 128-bit fingerprint of what the tables say: equal for equal scenes on every run and machine,
/// whatever the files were called. It is no defence against forgery.
pub fn content_hash(tables: &SceneTables) -> u128 {
    let mut hash = Xxh3::new();
    for mesh in &tables.shapes.meshes {
        add_mesh(&mut hash, mesh);
    }
    for image in &tables.textures.images {
        add_text(&mut hash, &(image.width, image.height, image.channels));
        add_floats(&mut hash, image.data.iter().copied());
    }
    let shapes = &tables.shapes;
    for shape in &shapes.shapes {
        add_text(&mut hash, shape);
    }
    add_text(&mut hash, &(&shapes.groups, &shapes.instances));
    add_text(&mut hash, &tables.bsdfs.bsdfs);
    add_text(&mut hash, &tables.textures.textures);
    add_text(&mut hash, &tables.emitters.emitters);
    add_text(&mut hash, &tables.sensors);
    add_text(&mut hash, &(&tables.integrator, &tables.aovs));
    hash.digest128()
}

/// Small things by their `Debug` text: it has every field, and floats round-trip in it. New fields
/// change the fingerprint, so that checkpoints of another version are refused.
fn add_text(hash: &mut Xxh3, value: &impl std::fmt::Debug) {
    let text = format!("{value:?}\n");
    hash.update(text.as_bytes());
}

fn add_mesh(hash: &mut Xxh3, mesh: &Mesh) {
    add_text(hash, &(mesh.positions.len(), mesh.normals.len(), mesh.uvs.len()));
    add_floats(hash, mesh.positions.iter().flat_map(|p| p.to_array()));
    add_floats(hash, mesh.normals.iter().flat_map(|n| n.to_array()));
    add_floats(hash, mesh.uvs.iter().flat_map(|u| u.to_array()));
    add_text(hash, &mesh.triangles.len());
    add_words(hash, mesh.triangles.iter().flatten().copied());
    for attribute in &mesh.attributes {
        let header = (&attribute.name, attribute.per_face, attribute.channels);
        add_text(hash, &(header, attribute.data.len()));
        add_floats(hash, attribute.data.iter().copied());
    }
}

fn add_floats(hash: &mut Xxh3, values: impl Iterator<Item = f32>) {
    add_words(hash, values.map(f32::to_bits));
}

/// Little-endian on every machine, a few kilobytes at a time.
fn add_words(hash: &mut Xxh3, values: impl Iterator<Item = u32>) {
    let mut buffer = [0_u8; 4096];
    let mut filled = 0;
    for value in values {
        buffer[filled..filled + 4].copy_from_slice(&value.to_le_bytes());
        filled += 4;
        if filled == buffer.len() {
            hash.update(&buffer);
            filled = 0;
        }
    }
    hash.update(&buffer[..filled]);
}
