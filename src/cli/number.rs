//! Numbers of the command line: each with the message that says what it must be, before anything is loaded.

use firstlight::mesh::simplify::{Target, check_target};

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

/// Stops of exposure: any number that is one.
pub fn parse_stops(text: &str) -> Result<f32, String> {
    match text.parse::<f32>() {
        Ok(stops) if stops.is_finite() => Ok(stops),
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
