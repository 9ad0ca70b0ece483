//! `firstlight completions SHELL`: prints a script that completes commands, options and built-in scenes.

use super::CommandLine;
use super::console::print_bytes;
use super::failure::Failure;
use clap::{Args, CommandFactory};
use clap_complete::Shell;

#[derive(Args, Clone, Debug)]
pub struct CompletionsArgs {
    /// Shell that runs the script.
    #[arg(value_enum)]
    shell: Shell,
}

pub fn run(args: &CompletionsArgs) -> Result<(), Failure> {
    let mut script = Vec::new();
    clap_complete::generate(args.shell, &mut CommandLine::command(), "firstlight", &mut script);
    print_bytes(&script)
}
