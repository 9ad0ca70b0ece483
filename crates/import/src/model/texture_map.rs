//! Maps of MTL files: an image, and options for how it is used.

use firstlight_render::Channel;
use glam::DVec2;
use std::path::PathBuf;

/// An image of a material and what the options of its line say.
#[derive(Clone, Debug, PartialEq)]
pub struct TextureMap {
    /// The image.
    pub path: PathBuf,
    /// `-s`: number of repetitions along u and v; not 0.
    pub repeat: DVec2,
    /// `-o`: shift along u and v in widths and heights of the image.
    pub offset: DVec2,
    /// `-clamp on`: the border continues outside of the image.
    pub clamp: bool,
    /// `-imfchan`: the channel of a scalar.
    pub channel: Option<Channel>,
    /// `-colorspace linear`: colours are linear, also of 8 bits.
    pub is_linear: bool,
    /// `-mm 0 gain`: factor of the values, at least 0.
    pub gain: f32,
    /// `-bm`: factor of heights or of the slope of normals.
    pub bump_scale: Option<f32>,
}

impl TextureMap {
    /// An image without options.
    pub fn of(path: PathBuf) -> Self {
        let (repeat, offset) = (DVec2::ONE, DVec2::ZERO);
        Self { path, repeat, offset, clamp: false, channel: None, is_linear: false, gain: 1.0, bump_scale: None }
    }

    /// The map of the text after a keyword; options come before the name or behind it.
    ///
    /// - `find`: the image of a name, if it can be one.
    pub(crate) fn parse(value: &str, find: impl FnOnce(&str) -> Option<PathBuf>) -> Option<Self> {
        let (name, options) = split(value);
        let mut map = Self::of(find(name.trim_matches('"'))?);
        for option in &options {
            map.apply(option);
        }
        Some(map)
    }

    /// Returns whether the option has an effect or asks for what is done anyway.
    fn apply(&mut self, option: &MapWords) -> bool {
        let numbers: Vec<f64> = option.values.iter().filter_map(|word| word.parse().ok()).collect();
        if numbers.iter().any(|number| !number.is_finite()) {
            return false;
        }
        let word = option.values.first().map(|word| word.to_ascii_lowercase()).unwrap_or_default();
        // Bounds of textures in scene files.
        let is_scale = |value: f64| (1e-12..=1e12).contains(&value.abs());
        match (option.name, &numbers[..]) {
            ("-s", &[u, ref rest @ ..]) => {
                let scale = DVec2::new(u, rest.first().copied().unwrap_or(1.0));
                let is_valid = is_scale(scale.x) && is_scale(scale.y);
                self.repeat = if is_valid { scale } else { self.repeat };
                return is_valid;
            }
            ("-o", &[u, ref rest @ ..]) => {
                let offset = DVec2::new(u, rest.first().copied().unwrap_or(0.0));
                let is_valid = offset.abs().max_element() <= 1e12;
                self.offset = if is_valid { offset } else { self.offset };
                return is_valid;
            }
            ("-mm", &[base, gain, ..]) => {
                let is_valid = base == 0.0 && (0.0..=1e6).contains(&gain);
                self.gain = if is_valid { gain as f32 } else { self.gain };
                return is_valid;
            }
            ("-bm", &[scale, ..]) => {
                let is_valid = scale.abs() <= 1e6;
                self.bump_scale = if is_valid { Some(scale as f32) } else { self.bump_scale };
                return is_valid;
            }
            ("-t", turbulence) => return turbulence.iter().all(|&value| value == 0.0),
            ("-boost", &[boost, ..]) => return boost == 0.0,
            _ => {}
        }
        match (option.name, &*word) {
            ("-clamp", _) => self.clamp = word == "on",
            ("-imfchan", "r") => self.channel = Some(Channel::R),
            ("-imfchan", "g") => self.channel = Some(Channel::G),
            ("-imfchan", "b") => self.channel = Some(Channel::B),
            ("-imfchan", "m") => self.channel = Some(Channel::A),
            // Luminance, the default: the red channel of a grey image.
            ("-imfchan", "l") | ("-blendu" | "-blendv", "on") | ("-cc", "off") | ("-texres", _) => {}
            ("-colorspace", _) => self.is_linear = word.contains("linear") || word.contains("raw"),
            _ => return false,
        }
        true
    }
}

/// The options of a map that are not modelled.
pub(crate) fn ignored_options(value: &str) -> impl Iterator<Item = &str> {
    let (_, options) = split(value);
    let mut map = TextureMap::of(PathBuf::new());
    options.into_iter().filter(move |option| !map.apply(option)).map(|option| option.name)
}

/// An option and what follows it.
struct MapWords<'a> {
    name: &'a str,
    values: Vec<&'a str>,
}

/// The name of the image, and the options before and behind it.
fn split(value: &str) -> (&str, Vec<MapWords<'_>>) {
    let (mut options, name) = leading_options(value.trim());
    /// No real line has as many; each is tried up to the end of the line.
    const MOST_TRIED: usize = 64;
    for (at, _) in name.match_indices(" -").take(MOST_TRIED) {
        let (behind, left) = leading_options(name[at..].trim_start());
        if left.is_empty() && !behind.is_empty() {
            options.extend(behind);
            return (name[..at].trim_end(), options);
        }
    }
    (name, options)
}

/// The options at the beginning of a text, and the rest.
fn leading_options(text: &str) -> (Vec<MapWords<'_>>, &str) {
    let (mut options, mut left) = (Vec::new(), text);
    while left.starts_with('-') {
        let name = left.split_whitespace().next().unwrap_or_default();
        let (least, most) = match name {
            "-o" | "-s" | "-t" => (1, 3),
            "-mm" => (2, 2),
            "-blendu" | "-blendv" | "-boost" | "-bm" | "-cc" | "-clamp" | "-colorspace" | "-imfchan" | "-texres"
            | "-type" => (1, 1),
            // Not an option: a file name that starts with a dash.
            _ => break,
        };
        left = left[name.len()..].trim_start();
        let mut values = Vec::new();
        for i in 0..most {
            let word = left.split_whitespace().next().unwrap_or_default();
            if word.is_empty() || (i >= least && word.parse::<f64>().is_err()) {
                break;
            }
            values.push(word);
            left = left[word.len()..].trim_start();
        }
        options.push(MapWords { name, values });
    }
    (options, left)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn map(value: &str) -> TextureMap {
        TextureMap::parse(value, |name| Some(name.into())).unwrap()
    }

    #[test]
    fn options_are_before_or_behind_the_name_and_never_part_of_it() {
        let scaled = |name: &str| TextureMap { repeat: DVec2::new(2.0, 1.0), ..TextureMap::of(name.into()) };
        for text in ["-s 2 a b.png", "a b.png -s 2", "-s 2 1 1 a b.png", "\"a b.png\" -s 2", "-s 2 -clamp off a b.png"]
        {
            assert_eq!(map(text), scaled("a b.png"), "{text}");
        }
        for name in ["-a.png", "a -b.png", "a -s.png", "x -s 2 y.png"] {
            assert_eq!(map(name), TextureMap::of(name.into()));
        }
        let linear = TextureMap { is_linear: true, ..TextureMap::of("a.png".into()) };
        assert_eq!(map("-colorspace linear a.png"), linear);
        assert_eq!(map("-colorspace sRGB a.png"), TextureMap::of("a.png".into()));
        assert_eq!(
            map("-mm 0 0.5 -o 1 -2 0 -bm .25 a.png"),
            TextureMap {
                gain: 0.5,
                offset: DVec2::new(1.0, -2.0),
                bump_scale: Some(0.25),
                ..TextureMap::of("a.png".into())
            }
        );
    }

    #[test]
    fn a_scale_of_zero_and_numbers_that_are_none_are_ignored() {
        for text in ["-s 0 a.png", "-o nan a.png", "-s inf 1 1 a.png", "-mm -1 2 a.png", "-bm inf a.png", "-t 1 a.png"]
        {
            assert_eq!(map(text), TextureMap::of("a.png".into()), "{text}");
            assert_eq!(ignored_options(text).count(), 1, "{text}");
        }
        assert_eq!(
            ignored_options("-s 2 -t 0 0 0 -cc on -boost 0 -type sphere a.png").collect::<Vec<_>>(),
            ["-cc", "-type"]
        );
    }
}
