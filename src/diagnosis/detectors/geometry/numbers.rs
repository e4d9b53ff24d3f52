//! The numbers that an array may differ by, and those of them that the body can make as well.

use nalgebra::{DMatrix, DVector};

use crate::radar::Radar;

/// One after the other: logarithmic gains, phases, and displacements along x in radian per
/// unit of the sine, of every receiver; real and imaginary part of the coupling from the one before, and from the one after.
#[derive(Clone, Copy, Debug)]
pub struct Numbers {
    pub receivers: usize,
}

impl Numbers {
    pub fn count(self) -> usize {
        3 * self.receivers + 4
    }

    pub fn gain(self, rx: usize) -> usize {
        rx
    }

    pub fn phase(self, rx: usize) -> usize {
        self.receivers + rx
    }

    pub fn place(self, rx: usize) -> usize {
        2 * self.receivers + rx
    }

    /// Of the one before, then of the one after; real, then imaginary part.
    pub fn coupling(self, part: usize) -> usize {
        3 * self.receivers + part
    }

    /// Changes of these numbers that the body makes as well, or that nothing shows: one gain and one phase of all, another
    /// direction, and directions wider apart. `[number, change]`
    pub fn of_the_body(self, radar: &Radar) -> DMatrix<f64> {
        let mut changes = vec![];
        let mut change = |of: &dyn Fn(usize) -> (usize, f64)| {
            let mut column = DVector::zeros(self.count());
            (0..self.receivers).map(of).for_each(|(number, value)| column[number] = value);
            if column.norm() > 1e-9 {
                changes.push(column.normalize());
            }
        };
        change(&|rx| (self.gain(rx), 1.0));
        change(&|rx| (self.phase(rx), 1.0));
        for places in centred(radar) {
            change(&|rx| (self.phase(rx), places[rx]));
        }
        change(&|rx| (self.place(rx), 1.0));
        change(&|rx| (self.place(rx), centred(radar)[0][rx]));
        DMatrix::from_columns(&changes)
    }

    /// Orthonormal directions among some kinds of these numbers, each identified by its first one, that no such change has a part
    /// in. `[number, direction]`, one kind after the other.
    pub fn own(self, radar: &Radar, kinds: &[usize]) -> DMatrix<f64> {
        let of_the_body = self.of_the_body(radar);
        let columns: Vec<DVector<f64>> = kinds
            .iter()
            .flat_map(|&first| {
                let free = beside(&of_the_body.rows(first, self.receivers).into_owned());
                free.into_iter().map(move |direction| {
                    let mut column = DVector::zeros(self.count());
                    column.rows_mut(first, self.receivers).copy_from(&direction);
                    column
                })
            })
            .collect();
        if columns.is_empty() { DMatrix::zeros(self.count(), 0) } else { DMatrix::from_columns(&columns) }
    }
}

/// Orthonormal columns that make up everything that is no combination of some columns.
fn beside(columns: &DMatrix<f64>) -> Vec<DVector<f64>> {
    let squares = (columns * columns.transpose()).symmetric_eigen();
    let each = squares.eigenvalues.iter().zip(squares.eigenvectors.column_iter());
    each.filter(|(value, _)| **value < 1e-6).map(|(_, column)| column.into_owned()).collect()
}

/// Places of the receivers by axis, from their middle, wavelengths.
fn centred(radar: &Radar) -> [Vec<f64>; 3] {
    std::array::from_fn(|axis| {
        let middle = radar.rx_m.iter().map(|at| at[axis]).sum::<f64>() / radar.rx_m.len() as f64;
        radar.rx_m.iter().map(|at| (at[axis] - middle) / radar.wavelength_m()).collect()
    })
}
