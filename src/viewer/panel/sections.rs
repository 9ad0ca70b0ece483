//! The titles of the sections.

/// The sections of the panel, from the top; the list of keys mentions each.
pub const SECTIONS: [&str; 16] = [
    "Render",
    "Animation",
    "Camera",
    "Views",
    "Lens",
    "Display",
    "Add",
    "Selected",
    "Mesh",
    "Objects",
    "Materials",
    "Lights",
    "Environment",
    "Open",
    "Statistics",
    "Messages",
];
