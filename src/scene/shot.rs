//! What a picture says about itself, so that it can be opened again.

/// The name of the note in a picture: of the text chunk in a PNG, of the attribute in an EXR.
pub const NOTE_KEY: &str = "firstlight";
