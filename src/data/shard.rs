//! Work that is divided between processes.

use std::str::FromStr;

/// Which part of the work is dealt with: number (from 1) and count, written `2/8`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Shard {
    pub number: usize,
    pub of: usize,
}

impl Shard {
    /// All of the work, in one part.
    pub const ALL: Self = Self { number: 1, of: 1 };

    /// Whether the part has the piece of work with this index, from 0.
    pub fn holds(&self, index: usize) -> bool {
        index % self.of == self.number - 1
    }
}

impl FromStr for Shard {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let (number, of) = text.split_once('/').ok_or("write i/n, such as 2/8")?;
        let parse = |part: &str| part.parse::<usize>().map_err(|_| format!("{part} is no whole number"));
        let shard = Self { number: parse(number)?, of: parse(of)? };
        if (1..=shard.of).contains(&shard.number) { Ok(shard) } else { Err("i must be between 1 and n".into()) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn shards_hold_everything_once_and_are_written_as_fractions() {
        for index in 0..9 {
            let holders = (1..=3).filter(|&number| Shard { number, of: 3 }.holds(index)).count();
            assert_eq!(holders, 1);
        }
        assert!((0..9).all(|index| Shard::ALL.holds(index)));
        assert_eq!("2/8".parse(), Ok(Shard { number: 2, of: 8 }));
        for wrong in ["0/8", "9/8", "2", "a/b"] {
            assert!(wrong.parse::<Shard>().is_err(), "{wrong}");
        }
    }
}
