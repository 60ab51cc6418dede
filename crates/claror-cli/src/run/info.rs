//! `claror info`: what was understood of a scene.

use std::collections::BTreeMap;

use claror::bsdf::Bsdf;
use claror::emitter::Emitter;
use claror::scene::{Scene, SceneTables};
use claror::sensor::{Sensor, SensorKind};
use claror::shape::{Shape, ShapeKind};
use claror::spectrum::Rgb;
use claror::texture::Texture;
use serde_json::{Value, json};

use super::load;
use crate::args::SceneArgs;
use crate::exit::{Exit, Failure};
use crate::messages::Console;
use crate::signals::Interrupts;
use crate::{memory, parameters, units};

/// Lights that are listed one by one; a scene may have 10^5.
const LISTED_LIGHTS: usize = 16;

/// Reads the scene and tells what is in it.
pub(crate) fn run(args: &SceneArgs, console: &Console) -> Result<Exit, Failure> {
    let interrupts = Interrupts::listen();
    let pool = load::thread_pool(args)?;
    let mut loaded = load::load(args, console, &interrupts, &pool)?;
    let tables = std::mem::take(&mut loaded.tables);
    let scene = load::build(tables, args, console, &interrupts, &pool)?;
    let tables = &scene.tables;

    let mut info = Info::default();
    info.add("scene", args.scene.display().to_string());
    info.add("hash", format!("{:032x}", loaded.content_hash));
    geometry(&mut info, &scene);
    info.count("materials", tables.bsdfs.bsdfs.iter().map(bsdf_name));
    info.count("textures", tables.textures.textures.iter().map(texture_name));
    pictures(&mut info, tables);
    lights(&mut info, tables, &loaded.shape_names);
    cameras(&mut info, tables);
    sizes(&mut info, &scene);
    let defines: Vec<String> =
        loaded.parameters.iter().map(|(n, v)| format!("${n} = {v}")).collect();
    info.list("parameters", &defines);
    let files: Vec<String> = loaded.files.iter().map(|file| file.display().to_string()).collect();
    info.list("files", &files);
    info.json.insert("warnings".to_owned(), json!(loaded.warnings.len()));

    info.finish(console);
    Ok(Exit::Success)
}

/// Facts as lines of a table and as members of an object.
#[derive(Default)]
pub(super) struct Info {
    lines: Vec<String>,
    pub(super) json: serde_json::Map<String, Value>,
}

impl Info {
    pub(super) fn line(&mut self, label: &str, text: &str) {
        self.lines.push(format!("{label:<11} {text}"));
    }

    pub(super) fn add(&mut self, label: &str, text: String) {
        self.line(label, &text);
        self.json.insert(label.to_owned(), json!(text));
    }

    /// How many there are of each kind.
    fn count<'n>(&mut self, label: &str, names: impl Iterator<Item = &'n str>) {
        let mut counts = BTreeMap::<&str, u64>::new();
        for name in names {
            *counts.entry(name).or_default() += 1;
        }
        let total = units::grouped(counts.values().sum());
        let kinds: Vec<String> =
            counts.iter().map(|(name, n)| format!("{} {name}", units::grouped(*n))).collect();
        let text = match kinds.as_slice() {
            [] => total,
            [only] => only.clone(),
            _ => format!("{total}: {}", kinds.join(", ")),
        };
        self.line(label, &text);
        self.json.insert(label.to_owned(), json!(counts));
    }

    /// One line for each, under one label.
    pub(super) fn list(&mut self, label: &str, texts: &[String]) {
        for (index, text) in texts.iter().enumerate() {
            self.line(if index == 0 { label } else { "" }, text);
        }
        self.json.insert(label.to_owned(), json!(texts));
    }

    /// Shows all of it.
    pub(super) fn finish(mut self, console: &Console) {
        self.lines.iter().for_each(|line| console.result(line));
        self.json.insert("event".to_owned(), json!("result"));
        console.event(&Value::Object(self.json));
    }
}

fn geometry(info: &mut Info, scene: &Scene) {
    let shapes = &scene.tables.shapes;
    info.count("shapes", shapes.shapes.iter().map(shape_name));
    let triangles: u64 = shapes.meshes.iter().map(|mesh| mesh.triangles.len() as u64).sum();
    info.line("", &units::plural(triangles, "triangle"));
    info.json.insert("triangles".to_owned(), json!(triangles));
    let (instances, groups) = (shapes.instances.len() as u64, shapes.groups.len() as u64);
    if instances > 0 {
        let (instances, groups) =
            (units::plural(instances, "instance"), units::plural(groups, "group"));
        info.line("", &format!("{instances} of {groups}"));
    }
    info.json.insert("instances".to_owned(), json!(instances));
    let bounds = scene.accel.bounds();
    if bounds.min.cmple(bounds.max).all() {
        let [min, max] = [bounds.min, bounds.max].map(|corner| triple(corner.to_array()));
        info.line("bounds", &format!("{min} to {max}"));
        info.json
            .insert("bounds".to_owned(), json!([bounds.min.to_array(), bounds.max.to_array()]));
    }
}

fn pictures(info: &mut Info, tables: &SceneTables) {
    let sizes: Vec<String> = tables
        .textures
        .images
        .iter()
        .map(|i| {
            format!("{}x{}, {}", i.width, i.height, units::plural(i.channels as u64, "channel"))
        })
        .collect();
    info.list("pictures", &sizes);
}

fn lights(info: &mut Info, tables: &SceneTables, shape_names: &[String]) {
    let emitters = &tables.emitters.emitters;
    info.count("lights", emitters.iter().map(emitter_name));
    let shown = emitters.iter().take(LISTED_LIGHTS).map(|e| light(e, tables, shape_names));
    let shown: Vec<String> = shown.collect();
    shown.iter().for_each(|text| info.line("", text));
    if emitters.len() > LISTED_LIGHTS {
        info.line("", &format!("and {} more", emitters.len() - LISTED_LIGHTS));
    }
    info.json.insert("first_lights".to_owned(), json!(shown));
}

fn light(emitter: &Emitter, tables: &SceneTables, shape_names: &[String]) -> String {
    let rgb = |colour: Rgb| triple(colour.to_array());
    let name = emitter_name(emitter);
    match emitter {
        Emitter::Area { shape, radiance } => {
            let owner = shape_names.get(shape.0 as usize).map_or("", String::as_str);
            let mean = tables.textures.mean(&tables.shapes, *radiance);
            let area = tables.shapes.surface_area(*shape);
            format!("{name} on {owner}: radiance {}, area {}", rgb(mean), number(area))
        }
        Emitter::Point { position, intensity } => {
            format!("{name} at {}: intensity {}", triple(position.to_array()), rgb(*intensity))
        }
        Emitter::Spot { intensity, cutoff_angle, .. } => {
            let angle = cutoff_angle.to_degrees();
            format!("{name}: intensity {}, half angle {angle:.1}°", rgb(*intensity))
        }
        Emitter::Directional { direction, irradiance } => {
            let along = triple(direction.to_array());
            format!("{name} along {along}: irradiance {}", rgb(*irradiance))
        }
        Emitter::Constant { radiance } => format!("{name}: radiance {}", rgb(*radiance)),
        Emitter::Envmap { image, scale, .. } => {
            match tables.textures.images.get(image.0 as usize) {
                Some(i) => format!("{name}: {}x{} pixels, scale {scale}", i.width, i.height),
                None => format!("{name}: scale {scale}"),
            }
        }
        Emitter::SunDisc { half_angle, radiance, .. } => {
            let angle = half_angle.to_degrees();
            format!("{name}: radiance {}, half angle {angle:.3}°", rgb(*radiance))
        }
    }
}

/// Five significant digits; smaller than any scene's unit is zero.
pub(super) fn number(value: f32) -> String {
    let value = f64::from(value);
    if value.abs() < 1e-6 {
        return "0".to_owned();
    }
    let decimals = (4 - value.abs().log10().floor() as i32).clamp(0, 9) as usize;
    let text = format!("{value:.decimals$}");
    if text.contains('.') {
        text.trim_end_matches('0').trim_end_matches('.').to_owned()
    } else {
        text
    }
}

pub(super) fn triple(values: [f32; 3]) -> String {
    let [a, b, c] = values.map(number);
    format!("({a}, {b}, {c})")
}

fn cameras(info: &mut Info, tables: &SceneTables) {
    let sensors = tables.sensors.iter();
    let texts: Vec<String> =
        sensors.enumerate().map(|(index, s)| format!("{index}: {}", camera(s))).collect();
    info.list("sensors", &texts);
    if let Some(sensor) = tables.sensors.first() {
        let listed = parameters::list(&tables.integrator, sensor);
        let texts: Vec<String> = listed
            .iter()
            .filter(|(name, _)| name.starts_with("integrator."))
            .map(|(name, value)| format!("{} {value}", name.trim_start_matches("integrator.")))
            .collect();
        info.line("integrator", &texts.join(", ").replacen("type ", "", 1));
        let object: serde_json::Map<String, Value> =
            listed.into_iter().map(|(name, value)| (name, json!(value))).collect();
        info.json.insert("settings".to_owned(), Value::Object(object));
    }
    if !tables.aovs.is_empty() {
        let names: Vec<&str> = tables.aovs.iter().map(|aov| aov.name.as_str()).collect();
        info.add("layers", names.join(", "));
    }
}

fn camera(sensor: &Sensor) -> String {
    let lens = match sensor.kind {
        SensorKind::Perspective { fov_x, .. } => {
            format!("perspective, {:.2}° across", fov_x.to_degrees())
        }
        SensorKind::ThinLens { fov_x, aperture_radius, focus_distance, .. } => format!(
            "thinlens, {:.2}° across, aperture {aperture_radius}, focus at {focus_distance}",
            fov_x.to_degrees()
        ),
        SensorKind::Orthographic => "orthographic".to_owned(),
    };
    let film = &sensor.film;
    let settings = claror::integrator::IntegratorSettings::default();
    let find = |wanted: &str| {
        let listed = parameters::list(&settings, sensor);
        listed.into_iter().find(|(name, _)| name == wanted).map(|(_, v)| v).unwrap_or_default()
    };
    let name =
        if sensor.name.is_empty() { String::new() } else { format!("\"{}\", ", sensor.name) };
    let crop = film.crop;
    let crop = if (crop.width, crop.height) == (film.width, film.height) {
        String::new()
    } else {
        format!(" (crop {}x{} at {}, {})", crop.width, crop.height, crop.x, crop.y)
    };
    format!(
        "{name}{lens}; {}x{} pixels{crop}, {} filter; {}, {} spp",
        film.width,
        film.height,
        find("film.rfilter"),
        find("sampler.type"),
        sensor.sampler.sample_count
    )
}

fn sizes(info: &mut Info, scene: &Scene) {
    let tables = &scene.tables;
    let mut sizes = vec![
        ("tables", memory::table_bytes(tables)),
        ("hierarchy", scene.accel.memory_bytes() as u64),
    ];
    if let Some(sensor) = tables.sensors.first() {
        let channels = tables.aovs.iter().map(|aov| aov.kind.channels().len()).sum();
        sizes.push(("film", memory::film_bytes(sensor, channels, false)));
    }
    let texts: Vec<String> =
        sizes.iter().map(|(name, count)| format!("{name} {}", units::bytes(*count))).collect();
    info.line("memory", &texts.join(", "));
    let object: serde_json::Map<String, Value> =
        sizes.into_iter().map(|(name, count)| (name.to_owned(), json!(count))).collect();
    info.json.insert("memory_bytes".to_owned(), Value::Object(object));
}

fn shape_name(shape: &Shape) -> &'static str {
    match shape.kind {
        ShapeKind::Mesh(_) => "mesh",
        ShapeKind::Rectangle(_) => "rectangle",
        ShapeKind::Disk(_) => "disk",
        ShapeKind::Sphere(_) => "sphere",
        ShapeKind::Cylinder(_) => "cylinder",
    }
}

fn bsdf_name(bsdf: &Bsdf) -> &'static str {
    match bsdf {
        Bsdf::Diffuse { .. } => "diffuse",
        Bsdf::Conductor { .. } => "conductor",
        Bsdf::RoughConductor { .. } => "roughconductor",
        Bsdf::Dielectric { .. } => "dielectric",
        Bsdf::ThinDielectric { .. } => "thindielectric",
        Bsdf::RoughDielectric { .. } => "roughdielectric",
        Bsdf::Plastic { .. } => "plastic",
        Bsdf::RoughPlastic { .. } => "roughplastic",
        Bsdf::Principled(_) => "principled",
        Bsdf::TwoSided { .. } => "twosided",
        Bsdf::Mask { .. } => "mask",
        Bsdf::Blend { .. } => "blendbsdf",
        Bsdf::BumpMap { .. } => "bumpmap",
        Bsdf::NormalMap { .. } => "normalmap",
        Bsdf::Null => "null",
    }
}

fn texture_name(texture: &Texture) -> &'static str {
    match texture {
        Texture::Constant(_) => "constant",
        Texture::Bitmap { .. } => "bitmap",
        Texture::Checkerboard { .. } => "checkerboard",
        Texture::MeshAttribute { .. } => "mesh_attribute",
    }
}

fn emitter_name(emitter: &Emitter) -> &'static str {
    match emitter {
        Emitter::Area { .. } => "area",
        Emitter::Point { .. } => "point",
        Emitter::Spot { .. } => "spot",
        Emitter::Directional { .. } => "directional",
        Emitter::Constant { .. } => "constant",
        Emitter::Envmap { .. } => "envmap",
        Emitter::SunDisc { .. } => "sun disc",
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_are_short() {
        let cases = [(0.011_309_733, "0.01131"), (20.710_836, "20.711"), (13650.0, "13650")];
        for (value, text) in cases.into_iter().chain([(-1e-13, "0"), (3.0, "3"), (-2.5, "-2.5")]) {
            assert_eq!(number(value), text);
        }
    }
}
