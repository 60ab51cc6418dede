//! Records of an irradiance cache for other programs: as a point cloud, or as a table.

use std::io::{self, Write};

use claror::irradiance::Record;

use crate::image::linear_to_srgb;

/// Names of the numbers of a record, in the order of [`floats`].
const FLOATS: [&str; 35] = [
    "x",
    "y",
    "z",
    "nx",
    "ny",
    "nz",
    "irradiance_red",
    "irradiance_green",
    "irradiance_blue",
    "translational_red_x",
    "translational_red_y",
    "translational_red_z",
    "translational_green_x",
    "translational_green_y",
    "translational_green_z",
    "translational_blue_x",
    "translational_blue_y",
    "translational_blue_z",
    "rotational_red_x",
    "rotational_red_y",
    "rotational_red_z",
    "rotational_green_x",
    "rotational_green_y",
    "rotational_green_z",
    "rotational_blue_x",
    "rotational_blue_y",
    "rotational_blue_z",
    "axis_x",
    "axis_y",
    "axis_z",
    "radius_along_axis",
    "radius_across_axis",
    "natural_radius",
    "harmonic_mean_distance",
    "max_angle",
];

fn floats(record: &Record) -> [f32; FLOATS.len()] {
    let mut out = [0.0; FLOATS.len()];
    let gradients = record.translational.iter().chain(&record.rotational);
    let numbers = [record.position.to_array(), record.normal.to_array()]
        .into_iter()
        .chain([record.irradiance.to_array()])
        .chain(gradients.map(|v| v.to_array()))
        .chain([record.axis.to_array()])
        .flatten()
        .chain(record.radii)
        .chain([record.natural_radius, record.harmonic_mean_distance, record.max_angle]);
    out.iter_mut().zip(numbers).for_each(|(out, number)| *out = number);
    out
}

/// Share of the records that the brightest colour of a point cloud is as bright as.
const WHITE: f64 = 0.99;

/// Writes records as vertices of a binary PLY file: all numbers as `float`, the flags as `uint`,
/// and irradiance once more as a colour (`red`, `green`, `blue`) for viewers, sRGB-encoded, scaled
/// so that all but the brightest hundredth of the records keep their hue.
pub fn write_ply(w: &mut impl Write, records: &[Record]) -> io::Result<()> {
    writeln!(w, "ply\nformat binary_little_endian 1.0")?;
    writeln!(w, "comment records of an irradiance cache of claror")?;
    writeln!(w, "element vertex {}", records.len())?;
    FLOATS.iter().try_for_each(|name| writeln!(w, "property float {name}"))?;
    writeln!(w, "property uint flags")?;
    ["red", "green", "blue"].iter().try_for_each(|name| writeln!(w, "property uchar {name}"))?;
    writeln!(w, "end_header")?;
    let white = white(records);
    for record in records {
        floats(record).iter().try_for_each(|number| w.write_all(&number.to_le_bytes()))?;
        w.write_all(&record.flags.to_le_bytes())?;
        let byte = |e: f32| (255.0 * linear_to_srgb((e / white).clamp(0.0, 1.0))).round() as u8;
        w.write_all(&record.irradiance.to_array().map(byte))?;
    }
    Ok(())
}

fn white(records: &[Record]) -> f32 {
    let mut largest: Vec<f32> = records.iter().map(|r| r.irradiance.max_component()).collect();
    largest.sort_unstable_by(f32::total_cmp);
    let at = (WHITE * largest.len().saturating_sub(1) as f64).round() as usize;
    largest.get(at).copied().filter(|&e| e > 0.0).unwrap_or(1.0)
}

/// Writes records as lines of numbers separated by commas, below a line of names; `inf` where a
/// record sees nothing. Numbers read back to the same bits.
pub fn write_csv(w: &mut impl Write, records: &[Record]) -> io::Result<()> {
    writeln!(w, "key,{},flags", FLOATS.join(","))?;
    for record in records {
        write!(w, "{}", record.key)?;
        floats(record).iter().try_for_each(|number| write!(w, ",{number}"))?;
        writeln!(w, ",{}", record.flags)?;
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use claror::math::Vec3;
    use claror::spectrum::Rgb;

    use super::*;

    fn records() -> Vec<Record> {
        let record = Record {
            key: u64::MAX,
            position: Vec3::new(0.1, -2.5, 3e-7),
            normal: Vec3::Z,
            axis: Vec3::Y,
            irradiance: Rgb::new(0.0, 0.25, 1.0),
            translational: [Vec3::new(11.0, 12.0, 13.0), Vec3::splat(2.0), Vec3::splat(3.0)],
            rotational: [Vec3::splat(4.0), Vec3::splat(5.0), Vec3::new(61.0, 62.0, 63.0)],
            radii: [0.5, 0.75],
            max_angle: 1.25,
            harmonic_mean_distance: f32::INFINITY,
            natural_radius: 0.375,
            corral: 0,
            corral_distance: f32::INFINITY,
            flags: Record::RAISED | Record::CREVICE,
        };
        vec![record, Record { position: Vec3::X, flags: 0, ..record }]
    }

    #[test]
    fn a_table_holds_every_number() {
        let mut bytes = Vec::new();
        write_csv(&mut bytes, &records()).unwrap();
        let text = String::from_utf8(bytes).unwrap();
        let lines: Vec<Vec<&str>> = text.lines().map(|line| line.split(',').collect()).collect();
        assert_eq!(lines.len(), 3);
        let value = |name: &str| {
            let column = lines[0].iter().position(|n| *n == name).unwrap();
            lines[1][column].to_owned()
        };
        for (name, expected) in [
            ("key", "18446744073709551615"),
            ("y", "-2.5"),
            ("z", "0.0000003"),
            ("nz", "1"),
            ("irradiance_green", "0.25"),
            ("translational_red_z", "13"),
            ("rotational_blue_x", "61"),
            ("axis_y", "1"),
            ("radius_across_axis", "0.75"),
            ("natural_radius", "0.375"),
            ("harmonic_mean_distance", "inf"),
            ("max_angle", "1.25"),
            ("flags", "17"),
        ] {
            assert_eq!(value(name), expected, "{name}");
        }
        let z: f32 = value("z").parse().unwrap();
        assert_eq!(z.to_bits(), 3e-7_f32.to_bits());
    }

    #[test]
    fn a_point_cloud_is_a_ply_file() {
        let mut bytes = Vec::new();
        write_ply(&mut bytes, &records()).unwrap();
        let end = b"end_header\n";
        let at = bytes.windows(end.len()).position(|w| w == end).unwrap() + end.len();
        let body = &bytes[at..];
        let stride = 4 * FLOATS.len() + 4 + 3;
        assert_eq!(body.len(), 2 * stride);
        let float = |name: &str| {
            let column = FLOATS.iter().position(|n| *n == name).unwrap();
            f32::from_le_bytes(body[4 * column..4 * column + 4].try_into().unwrap())
        };
        assert_eq!(float("y"), -2.5);
        assert_eq!(float("irradiance_blue"), 1.0);
        assert_eq!(float("max_angle"), 1.25);
        assert_eq!(body[stride - 7], 17);
        assert_eq!(body[stride - 3..stride], [0, 137, 255], "sRGB of 0, 1/4 and 1");
    }

    #[test]
    fn no_records_are_files_too() {
        let (mut ply, mut csv) = (Vec::new(), Vec::new());
        write_ply(&mut ply, &[]).unwrap();
        write_csv(&mut csv, &[]).unwrap();
        assert!(ply.ends_with(b"end_header\n") && csv.ends_with(b"flags\n"));
    }
}
