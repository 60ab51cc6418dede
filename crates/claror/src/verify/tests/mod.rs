//! Statistics by themselves, and checks of pictures whose error is known.

mod pictures;
mod statistics;
