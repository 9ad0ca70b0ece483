//! Numbers of the command line: each with the message that says what it must be, before anything is loaded.

use firstlight::mesh::simplify::{Target, check_target};
use firstlight::scene::check_stops;

/// `640x480` as a width and a height.
pub fn parse_size(text: &str) -> Result<(u32, u32), String> {
    let (width, height) = text.split_once(['x', 'X', '×']).ok_or("write it as WIDTHxHEIGHT, such as 1280x720")?;
    let number = |text: &str| text.trim().parse::<u32>().map_err(|_| format!("`{text}` is not a number of pixels"));
    let (width, height) = (number(width)?, number(height)?);
    firstlight::scene::file::check_film_size(width, height)?;
    Ok((width, height))
}

/// A positive, finite number.
pub fn parse_positive(text: &str) -> Result<f64, String> {
    match text.parse::<f64>() {
        Ok(value) if value > 0.0 && value.is_finite() => Ok(value),
        _ => Err("must be a positive number".to_owned()),
    }
}

/// A relative error to stop at: `0.05`, or the same as `5%`. Above 1 only with the sign: who writes 5 means per cent.
pub fn parse_share(text: &str) -> Result<f64, String> {
    let (number, unit) = match text.trim_end().strip_suffix('%') {
        Some(number) => (number.trim_end(), 0.01),
        None => (text.trim_end(), 1.0),
    };
    match number.parse::<f64>().map(|value| value * unit) {
        Ok(share) if unit == 1.0 && share > 1.0 && share.is_finite() => {
            let per_cent = 100.0 * share;
            Err(format!("{number} means {per_cent} %: write {number}% for {number} per cent"))
        }
        Ok(share) if share > 0.0 && share.is_finite() => Ok(share),
        _ => Err("must be a positive number: five per cent is 0.05 or 5%".to_owned()),
    }
}

/// Stops of exposure: any number that is one.
pub fn parse_stops(text: &str) -> Result<f32, String> {
    match text.parse::<f32>() {
        Ok(stops) => check_stops(stops).map(|()| stops).map_err(|error| error.to_string()),
        _ => Err("must be a finite number of stops".to_owned()),
    }
}

/// The share of triangles to keep.
pub fn parse_ratio(text: &str) -> Result<f64, String> {
    let ratio = text.parse().map_err(|_| "must be a number above 0 and at most 1")?;
    check_target(Target::Ratio(ratio)).map_err(|error| error.to_string())?;
    Ok(ratio)
}

/// A number of triangles to keep.
pub fn parse_faces(text: &str) -> Result<usize, String> {
    let faces = text.parse().map_err(|_| "must be a number of triangles, at least 1")?;
    check_target(Target::Faces(faces)).map_err(|error| error.to_string())?;
    Ok(faces)
}

/// The largest distance between two surfaces.
pub fn parse_error(text: &str) -> Result<f64, String> {
    let error = text.parse().map_err(|_| "must be a length above 0")?;
    check_target(Target::Error(error)).map_err(|error| error.to_string())?;
    Ok(error)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn shares_are_numbers_or_per_cent() {
        for (text, share) in [("0.05", 0.05), ("5%", 0.05), ("0.5 %", 0.005), ("1e-3", 1e-3), ("150%", 1.5)] {
            assert!((parse_share(text).unwrap() - share).abs() < 1e-15, "{text}");
        }
        assert_eq!(parse_share("1"), Ok(1.0));
        for text in ["5", "1.5", "5 ", "1e3"] {
            let number = text.trim();
            let error = parse_share(text).unwrap_err();
            assert!(
                error.starts_with(&format!("{number} means ")) && error.contains(&format!("write {number}%")),
                "{error}"
            );
        }
        assert!(parse_share("5").unwrap_err().starts_with("5 means 500 %"));
        for text in ["", "%", "5%%", "5 per cent", "-5%", "0%", "nan%", "inf", "%5"] {
            assert!(parse_share(text).unwrap_err().contains("0.05 or 5%"), "{text}");
        }
    }
}
