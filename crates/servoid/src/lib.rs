#![doc = include_str!("../README.md")]

pub mod camera;
mod changing;
pub mod evolve;
pub mod fitness;
pub mod model;
mod parallel;
pub mod pose;
#[cfg(feature = "render")]
pub mod render;
pub mod servo;
pub mod shape;
mod simd;
pub mod track;
pub mod words;
