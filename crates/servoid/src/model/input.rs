use super::ModelError;
use crate::camera::View;
use crate::changing::changeable;
use crate::fitness::RangeSample;
use crate::shape::Mesh;

/// What modelling starts from; at least one part must say something.
#[derive(Debug, Clone, Copy, Default)]
#[non_exhaustive]
pub struct ModelInput<'a> {
    /// Pictures that say where the object is.
    pub views: &'a [View<'a>],
    /// The object's surface, whole and closed.
    pub mesh: Option<&'a Mesh>,
    /// Points of its surface that were seen.
    pub samples: &'a [RangeSample],
    /// How often each of them counts.
    pub weights: Weights,
}

/// How often each kind of evidence counts: with weight 2 it speaks as if it had been seen twice.
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub struct Weights {
    /// Silhouettes, of views or of a mesh.
    pub silhouettes: f64,
    /// The volume of a mesh.
    pub volume: f64,
    /// Seen points of the surface.
    pub depth: f64,
}

changeable!(ModelInput<'_>, Weights);

impl Weights {
    /// Checks that each is a number of at least 0.
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
