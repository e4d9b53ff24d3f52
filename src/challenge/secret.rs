//! The secret that all random numbers of a challenge come from.

use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use serde::{Deserialize, Serialize};
use sha2::{Digest, Sha256};

use crate::data::hex;

/// 32 bytes, as hexadecimal digits in `sealed/secret.toml`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Secret {
    pub seed: String,
}

impl Secret {
    /// From whatever text the user gave, or from the operating system; a secret that was published is taken as it is.
    pub fn new(text: Option<&str>) -> Self {
        let is_secret = |text: &str| text.len() == 64 && text.bytes().all(|digit| matches!(digit, b'0'..=b'9' | b'a'..=b'f'));
        match text {
            Some(text) if is_secret(text) => Self { seed: text.into() },
            Some(text) => Self { seed: hex(&<[u8; 32]>::from(Sha256::digest(text.as_bytes()))) },
            None => Self { seed: hex(&rand::random::<[u8; 32]>()) },
        }
    }

    fn derived(&self, purpose: &str, index: usize) -> [u8; 32] {
        Sha256::digest(format!("{}|{purpose}|{index}", self.seed)).into()
    }

    /// The random numbers of one purpose and case; knowing one stream says nothing about another.
    pub fn random(&self, purpose: &str, index: usize) -> ChaCha8Rng {
        ChaCha8Rng::from_seed(self.derived(purpose, index))
    }

    /// The recorder's seed of a case.
    pub fn world_seed(&self, index: usize) -> u64 {
        // TOML has no unsigned numbers of 64 bits.
        u64::from_le_bytes(self.derived("world", index)[..8].try_into().expect("eight bytes")) >> 1
    }

    /// A name that says nothing.
    pub fn name(&self, index: usize) -> String {
        hex(&self.derived("name", index)[..8])
    }

    /// 32 bytes as hexadecimal digits, which hide a case's truth in its leaf.
    pub fn salt(&self, index: usize) -> String {
        hex(&self.derived("salt", index))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn equal_texts_give_equal_secrets_and_the_system_gives_new_ones() {
        assert_eq!(Secret::new(Some("a")), Secret::new(Some("a")));
        assert_ne!(Secret::new(Some("a")), Secret::new(Some("b")));
        assert_ne!(Secret::new(None), Secret::new(None));
        let drawn = Secret::new(None);
        assert_eq!(Secret::new(Some(&drawn.seed)), drawn);
        let secret = Secret::new(Some("a"));
        assert_ne!(secret.name(0), secret.name(1));
        assert_eq!((secret.name(0).len(), secret.salt(0).len()), (16, 64));
    }
}
