//! A graphics driver that loses a window's surface or the whole device when a test says so.

use super::until;
use serde_json::json;
use std::path::{Path, PathBuf};
use std::process::Command;

/// The driver's answer from then on, as the Vulkan specification numbers it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Loss {
    /// The images no longer fit the window.
    OutOfDate = -1000001004,
    Surface = -1000000000,
    Device = -4,
}

/// Tells the layer in `loss_layer.rs`, which lies between the program and its driver.
pub struct Losing {
    folder: PathBuf,
}

impl Losing {
    /// Compiles the layer into this folder.
    pub fn new(folder: &Path) -> Self {
        let source = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/desktop/loss_layer.rs");
        let library = folder.join("libloss_layer.so");
        let compiler = std::env::var_os("RUSTC").unwrap_or("rustc".into());
        let output = Command::new(compiler)
            .args(["--edition", "2024", "--crate-type", "cdylib", "-C", "panic=abort", "-o"])
            .args([&library, &source])
            .output()
            .expect("the compiler that has compiled this");
        assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
        let manifest = json!({
            "file_format_version": "1.1.2",
            "layer": {
                "name": "VK_LAYER_FIRSTLIGHT_loss",
                "type": "GLOBAL",
                "library_path": library,
                "api_version": "1.3.0",
                "implementation_version": "1",
                "description": "loses surfaces and devices",
            },
        });
        std::fs::write(folder.join("loss.json"), manifest.to_string()).expect("a manifest");
        Self { folder: folder.to_owned() }
    }

    /// What a program needs in its environment to meet such a driver.
    pub fn environment(&self) -> [(&str, String); 3] {
        [
            ("VK_LAYER_PATH", self.folder.display().to_string()),
            ("VK_INSTANCE_LAYERS", "VK_LAYER_FIRSTLIGHT_loss".to_owned()),
            ("FIRSTLIGHT_LOSE", self.order().display().to_string()),
        ]
    }

    /// Loses it with the next image of the window that the program asks for.
    pub fn lose_next(&self, loss: Loss) {
        let new = self.folder.join("lose.new");
        std::fs::write(&new, (loss as i64).to_string()).expect("an order");
        std::fs::rename(&new, self.order()).expect("an order");
    }

    /// Waits until the program has been told.
    pub fn has_lost(&self) {
        until("the loss to happen", || (!self.order().exists()).then_some(()));
    }

    fn order(&self) -> PathBuf {
        self.folder.join("lose")
    }
}
