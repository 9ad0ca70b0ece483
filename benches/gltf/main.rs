//! glTF files: beside reference images, and what they cost to open and to render.
//!
//! ```text
//! cargo bench -p firstlight-benches --bench gltf -- references FOLDER [OUT]
//! cargo bench -p firstlight-benches --bench gltf -- opening [FOLDER]
//! cargo bench -p firstlight-benches --bench gltf -- textures
//! ```
//!
//! - `references`: renders every file of FOLDER that has a reference (`NAME.json` beside it) and prints how far it is from it;
//!   the pictures, reference on the right, go to OUT.
//! - `opening`: writes large files to FOLDER (a temporary one if none is given) and opens them, beside the crates `gltf` and
//!   `image` alone.
//! - `textures`: rays per second of a mesh with and without textures.

mod files;
mod opening;
mod references;
mod textures;

use std::path::PathBuf;

fn main() {
    // Cargo itself adds `--bench`.
    let mut args = std::env::args().skip(1).filter(|arg| arg != "--bench");
    let command = args.next();
    let mut path = || args.next().map(PathBuf::from);
    match command.as_deref() {
        Some("references") => references::run(&path().expect("references wants a folder"), path().as_deref()),
        Some("opening") => opening::run(path().as_deref()),
        Some("textures") => textures::run(),
        _ => println!("say what to measure: references FOLDER [OUT], opening [FOLDER], or textures"),
    }
}
