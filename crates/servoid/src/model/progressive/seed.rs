use nalgebra::{Matrix3, Vector3};

use crate::evolve::{Ga, Rng};
use crate::fitness::Fitness;
use crate::model::{ModelError, Settings};
use crate::pose::even_turn;
use crate::shape::Quadric;

/// Search range of later ellipsoids around the origin, in units of the object's mean radius.
const REACH: f64 = 2.0;

/// Range of the radii in a search, in units of the object's mean radius.
const RADII: (f64, f64) = (0.06, 1.2);

/// Evolves one more ellipsoid; its centre lies on the surface of an existing one, as in the paper,
/// or anywhere about the origin. `open` scores its gain.
pub(in crate::model) fn search(
    open: &dyn Fitness,
    current: &[Quadric],
    settings: &Settings,
    rng: Rng,
) -> Result<Quadric, ModelError> {
    let size = (libm::log(RADII.0), libm::log(RADII.1));
    let (place, share) = ((-1.0, 1.0), (0.0, 1.0));
    let ranges = [place, place, place, size, size, size, share, share, share, share];
    let mut ga = Ga::new(&ranges, settings.search, rng)?;
    for _ in 0..settings.generations {
        let quadrics: Vec<_> =
            ga.ask().iter().map(|individual| decode(&individual.genes, current)).collect();
        let scores: Vec<_> =
            quadrics.iter().map(|quadric| open.score(std::slice::from_ref(quadric))).collect();
        ga.tell(&scores)?;
    }
    Ok(decode(&ga.best().genes, current))
}

/// Decodes the genes of an ellipsoid: position (3), logarithms of the radii (3), rotation (3),
/// parent (1).
fn decode(genes: &[f64], current: &[Quadric]) -> Quadric {
    let place = Vector3::new(genes[0], genes[1], genes[2]);
    let radii = Vector3::new(libm::exp(genes[3]), libm::exp(genes[4]), libm::exp(genes[5]));
    let turn = even_turn(genes[6], genes[7], genes[8]);
    let factor = turn.to_rotation_matrix().into_inner() * Matrix3::from_diagonal(&radii);
    // A share of the gene's range stands for an independent position: an object may have parts that
    // do not touch.
    let parent = (genes[9] * (current.len() + 1) as f64) as usize;
    let center = match current.get(parent) {
        Some(parent) => parent.center + parent.factor * place.normalize(),
        None if current.is_empty() => place,
        None => place * REACH,
    };
    Quadric { center, factor }
}
