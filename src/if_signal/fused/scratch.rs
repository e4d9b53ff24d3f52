//! Memory that is used again: fresh pages of tens of megabytes cost as much time as what is computed in them.

use std::ops::{Deref, DerefMut};
use std::sync::Mutex;

use super::lanes::{Lanes, ZERO};

/// Kept between uses at most, in lanes: 128 MB.
const KEPT: usize = 1 << 21;

static FREE: Mutex<Vec<Vec<Lanes>>> = Mutex::new(Vec::new());

/// Lanes of an unknown content, given back when dropped.
pub struct Scratch(Vec<Lanes>);

impl Scratch {
    pub fn new(length: usize) -> Self {
        // Calls repeat, and so do the lengths they ask for.
        let mut free = FREE.lock().unwrap_or_else(|poisoned| poisoned.into_inner());
        let found = free.iter().position(|memory| memory.len() == length).map(|index| free.swap_remove(index));
        drop(free);
        Self(found.unwrap_or_else(|| vec![ZERO; length]))
    }
}

fn keep(memory: Vec<Lanes>) {
    let mut free = FREE.lock().unwrap_or_else(|poisoned| poisoned.into_inner());
    free.push(memory);
    // Those unused for longest go first.
    while free.iter().map(Vec::len).sum::<usize>() > KEPT {
        free.remove(0);
    }
}

impl Drop for Scratch {
    fn drop(&mut self) {
        keep(std::mem::take(&mut self.0));
    }
}

impl Deref for Scratch {
    type Target = [Lanes];

    fn deref(&self) -> &[Lanes] {
        &self.0
    }
}

impl DerefMut for Scratch {
    fn deref_mut(&mut self) -> &mut [Lanes] {
        &mut self.0
    }
}
