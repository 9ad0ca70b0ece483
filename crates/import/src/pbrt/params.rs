//! The parameters of a directive: `"type name" value`, or several values in brackets.
//!
//! Getters return `None` for what is not there. What is there but of the wrong kind is noted, and counts as missing:
//! a broken parameter never refuses a scene.

use crate::pbrt::spectrum::Spectrum;
use firstlight_files::printable;
use glam::{DVec2, DVec3};
use std::cell::{Cell, RefCell};
use std::rc::Rc;

/// Values of one parameter.
#[derive(Clone, Debug, PartialEq)]
pub(crate) enum Values {
    Numbers(Vec<f64>),
    Strings(Vec<String>),
    Bools(Vec<bool>),
}

#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Param {
    /// `float`, `rgb`, `texture` …
    pub kind: String,
    pub name: String,
    pub values: Values,
}

impl Param {
    /// Bytes of its name and its values.
    pub(crate) fn n_bytes(&self) -> usize {
        let of_values = match &self.values {
            Values::Numbers(numbers) => size_of_val(numbers.as_slice()),
            Values::Strings(strings) => strings.iter().map(|it| size_of_val(it) + it.len()).sum(),
            Values::Bools(flags) => flags.len(),
        };
        self.kind.len() + self.name.len() + of_values
    }

    /// A number.
    pub(crate) fn number(name: &str, number: f64) -> Self {
        Self { kind: "float".to_owned(), name: name.to_owned(), values: Values::Numbers(vec![number]) }
    }
}

/// Parameters that an `Attribute` gave for all later things of a kind, and those of the `Attribute`s before it.
#[derive(Debug)]
struct Attribute {
    /// `shape`, `light`, `material`, `medium` or `texture`.
    of: String,
    list: Vec<Param>,
    n_params: usize,
    n_bytes: usize,
    earlier: Attributes,
}

/// All `Attribute`s that count at a place: shared, since each shape has them.
#[derive(Clone, Debug, Default)]
pub(crate) struct Attributes(Option<Rc<Attribute>>);

impl Attributes {
    /// With one more.
    pub(crate) fn and(&self, of: &str, list: Vec<Param>) -> Self {
        if list.is_empty() {
            return self.clone();
        }
        Self(Some(Rc::new(Attribute {
            n_params: self.n_params() + list.len(),
            n_bytes: self.n_bytes() + list.iter().map(Param::n_bytes).sum::<usize>(),
            of: of.to_owned(),
            list,
            earlier: self.clone(),
        })))
    }

    /// Number of all parameters.
    pub(crate) fn n_params(&self) -> usize {
        self.0.as_ref().map_or(0, |last| last.n_params)
    }

    /// Bytes of all parameters.
    pub(crate) fn n_bytes(&self) -> usize {
        self.0.as_ref().map_or(0, |last| last.n_bytes)
    }

    /// The parameter of this name for things of a kind; the latest counts.
    fn find(&self, of: &str, name: &str) -> Option<&Param> {
        let all = std::iter::successors(self.0.as_deref(), |attribute| attribute.earlier.0.as_deref());
        all.filter(|attribute| attribute.of == of).flat_map(|it| &it.list).find(|param| param.name == name)
    }
}

/// All parameters of a directive, and complaints about them.
#[derive(Clone, Debug, Default)]
pub(crate) struct Params {
    list: Vec<Param>,
    /// What counts where `list` has nothing, and the kind of thing that this is.
    attributes: (&'static str, Attributes),
    complaints: RefCell<Vec<String>>,
    /// A bit for each of the first parameters of `list`: whether it was asked for.
    asked: Cell<u64>,
}

impl Params {
    pub(crate) fn new(list: Vec<Param>) -> Self {
        Self { list, ..Self::default() }
    }

    /// With what `Attribute`s gave for things of this kind.
    pub(crate) fn with_attributes(self, of: &'static str, attributes: &Attributes) -> Self {
        Self { attributes: (of, attributes.clone()), ..self }
    }

    pub(crate) fn into_list(self) -> Vec<Param> {
        self.list
    }

    /// Complaints about values that could not be used.
    pub(crate) fn complaints(&self) -> Vec<String> {
        std::mem::take(&mut self.complaints.borrow_mut())
    }

    pub(crate) fn find(&self, name: &str) -> Option<&Param> {
        let (of, attributes) = &self.attributes;
        let Some(own) = self.list.iter().position(|param| param.name == name) else {
            return attributes.find(of, name);
        };
        self.asked.set(self.asked.get() | 1_u64.checked_shl(own as u32).unwrap_or(0));
        Some(&self.list[own])
    }

    /// Complaints about parameters that were not asked for.
    pub(crate) fn unused(&self) -> impl Iterator<Item = String> {
        let is_unused = |(i, _): &(usize, &Param)| *i < 64 && self.asked.get() >> i & 1 == 0;
        self.list.iter().enumerate().filter(is_unused).map(|(_, param)| {
            format!("`{} {}` has no effect", printable::name(&param.kind), printable::name(&param.name))
        })
    }

    pub(crate) fn has(&self, name: &str) -> bool {
        self.find(name).is_some()
    }

    fn complain<T>(&self, param: &Param, expected: &str) -> Option<T> {
        let (kind, name) = (printable::name(&param.kind), printable::name(&param.name));
        self.complaints.borrow_mut().push(format!("`{kind} {name}` is ignored: expected {expected}"));
        None
    }

    /// All numbers of a parameter; empty if it is missing.
    pub(crate) fn numbers(&self, name: &str) -> &[f64] {
        let Some(param) = self.find(name) else { return &[] };
        match &param.values {
            Values::Numbers(numbers) if numbers.iter().all(|number| number.is_finite()) => numbers,
            Values::Numbers(_) => self.complain(param, "finite numbers").unwrap_or(&[]),
            _ => self.complain(param, "numbers").unwrap_or(&[]),
        }
    }

    fn exactly<const N: usize>(&self, name: &str, expected: &str) -> Option<[f64; N]> {
        let param = self.find(name)?;
        // Names of textures and spectra are read by others.
        if matches!(param.values, Values::Strings(_)) {
            return None;
        }
        let numbers = self.numbers(name);
        numbers.try_into().ok().or_else(|| if numbers.is_empty() { None } else { self.complain(param, expected) })
    }

    pub(crate) fn number(&self, name: &str) -> Option<f64> {
        self.exactly::<1>(name, "one number").map(|[number]| number)
    }

    /// A whole number that is not negative.
    pub(crate) fn count(&self, name: &str) -> Option<u32> {
        let number = self.number(name)?;
        if (0.0..=f64::from(u32::MAX)).contains(&number) && number.fract() == 0.0 {
            return Some(number as u32);
        }
        self.find(name).and_then(|param| self.complain(param, "a whole number that is not negative"))
    }

    pub(crate) fn point(&self, name: &str) -> Option<DVec3> {
        self.exactly::<3>(name, "three numbers").map(DVec3::from_array)
    }

    /// Groups of three numbers.
    pub(crate) fn points(&self, name: &str) -> Vec<DVec3> {
        self.groups(name, "three numbers for each of them").iter().copied().map(DVec3::from_array).collect()
    }

    /// Pairs of numbers.
    pub(crate) fn pairs(&self, name: &str) -> Vec<DVec2> {
        self.groups(name, "pairs of numbers").iter().copied().map(DVec2::from_array).collect()
    }

    /// Groups of `N` numbers; none, with a complaint, if some are left.
    fn groups<const N: usize>(&self, name: &str, expected: &str) -> &[[f64; N]] {
        let (groups, rest) = self.numbers(name).as_chunks::<N>();
        if let (Some(param), false) = (self.find(name), rest.is_empty()) {
            return self.complain(param, expected).unwrap_or_default();
        }
        groups
    }

    /// Indices of vertices.
    pub(crate) fn indices(&self, name: &str) -> Vec<u32> {
        let numbers = self.numbers(name);
        let is_index = |number: &f64| (0.0..=f64::from(u32::MAX)).contains(number) && number.fract() == 0.0;
        if let (Some(param), false) = (self.find(name), numbers.iter().all(is_index)) {
            return self.complain(param, "whole numbers that are not negative").unwrap_or_default();
        }
        numbers.iter().map(|&number| number as u32).collect()
    }

    pub(crate) fn flag(&self, name: &str) -> Option<bool> {
        let param = self.find(name)?;
        match &param.values {
            Values::Bools(flags) if flags.len() == 1 => Some(flags[0]),
            Values::Strings(words) if words.len() == 1 && words[0] == "true" => Some(true),
            Values::Strings(words) if words.len() == 1 && words[0] == "false" => Some(false),
            _ => self.complain(param, "`true` or `false`"),
        }
    }

    pub(crate) fn strings(&self, name: &str) -> &[String] {
        let Some(param) = self.find(name) else { return &[] };
        match &param.values {
            Values::Strings(words) => words,
            _ => self.complain(param, "a string in quotes").unwrap_or(&[]),
        }
    }

    pub(crate) fn string(&self, name: &str) -> Option<&str> {
        self.strings(name).first().map(String::as_str)
    }

    /// Name of a texture, if the parameter is one.
    pub(crate) fn texture(&self, name: &str) -> Option<&str> {
        let param = self.find(name).filter(|param| param.kind == "texture")?;
        match &param.values {
            Values::Strings(words) => words.first().map(String::as_str),
            _ => self.complain(param, "the name of a texture"),
        }
    }

    /// A spectrum that is no texture.
    pub(crate) fn spectrum(&self, name: &str) -> Option<Spectrum> {
        let param = self.find(name).filter(|param| param.kind != "texture")?;
        let numbers = |expected| match &param.values {
            Values::Numbers(numbers) if numbers.iter().all(|number| number.is_finite()) => Some(numbers.as_slice()),
            _ => self.complain(param, expected),
        };
        match (&*param.kind, &param.values) {
            ("spectrum", Values::Strings(words)) => words.first().map(|word| Spectrum::Named(word.clone())),
            ("spectrum", _) => {
                let expected = "the name of a spectrum, or pairs of a wavelength and a value";
                let (pairs, rest) = numbers(expected)?.as_chunks::<2>();
                let ascends = pairs.is_sorted_by(|a, b| a[0] < b[0]);
                if pairs.is_empty() || !rest.is_empty() || !ascends {
                    return self.complain(param, expected);
                }
                Some(Spectrum::Sampled(pairs.iter().map(|&[wavelength, value]| (wavelength, value)).collect()))
            }
            ("blackbody", _) => match numbers("one temperature in kelvins")? {
                [kelvins, ..] if *kelvins > 0.0 => Some(Spectrum::Blackbody(*kelvins)),
                _ => self.complain(param, "one temperature in kelvins"),
            },
            _ => match numbers("a colour of three numbers")? {
                [r, g, b] => Some(Spectrum::Rgb(DVec3::new(*r, *g, *b))),
                [grey] => Some(Spectrum::Rgb(DVec3::splat(*grey))),
                _ => self.complain(param, "a colour of three numbers"),
            },
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn own_parameters_count_before_those_of_the_latest_attribute_of_their_kind() {
        let first = Attributes::default().and("shape", vec![Param::number("a", 1.0), Param::number("b", 1.0)]);
        let second = first.and("light", vec![Param::number("b", 2.0)]).and("shape", vec![Param::number("b", 3.0)]);
        let numbers = |attributes: &Attributes, kind| {
            let params = Params::new(vec![Param::number("own", 0.0)]).with_attributes(kind, attributes);
            ["own", "a", "b", "c"].map(|name| params.number(name))
        };
        assert_eq!(numbers(&first, "shape"), [Some(0.0), Some(1.0), Some(1.0), None]);
        assert_eq!(numbers(&second, "shape"), [Some(0.0), Some(1.0), Some(3.0), None]);
        assert_eq!(numbers(&second, "light"), [Some(0.0), None, Some(2.0), None]);
        let own = Params::new(vec![Param::number("b", 4.0)]).with_attributes("shape", &second);
        assert_eq!(own.number("b"), Some(4.0));
        assert_eq!((second.n_params(), second.and("shape", Vec::new()).n_params()), (4, 4));
    }
}
