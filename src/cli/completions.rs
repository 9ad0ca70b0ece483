//! `firstlight completions SHELL`: prints a script that completes commands, options and built-in scenes.

use crate::cli::console::print_bytes;
use crate::cli::failure::Failure;
use clap::{Args, Command};
use clap_complete::Shell;

#[derive(Args, Clone, Debug)]
pub struct CompletionsArgs {
    /// Shell that runs the script.
    #[arg(value_enum)]
    shell: Shell,
}

/// - `program`: all commands.
pub fn run(args: &CompletionsArgs, mut program: Command) -> Result<(), Failure> {
    let mut script = Vec::new();
    clap_complete::generate(args.shell, &mut program, "firstlight", &mut script);
    print_bytes(&script)
}
