//! Receivers that a board feeds from the opposite side: the samples of such a one are turned by half a turn, and are turned back here.

use super::boards::Board;
use crate::data::IfFrame;

/// Which places of a recording such receivers take, of receivers in the board's numbers.
pub fn places(board: &Board, receivers: impl IntoIterator<Item = usize>) -> Vec<usize> {
    receivers.into_iter().enumerate().filter(|(_, rx)| board.inverted_rx.contains(rx)).map(|(place, _)| place).collect()
}

/// That samples are negated; none where they are not.
pub fn note(inverted: &[usize]) -> Option<String> {
    (!inverted.is_empty()).then(|| format!("receivers {inverted:?} are fed from the opposite side: their samples are negated"))
}

/// The same of an array, whose maker may have turned the samples back: `keys` of the antennas that `board` places.
pub fn note_of_array(inverted: &[usize], board: &Board, keys: &[&str]) -> Option<String> {
    let sets = keys.iter().map(|key| format!("--set radar.{key}=[…]")).collect::<Vec<_>>().join(" and ");
    note(inverted).map(|note| {
        format!(
            "{note}, as raw samples of the {} need it; samples that were turned back before are kept as they are without --board: give \
             {sets} instead",
            board.name
        )
    })
}

/// A frame with the samples of these receivers turned back.
pub fn turned_back(mut frame: IfFrame, inverted: &[usize]) -> IfFrame {
    let [_, n_rx, loops, samples] = frame.dims;
    for part in [Some(&mut frame.re), frame.im.as_mut()].into_iter().flatten().filter(|_| !inverted.is_empty()) {
        let receivers = part.chunks_exact_mut(loops * samples).enumerate();
        let turned = receivers.filter(|(place, _)| inverted.contains(&(place % n_rx))).flat_map(|(_, values)| values);
        turned.for_each(|value| *value = -*value);
    }
    frame
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn samples_of_inverted_receivers_are_turned_back_and_others_are_kept() {
        let values: Vec<f32> = (1..=24).map(|value| value as f32).collect();
        let frame = |values: Vec<f32>| IfFrame::new([2, 3, 2, 2], values.clone(), Some(values));
        let turned = values.iter().enumerate().map(|(place, value)| if place / 4 % 3 == 1 { *value } else { -value }).collect();
        assert_eq!(turned_back(frame(values.clone()), &[0, 2]), frame(turned));
        assert_eq!(turned_back(frame(values.clone()), &[]), frame(values));
    }

    #[test]
    fn places_count_among_the_receivers_that_are_on() {
        let board = Board::named("IWR6843AOP").unwrap();
        assert_eq!(places(board, 0..4), [0, 2]);
        assert_eq!(places(board, [1, 2, 3]), [1]);
        assert_eq!((places(board, [1, 3]), note(&[])), (vec![], None));
    }
}
