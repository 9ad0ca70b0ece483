//! Object definitions and their instances.

use crate::model::foreign::MAX_OBJECTS;
use crate::model::foreign::cut;
use crate::pbrt::build::{Builder, FIRST_COUNTS, TooMany};
use firstlight_files::printable;
use glam::DAffine3;

impl Builder<'_> {
    pub(crate) fn begin_object(&mut self, name: &str) -> Result<(), &'static str> {
        if self.open.is_some() {
            return Err("an object definition inside of another one");
        }
        self.open = Some((cut(name).to_owned(), Vec::new()));
        self.strands.part();
        Ok(())
    }

    pub(crate) fn end_object(&mut self) -> Result<(), &'static str> {
        let (name, items) = self.open.take().ok_or("there is no object definition to end")?;
        if self.is_first("object", &name, FIRST_COUNTS) {
            self.definitions.insert(name, items);
        }
        self.strands.part();
        Ok(())
    }

    /// Whether an object definition is not ended.
    pub(crate) fn is_in_object(&self) -> bool {
        self.open.is_some()
    }

    /// An instance of an object definition, which may follow.
    pub(crate) fn instance(&mut self, name: &str, ctm: &DAffine3) -> Result<(), TooMany> {
        if self.open.is_some() {
            self.tell(format!("an instance of `{}` inside of an object definition is ignored", printable::name(name)));
            return Ok(());
        }
        match self.placed(cut(name), ctm) {
            Some(all) => all,
            None if self.early.len() == MAX_OBJECTS => Err(TooMany),
            None => {
                self.early.push((cut(name).to_owned(), *ctm));
                Ok(())
            }
        }
    }

    /// Adds the instances whose object is defined after them.
    pub(crate) fn finish_instances(&mut self) -> Result<(), TooMany> {
        for (name, ctm) in std::mem::take(&mut self.early) {
            match self.placed(&name, &ctm) {
                Some(all) => all?,
                None => self.tell(format!("there is no object `{}` to make an instance of", printable::name(&name))),
            }
        }
        Ok(())
    }

    /// Adds what an object consists of; `None` if it is not defined.
    fn placed(&mut self, name: &str, ctm: &DAffine3) -> Option<Result<(), TooMany>> {
        let (name, items) = self.definitions.remove_entry(name)?;
        let all = items.iter().try_for_each(|item| self.place(item, &(*ctm * item.local)));
        self.definitions.insert(name, items);
        Some(all)
    }
}
