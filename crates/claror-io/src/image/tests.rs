//! Round trips of every format, and hostile pictures.

use std::path::Path;

use claror::image::Image;
use proptest::prelude::*;

use super::*;
use crate::diagnostic::{ReadError, Subject};
use crate::limits::Limits;

/// Values over many magnitudes; no two channels alike.
fn gradient(width: usize, height: usize, channels: usize) -> Image {
    let mut image = Image::new(width, height, channels);
    for (i, v) in image.data.iter_mut().enumerate() {
        *v = (i as f32 * 0.37).sin().abs() * 10_f32.powi(i as i32 % 7 - 3);
    }
    image
}

fn written(write: impl FnOnce(&mut Vec<u8>) -> Result<(), WriteError>) -> Vec<u8> {
    let mut bytes = Vec::new();
    write(&mut bytes).unwrap();
    bytes
}

fn read_bytes(bytes: &[u8]) -> Result<DecodedImage, ReadError> {
    decode(bytes, Path::new("t"), None, &Limits::default())
}

fn exr(image: &Image) -> Vec<u8> {
    written(|w| write_exr(w, &[Layer::new("", image)], &[]))
}

fn png(image: &Image) -> Vec<u8> {
    written(|w| write_png(w, image, 0.0, BitDepth::Eight))
}

#[test]
fn exr_and_pfm_round_trips_are_exact() {
    for channels in 1..=4 {
        // More lines than one chunk has, and less.
        for (width, height) in [(1, 1), (5, 3), (33, 40)] {
            let image = gradient(width, height, channels);
            let decoded = read_bytes(&exr(&image)).unwrap();
            assert_eq!((decoded.image, decoded.is_srgb_encoded), (image.clone(), false));
            if channels == 1 || channels == 3 {
                let decoded = read_bytes(&written(|w| write_pfm(w, &image))).unwrap();
                assert_eq!(decoded.image, image);
            }
        }
    }
}

#[test]
fn special_values_survive_exr() {
    let data = vec![f32::NAN, f32::INFINITY, -0.0, f32::MIN_POSITIVE / 4.0, -1e38, 65505.0];
    let image = Image { width: 2, height: 1, channels: 3, data };
    let got = read_bytes(&exr(&image)).unwrap().image;
    let bits = |i: &Image| i.data.iter().map(|v| v.to_bits()).collect::<Vec<_>>();
    assert_eq!(bits(&got), bits(&image));
}

#[test]
fn exr_layers_by_name() {
    let (beauty, albedo) = (gradient(4, 4, 4), gradient(4, 4, 3));
    let (depth, uv) = (gradient(4, 4, 1), gradient(4, 4, 2));
    let layers = [
        Layer::new("", &beauty),
        Layer { format: SampleFormat::Half, ..Layer::new("albedo", &albedo) },
        Layer::with_channels("depth", &["T"], &depth),
        Layer::with_channels("uv", &["U", "V"], &uv),
        Layer::with_channels("count", &[""], &depth),
    ];
    let metadata = [
        ("claror:version".to_owned(), MetadataValue::Text("0.1 é".into())),
        ("claror:seed".to_owned(), MetadataValue::Integer(-3)),
        ("a name of more than thirty-one bytes".to_owned(), MetadataValue::Number(0.5)),
    ];
    let bytes = written(|w| write_exr(w, &layers, &metadata));
    let read = |name| decode(&bytes, Path::new("t"), Some(name), &Limits::default());
    assert_eq!(read("").unwrap().image, beauty);
    assert_eq!(read("depth").unwrap().image, depth);
    assert_eq!(read("uv").unwrap().image, uv);
    for (got, wanted) in read("albedo").unwrap().image.data.iter().zip(&albedo.data) {
        assert!((got - wanted).abs() <= wanted * 0.000_5 + 1e-7);
    }
    assert_eq!(read("uv").unwrap().layers, ["", "albedo", "depth", "uv"]);
    let error = read("normal").unwrap_err();
    assert_eq!(error.message, "the picture has no layer \"normal\"");

    let meta = exr::meta::MetaData::read_from_buffered(bytes.as_slice(), true).unwrap();
    use exr::meta::attribute::AttributeValue;
    let other = &meta.headers[0].own_attributes.other;
    let find = |name: &str| other.iter().find(|o| o.0.eq(name)).unwrap().1.clone();
    assert_eq!(find("claror:seed"), AttributeValue::I32(-3));
    assert_eq!(find("a name of more than thirty-one bytes"), AttributeValue::F64(0.5));
    let AttributeValue::Text(text) = find("claror:version") else { panic!("not a text") };
    assert_eq!(text.as_slice(), "0.1 é".as_bytes());
}

#[test]
fn equal_pictures_are_equal_files() {
    let image = gradient(9, 20, 3);
    let metadata: Vec<_> =
        (0..20).map(|i| (format!("key{i}"), MetadataValue::Integer(i))).collect();
    let write = || written(|w| write_exr(w, &[Layer::new("", &image)], &metadata));
    assert_eq!(write(), write());
}

#[test]
fn exr_writer_refuses_what_the_format_cannot_hold() {
    let (a, b) = (gradient(2, 2, 3), gradient(3, 2, 3));
    let refused = |layers: &[Layer<'_>], metadata: &[(String, MetadataValue)]| {
        write_exr(&mut Vec::new(), layers, metadata).unwrap_err().to_string()
    };
    let [plain, twice] = [Layer::new("", &a), Layer::new("", &a)];
    assert_eq!(refused(&[plain.clone(), twice], &[]), "channel \"B\" occurs twice");
    let other = [plain.clone(), Layer::new("x", &b)];
    assert_eq!(refused(&other, &[]), "layer \"x\" has another size");
    let empty = Image::new(0, 0, 3);
    let message = "OpenEXR cannot hold a picture of this size";
    assert_eq!(refused(&[Layer::new("", &empty)], &[]), message);
    assert_eq!(refused(&[], &[]), message);
    let taken = [("channels".to_owned(), MetadataValue::Integer(1))];
    assert_eq!(refused(&[plain], &taken), "the OpenEXR attribute \"channels\" is taken");
}

#[test]
fn png_stores_srgb_of_the_exposed_picture() {
    let data = vec![0.0, 0.5, 2.0, f32::NAN, -1.0, 0.214_041_14];
    let image = Image { width: 2, height: 1, channels: 3, data };
    let decoded = read_bytes(&png(&image)).unwrap();
    assert!(decoded.is_srgb_encoded);
    let bytes: Vec<f32> = decoded.image.data.iter().map(|v| v * 255.0).collect();
    assert_eq!(bytes, [0.0, 188.0, 255.0, 0.0, 0.0, 128.0]);
    let sixteen = written(|w| write_png(w, &image, -1.0, BitDepth::Sixteen));
    let got = read_bytes(&sixteen).unwrap().image.data;
    for (got, linear) in got.into_iter().zip([0.0, 0.25, 1.0, 0.0, 0.0, 0.107_020_57]) {
        assert!((srgb_to_linear(got) - linear).abs() < 2e-5, "{got}");
    }
    // Alpha is not encoded and not exposed.
    let image = Image { width: 1, height: 1, channels: 2, data: vec![0.25, 0.5] };
    let bytes = written(|w| write_png(w, &image, 1.0, BitDepth::Eight));
    assert_eq!(read_bytes(&bytes).unwrap().image.data, [188.0 / 255.0, 128.0 / 255.0]);
}

#[test]
fn hdr_keeps_the_leading_bits() {
    let image = gradient(40, 9, 3);
    let bytes = written(|w| write_hdr(w, &image));
    // Mitsuba writes the other signature.
    let other = [b"#?RGBE".as_slice(), &bytes["#?RADIANCE".len()..]].concat();
    for bytes in [bytes, other] {
        let decoded = read_bytes(&bytes).unwrap();
        assert!(!decoded.is_srgb_encoded);
        for (got, wanted) in decoded.image.data.chunks(3).zip(image.data.chunks(3)) {
            let brightest = wanted.iter().fold(0.0_f32, |a, &b| a.max(b));
            let near = |(g, w): (&f32, &f32)| (g - w).abs() <= brightest / 127.0;
            assert!(got.iter().zip(wanted).all(near), "{got:?} is not {wanted:?}");
        }
    }
}

#[test]
fn srgb_curve_is_the_exact_one_and_inverts() {
    assert_eq!((srgb_to_linear(0.0), srgb_to_linear(1.0)), (0.0, 1.0));
    assert!((srgb_to_linear(0.5) - 0.214_041_14).abs() < 1e-7);
    assert!((srgb_to_linear(0.04) - 0.04 / 12.92).abs() < 1e-9);
    for i in 0..=1000 {
        let v = i as f32 / 1000.0;
        assert!((linear_to_srgb(srgb_to_linear(v)) - v).abs() < 1e-6);
    }
}

#[test]
fn formats_by_ending() {
    assert_eq!(Format::of_path(Path::new("a/b.c.EXR")), Some(Format::Exr));
    assert_eq!(Format::of_path(Path::new("b.png")), Some(Format::Png));
    assert_eq!(Format::of_path(Path::new("exr")), None);
    assert_eq!(Format::of_path(Path::new("a.bmp")), None);
}

/// A PNG that claims 60 000 × 60 000 pixels in a few bytes.
fn png_bomb() -> Vec<u8> {
    let mut bytes = png(&gradient(1, 1, 3));
    for at in [16, 20] {
        bytes[at..at + 4].copy_from_slice(&60_000_u32.to_be_bytes());
    }
    let crc = crc32(&bytes[12..29]);
    bytes[29..33].copy_from_slice(&crc.to_be_bytes());
    bytes
}

/// The checksum of PNG chunks, bit by bit.
fn crc32(bytes: &[u8]) -> u32 {
    !bytes.iter().fold(!0_u32, |crc, &byte| {
        (0..8).fold(crc ^ u32::from(byte), |crc, _| {
            (crc >> 1) ^ (0xedb8_8320 & (crc & 1).wrapping_neg())
        })
    })
}

/// An OpenEXR file that claims a larger picture than it holds.
fn exr_bomb(width: i32, height: i32) -> Vec<u8> {
    let mut bytes = exr(&gradient(1, 1, 3));
    let name = b"dataWindow\0box2i\0\x10\0\0\0";
    let at = bytes.windows(name.len()).position(|w| w == name).unwrap() + name.len();
    bytes[at + 8..at + 12].copy_from_slice(&(width - 1).to_le_bytes());
    bytes[at + 12..at + 16].copy_from_slice(&(height - 1).to_le_bytes());
    bytes
}

#[test]
fn bad_pictures_are_refused_with_a_message() {
    let cases: [(&[u8], &str); 12] = [
        (b"", "the file is empty"),
        (b"<svg/>", "this is not a picture of a known format"),
        (b"\x89PNG", "the picture cannot be decoded: "),
        (b"\xff\xd8\xff\xe0", "the picture cannot be decoded: "),
        (b"#?RADIANCE\n", "the picture cannot be decoded: "),
        (b"\x76\x2f\x31\x01", "the OpenEXR picture cannot be decoded: "),
        (b"PF\n", "the header of the PFM picture is cut"),
        (b"PF\n-1 2\n-1\n", "\"-1\" is not a valid width of a PFM picture"),
        (b"PF\n1 2\nnan\n", "the scale of a PFM picture cannot be NaN"),
        (b"PF\n0 2\n-1\n", "the picture is empty: 0 × 2 pixels"),
        (b"Pf\n1 2\n-1\n1234567", "the file is cut: 7 of 8 bytes of pixels"),
        (b"PF\n4000000000 4000000000\n-1\n", "16000000000000000000 pixels are more than the limit"),
    ];
    for (bytes, message) in cases {
        let got = read_bytes(bytes).unwrap_err().message;
        assert!(got.starts_with(message), "\"{got}\" does not begin with \"{message}\"");
        assert!(!got.contains('\n'), "{got}");
    }
}

#[test]
fn bombs_are_refused_before_they_are_decoded() {
    let message = read_bytes(&png_bomb()).unwrap_err();
    assert_eq!(message.subject, Subject::Memory);
    assert!(message.message.starts_with("3600000000 pixels are more than the limit"), "{message}");
    let wide = Limits { max_image_pixels: u64::MAX, ..Limits::default() };
    for bytes in [png_bomb(), exr_bomb(60_000, 60_000)] {
        let error = decode(&bytes, Path::new("t"), None, &wide).unwrap_err().message;
        assert!(error.contains("that the file claims"), "{error}");
    }
    let error = read_bytes(&exr_bomb(2000, 20)).unwrap_err().message;
    assert!(!error.is_empty());
}

#[test]
fn pictures_cut_at_every_tenth_are_refused() {
    let image = gradient(50, 40, 3);
    let pictures = [
        ("exr", exr(&image)),
        ("png", png(&image)),
        ("hdr", written(|w| write_hdr(w, &image))),
        ("pfm", written(|w| write_pfm(w, &image))),
    ];
    for (name, bytes) in pictures {
        read_bytes(&bytes).unwrap();
        for tenth in 0..10 {
            let cut = &bytes[..bytes.len() * tenth / 10];
            assert!(read_bytes(cut).is_err(), "{name} cut to {tenth} tenths");
        }
    }
}

/// A picture file with some bytes replaced and its end cut.
fn mutated(bytes: Vec<u8>) -> impl Strategy<Value = Vec<u8>> {
    let length = bytes.len();
    let changes = proptest::collection::vec((0..length, any::<u8>()), 0..5);
    (changes, length / 2..=length).prop_map(move |(changes, end)| {
        let mut out = bytes.clone();
        changes.into_iter().for_each(|(at, byte)| out[at] = byte);
        out.truncate(end);
        out
    })
}

fn assert_valid(result: Result<DecodedImage, ReadError>) {
    if let Ok(DecodedImage { image, .. }) = result {
        assert!((1..=4).contains(&image.channels));
        assert_eq!(image.data.len(), image.width * image.height * image.channels);
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(200))]

    #[test]
    fn changed_exr_files_are_survived(bytes in mutated(exr(&gradient(3, 20, 3)))) {
        assert_valid(read_bytes(&bytes));
    }

    #[test]
    fn changed_png_files_are_survived(bytes in mutated(png(&gradient(3, 3, 3)))) {
        assert_valid(read_bytes(&bytes));
    }

    #[test]
    fn changed_hdr_and_pfm_files_are_survived(
        hdr in mutated(written(|w| write_hdr(w, &gradient(9, 3, 3)))),
        pfm in mutated(written(|w| write_pfm(w, &gradient(2, 2, 3)))),
    ) {
        assert_valid(read_bytes(&hdr));
        assert_valid(read_bytes(&pfm));
    }
}
