use pyo3::prelude::*;
use servoid::{camera, evolve, fitness, model, pose, render, servo, shape, track};

/// An error of the core with a class in `servoid.errors`.
pub trait Named: std::error::Error {
    fn class(&self) -> &'static str;
}

impl Named for pose::PoseError {
    fn class(&self) -> &'static str {
        "PoseError"
    }
}

impl Named for camera::CameraError {
    fn class(&self) -> &'static str {
        "CameraError"
    }
}

impl Named for camera::RigError {
    fn class(&self) -> &'static str {
        "ImageError"
    }
}

impl Named for camera::ImageError {
    fn class(&self) -> &'static str {
        match self {
            Self::MaskChannels | Self::EmptyMask { .. } | Self::FullMask { .. } => "MaskError",
            _ => "ImageError",
        }
    }
}

impl Named for shape::ShapeError {
    fn class(&self) -> &'static str {
        "BodyError"
    }
}

impl Named for fitness::BackendError {
    fn class(&self) -> &'static str {
        "BackendError"
    }
}

impl Named for fitness::RangeSampleError {
    fn class(&self) -> &'static str {
        "ModelError"
    }
}

impl Named for evolve::GaError {
    fn class(&self) -> &'static str {
        "ModelError"
    }
}

impl Named for model::ModelError {
    fn class(&self) -> &'static str {
        match self {
            Self::Image(error) => error.class(),
            Self::Picture(error) => error.class(),
            Self::Camera(error) => error.class(),
            Self::Shape(error) => error.class(),
            _ => "ModelError",
        }
    }
}

impl Named for track::TrackError {
    fn class(&self) -> &'static str {
        match self {
            Self::Model(error) => error.class(),
            Self::Shape(error) => error.class(),
            Self::Image(error) => error.class(),
            _ => "TrackError",
        }
    }
}

impl Named for track::OneStepError {
    fn class(&self) -> &'static str {
        match self {
            Self::Observation(error) => error.class(),
            Self::Image(error) => error.class(),
            _ => "TrackError",
        }
    }
}

impl Named for servo::MotionError {
    fn class(&self) -> &'static str {
        "ServoError"
    }
}

impl Named for servo::ArmError {
    fn class(&self) -> &'static str {
        match self {
            Self::Pose(error) => error.class(),
            _ => "ServoError",
        }
    }
}

impl Named for render::RenderError {
    fn class(&self) -> &'static str {
        "SimError"
    }
}

/// Converts an error of the core to a Python exception.
pub fn raise(error: impl Named) -> PyErr {
    named(error.class(), error.to_string())
}

/// Makes a Python exception of a class of `servoid.errors`.
pub fn named(class: &str, message: String) -> PyErr {
    Python::attach(|py| {
        let made = py
            .import("servoid.errors")
            .and_then(|errors| errors.getattr(class))
            .and_then(|class| class.call1((message,)));
        made.map_or_else(|missing| missing, PyErr::from_value)
    })
}
