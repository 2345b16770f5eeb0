use super::TrackError;
use super::adjust::Pending;
use super::adjust::outlined::Outlining;
use super::clock::Clock;
use super::estimate::{Estimate, Status};
use super::frame::Frame;
use super::motion::Motion;
use super::motion::held_back::HeldBack;
use super::motion::jitter::Jitter;
use super::motion::outdated::Newest;
use super::pose::hypothesis::Hypothesis;
use super::pose::refine::Workspace;
use super::pose::search::{Deviation, Search};
use super::pose::verify::Quality;
use super::relocalize::{LookAlikes, Relocalizer};
use super::settings::TrackSettings;
use super::target::Target;
use super::target::points::Feature;
use super::target::solid::Solid;
use super::trust::{Parting, Trust};
use super::update::detect::Cells;
use super::update::growth::Evolving;
use crate::camera::{Camera, Observation};
use crate::evolve;
use crate::fitness::SurfacePoint;
use crate::pose::Pose;
use crate::shape::{Body, ShapeError};

/// Tracks a body in six degrees of freedom from observation to observation.
#[derive(Debug, Clone)]
pub struct Tracker {
    pub(super) settings: TrackSettings,
    pub(super) frame: Frame,
    pub(super) target: Target,
    pub(super) search: Search,
    pub(super) relocalizer: Relocalizer,
    pub(super) look_alikes: LookAlikes,
    pub(super) motion: Motion,
    pub(super) newest: Option<Newest>,
    pub(super) jitter: Jitter,
    pub(super) held_back: HeldBack,
    pub(super) workspace: Workspace,
    /// Another one, for poses that are compared with the one that is followed.
    pub(super) spare: Workspace,
    pub(super) fresh: Vec<Feature>,
    pub(super) cells: Cells,
    /// Running mean of the prediction error, in metres and radians.
    pub(super) innovation: Deviation,
    pub(super) status: Status,
    pub(super) trust: Trust,
    pub(super) parting: Parting,
    pub(super) cell: usize,
    pub(super) color_updates: usize,
    pub(super) pending: Option<Pending>,
    pub(super) outlining: Option<Outlining>,
    pub(super) evolving: Option<Evolving>,
    /// Whether the body changed since the last estimate.
    pub(super) has_evolved: bool,
    /// Number of the keyframe that the last pose belonged to.
    pub(super) keyframe: Option<usize>,
}

/// Margin of a window around the object, as a share of its size: the least, and the one used right
/// after the object was found.
const LEAST_MARGIN: f64 = 0.2;
pub(super) const MARGIN: f64 = 0.3;
/// Share of the newest prediction error in its running mean, for a pose that is measured well.
const INNOVATION_RATE: f64 = 0.3;

impl Tracker {
    /// Makes a tracker for cameras and a body.
    ///
    /// # Errors
    /// If there is no camera or a setting is out of its range.
    pub fn new(
        cameras: &[Camera],
        body: &Body,
        settings: TrackSettings,
    ) -> Result<Self, TrackError> {
        let settings = settings.checked()?;
        if cameras.is_empty() {
            return Err(TrackError::NoCamera);
        }
        let target = Target::new(body, &settings);
        Ok(Self {
            settings,
            frame: Frame::new(cameras),
            innovation: first_innovation(&target.solid),
            jitter: Jitter::new(target.solid.radius),
            held_back: HeldBack::default(),
            target,
            search: Search::new(settings.population, evolve::rng(settings.seed, 0))?,
            relocalizer: Relocalizer::new(settings.seed),
            look_alikes: LookAlikes::new(cameras),
            motion: Motion::at_rest(0.0, body.world_from_object()),
            newest: None,
            workspace: Workspace::default(),
            spare: Workspace::default(),
            fresh: Vec::new(),
            cells: Cells::default(),
            status: Status::Searching,
            trust: Trust::unstarted(),
            parting: Parting::default(),
            cell: 0,
            color_updates: 0,
            pending: None,
            outlining: None,
            evolving: None,
            has_evolved: false,
            keyframe: None,
        })
    }

    /// Estimates the object's pose in the next observation.
    ///
    /// # Errors
    /// If there is not one entry per camera, the time stamp is not finite, or neither `start`,
    /// `recall` nor `find` was called before.
    pub fn step(&mut self, observation: &Observation<'_>) -> Result<Estimate, TrackError> {
        let mut clock = Clock::start();
        self.frame.check(observation)?;
        if !self.trust.is_started() && !self.target.has_appearance() {
            return Err(TrackError::NotStarted);
        }
        self.take_adjusted();
        self.take_outlined();
        self.has_evolved |= self.take_evolved()?;
        let mut expected = self.motion.predict(observation.time_s);
        if self.is_outdated(observation) {
            self.frame.shut();
        }
        let mut hypothesis = Hypothesis::nothing(expected, self.target.solid.radius);
        let (mut least, mut evaluations) = (self.least_share(), 0);
        let visible = self.open_windows(observation, &expected, self.margin());
        self.predict_blur(&expected);
        clock.lap(|timing| &mut timing.prepare);
        if visible {
            let (guess, scored) = self.search_around(observation, &expected, &clock)?;
            evaluations += scored;
            clock.lap(|timing| &mut timing.search);
            hypothesis = self.refined(observation, &expected, &guess);
            clock.lap(|timing| &mut timing.refine);
        }
        let missed = hypothesis.quality.share < least;
        if !missed && self.trust.is_proved() {
            let budget = self.settings.budget_s;
            if self.needs_rival(&hypothesis.quality) && !clock.is_over(budget) {
                evaluations += self.compare_with_rival(observation, &expected, &mut hypothesis)?;
            }
            if !clock.is_over(budget) {
                evaluations +=
                    self.return_to_known_side(observation, &mut expected, &mut hypothesis)?;
            }
            if !clock.is_over(budget) {
                evaluations += self.check_side_again(observation, &expected, &mut hypothesis);
            }
            clock.lap(|timing| &mut timing.search);
        }
        if (missed || !self.trust.is_proved()) && self.frame.can_see() {
            least = self.settings.trusted;
            evaluations += self.relocalize(observation, &expected, &mut hypothesis)?;
            if self.has_jumped(&expected, &hypothesis.pose) {
                // An object found there is relocalized and no longer followed.
                self.status = self.trust.without();
            }
            clock.lap(|timing| &mut timing.search);
        }
        self.accept_or_miss(observation.time_s, &expected, &hypothesis, least);
        self.note_dropped(self.status == Status::Tracking);
        self.note_newest(observation);
        if self.status == Status::Tracking {
            self.follow_held_back(observation, &hypothesis);
            self.compare_depths(observation, &hypothesis.pose);
            self.seek_parted(observation, &hypothesis);
            self.workspace.occlusion.remember();
        } else {
            self.workspace.occlusion.forget();
        }
        let mut estimate = self.estimate(observation, &hypothesis);
        if estimate.located {
            let sd_rad = self.target.points.turn_variance().sqrt();
            self.trust.found_turn.follow(observation.time_s, &hypothesis.pose, sd_rad);
            self.keep_surely_seen(observation, &hypothesis);
        }
        clock.lap(|timing| &mut timing.verify);
        if self.target.keyframes.is_open() {
            self.keep_keyframe(observation, &hypothesis);
        }
        if self.status == Status::Tracking && !self.frame.is_stale() {
            self.update(observation, &hypothesis);
        } else {
            self.trust.cool_down();
        }
        if self.status != Status::Tracking {
            self.target.keyframes.followed = false;
        }
        clock.lap(|timing| &mut timing.update);
        (estimate.evaluations, estimate.timing) = (evaluations, clock.timing());
        Ok(estimate)
    }

    /// Returns the body at its latest pose.
    ///
    /// # Errors
    /// Never, as long as the given body is valid.
    pub fn body(&self) -> Result<Body, ShapeError> {
        Body::new(self.motion.last(), self.target.body.ellipsoids().to_vec())
    }

    /// Returns the pose of the object at a keyframe, by its number, as currently estimated.
    pub fn keyframe_pose(&self, number: usize) -> Option<Pose> {
        self.target.keyframes.pose(number)
    }

    /// Returns the surface points in the object's frame, edgels included.
    pub fn surface(&self) -> impl Iterator<Item = &SurfacePoint> {
        self.target.points.features.iter().map(|known| &known.point)
    }

    /// Accepts a hypothesis whose share is at least `least`, or else counts a miss.
    pub(super) fn accept_or_miss(
        &mut self,
        time_s: f64,
        expected: &Pose,
        hypothesis: &Hypothesis,
        least: f64,
    ) {
        if hypothesis.quality.share < least {
            self.trust.miss();
            self.status = self.trust.without();
            self.motion.wait(time_s, self.process_noise());
            self.jitter.pause();
            self.held_back.pause();
            return;
        }
        let relocalized = self.status != Status::Tracking;
        let known = hypothesis.normal.covariance();
        // A jump from one image to the next is fast motion; otherwise the last pose implies no
        // motion.
        let (went_on, followed) = (self.trust.is_unbroken(), self.trust.was_followed());
        self.status = Status::Tracking;
        self.search.follow(expected, &hypothesis.pose, self.search_range());
        let drifted = self.target.points.drift_variance;
        let foreseen = self.motion.turn_variance_at(time_s, self.process_noise());
        self.follow_drift(hypothesis, Some(foreseen).filter(|_| !relocalized));
        if followed {
            self.close_loop(expected, hypothesis, drifted);
        }
        let usual = self.least_share_of_print();
        if relocalized || !self.is_landed(expected, hypothesis) {
            self.trust.found_turn.find(time_s, &hypothesis.pose);
        }
        if relocalized {
            self.held_back.pause();
            if went_on {
                self.motion.follow(time_s, hypothesis.pose, &known, self.process_noise());
            } else {
                self.motion = Motion::at_rest(time_s, hypothesis.pose);
            }
            self.innovation = first_innovation(&self.target.solid);
            self.accept_as(&hypothesis.quality, false, usual);
            return;
        }
        let goes_on = self.is_landed(expected, hypothesis);
        self.accept_as(&hypothesis.quality, goes_on, usual);
        self.target.bias.update(
            &hypothesis.toward,
            hypothesis.normal.outline,
            hypothesis.normal.rest(),
        );
        // The correction of a loop closure is not a motion.
        let off = (self.motion.predict(time_s).inverse() * hypothesis.pose).log();
        let gains = self.motion.follow(time_s, hypothesis.pose, &known, self.process_noise());
        self.jitter.follow(time_s, hypothesis.pose);
        let (across, turned) = (off.fixed_rows::<3>(0).norm(), off.fixed_rows::<3>(3).norm());
        self.innovation.0 += INNOVATION_RATE * gains.0 * (across - self.innovation.0);
        self.innovation.1 += INNOVATION_RATE * gains.1 * (turned - self.innovation.1);
    }

    /// Accepts a pose, and uses all that was recalled of the points once the object is proved.
    fn accept_as(&mut self, quality: &Quality, goes_on: bool, usual: f64) {
        self.trust.accept(quality, &self.target.reference, goes_on, usual);
        if self.trust.is_confirmed() {
            self.target.points.features.iter_mut().for_each(Feature::release);
        }
    }

    /// Returns the margin of a window around the object, as a share of its size, that covers the
    /// search range.
    fn margin(&self) -> f64 {
        let (across, turned) = self.search_range();
        // The object's image is about two radii long.
        let beyond = 0.5 * (across / self.target.solid.radius + turned);
        if self.status == Status::Tracking { beyond.clamp(LEAST_MARGIN, MARGIN) } else { MARGIN }
    }
}

/// Initial prediction error of an object whose motion is unknown: in metres and radians.
fn first_innovation(solid: &Solid) -> Deviation {
    (0.2 * solid.radius, 0.1)
}
