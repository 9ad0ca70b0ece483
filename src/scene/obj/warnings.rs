/// Sentences for the user, no more than anyone would read: a hostile file can cause a million.
#[derive(Debug, Default)]
pub(super) struct Warnings {
    list: Vec<String>,
    more: usize,
}

impl Warnings {
    const MAX: usize = 100;

    pub(super) fn push(&mut self, warning: String) {
        if self.list.len() < Self::MAX {
            self.list.push(warning);
        } else {
            self.more += 1;
        }
    }

    pub(super) fn into_list(mut self) -> Vec<String> {
        if self.more > 0 {
            self.list.push(format!("and {} more warnings of this kind", self.more));
        }
        self.list
    }
}
