//! The command line of claror.

fn main() {}
