//! Looks at an object that nobody described and models it as a handful of ellipsoids.
//!
//! The crate is the pure core of servoid: it reads no files, prints nothing and knows no Python.
//! Modules stand on floors and look only downwards:
//! [`pose`] < [`camera`] < [`shape`] < [`fitness`], [`evolve`] < [`model`] < [`track`] < [`sim`].
//!
//! Lengths are metres, angles radians, poses map `a_from_b`; pixel (0, 0) is the *centre* of the
//! top-left pixel and cameras look along +z with x to the right and y down.

pub mod camera;
pub mod evolve;
pub mod fitness;
pub mod model;
pub mod pose;
pub mod shape;
pub mod sim;
pub mod track;
pub mod words;
