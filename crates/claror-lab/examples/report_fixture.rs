//! Writes the report of a made-up study, to be looked at:
//! `cargo run -p claror-lab --example report_fixture -- FOLDER`.

#[path = "../tests/fixture/mod.rs"]
mod fixture;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let folder = std::env::args().nth(1).ok_or("name a folder")?;
    let folder = std::path::Path::new(&folder);
    std::fs::create_dir_all(folder)?;
    let path = claror_lab::report::write(&fixture::build(folder), folder)?;
    println!("{}", path.display());
    Ok(())
}
