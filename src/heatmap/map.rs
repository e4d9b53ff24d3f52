//! A picture's worth of numbers, with its axes.

/// One axis of a [`Map`]: the value of every row or column.
#[derive(Clone, Debug, PartialEq)]
pub struct Axis {
    pub name: &'static str,
    pub unit: &'static str,
    /// Of every row or column, in `unit`.
    pub values: Vec<f64>,
}

impl Axis {
    /// An axis with its name and unit as pictures write them.
    pub fn new(name: &'static str, unit: &'static str, values: Vec<f64>) -> Self {
        Self { name, unit, values }
    }

    /// How many rows or columns there are.
    pub fn len(&self) -> usize {
        self.values.len()
    }

    /// Whether there is no row or column.
    pub fn is_empty(&self) -> bool {
        self.values.is_empty()
    }

    /// Index of the value nearest to this one.
    pub fn nearest(&self, value: f64) -> usize {
        let distance = |index: &usize| (self.values[*index] - value).abs();
        (0..self.len()).min_by(|a, b| distance(a).total_cmp(&distance(b))).expect("an axis has values")
    }
}

/// `[row, column]`: power (linear) as it comes from the transforms, or decibels after [`Map::db`].
#[derive(Clone, Debug, PartialEq)]
pub struct Map {
    pub rows: Axis,
    pub columns: Axis,
    /// Row-major.
    pub values: Vec<f64>,
}

impl Map {
    /// # Panics
    /// When the number of values is not rows times columns.
    pub fn new(rows: Axis, columns: Axis, values: Vec<f64>) -> Self {
        assert_eq!(
            values.len(),
            rows.len() * columns.len(),
            "map: {} values for {} {} × {} {}",
            values.len(),
            rows.len(),
            rows.name,
            columns.len(),
            columns.name
        );
        Self { rows, columns, values }
    }

    /// Numbers of rows and columns.
    pub fn dims(&self) -> [usize; 2] {
        [self.rows.len(), self.columns.len()]
    }

    /// The value of one cell.
    ///
    /// # Panics
    /// For a row that the map has not.
    pub fn at(&self, row: usize, column: usize) -> f64 {
        self.values[row * self.columns.len() + column]
    }

    /// 10 log₁₀(power + floor²); `floor_amplitude` keeps empty cells finite.
    pub fn db(&self, floor_amplitude: f64) -> Self {
        let floor = (floor_amplitude * floor_amplitude).max(f64::MIN_POSITIVE);
        self.with_values(self.values.iter().map(|power| 10.0 * (power + floor).log10()).collect())
    }

    /// The same axes around other numbers.
    pub fn with_values(&self, values: Vec<f64>) -> Self {
        Self::new(self.rows.clone(), self.columns.clone(), values)
    }

    /// The part whose axis values lie within both limits, ends included.
    pub fn cropped(&self, rows: [f64; 2], columns: [f64; 2]) -> Self {
        let inside = |axis: &Axis, [low, high]: [f64; 2]| -> Vec<usize> {
            (0..axis.len()).filter(|&index| (low..=high).contains(&axis.values[index])).collect()
        };
        let (kept_rows, kept_columns) = (inside(&self.rows, rows), inside(&self.columns, columns));
        let keep = |axis: &Axis, kept: &[usize]| Axis::new(axis.name, axis.unit, kept.iter().map(|&i| axis.values[i]).collect());
        let values = kept_rows.iter().flat_map(|&row| kept_columns.iter().map(move |&column| self.at(row, column))).collect();
        Self::new(keep(&self.rows, &kept_rows), keep(&self.columns, &kept_columns), values)
    }

    /// The largest value.
    pub fn max(&self) -> f64 {
        self.values.iter().copied().fold(f64::NEG_INFINITY, f64::max)
    }

    /// Row and column index of the largest value.
    pub fn peak(&self) -> [usize; 2] {
        self.peak_where(|_, _| true).expect("a map has cells")
    }

    /// Row and column index of the largest value among the cells whose axis values pass; `None` when none does.
    pub fn peak_where(&self, passes: impl Fn(f64, f64) -> bool) -> Option<[usize; 2]> {
        let columns = self.columns.len();
        (0..self.values.len())
            .map(|index| [index / columns, index % columns])
            .filter(|&[row, column]| passes(self.rows.values[row], self.columns.values[column]))
            .max_by(|&[a, b], &[c, d]| self.at(a, b).total_cmp(&self.at(c, d)))
    }

    /// Half of the values lie below: the noise floor of a map with few targets.
    pub fn median(&self) -> f64 {
        let mut sorted = self.values.clone();
        sorted.sort_by(f64::total_cmp);
        sorted[sorted.len() / 2]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn small() -> Map {
        let rows = Axis::new("velocity", "m/s", vec![-1.0, 0.0]);
        Map::new(rows, Axis::new("range", "m", vec![0.0, 0.5, 1.0]), vec![1.0, 10.0, 3.0, 4.0, 100.0, 6.0])
    }

    #[test]
    fn the_peak_is_found_and_can_be_restricted() {
        assert_eq!(small().peak(), [1, 1]);
        assert_eq!(small().peak_where(|velocity, _| velocity < 0.0), Some([0, 1]));
        assert_eq!(small().peak_where(|_, range| range > 2.0), None);
        assert_eq!(small().columns.nearest(0.6), 1);
    }

    #[test]
    fn a_crop_keeps_the_cells_within_its_limits() {
        let part = small().cropped([0.0, 1.0], [0.5, 2.0]);
        assert_eq!((part.dims(), part.values.as_slice()), ([1, 2], [100.0, 6.0].as_slice()));
        assert_eq!(part.columns.values, [0.5, 1.0]);
    }

    #[test]
    fn decibels_of_an_empty_cell_are_the_floor() {
        let map = Map::new(Axis::new("a", "", vec![0.0]), Axis::new("b", "", vec![0.0, 1.0]), vec![0.0, 100.0]);
        let db = map.db(1e-3);
        assert!((db.at(0, 0) + 60.0).abs() < 1e-12);
        assert!((db.at(0, 1) - 20.0).abs() < 1e-6);
        assert!(map.db(0.0).values.iter().all(|value| value.is_finite()));
    }

    #[test]
    #[should_panic(expected = "map: 2 values for 1 a × 1 b")]
    fn values_that_do_not_fill_the_axes_are_refused() {
        Map::new(Axis::new("a", "", vec![0.0]), Axis::new("b", "", vec![0.0]), vec![1.0, 2.0]);
    }
}
