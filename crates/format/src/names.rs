//! Unique names.

use std::collections::{HashMap, HashSet};

/// Names in use.
#[derive(Debug, Default)]
pub struct Names {
    names: HashSet<String>,
    /// The next number to try for a name; smaller ones are taken.
    next: HashMap<String, u64>,
}

impl Names {
    /// These are taken.
    pub fn taken(names: impl IntoIterator<Item = String>) -> Self {
        Self { names: names.into_iter().collect(), next: HashMap::new() }
    }

    /// Marks a name as taken.
    pub fn take(&mut self, name: &str) {
        self.names.insert(name.to_owned());
    }

    /// `wanted`, with the first number that makes it unique if it is taken.
    pub fn free(&mut self, wanted: &str) -> String {
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
