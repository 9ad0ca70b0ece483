//! Unused films, kept for their memory: mapping and clearing new memory takes longer than the first image may.

use crate::render::Film;

/// Unused films, at most one per size.
#[derive(Default)]
pub struct IdleFilms(Vec<Film>);

/// Number of films: the one at full resolution and the finest of the coarse ones gain most.
const MOST: usize = 3;

impl IdleFilms {
    pub fn keep(&mut self, film: Film) {
        self.0.retain(|other| size(other) != size(&film));
        self.0.push(film);
        if self.0.len() > MOST {
            let n_pixels = |place: &usize| u64::from(self.0[*place].width()) * u64::from(self.0[*place].height());
            let smallest = (0..self.0.len()).min_by_key(n_pixels).expect("some were there");
            self.0.swap_remove(smallest);
        }
    }

    /// Removes and returns the film of this width and height, with its old samples.
    pub fn take(&mut self, wanted: (u32, u32)) -> Option<Film> {
        let place = self.0.iter().position(|film| size(film) == wanted)?;
        Some(self.0.remove(place))
    }

    /// Drops all films, for example because the image size changes.
    pub fn forget(&mut self) {
        self.0.clear();
    }
}

fn size(film: &Film) -> (u32, u32) {
    (film.width(), film.height())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_largest_are_kept_one_of_each_size() {
        let mut idle = IdleFilms::default();
        for width in [8, 4, 8, 2, 1, 3] {
            idle.keep(Film::new(width, 3));
        }
        let mut has = |width| idle.take((width, 3)).is_some();
        assert_eq!([1, 2, 3, 4, 8].map(&mut has), [false, false, true, true, true]);
        assert_eq!([1, 2, 3, 4, 8].map(&mut has), [false; 5], "each is handed out once");
        idle.keep(Film::new(8, 3));
        idle.forget();
        assert!(idle.take((8, 3)).is_none());
    }
}
