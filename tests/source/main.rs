//! The source itself: who imports whom, who may open a file; and the documentation.

mod docs;
mod gates;
mod layers;
mod words;
