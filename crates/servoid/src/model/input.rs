use super::ModelError;
use crate::camera::View;
use crate::changing::changeable;
use crate::fitness::RangeSample;
use crate::shape::Mesh;

/// The evidence to model from; at least one part must not be empty.
#[derive(Debug, Clone, Copy, Default)]
#[non_exhaustive]
pub struct ModelInput<'a> {
    /// Images in which the object is marked.
    pub views: &'a [View<'a>],
    /// The object's complete, closed surface.
    pub mesh: Option<&'a Mesh>,
    /// Measured points of its surface.
    pub samples: &'a [RangeSample],
    /// Weight of each kind of evidence.
    pub weights: Weights,
}

/// Weight of each kind of evidence: with weight 2 it counts as if it had been observed twice.
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub struct Weights {
    /// Silhouettes, of views or of a mesh.
    pub silhouettes: f64,
    /// The volume of a mesh.
    pub volume: f64,
    /// Measured points of the surface.
    pub depth: f64,
}

changeable!(ModelInput<'_>, Weights);

impl Weights {
    /// Checks that each weight is a number of at least 0.
    pub(super) fn check(&self) -> Result<(), ModelError> {
        let Self { silhouettes, volume, depth } = *self;
        for (name, given) in
            [("silhouette_weight", silhouettes), ("volume_weight", volume), ("depth_weight", depth)]
        {
            if !(0.0..f64::INFINITY).contains(&given) {
                let (allowed, given) = ("a number of at least 0".into(), given.to_string());
                return Err(ModelError::Setting { name, allowed, given });
            }
        }
        Ok(())
    }
}

impl Default for Weights {
    fn default() -> Self {
        Self { silhouettes: 1.0, volume: 10.0, depth: 1.0 }
    }
}
