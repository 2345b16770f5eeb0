//! The kinematics of a chain of revolute joints.

use super::ArmError;
use super::jacobian::Jacobian;
use super::moving::{matrix_of, place, rows_of};
use crate::pose::Pose;
use crate::pose::exact::Rows;

/// A joint with its link by modified Denavit-Hartenberg parameters: the former joint's frame is
/// turned about its x axis and shifted along the new z axis, about which the joint turns.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Link {
    /// The turn about the x axis in radians.
    pub twist: f64,
    /// The shift along the joint's axis in metres.
    pub along: f64,
}

/// A chain of revolute joints whose base is the world, with a hand at its end.
///
/// Source: Craig, *Introduction to Robotics* (1986), Sec. 3.4.
#[derive(Debug, Clone)]
pub struct Chain {
    links: Vec<Parts>,
    flange_from_hand: Rows,
}

/// A link's frame in the former one is fixed + cos(angle) cosine + sin(angle) sine.
#[derive(Debug, Clone)]
struct Parts {
    fixed: Rows,
    cosine: Rows,
    sine: Rows,
}

impl Chain {
    /// Joins links, from the base on, and a hand to the last one.
    ///
    /// # Errors
    /// If there is no link.
    pub fn new(links: &[Link], flange_from_hand: &Pose) -> Result<Self, ArmError> {
        if links.is_empty() {
            return Err(ArmError::NoLink);
        }
        let links = links.iter().map(Parts::of).collect();
        Ok(Self { links, flange_from_hand: rows_of(flange_from_hand) })
    }

    /// Returns the number of joints.
    #[must_use]
    pub fn count(&self) -> usize {
        self.links.len()
    }

    /// Returns the pose of the hand for angles in radians; those after the chain's do not move it.
    ///
    /// # Errors
    /// If there are fewer angles than joints, or one is not finite.
    pub fn world_from_hand(&self, positions: &[f64]) -> Result<Pose, ArmError> {
        let hand = self.frames(positions)?.1;
        Ok(Pose::from_matrix(&matrix_of(&hand))?)
    }

    /// Returns the hand's Jacobian for angles in radians, with a column for each of them; those
    /// after the chain's are 0.
    ///
    /// # Errors
    /// If there are fewer angles than joints.
    pub fn jacobian(&self, positions: &[f64]) -> Result<Jacobian, ArmError> {
        let (frames, hand) = self.frames(positions)?;
        let end = place(&hand);
        let mut jacobian = Rows::zeros(6, positions.len());
        for (joint, frame) in frames.iter().enumerate() {
            let axis: [f64; 3] = std::array::from_fn(|i| frame.at(i, 2));
            let from = place(frame);
            let [x, y, z]: [f64; 3] = std::array::from_fn(|i| end[i] - from[i]);
            let linear =
                [axis[1] * z - axis[2] * y, axis[2] * x - axis[0] * z, axis[0] * y - axis[1] * x];
            for (row, value) in linear.into_iter().chain(axis).enumerate() {
                *jacobian.at_mut(row, joint) = value;
            }
        }
        Jacobian::new(jacobian)
    }

    /// Returns the frames of the links in the world, and that of the hand.
    fn frames(&self, positions: &[f64]) -> Result<(Vec<Rows>, Rows), ArmError> {
        if positions.len() < self.count() {
            return Err(ArmError::Few { given: positions.len(), least: self.count() });
        }
        let mut frames: Vec<Rows> = Vec::with_capacity(self.count());
        for (link, &angle) in self.links.iter().zip(positions) {
            let link = link.at(angle);
            frames.push(match frames.last() {
                Some(last) => last.times(&link),
                None => link,
            });
        }
        let hand = frames[frames.len() - 1].times(&self.flange_from_hand);
        Ok((frames, hand))
    }
}

impl Parts {
    fn of(link: &Link) -> Self {
        let (cos, sin, along) = (libm::cos(link.twist), libm::sin(link.twist), link.along);
        let rows = |numbers: [f64; 16]| Rows { numbers: numbers.to_vec(), columns: 4 };
        Self {
            fixed: rows([
                0.0,
                0.0,
                0.0,
                0.0, //
                0.0,
                0.0,
                -sin,
                -sin * along, //
                0.0,
                0.0,
                cos,
                cos * along, //
                0.0,
                0.0,
                0.0,
                1.0,
            ]),
            cosine: rows([
                1.0, 0.0, 0.0, 0.0, //
                0.0, cos, 0.0, 0.0, //
                0.0, sin, 0.0, 0.0, //
                0.0, 0.0, 0.0, 0.0,
            ]),
            sine: rows([
                0.0, -1.0, 0.0, 0.0, //
                cos, 0.0, 0.0, 0.0, //
                sin, 0.0, 0.0, 0.0, //
                0.0, 0.0, 0.0, 0.0,
            ]),
        }
    }

    fn at(&self, angle: f64) -> Rows {
        let cosine = self.cosine.scaled(libm::cos(angle));
        self.fixed.clone().plus(&cosine).plus(&self.sine.scaled(libm::sin(angle)))
    }
}
