//! What engines are told: readable files that run `firstlight work` in the folder of a job.
//!
//! A file is a template of `cluster/` in which words in `@` are replaced. It stays simple enough to be changed by hand:
//! which samples a part has, whether it is done, and whether another round follows, is decided by the program.

use super::job::{Engine, Job};
use std::fmt::Write;

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
    /// Lines for the head of Slurm scripts, as `--partition=long`.
    pub slurm: Vec<String>,
    /// The container image for Kubernetes.
    pub image: String,
    /// The persistent volume claim for Kubernetes.
    pub claim: String,
}

/// The files with which an engine runs `job`.
pub fn files(job: &Job, options: &EngineOptions) -> Vec<JobFile> {
    let fill = |text: &str| {
        let slurm: String = options.slurm.iter().map(|option| format!("#SBATCH {option}\n")).collect();
        text.replace("@NAME@", &job.name)
            .replace("@PROGRAM@", &shell_word(&job.program))
            .replace("@FOLDER@", &shell_word(&options.folder))
            .replace("#@OPTIONS@\n", &slurm)
            .replace("@IMAGE@", &yaml_word(&options.image))
            .replace("@CLAIM@", &yaml_word(&options.claim))
            .replace("@COMMAND@", &yaml_word(&job.program))
            .replace("@SUBFOLDER@", &yaml_word(options.folder.rsplit('/').next().unwrap_or_default()))
            .replace("@PARTS@", &job.parts.to_string())
    };
    let file = |name, text: &str| JobFile { name, text: fill(text), is_script: false };
    let script = |name, text: &str| JobFile { is_script: true, ..file(name, text) };
    match job.engine {
        Engine::Slurm => vec![
            file("part.sbatch", include_str!("../../cluster/slurm/part.sbatch")),
            file("merge.sbatch", include_str!("../../cluster/slurm/merge.sbatch")),
            script("submit.sh", include_str!("../../cluster/slurm/submit.sh")),
        ],
        Engine::Kubernetes => vec![
            file("parts.yaml", include_str!("../../cluster/kubernetes/parts.yaml")),
            file("merge.yaml", include_str!("../../cluster/kubernetes/merge.yaml")),
            script("submit.sh", include_str!("../../cluster/kubernetes/submit.sh")),
        ],
        Engine::Openjd => vec![JobFile { name: "template.yaml", text: openjd(job), is_script: false }],
    }
}

/// A template of Open Job Description: its rounds are steps that depend on each other, as many as there can be at most.
/// Those that turn out not to be needed end at once.
fn openjd(job: &Job) -> String {
    let text = include_str!("../../cluster/openjd/template.yaml")
        .replace("@NAME@", &job.name)
        .replace("@COMMAND@", &yaml_word(&job.program));
    let (head, step) = text.split_once("#@STEPS@\n").expect("the template has steps");
    let mut steps = head.to_owned();
    for round in 1..=job.most_rounds() {
        // What a later round has is not known yet, but no more parts than samples.
        let after = match round {
            1 => String::new(),
            _ => format!("    dependencies:\n      - dependsOn: Merge{}\n", round - 1),
        };
        let step = step.replace("    #@AFTER@\n", &after).replace("@ROUND@", &round.to_string());
        let _ = write!(steps, "{}", step.replace("@PARTS@", &job.parts.to_string()));
    }
    steps
}

/// A word of a shell script that stands for itself.
fn shell_word(text: &str) -> String {
    let is_plain = |c: char| c.is_ascii_alphanumeric() || "/._-+=:,".contains(c);
    if !text.is_empty() && text.chars().all(is_plain) {
        return text.to_owned();
    }
    format!("'{}'", text.replace('\'', r"'\''"))
}

/// A string of YAML: JSON strings are.
fn yaml_word(text: &str) -> String {
    serde_json::Value::from(text).to_string()
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
    fn files_have_no_holes_and_quote_what_they_are_given() {
        let options = EngineOptions {
            folder: "/data/it's here".to_owned(),
            slurm: vec!["--partition=long".to_owned()],
            image: "registry/firstlight:1".to_owned(),
            claim: "shared".to_owned(),
        };
        for engine in [Engine::Slurm, Engine::Kubernetes, Engine::Openjd] {
            for file in files(&job(engine, Some(0.01)), &options) {
                let hole = file.text.split('@').nth(1).filter(|word| word.chars().all(|c| c.is_ascii_uppercase()));
                assert_eq!(hole.filter(|word| !word.is_empty()), None, "{}", file.name);
            }
        }
        let slurm = files(&job(Engine::Slurm, None), &options);
        assert!(slurm[0].text.contains("#SBATCH --partition=long\n"));
        assert!(slurm[0].text.contains("'/opt/first light/firstlight' work"), "{}", slurm[0].text);
        assert!(slurm[2].text.contains(r"'/data/it'\''s here'"), "{}", slurm[2].text);
        assert_eq!(job(Engine::Slurm, None).name, "scenes-my-room-ron");
        assert_eq!((job_name("É"), job_name("-a--b-")), ("scene".to_owned(), "a-b".to_owned()));
    }

    #[test]
    fn a_template_has_a_step_for_each_round_that_there_can_be() {
        let steps = |error| openjd(&job(Engine::Openjd, error)).matches("- name: Merge").count();
        assert_eq!(steps(None), 1);
        assert_eq!(steps(Some(0.01)), job(Engine::Openjd, Some(0.01)).most_rounds());
    }
}
