//! What engines are told: readable files that run `firstlight work` in the folder of a job.
//!
//! A file is a template of `cluster/` in which words in `@` are replaced, in one pass over the template: what a value
//! contains is never looked at again. Values are typed and quoted for the language of the file (`fill`), so a name of a
//! scene or a folder stands for itself whatever is in it. Files stay simple enough to be changed by hand:
//! which samples a part has, whether it is done, and whether another round follows, is decided by the program.

use crate::cluster::job::{Engine, Job};
use std::str::FromStr;

/// A file of a job.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct JobFile {
    /// In the folder of the job.
    pub name: &'static str,
    /// What is in it.
    pub text: String,
    /// Whether it is a program.
    pub is_script: bool,
}

/// What a person may say about how an engine runs a job.
#[derive(Clone, Debug, Default)]
pub struct EngineOptions {
    /// The folder of the job, absolute.
    pub folder: String,
    /// Lines for the head of Slurm scripts.
    pub slurm: Vec<SlurmOption>,
    /// The container image for Kubernetes.
    pub image: String,
    /// The persistent volume claim for Kubernetes.
    pub claim: String,
}

/// An option for the head of Slurm scripts, as `--partition=long`: one line of text.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct SlurmOption(String);

impl FromStr for SlurmOption {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        match text.contains(char::is_control) {
            true => Err("expected one line of text, without control characters".to_owned()),
            false => Ok(Self(text.to_owned())),
        }
    }
}

/// The language of a template, which decides how texts are quoted.
#[derive(Clone, Copy)]
enum Language {
    Shell,
    /// A string of JSON is one of YAML, too.
    Yaml,
}

/// What a word in a template stands for.
enum TemplateValue {
    Number(u64),
    /// Letters, digits and `-`, which mean the same in every language, even within a word or a string.
    Name(String),
    /// Any text: a word of a shell script, or a string of YAML, by itself.
    Text(String),
    /// Further lines of a comment.
    Directives(Vec<SlurmOption>),
}

/// A string of JSON that is the same string in YAML, which breaks lines at more characters, and allows fewer.
fn yaml_string(text: &str) -> String {
    let mut quoted = String::new();
    for c in serde_json::Value::from(text).to_string().chars() {
        match c {
            '\u{7f}'..='\u{9f}' | '\u{2028}' | '\u{2029}' | '\u{feff}' | '\u{fffe}' | '\u{ffff}' => {
                quoted += &format!("\\u{:04x}", u32::from(c));
            }
            c => quoted.push(c),
        }
    }
    quoted
}

impl TemplateValue {
    fn quoted(&self, language: Language) -> String {
        match (self, language) {
            (Self::Number(number), _) => number.to_string(),
            (Self::Name(name), _) => {
                let is_plain = |c: char| c.is_ascii_alphanumeric() || c == '-';
                assert!(name.chars().all(is_plain), "`{name}` is not a name of a job");
                name.clone()
            }
            (Self::Text(text), Language::Shell) => shell_word(text),
            (Self::Text(text), Language::Yaml) => yaml_string(text),
            (Self::Directives(options), _) => {
                let lines = options.iter().map(|SlurmOption(option)| format!("SBATCH {option}"));
                lines.collect::<Vec<_>>().join("\n#")
            }
        }
    }
}

/// A word of a shell script, or of a line for a shell, that stands for itself.
///
/// # Panics
/// If it contains a zero byte, which paths and arguments cannot.
pub fn shell_word(text: &str) -> String {
    shlex::try_quote(text).expect("a text without zero bytes").into_owned()
}

/// The text of a template with every word in `@` replaced by its value; of values, nothing is replaced.
fn fill(template: &str, language: Language, values: &[(&str, TemplateValue)]) -> String {
    let mut text = String::with_capacity(template.len());
    let mut rest = template;
    while let Some((before, after)) = rest.split_once('@') {
        text.push_str(before);
        let is_word = |word: &str| !word.is_empty() && word.chars().all(|c| c.is_ascii_uppercase());
        let Some((word, after)) = after.split_once('@').filter(|(word, _)| is_word(word)) else {
            text.push('@');
            rest = after;
            continue;
        };
        let value = values.iter().find(|(name, _)| *name == word);
        let (_, value) = value.unwrap_or_else(|| panic!("the word @{word}@ of a template has no value"));
        text.push_str(&value.quoted(language));
        rest = after;
    }
    text + rest
}

/// The files with which an engine runs `job`.
pub fn files(job: &Job, options: &EngineOptions) -> Vec<JobFile> {
    let values = [
        ("NAME", TemplateValue::Name(job.name.clone())),
        ("PROGRAM", TemplateValue::Text(job.program.clone())),
        ("FOLDER", TemplateValue::Text(options.folder.clone())),
        ("SUBFOLDER", TemplateValue::Text(options.folder.rsplit('/').next().unwrap_or_default().to_owned())),
        ("OPTIONS", TemplateValue::Directives(options.slurm.clone())),
        ("IMAGE", TemplateValue::Text(options.image.clone())),
        ("CLAIM", TemplateValue::Text(options.claim.clone())),
        ("PARTS", TemplateValue::Number(job.parts.into())),
    ];
    let script = |name, text| JobFile { name, text: fill(text, Language::Shell, &values), is_script: false };
    let program = |name, text| JobFile { is_script: true, ..script(name, text) };
    let yaml = |name, text| JobFile { name, text: fill(text, Language::Yaml, &values), is_script: false };
    match job.engine {
        Engine::Slurm => vec![
            script("part.sbatch", include_str!("../../cluster/slurm/part.sbatch")),
            script("merge.sbatch", include_str!("../../cluster/slurm/merge.sbatch")),
            program("submit.sh", include_str!("../../cluster/slurm/submit.sh")),
        ],
        Engine::Kubernetes => vec![
            yaml("parts.yaml", include_str!("../../cluster/kubernetes/parts.yaml")),
            yaml("merge.yaml", include_str!("../../cluster/kubernetes/merge.yaml")),
            program("submit.sh", include_str!("../../cluster/kubernetes/submit.sh")),
        ],
        Engine::Openjd => vec![JobFile { name: "template.yaml", text: openjd(job), is_script: false }],
    }
}

/// A template of Open Job Description: its rounds are steps that depend on each other, as many as there can be at most.
/// Those that turn out not to be needed end at once.
fn openjd(job: &Job) -> String {
    let template = include_str!("../../cluster/openjd/template.yaml");
    let (head, step) = template.split_once("#@STEPS@\n").expect("the template has steps");
    let values =
        [("NAME", TemplateValue::Name(job.name.clone())), ("PROGRAM", TemplateValue::Text(job.program.clone()))];
    let mut steps = fill(head, Language::Yaml, &values);
    for round in 1..=job.most_rounds() as u64 {
        let after = if round == 1 { "" } else { "    dependencies:\n      - dependsOn: Merge@BEFORE@\n" };
        let values = [
            ("ROUND", TemplateValue::Number(round)),
            ("BEFORE", TemplateValue::Number(round - 1)),
            // What a later round has is not known yet, but no more parts than samples.
            ("PARTS", TemplateValue::Number(job.parts.into())),
        ];
        steps += &fill(&step.replace("    #@AFTER@\n", after), Language::Yaml, &values);
    }
    steps
}

/// A name that every engine takes, made of the name of a scene: lower case letters, digits and single `-`.
pub fn job_name(scene: &str) -> String {
    /// Kubernetes adds to it.
    const LONGEST: usize = 40;
    let words = scene.to_ascii_lowercase();
    let words = words.split(|c: char| !c.is_ascii_alphanumeric()).filter(|word| !word.is_empty());
    let name = words.collect::<Vec<_>>().join("-");
    let name: String = name.chars().take(LONGEST).collect();
    let name = name.trim_matches('-');
    if name.is_empty() { "scene".to_owned() } else { name.to_owned() }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn job(engine: Engine, error: Option<f64>) -> Job {
        Job {
            format: Job::FORMAT,
            name: job_name("Scenes/My room.ron"),
            engine,
            program: "/opt/first light/firstlight".to_owned(),
            scene: "cornell".to_owned(),
            options: Vec::new(),
            parts: 8,
            spp: 16,
            error,
            max_spp: 64,
            frames: None,
        }
    }

    #[test]
    fn files_quote_what_they_are_given() {
        let options = EngineOptions {
            folder: "/data/it's here".to_owned(),
            slurm: vec!["--partition=long".parse().unwrap()],
            image: "registry/firstlight:1".to_owned(),
            claim: "shared".to_owned(),
        };
        let slurm = files(&job(Engine::Slurm, None), &options);
        assert!(slurm[0].text.contains("#SBATCH --partition=long\n"));
        assert!(slurm[0].text.contains("'/opt/first light/firstlight' work"), "{}", slurm[0].text);
        let folder = slurm[2].text.lines().find_map(|line| line.strip_prefix("cd -- ")).and_then(shlex::split);
        assert_eq!(folder, Some(vec![options.folder.clone()]), "{}", slurm[2].text);
        assert!("--partition=a\nrm -rf x".parse::<SlurmOption>().is_err());
        assert_eq!(job(Engine::Slurm, None).name, "scenes-my-room-ron");
        assert_eq!((job_name("É"), job_name("-a--b-")), ("scene".to_owned(), "a-b".to_owned()));
    }

    #[test]
    fn values_are_not_filled_again() {
        let hostile = "x'||touch y;#@SUBFOLDER@ @PARTS@ @NONE@ \"$(z)`".to_owned();
        let text = |text: &str| TemplateValue::Text(text.to_owned());
        let values = [("A", text(&hostile)), ("SUBFOLDER", text("'")), ("PARTS", TemplateValue::Number(3))];
        let words = shlex::split(&fill("@A@ @SUBFOLDER@ @PARTS@", Language::Shell, &values));
        assert_eq!(words, Some(vec![hostile.clone(), "'".to_owned(), "3".to_owned()]));
        let string: String = serde_json::from_str(&fill("@A@", Language::Yaml, &values)).unwrap();
        assert_eq!(string, hostile);
        // YAML breaks lines at the first, the third and the fourth, and allows none of them.
        let breaks = "a\u{85}\u{7f}\u{2028}\u{2029}\u{feff}é";
        assert_eq!(yaml_string(breaks), r#""a\u0085\u007f\u2028\u2029\ufeffé""#);
        assert_eq!(serde_json::from_str::<String>(&yaml_string(breaks)).unwrap(), breaks);
    }

    #[test]
    fn a_template_has_a_step_for_each_round_that_there_can_be() {
        let steps = |error| openjd(&job(Engine::Openjd, error)).matches("- name: Merge").count();
        assert_eq!(steps(None), 1);
        assert_eq!(steps(Some(0.01)), job(Engine::Openjd, Some(0.01)).most_rounds());
    }
}
