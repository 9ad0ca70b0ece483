//! `firstlight man [FOLDER]`: prints the manual page, or writes a page per command.

use crate::cli::console::{inform, print_bytes};
use crate::cli::failure::Failure;
use clap::{Args, Command};
use clap_mangen::Man;
use firstlight::scene::whole_file::{check_own, write_whole};
use std::path::PathBuf;

#[derive(Args, Clone, Debug)]
pub struct ManArgs {
    /// Folder for firstlight.1, firstlight-render.1 and so on; created if missing [default: print the main page].
    #[arg(value_name = "FOLDER")]
    folder: Option<PathBuf>,
}

/// - `program`: all commands.
pub fn run(args: &ManArgs, program: Command) -> Result<(), Failure> {
    let mut main = program.disable_help_subcommand(true);
    main.build();
    let Some(folder) = &args.folder else {
        return print_bytes(&page(&main)?);
    };
    std::fs::create_dir_all(folder)
        .map_err(|error| Failure::Failed(format!("{}: cannot create the folder: {error}", folder.display())))?;
    let pages: Vec<&Command> = std::iter::once(&main).chain(main.get_subcommands()).collect();
    let path = |command: &Command| folder.join(format!("{}.1", name(command)));
    for command in &pages {
        check_own(&path(command), |text| text.lines().any(|line| line.starts_with(".TH firstlight")))?;
    }
    for command in &pages {
        write_whole(&path(command), &page(command)?)?;
    }
    inform(format_args!("{}: {} manual pages saved", folder.display(), pages.len()));
    Ok(())
}

/// Such as `firstlight-render` for `render`.
fn name(command: &Command) -> String {
    command.get_display_name().unwrap_or(command.get_name()).to_owned()
}

fn page(command: &Command) -> Result<Vec<u8>, Failure> {
    let mut page = Vec::new();
    Man::new(command.clone())
        .render(&mut page)
        .map_err(|error| Failure::Failed(format!("the manual page cannot be made: {error}")))?;
    Ok(page)
}
