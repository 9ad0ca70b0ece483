//! Options of `render` that a job may have: those that decide how the image looks, and none that names an output. The
//! folder of a job may come from anybody, and its options become a command line.

use serde::{Deserialize, Serialize};
use std::path::{Component, Path};

/// An option of `render`, with its value.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(try_from = "String", into = "String")]
pub struct JobOption {
    name: OptionName,
    /// Without one, it is a flag.
    value: Option<String>,
}

/// Names of the options that `firstlight submit` passes on.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum OptionName {
    /// `--up`
    Up,
    /// `--camera`
    Camera,
    /// `--at`
    At,
    /// `--shutter`
    Shutter,
    /// `--variant`
    Variant,
    /// `--allow-outside`, which has no value.
    AllowOutside,
    /// `--env`: a path from the folder of the job that stays in it.
    Env,
    /// `--size`
    Size,
    /// `--scale`
    Scale,
    /// `--seed`
    Seed,
    /// `--integrator`
    Integrator,
    /// `--filter`
    Filter,
    /// `--max-depth`
    MaxDepth,
    /// `--exposure`
    Exposure,
    /// `--fps`
    Fps,
    /// `--define`
    Define,
}

/// Why a text is no option of a job.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("`{}` is no option that `firstlight submit` gives a job", crate::files::printable::name(.0))]
pub struct NoOption(String);

impl OptionName {
    const ALL: [Self; 16] = [
        Self::Up,
        Self::Camera,
        Self::At,
        Self::Shutter,
        Self::Variant,
        Self::AllowOutside,
        Self::Env,
        Self::Size,
        Self::Scale,
        Self::Seed,
        Self::Integrator,
        Self::Filter,
        Self::MaxDepth,
        Self::Exposure,
        Self::Fps,
        Self::Define,
    ];

    /// As on a command line.
    fn word(self) -> &'static str {
        match self {
            Self::Up => "--up",
            Self::Camera => "--camera",
            Self::At => "--at",
            Self::Shutter => "--shutter",
            Self::Variant => "--variant",
            Self::AllowOutside => "--allow-outside",
            Self::Env => "--env",
            Self::Size => "--size",
            Self::Scale => "--scale",
            Self::Seed => "--seed",
            Self::Integrator => "--integrator",
            Self::Filter => "--filter",
            Self::MaxDepth => "--max-depth",
            Self::Exposure => "--exposure",
            Self::Fps => "--fps",
            Self::Define => "--define",
        }
    }

    /// The option with a value.
    pub fn with(self, value: impl ToString) -> JobOption {
        JobOption { name: self, value: Some(value.to_string()) }
    }

    /// The option as a flag.
    pub fn flag(self) -> JobOption {
        JobOption { name: self, value: None }
    }
}

impl From<JobOption> for String {
    fn from(option: JobOption) -> Self {
        let word = option.name.word();
        // With `=`, a value that begins with `-` is not taken for an option.
        option.value.map_or_else(|| word.to_owned(), |value| format!("{word}={value}"))
    }
}

impl TryFrom<String> for JobOption {
    type Error = NoOption;

    fn try_from(text: String) -> Result<Self, NoOption> {
        let (word, value) = match text.split_once('=') {
            Some((word, value)) => (word, Some(value.to_owned())),
            None => (&*text, None),
        };
        let name = OptionName::ALL.into_iter().find(|name| name.word() == word);
        let is_inside = |path: &str| Path::new(path).components().all(|part| matches!(part, Component::Normal(_)));
        match (name, value) {
            (Some(OptionName::AllowOutside), Some(_)) | (None, _) => Err(NoOption(text)),
            (Some(OptionName::Env), Some(path)) if !is_inside(&path) => Err(NoOption(text)),
            (Some(name), None) if name != OptionName::AllowOutside => Err(NoOption(text)),
            (Some(name), value) => Ok(Self { name, value }),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn options_are_read_as_they_are_written_and_no_others() {
        for name in OptionName::ALL {
            let option = if name == OptionName::AllowOutside { name.flag() } else { name.with("-a=b") };
            assert_eq!(JobOption::try_from(String::from(option.clone())), Ok(option));
        }
        let refused = [
            "",
            "-",
            "--",
            "x",
            "-o",
            "--output=a.png",
            "--film=a.exr",
            "--overwrite",
            "--resume",
            "--frames=0..2",
            "--part=1/1",
            "--size",
            "--size 8x8",
            "--Size=8x8",
            "--allow-outside=",
            "--env",
            "--env=/a.hdr",
            "--env=scene/../../a.hdr",
        ];
        for text in refused {
            let said = JobOption::try_from(text.to_owned()).unwrap_err().to_string();
            assert!(said.contains(&format!("`{text}`")), "{said}");
        }
    }
}
