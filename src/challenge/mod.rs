//! The proof on concealed data: cases drawn by a secret, committed to before anybody diagnoses them, answered by
//! separate processes that cannot see the truth, and scored by rules that were fixed beforehand.
//!
//! The way of a case, in the order of the files:
//! - [`config`], [`structures`], [`secret`]: what may be drawn, and by which random numbers
//! - [`library`], `possible`, [`rules`]: graded effects; which of them a radar cannot have; look-alike sets and thresholds, fixed before any
//!   sealed run
//! - [`plan`], [`measure`], [`surviving`], [`seal`]: a case is drawn, recorded, its effect measured, and everything committed to
//! - [`commitment`]: leaves, their Merkle root, and their verification
//! - [`answer`]: one process per case, and what it answered
//! - [`twins`]: the same scenes without their effects, for what a perfect diagnosis would be left with
//! - [`salt`]: the same with effects put into somebody's recording; [`calibrate`]: what nulls of somebody's radar say
//! - [`report`], [`truth`], [`judge`], [`psychometric`], [`baselines`], [`table`], [`score`]: reports held against truths

pub mod answer;
pub mod baselines;
pub mod calibrate;
pub mod commitment;
pub mod config;
pub mod judge;
pub mod library;
pub mod measure;
pub mod plan;
mod possible;
pub mod psychometric;
pub mod report;
pub mod rules;
pub mod salt;
pub mod score;
pub mod seal;
mod sealing;
pub mod secret;
pub mod structures;
pub mod surviving;
pub mod table;
pub mod truth;
pub mod twins;
mod uniformity;
mod worker;

pub use config::ChallengeConfig;
