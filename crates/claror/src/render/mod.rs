//! Tile schedule, progress, cancellation, checkpoint state, statistics.
