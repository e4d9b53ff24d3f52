//! Samples of one chirp that another radar or an impulse hit.

/// A hit stretch of one chirp.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Burst {
    pub frame: usize,
    pub channel: usize,
    pub chirp: usize,
    pub first: usize,
    pub last: usize,
}

impl Burst {
    pub fn overlaps(&self, other: &Self) -> bool {
        (self.frame, self.channel, self.chirp) == (other.frame, other.channel, other.chirp)
            && self.first <= other.last
            && other.first <= self.last
    }
}
