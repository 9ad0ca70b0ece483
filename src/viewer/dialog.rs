//! File dialogs of the desktop.
//!
//! A dialog is a separate program, zenity or kdialog, whichever is installed: toolkits and message buses would be more
//! code than the whole window. Where there is neither, [`browser`](crate::viewer::browser) is shown inside the window. A
//! thread waits for the program, so that rendering continues.

use crate::format::model_format::ModelFormat;
use crate::format::scene_format::SceneFormat;
use crate::frame::{Command, Edit, Id, NewThing, Waker};
use crate::scene::{MeshSource, TextureSource};
use std::ffi::OsString;
use std::path::{Path, PathBuf};
use std::process::{Command as Program, Stdio};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{Receiver, Sender, channel};

/// The purpose of the chosen file.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum DialogPurpose {
    Open,
    /// At a place of the image, fractions; `None`: in the middle.
    AddMesh {
        at: Option<[f64; 2]>,
    },
    /// The file that the scene is saved to.
    SaveScene,
    /// The file of an image that is to be rendered.
    SaveImage,
    /// The folder of the frames of an animation.
    SaveFrames,
    /// As the light from all around.
    Environment,
    /// As the texture of this material's colour.
    Texture {
        id: Id,
    },
}

impl DialogPurpose {
    pub fn title(self) -> &'static str {
        match self {
            Self::Open => "Open a scene, a model or an image",
            Self::AddMesh { .. } => "Add a model",
            Self::SaveScene => "Save the scene as",
            Self::SaveImage => "Save the image as",
            Self::SaveFrames => "The folder of the frames",
            Self::Environment => "Choose an environment image",
            Self::Texture { .. } => "Choose a texture image",
        }
    }

    /// The kinds of files, the first one chosen at first: in words, and their extensions.
    pub fn kinds(self) -> Vec<(&'static str, Vec<String>)> {
        let kind = |name, patterns: &str| {
            (name, patterns.split(' ').map(|pattern| pattern.trim_start_matches("*.").to_owned()).collect())
        };
        match self {
            Self::Open => vec![
                kind("All that opens", &self.patterns()),
                kind("Scenes", &SceneFormat::patterns()),
                kind("Models", &ModelFormat::patterns()),
                kind("Images", "*.png *.exr *.hdr"),
            ],
            Self::AddMesh { .. } => vec![kind("Models", &self.patterns())],
            Self::SaveScene => vec![kind("Scene files", &self.patterns())],
            Self::SaveFrames => vec![kind("Folders", &self.patterns())],
            Self::SaveImage | Self::Environment | Self::Texture { .. } => vec![kind("Images", &self.patterns())],
        }
    }

    /// File name patterns in shell syntax.
    fn patterns(self) -> String {
        match self {
            Self::Open => format!("{} {} *.png *.exr *.hdr", SceneFormat::patterns(), ModelFormat::patterns()),
            Self::AddMesh { .. } => ModelFormat::patterns(),
            Self::SaveScene => "*.ron".to_owned(),
            Self::SaveImage | Self::SaveFrames => "*.png *.jpg *.jpeg *.exr".to_owned(),
            Self::Environment | Self::Texture { .. } => "*.png *.jpg *.jpeg *.hdr *.exr".to_owned(),
        }
    }

    /// Whether the file becomes a part of the open scene.
    pub fn adds(self) -> bool {
        !self.saves() && self != Self::Open
    }

    /// Whether something is to be written there.
    pub fn saves(self) -> bool {
        matches!(self, Self::SaveScene | Self::SaveImage | Self::SaveFrames)
    }

    /// The command for the chosen file; `None` if an image or frames are to be written there.
    pub fn command(self, path: PathBuf) -> Option<Command> {
        Some(match self {
            Self::SaveImage | Self::SaveFrames => return None,
            // An open scene is lit by such an image; it is no scene itself.
            Self::Open if path.extension().is_some_and(|extension| extension.eq_ignore_ascii_case("hdr")) => {
                return Self::Environment.command(path);
            }
            Self::Open => Command::Open { path },
            Self::SaveScene if path.extension().is_some_and(|extension| extension == "ron") => {
                Command::SaveScene { path }
            }
            Self::SaveScene => {
                let mut name = path.into_os_string();
                name.push(".ron");
                Command::SaveScene { path: name.into() }
            }
            Self::Environment => Command::Edit(Edit::LightFrom { file: crate::scene::path_to_text(&path) }),
            Self::AddMesh { at } => {
                let thing = NewThing::Mesh(MeshSource::of_file(crate::scene::path_to_text(&path)));
                Command::Edit(match at {
                    Some([x, y]) => Edit::AddAt { thing, x, y },
                    None => Edit::Add(thing),
                })
            }
            Self::Texture { id } => {
                let part = TextureSource::image(crate::scene::path_to_text(&path));
                Command::Edit(Edit::Paint { id, part })
            }
        })
    }
}

type DialogAnswer = Result<(DialogPurpose, PathBuf), String>;

pub struct Dialog {
    waker: Waker,
    /// Whether a dialog is open; there is at most one.
    open: Arc<AtomicBool>,
    sender: Sender<DialogAnswer>,
    receiver: Receiver<DialogAnswer>,
    /// The folders of what was opened and of what was added to a scene last.
    chosen_from: [Option<PathBuf>; 2],
}

impl Dialog {
    /// Creates the dialogs; `waker` is called when there is an answer.
    pub fn new(waker: Waker) -> Self {
        let (sender, receiver) = channel();
        Self { waker, open: Arc::default(), sender, receiver, chosen_from: [None, None] }
    }

    /// A file was chosen: the next one of its kind probably lies beside it.
    pub fn remember(&mut self, purpose: DialogPurpose, path: &Path) {
        if !purpose.saves() {
            self.chosen_from[usize::from(purpose.adds())] = path.parent().map(Path::to_path_buf);
        }
    }

    /// The folder of what was opened, or added to a scene, last.
    pub fn chosen_from(&self, purpose: DialogPurpose) -> Option<PathBuf> {
        self.chosen_from[usize::from(purpose.adds())].clone().filter(|_| !purpose.saves())
    }

    /// Shows a dialog that starts in `folder`; returns false if this system has none.
    ///
    /// # Errors
    /// If it cannot be started; the message is for users.
    pub fn ask(&self, purpose: DialogPurpose, folder: &Path) -> Result<bool, String> {
        let path = std::env::var_os("PATH").unwrap_or_default();
        let Some(found) = find(&path) else { return Ok(false) };
        if self.open.swap(true, Ordering::AcqRel) {
            return Ok(true);
        }
        let arguments = arguments(found.1, purpose, folder);
        let (sender, waker, open) = (self.sender.clone(), self.waker.clone(), self.open.clone());
        let work = move || {
            let answer = run(&found.0, &arguments);
            open.store(false, Ordering::Release);
            // If the window is gone, the answer is not needed.
            if let Some(answer) = answer.transpose() {
                let _ = sender.send(answer.map(|path| (purpose, path)));
            }
            waker();
        };
        let spawned = std::thread::Builder::new().name("dialog".to_owned()).spawn(work);
        spawned.map(|_| true).map_err(|error| {
            self.open.store(false, Ordering::Release);
            format!("cannot show a dialog: {error}")
        })
    }

    /// The answers since the last call.
    pub fn answers(&self) -> Vec<DialogAnswer> {
        self.receiver.try_iter().collect()
    }
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum DialogKind {
    Zenity,
    Kdialog,
}

/// Returns the first dialog program in the folders of `path`.
fn find(path: &std::ffi::OsStr) -> Option<(PathBuf, DialogKind)> {
    [("zenity", DialogKind::Zenity), ("kdialog", DialogKind::Kdialog)].into_iter().find_map(|(name, kind)| {
        let file = std::env::split_paths(path).map(|folder| folder.join(name)).find(|file| file.is_file())?;
        Some((file, kind))
    })
}

fn arguments(kind: DialogKind, purpose: DialogPurpose, folder: &Path) -> Vec<OsString> {
    // Ends in a separator, because otherwise the folder itself would be preselected.
    let folder = std::path::absolute(folder).unwrap_or_else(|_| folder.to_path_buf()).join("");
    match kind {
        DialogKind::Zenity => {
            let mut start = OsString::from("--filename=");
            start.push(folder);
            let title = format!("--title={}", purpose.title());
            let filter = format!("--file-filter={0} | {0}", purpose.patterns());
            vec!["--file-selection".into(), title.into(), start, filter.into(), "--file-filter=* | *".into()]
        }
        DialogKind::Kdialog => {
            let title = ["--title".into(), purpose.title().into()];
            let rest = ["--getopenfilename".into(), folder.into(), purpose.patterns().into()];
            title.into_iter().chain(rest).collect()
        }
    }
}

/// Runs a dialog; returns the chosen file, `None` if it was cancelled.
fn run(program: &Path, arguments: &[OsString]) -> Result<Option<PathBuf>, String> {
    let output = Program::new(program).args(arguments).stdin(Stdio::null()).stderr(Stdio::null()).output();
    let output = output.map_err(|error| format!("{}: {error}", program.display()))?;
    // One line; a name may end in blanks.
    let text = String::from_utf8_lossy(&output.stdout);
    let line = text.lines().next().unwrap_or_default();
    Ok((output.status.success() && !line.is_empty()).then(|| PathBuf::from(line)))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn dialogs_are_asked_in_their_own_words() {
        let folder = Path::new("/home/somebody");
        let words = |kind, purpose| {
            arguments(kind, purpose, folder).into_iter().map(|word| word.into_string().unwrap()).collect::<Vec<_>>()
        };
        let zenity = words(DialogKind::Zenity, DialogPurpose::Open);
        assert!(zenity.contains(&"--file-selection".to_owned()), "{zenity:?}");
        assert!(zenity.contains(&"--filename=/home/somebody/".to_owned()), "{zenity:?}");
        assert!(zenity.iter().any(|word| word.contains("*.ron")), "{zenity:?}");
        assert_eq!(
            words(DialogKind::Kdialog, DialogPurpose::AddMesh { at: None }),
            ["--title", "Add a model", "--getopenfilename", "/home/somebody/", "*.obj *.ply *.stl *.glb *.gltf *.vrm"]
        );
    }

    #[test]
    fn a_scene_is_saved_under_the_name_that_was_typed() {
        for (typed, file) in
            [("/a/room.ron", "/a/room.ron"), ("/a/room", "/a/room.ron"), ("/a/room.v2", "/a/room.v2.ron")]
        {
            let command = DialogPurpose::SaveScene.command(typed.into());
            assert_eq!(command, Some(Command::SaveScene { path: file.into() }));
        }
        assert_eq!(DialogPurpose::SaveScene.kinds(), [("Scene files", vec!["ron".to_owned()])]);
    }

    #[cfg(unix)]
    #[test]
    fn a_choice_comes_back_and_a_cancelled_one_does_not() {
        use std::os::unix::fs::PermissionsExt as _;
        let folder = tempfile::tempdir().unwrap();
        let program = folder.path().join("kdialog");
        let write = |text: &str| {
            std::fs::write(&program, text).unwrap();
            std::fs::set_permissions(&program, std::fs::Permissions::from_mode(0o755)).unwrap();
        };
        write("#!/bin/sh\necho '/tmp/my model.obj'\n");
        assert_eq!(find(folder.path().as_os_str()), Some((program.clone(), DialogKind::Kdialog)));
        assert_eq!(run(&program, &[]), Ok(Some("/tmp/my model.obj".into())));
        write("#!/bin/sh\nexit 1\n");
        assert_eq!(run(&program, &[]), Ok(None));
        assert!(find(std::ffi::OsStr::new("/nowhere")).is_none());
        assert!(run(Path::new("/nowhere/zenity"), &[]).is_err());
    }
}
