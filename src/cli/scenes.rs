//! `firstlight scenes`: lists the built-in scenes.

use crate::cli::console::print;
use crate::cli::failure::Failure;
use clap::Args;
use firstlight::scene::BUILTIN_SCENES;

#[derive(Args, Clone, Copy, Debug)]
pub struct ScenesCommand {
    /// Print the result as one line of JSON.
    #[arg(long)]
    json: bool,
}

pub fn run(args: &ScenesCommand) -> Result<(), Failure> {
    if args.json {
        let list = BUILTIN_SCENES.iter().map(|(name, about, _)| serde_json::json!({ "name": name, "about": about }));
        return print(serde_json::Value::Array(list.collect()));
    }
    print(rows().collect::<Vec<_>>())
}

/// One line per scene: its name and what it shows.
pub fn rows() -> impl Iterator<Item = String> {
    let width = BUILTIN_SCENES.iter().map(|(name, _, _)| name.len()).max().unwrap_or(0);
    BUILTIN_SCENES.iter().map(move |(name, about, _)| format!("{name:width$}  {about}"))
}
