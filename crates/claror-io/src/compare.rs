//! How far two pictures differ.
