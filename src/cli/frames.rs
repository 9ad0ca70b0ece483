//! Numbers of frames on the command line.

use firstlight::cluster::job::Job;
use std::ops::Range;

/// Numbers of frames, as in the names of files.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum FramesArg {
    /// So many.
    Count(u32),
    /// From the first number up to, not including, the second.
    Range(u32, u32),
}

impl FramesArg {
    /// Of an animation: `N` is 0..N.
    pub fn range(self) -> Range<u32> {
        match self {
            Self::Count(n) => 0..n,
            Self::Range(start, end) => start..end,
        }
    }
}

/// `120`, or `A..B` for frames A to B-1.
pub fn parse_frames(text: &str) -> Result<FramesArg, String> {
    let number = |text: &str| text.trim().parse::<u32>().map_err(|_| format!("`{text}` is not a number of frames"));
    let (frames, n) = match text.split_once("..") {
        None => {
            let n = number(text)?;
            (FramesArg::Count(n), n)
        }
        Some((start, end)) => {
            let (start, end) = (number(start)?, number(end)?);
            (FramesArg::Range(start, end), end.saturating_sub(start))
        }
    };
    match n {
        0 => Err(format!("`{text}` has no frames: expected N or A..B, such as 0..60 for frames 0 to 59")),
        n if n > Job::MOST_FRAMES => Err(format!("{n} frames: use at most {}", Job::MOST_FRAMES)),
        _ => Ok(frames),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn frames_are_a_number_or_a_range() {
        assert_eq!(parse_frames("60"), Ok(FramesArg::Count(60)));
        assert_eq!(parse_frames("10..60"), Ok(FramesArg::Range(10, 60)));
        for wrong in ["", "0", "5..5", "9..3", "a..b", "-1..3", "0..100001", "1..=3"] {
            assert!(parse_frames(wrong).is_err(), "{wrong}");
        }
    }
}
