//! Values over named axes, the last of which varies fastest.

use std::ops::{Index, IndexMut, Range};

/// A dense array of `N` axes; an index that lies outside its axis panics and names the axis, instead of reading the next row.
#[derive(Clone, Debug, PartialEq)]
pub struct Grid<T, const N: usize> {
    axes: [&'static str; N],
    shape: [usize; N],
    values: Vec<T>,
}

impl<T, const N: usize> Grid<T, N> {
    /// # Panics
    /// Where there are not as many values as the axes have places.
    pub fn new(axes: [&'static str; N], shape: [usize; N], values: Vec<T>) -> Self {
        assert_eq!(values.len(), shape.iter().product::<usize>(), "values over {axes:?} of {shape:?}");
        Self { axes, shape, values }
    }

    /// A value for every place, made from its indices, in the order in which they are stored.
    pub fn from_fn(axes: [&'static str; N], shape: [usize; N], mut value: impl FnMut([usize; N]) -> T) -> Self {
        let mut at = [0; N];
        let values = (0..shape.iter().product())
            .map(|mut place| {
                for axis in (0..N).rev() {
                    at[axis] = place % shape[axis];
                    place /= shape[axis];
                }
                value(at)
            })
            .collect();
        Self { axes, shape, values }
    }

    /// Lengths of the axes, in their order.
    pub fn shape(&self) -> [usize; N] {
        self.shape
    }

    /// All values, the last axis fastest.
    pub fn values(&self) -> &[T] {
        &self.values
    }

    /// All values, the last axis fastest, to change in place.
    pub fn values_mut(&mut self) -> &mut [T] {
        &mut self.values
    }

    /// All values, the last axis fastest, without the grid.
    pub fn into_values(self) -> Vec<T> {
        self.values
    }

    /// All values below the first `M` indices, contiguous: a lane of the last axis for `M = N - 1`.
    #[inline]
    pub fn below<const M: usize>(&self, at: [usize; M]) -> &[T] {
        let range = self.range(at);
        &self.values[range]
    }

    /// As [`Self::below`], to change in place.
    #[inline]
    pub fn below_mut<const M: usize>(&mut self, at: [usize; M]) -> &mut [T] {
        let range = self.range(at);
        &mut self.values[range]
    }

    #[inline]
    fn range<const M: usize>(&self, at: [usize; M]) -> Range<usize> {
        let each: usize = self.shape[M..].iter().product();
        let first = self.place(at) * each;
        first..first + each
    }

    /// Of the first `M` axes. Inner loops come here: nothing but the product and the bounds.
    #[inline]
    fn place<const M: usize>(&self, at: [usize; M]) -> usize {
        let mut place = 0;
        for ((index, &length), axis) in at.into_iter().zip(&self.shape).zip(&self.axes) {
            if index >= length {
                outside(axis, index, length);
            }
            place = place * length + index;
        }
        place
    }
}

#[cold]
#[inline(never)]
fn outside(axis: &str, index: usize, length: usize) -> ! {
    panic!("{axis} {index} of {length}")
}

impl<T: Clone, const N: usize> Grid<T, N> {
    /// The same value at every place.
    pub fn filled(axes: [&'static str; N], shape: [usize; N], value: T) -> Self {
        Self { axes, shape, values: vec![value; shape.iter().product()] }
    }
}

impl<T, const N: usize> Index<[usize; N]> for Grid<T, N> {
    type Output = T;

    #[inline]
    fn index(&self, at: [usize; N]) -> &T {
        &self.values[self.place(at)]
    }
}

impl<T, const N: usize> IndexMut<[usize; N]> for Grid<T, N> {
    #[inline]
    fn index_mut(&mut self, at: [usize; N]) -> &mut T {
        let place = self.place(at);
        &mut self.values[place]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_last_axis_varies_fastest() {
        let grid = Grid::from_fn(["frame", "bin"], [2, 3], |[frame, bin]| 10 * frame + bin);
        assert_eq!(grid.values(), [0, 1, 2, 10, 11, 12]);
        assert_eq!((grid[[1, 2]], grid.below([1]), grid.below([]).len()), (12, &[10, 11, 12][..], 6));
        let mut other = Grid::filled(["frame", "bin"], [2, 3], 0);
        other[[1, 0]] = 4;
        other.below_mut([1])[2] = 5;
        assert_eq!(other, Grid::new(["frame", "bin"], [2, 3], vec![0, 0, 0, 4, 0, 5]));
    }

    #[test]
    #[should_panic(expected = "bin 3 of 3")]
    fn an_index_outside_its_axis_is_named() {
        let _ = Grid::filled(["frame", "bin"], [2, 3], 0)[[0, 3]];
    }
}
