//! Checkpoints of renders in progress.
