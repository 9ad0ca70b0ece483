//! Unique names.

use std::collections::{HashMap, HashSet};

/// Names in use.
#[derive(Debug, Default)]
pub(super) struct Names {
    names: HashSet<String>,
    /// The next number to try for a name; smaller ones are taken.
    next: HashMap<String, u64>,
}

impl Names {
    /// `wanted`, with the first number that makes it unique if it is taken.
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
