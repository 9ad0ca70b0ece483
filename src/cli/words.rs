//! Preprocessing of the command line: global options before a command, and mistyped commands.

use clap::Command;
use firstlight::printable;
use firstlight::scene::{BUILTIN_SCENES, SceneSource, suggestion};
use std::ffi::{OsStr, OsString};
use std::path::Path;
use std::sync::OnceLock;

/// The path of the program and its arguments.
static GIVEN: OnceLock<Vec<OsString>> = OnceLock::new();

/// Sets the words of this process, once.
pub fn give(words: Vec<OsString>) {
    // Those of a second call are those of another command, which a process does not run.
    let _ = GIVEN.set(words);
}

/// The path of the program and its arguments, as they were given.
pub fn given() -> &'static [OsString] {
    GIVEN.get().map_or(&[], Vec::as_slice)
}

/// The arguments, with global options before a command moved behind it: `--quiet render` becomes `render --quiet`.
pub fn typed(program: &Command) -> Vec<OsString> {
    ordered(given().to_vec(), &commands(program))
}

/// An error message if the first argument that is not an option cannot be opened and resembles a command.
pub fn mistyped_command(program: &Command) -> Option<String> {
    let words = typed(program);
    mistyped(words.get(1 + n_leading_options(&words))?, &commands(program))
}

/// An error message if a second scene or a command follows the first scene.
pub fn second_scene(program: &Command) -> Option<String> {
    let words = typed(program);
    let n = n_leading_options(&words);
    second(words.get(1 + n)?, words.get(2 + n)?, &commands(program))
}

fn commands(program: &Command) -> Vec<String> {
    program.get_subcommands().map(|command| command.get_name().to_owned()).chain(["help".to_owned()]).collect()
}

/// Number of arguments after the program name that belong to global options.
fn n_leading_options(words: &[OsString]) -> usize {
    let mut n = 0;
    while let Some(word) = words.get(1 + n).and_then(|word| word.to_str()) {
        match word {
            "-q" | "--quiet" | "-v" | "--verbose" => n += 1,
            "--simd" => n += 2,
            _ if word.starts_with("--simd=") => n += 1,
            _ => break,
        }
    }
    n
}

fn ordered(mut words: Vec<OsString>, commands: &[String]) -> Vec<OsString> {
    let n = n_leading_options(&words);
    let is_command = words.get(1 + n).is_some_and(|word| commands.iter().any(|command| OsStr::new(command) == word));
    if is_command {
        words[1..2 + n].rotate_right(1);
    }
    words
}

fn second(first: &OsStr, second: &OsStr, commands: &[String]) -> Option<String> {
    let is_command = |word: &OsStr| commands.iter().any(|command| OsStr::new(command) == word);
    let is_option = |word: &OsStr| word.to_string_lossy().starts_with('-');
    if is_command(first) || is_option(first) || is_option(second) {
        return None;
    }
    let [a, b] = [first, second].map(|word| printable::name(&word.to_string_lossy()).into_owned());
    Some(match is_command(second) {
        true => format!("the command comes first: firstlight {b} {a}"),
        false => format!(
            "a window shows one scene, and `{b}` follows `{a}`: start one window for each, or render several to a \
             folder: firstlight render {a} {b} -o FOLDER"
        ),
    })
}

fn mistyped(word: &OsStr, commands: &[String]) -> Option<String> {
    let text = word.to_string_lossy();
    let is_known = text.starts_with('-') || commands.iter().any(|command| *command == text);
    if is_known || SceneSource::parse(word).is_ok() || Path::new(word).exists() {
        return None;
    }
    let is_near = |hint: &str| hint.contains("did you mean");
    let of_scenes = suggestion(&text, BUILTIN_SCENES.iter().map(|(name, _, _)| *name));
    let of_commands = suggestion(&text, commands.iter().map(String::as_str));
    let hint = Some(of_commands).filter(|hint| is_near(hint) && !is_near(&of_scenes))?;
    Some(format!("unknown command `{}`{hint}", printable::name(&text)))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn commands() -> Vec<String> {
        ["render", "report", "info"].map(str::to_owned).to_vec()
    }

    #[test]
    fn a_word_that_is_nearly_a_command_is_taken_for_one() {
        let of = |word: &str| mistyped(OsStr::new(word), &commands());
        assert_eq!(of("rendr").as_deref(), Some("unknown command `rendr` (did you mean `render`?)"));
        assert_eq!(of("Info").as_deref(), Some("unknown command `Info` (did you mean `info`?)"));
        for other in ["render", "--rendr", "cornell", "galery", "xyzzy", "room.ron", ""] {
            assert_eq!(of(other), None, "{other}");
        }
    }

    #[test]
    fn a_second_scene_is_told() {
        let of = |a: &str, b: &str| second(OsStr::new(a), OsStr::new(b), &commands());
        let told = of("cornell", "gallery").unwrap();
        assert!(told.starts_with("a window shows one scene, and `gallery` follows `cornell`"), "{told}");
        assert_eq!(of("cornell", "render").as_deref(), Some("the command comes first: firstlight render cornell"));
        for (a, b) in [("render", "cornell"), ("cornell", "--size"), ("--size", "9x9")] {
            assert_eq!(of(a, b), None, "{a} {b}");
        }
    }

    #[test]
    fn options_of_every_command_may_stand_before_it() {
        let of = |line: &str| {
            let words = line.split(' ').map(OsString::from).collect();
            ordered(words, &commands()).join(OsStr::new(" ")).into_string().unwrap()
        };
        for (typed, meant) in [
            ("x -q --simd avx2 render a", "x render -q --simd avx2 a"),
            ("x --simd=avx2 info", "x info --simd=avx2"),
            ("x render -q a", "x render -q a"),
            ("x --quiet cornell", "x --quiet cornell"),
            ("x --size 2x2 render", "x --size 2x2 render"),
            ("x --simd", "x --simd"),
            ("x", "x"),
        ] {
            assert_eq!(of(typed), meant);
        }
    }
}
