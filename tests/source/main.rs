//! The source itself: who imports whom, and who may open a file.

mod gates;
mod layers;
