//! Warnings about a model that was read successfully.

/// Sentences for the user, limited in number: a hostile file can cause a million.
#[derive(Debug, Default)]
pub(in crate::scene) struct Warnings {
    list: Vec<String>,
    more: usize,
}

impl Warnings {
    const MAX: usize = 100;

    pub(in crate::scene) fn push(&mut self, warning: String) {
        if self.list.len() < Self::MAX {
            self.list.push(warning);
        } else {
            self.more += 1;
        }
    }

    pub(in crate::scene) fn into_list(mut self) -> Vec<String> {
        if self.more > 0 {
            self.list.push(format!("and {} more warnings of this kind", self.more));
        }
        self.list
    }
}
