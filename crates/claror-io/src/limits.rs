//! Bounds on what a file may make the program allocate.

/// Bounds that every reader respects before it allocates.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Limits {
    /// Largest scene description, all includes together, bytes.
    pub max_scene_bytes: u64,
    /// Deepest nesting of XML elements.
    pub max_xml_depth: u32,
    /// Deepest nesting of includes.
    pub max_include_depth: u32,
    /// Largest mesh, picture or checkpoint file, bytes.
    pub max_data_file_bytes: u64,
    /// Largest decoded picture, pixels.
    pub max_image_pixels: u64,
    /// Largest film, pixels.
    pub max_film_pixels: u64,
    /// Largest mesh, vertices or triangles.
    pub max_mesh_elements: u64,
}

impl Default for Limits {
    fn default() -> Self {
        Self {
            max_scene_bytes: 256 << 20,
            max_xml_depth: 64,
            max_include_depth: 15,
            max_data_file_bytes: 64 << 30,
            max_image_pixels: 1 << 28,
            max_film_pixels: 1 << 27,
            max_mesh_elements: 1 << 30,
        }
    }
}
