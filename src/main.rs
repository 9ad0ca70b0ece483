//! The program: see `cli`.

fn main() -> std::process::ExitCode {
    firstlight::cli::main()
}
