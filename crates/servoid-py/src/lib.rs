//! Python bindings of the core: convert arguments, release the interpreter, call, convert results.

mod backend;
mod camera;
mod errors;
mod exact;
mod given_images;
mod held;
mod model;
mod pose;
mod relay;
mod servo;
mod settings;
mod shape;
mod sim;
mod taking;
mod track;

use pyo3::prelude::*;

#[pymodule(name = "_native")]
fn native(module: &Bound<'_, PyModule>) -> PyResult<()> {
    module.add("__version__", env!("CARGO_PKG_VERSION"))?;
    module.add_function(wrap_pyfunction!(backend::backend, module)?)?;
    module.add_function(wrap_pyfunction!(backend::backends, module)?)?;
    module.add_function(wrap_pyfunction!(backend::force_backend, module)?)?;
    // An invalid name is reported at import, and not by each call that would use it.
    backend::force_named()?;
    exact::add_to(module)?;
    module.add_class::<pose::Pose>()?;
    module.add_class::<camera::Camera>()?;
    module.add_class::<camera::lens::Lens>()?;
    module.add_class::<camera::View>()?;
    module.add_class::<shape::Body>()?;
    module.add_class::<shape::Mesh>()?;
    module.add_class::<shape::Soup>()?;
    module.add_class::<track::estimate::Estimate>()?;
    module.add_class::<track::one_step::OneStepSettings>()?;
    module.add_class::<track::one_step::OneStepTracker>()?;
    module.add_class::<track::settings::TrackSettings>()?;
    module.add_class::<track::Tracker>()?;
    module.add_function(wrap_pyfunction!(camera::taken_image, module)?)?;
    module.add_function(wrap_pyfunction!(camera::taken_mask, module)?)?;
    module.add_function(wrap_pyfunction!(track::taken_depth, module)?)?;
    module.add_function(wrap_pyfunction!(track::from_masks::pose_from_masks, module)?)?;
    module.add_function(wrap_pyfunction!(track::from_masks::poses_from_masks, module)?)?;
    servo::add_to(module)?;
    module.add_class::<sim::Paint>()?;
    module.add_class::<sim::Lighting>()?;
    module.add_class::<sim::Scene>()?;
    module.add_class::<model::ModelInput>()?;
    module.add_class::<model::ModelSettings>()?;
    module.add_class::<model::Step>()?;
    module.add_function(wrap_pyfunction!(model::fit_body, module)?)?;
    module.add_function(wrap_pyfunction!(model::initial_body, module)?)?;
    module.add_function(wrap_pyfunction!(model::surface_coverage, module)?)?;
    module.add_class::<model::paper::PaperSettings>()?;
    module.add_function(wrap_pyfunction!(model::paper::fit_paper, module)?)?;
    module.add_function(wrap_pyfunction!(model::paper::paper_scores, module)?)?;
    module.add_function(wrap_pyfunction!(model::silhouette_ious, module)?)?;
    module.add_function(wrap_pyfunction!(model::ellipsoid_colors, module)?)?;
    Ok(())
}
