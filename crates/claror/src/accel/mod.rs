//! The ray kernel: bounding volume hierarchy over all shapes.
