//! One image on many machines: which part of it is whose, what a set of films has, and what engines that run commands are
//! told.
//!
//! A part is a range of samples, a rectangle of tiles or a range of frames. Films of parts add up exactly, in any order, so
//! nothing here talks to another machine: an engine runs `firstlight render --part I/N` as often as it takes, and
//! `firstlight merge` adds up what is there. No scheduler of its own.
//!
//! Start reading at [`part`].

pub mod coverage;
pub mod engine;
pub mod job;
pub mod job_option;
mod names;
pub mod pack;
pub mod part;
pub mod unpack;
