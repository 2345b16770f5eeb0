//! Computes hypotheses of the pose from the images of one instant and the target.

pub(super) mod align;
pub(super) mod confidence;
pub(super) mod guess;
pub(super) mod hypothesis;
pub(super) mod lines;
pub(super) mod matching;
pub(super) mod measurement;
pub(super) mod refine;
pub(super) mod search;
pub(super) mod uncertainty;
pub(super) mod verify;
pub(super) mod weakest_turn;
