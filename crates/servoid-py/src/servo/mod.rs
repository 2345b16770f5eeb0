mod bounds;
mod chain;
mod hand;
mod joints;
mod motion;
mod moving;
mod taking;

use pyo3::prelude::*;

/// Adds these classes and functions to the module.
pub fn add_to(module: &Bound<'_, PyModule>) -> PyResult<()> {
    module.add_class::<motion::MotionModel>()?;
    module.add_class::<motion::MotionPrior>()?;
    module.add_class::<motion::Noise>()?;
    module.add_class::<motion::Measurement>()?;
    module.add_class::<motion::Motion>()?;
    module.add_function(wrap_pyfunction!(motion::predicted_motion, module)?)?;
    module.add_function(wrap_pyfunction!(motion::certain_twist, module)?)?;
    module.add_function(wrap_pyfunction!(motion::spread_at, module)?)?;
    module.add_class::<moving::Moving>()?;
    module.add_function(wrap_pyfunction!(moving::shifted_and_turned, module)?)?;
    module.add_function(wrap_pyfunction!(moving::change_between, module)?)?;
    module.add_function(wrap_pyfunction!(hand::hand_correction, module)?)?;
    module.add_function(wrap_pyfunction!(hand::quaternion_error, module)?)?;
    module.add_function(wrap_pyfunction!(hand::twist_shares, module)?)?;
    module.add_function(wrap_pyfunction!(hand::twist_within, module)?)?;
    module.add_function(wrap_pyfunction!(hand::fixation, module)?)?;
    module.add_function(wrap_pyfunction!(hand::seen_from_head, module)?)?;
    module.add_class::<chain::Chain>()?;
    module.add_class::<joints::QuadraticLaw>()?;
    module.add_function(wrap_pyfunction!(joints::is_between, module)?)?;
    module.add_function(wrap_pyfunction!(joints::hand_weights, module)?)?;
    module.add_function(wrap_pyfunction!(joints::lost_speed, module)?)?;
    module.add_function(wrap_pyfunction!(joints::newton_turn, module)?)?;
    module.add_class::<joints::JointLimits>()?;
    module.add_function(wrap_pyfunction!(joints::stoppable_speed, module)?)?;
    module.add_class::<bounds::HandLimits>()?;
    module.add_class::<bounds::Balls>()?;
    module.add_class::<bounds::Workspace>()?;
    module.add_class::<bounds::VelocityLimits>()
}
