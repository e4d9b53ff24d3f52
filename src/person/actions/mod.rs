//! The eight actions.
