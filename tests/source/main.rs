//! The source itself: who imports whom, who may open a file; the example for Bevy; and the documentation.

mod bevy;
mod docs;
mod gates;
mod layers;
mod words;
