//! Parameters of a scene: `<default>` and `-D NAME=VALUE`, and the attributes in which `$name` takes their value.

use firstlight_files::printable;
use std::collections::HashMap;

/// Bytes of a name: as many beginnings of what follows a `$` are looked up.
const MAX_NAME: usize = 256;
/// Uses of parameters in all attributes: a value may be empty.
const MAX_USES: usize = 1 << 20;
/// Bytes of all values where they are used.
const MAX_SUBSTITUTED: usize = 16 << 20;

/// Numbers and names from the command line that take the place of `$name`.
pub(crate) type Defines = [(String, String)];

/// The parameters that are known so far.
pub(crate) struct Parameters {
    by_name: HashMap<String, Parameter>,
    n_uses: usize,
    substituted: usize,
}

struct Parameter {
    value: String,
    is_used: bool,
}

impl Parameters {
    /// Those of the command line, which defaults do not change. Of two with one name the last is meant.
    pub(crate) fn of(defines: &Defines) -> Self {
        let parameter = |value: &String| Parameter { value: value.clone(), is_used: false };
        let by_name = defines.iter().map(|(name, value)| (name.clone(), parameter(value))).collect();
        Self { by_name, n_uses: 0, substituted: 0 }
    }

    /// Whether a `$name` has had this value.
    pub(crate) fn is_used(&self, name: &str) -> bool {
        self.by_name.get(name).is_some_and(|it| it.is_used)
    }

    /// Gives a parameter a value if it has none.
    ///
    /// # Errors
    /// Why there is no parameter of this name.
    pub(crate) fn add_default(&mut self, name: String, value: String) -> Result<(), String> {
        if name.is_empty() {
            return Err("`name` of a `<default>` is empty".to_owned());
        }
        if name.len() > MAX_NAME || name.contains('$') {
            let name = printable::name(&name);
            return Err(format!("the name of a parameter has at most {MAX_NAME} bytes and no `$`, not `{name}`"));
        }
        self.by_name.entry(name).or_insert(Parameter { value, is_used: false });
        Ok(())
    }

    /// Replaces `$name` by its value; `\$` is a dollar. The longest name that fits is meant, as in Mitsuba.
    ///
    /// # Errors
    /// If there is no such parameter, or the limits are passed.
    pub(crate) fn substitute(&mut self, text: &str) -> Result<String, String> {
        let mut out = String::new();
        let mut rest = text;
        while let Some(at) = rest.find('$') {
            let (before, after) = (&rest[..at], &rest[at + 1..]);
            if let Some(before) = before.strip_suffix('\\') {
                out += before;
                out.push('$');
                rest = after;
                continue;
            }
            out += before;
            let ends = after.char_indices().take_while(|(_, c)| *c != '$').map(|(at, c)| at + c.len_utf8());
            let names = ends.take_while(|end| *end <= MAX_NAME).map(|end| &after[..end]);
            let Some(name) = names.filter(|name| self.by_name.contains_key(*name)).last() else {
                let end = after.find(|c: char| !c.is_alphanumeric() && c != '_').unwrap_or(after.len());
                let name = printable::name(&after[..end]);
                return Err(format!(
                    "`${name}` has no value: add `<default name=\"{name}\" value=\"…\"/>`, or give -D {name}=…"
                ));
            };
            let parameter = self.by_name.get_mut(name).expect("it was found");
            parameter.is_used = true;
            out += &parameter.value;
            self.substituted += parameter.value.len();
            self.n_uses += 1;
            if self.n_uses > MAX_USES {
                return Err(format!("a scene may use parameters {MAX_USES} times"));
            }
            if self.substituted > MAX_SUBSTITUTED {
                return Err("parameters give more text than a scene may have".to_owned());
            }
            rest = &after[name.len()..];
        }
        out += rest;
        Ok(out)
    }
}
