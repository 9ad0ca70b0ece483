//! Names that are used once.

use std::collections::{HashMap, HashSet};

/// Names in use.
#[derive(Debug, Default)]
pub(super) struct Names {
    names: HashSet<String>,
    /// The number that is tried next for a name; smaller ones are taken.
    next: HashMap<String, u64>,
}

impl Names {
    /// `wanted`, or with the first number that makes it new.
    pub(super) fn free(&mut self, wanted: &str) -> String {
        if self.names.insert(wanted.to_owned()) {
            return wanted.to_owned();
        }
        let next = self.next.entry(wanted.to_owned()).or_insert(2);
        loop {
            let name = format!("{wanted} {next}");
            *next += 1;
            if self.names.insert(name.clone()) {
                return name;
            }
        }
    }
}
