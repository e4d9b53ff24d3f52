//! Parts of a map.

use std::ops::Range;

use crate::heatmap::Map;

/// The cells that hold a person: those of `person_db`, a map of the person alone (or a static-removed one), within
/// `down_db` of its strongest cell.
pub fn person_cells(person_db: &Map, down_db: f64) -> Vec<bool> {
    let level = person_db.max() - down_db;
    person_db.values.iter().map(|&db| db >= level).collect()
}

/// Rows and columns of the smallest box around a mask `[row, column]`, grown evenly to `at_least` cells each way and kept
/// within the map (which may be smaller). `None` when the mask holds no cell.
pub fn bounding_box(mask: &[bool], [rows, columns]: [usize; 2], at_least: usize) -> Option<[Range<usize>; 2]> {
    assert_eq!(mask.len(), rows * columns, "bounding_box: mask of {} cells for {rows} × {columns}", mask.len());
    let grown = |inside: Vec<usize>, length: usize| {
        let (first, last) = (*inside.iter().min()?, *inside.iter().max()?);
        let wanted = (last + 1 - first).max(at_least).min(length);
        let start = (first + last + 1).saturating_sub(wanted) / 2;
        let start = start.min(length - wanted);
        Some(start..start + wanted)
    };
    let cells = || (0..mask.len()).filter(|&index| mask[index]);
    Some([
        grown(cells().map(|index| index / columns).collect(), rows)?,
        grown(cells().map(|index| index % columns).collect(), columns)?,
    ])
}

/// The pixels within a box of an image `[row, column]`.
pub fn crop(image: &[f64], [rows, columns]: [usize; 2], limits: &[Range<usize>; 2]) -> Vec<f64> {
    assert_eq!(image.len(), rows * columns, "crop: {} pixels for {rows} × {columns}", image.len());
    let [kept_rows, kept_columns] = limits;
    kept_rows.clone().flat_map(|row| &image[row * columns..][kept_columns.clone()]).copied().collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::heatmap::Axis;

    #[test]
    fn the_persons_cells_are_those_near_the_strongest() {
        let axis = |length: usize| Axis::new("cell", "", (0..length).map(|index| index as f64).collect());
        let mut values = vec![-90.0; 320];
        (values[5], values[6], values[7]) = (-20.0, -35.0, -41.0);
        let cells = person_cells(&Map::new(axis(16), axis(20), values), 20.0);
        assert_eq!(cells.iter().filter(|cell| **cell).count(), 2);
        assert!(cells[5] && cells[6]);
    }

    #[test]
    fn a_box_grows_around_its_cells_and_stays_within_the_map() {
        let mask = |cells: &[[usize; 2]]| {
            let mut mask = vec![false; 10 * 20];
            cells.iter().for_each(|[row, column]| mask[row * 20 + column] = true);
            mask
        };
        let found = |cells: &[[usize; 2]], at_least| bounding_box(&mask(cells), [10, 20], at_least);
        assert_eq!(found(&[[2, 3], [5, 9]], 1), Some([2..6, 3..10]));
        // four cells around row 5 and column 10
        assert_eq!(found(&[[5, 10]], 4), Some([3..7, 8..12]));
        assert_eq!(found(&[[0, 19]], 4), Some([0..4, 16..20]));
        // ten rows are all there are
        assert_eq!(found(&[[5, 10]], 12), Some([0..10, 4..16]));
        assert_eq!(found(&[], 4), None);
    }

    #[test]
    fn a_crop_holds_the_pixels_of_its_box() {
        let image: Vec<f64> = (0..12).map(f64::from).collect();
        assert_eq!(crop(&image, [3, 4], &[1..3, 2..4]), [6.0, 7.0, 10.0, 11.0]);
    }
}
