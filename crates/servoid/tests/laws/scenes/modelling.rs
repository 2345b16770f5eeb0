//! Bodies modelled from silhouettes, and from a mesh.

use servoid::model::{Settings, silhouette_ious};

use super::Sense::AtMost;
use super::{Figures, MISCOUNTED, MISSED, Scene};
use crate::modelling::{
    Scene as Seen, dumbbell, exactly, model_mesh, painted_initial, pair, solid,
};

pub const SCENES: &[Scene] = &[
    Scene {
        name: "modelling one ellipsoid",
        measures: &[
            ("middle off", "mm", AtMost),
            ("radii off", "mm", AtMost),
            ("unfit", "1", AtMost),
        ],
        run: one_ellipsoid,
    },
    Scene {
        name: "modelling with a count",
        measures: &[("falls", "1", AtMost), MISSED],
        run: with_a_count,
    },
    Scene { name: "modelling that stops", measures: &[MISCOUNTED], run: that_stops },
    Scene { name: "modelling held out", measures: &[MISCOUNTED], run: held_out },
    Scene {
        name: "modelling a mesh",
        measures: &[("unfit", "1", AtMost), ("sizes off", "1", AtMost)],
        run: a_mesh,
    },
    Scene { name: "modelling unmarked pictures", measures: &[MISSED], run: unmarked },
];

fn settings(seed: u64, count: usize) -> Settings {
    exactly(count).with(|it| it.seed = seed)
}

fn one_ellipsoid(seed: u64) -> Figures {
    let truth = solid([0.01, -0.02, 0.03], [0.09, 0.05, 0.04]);
    let steps = Seen::new(&[truth]).model(settings(seed, 1));
    let found = steps[0].body.in_world()[0];
    vec![
        ("middle off", 1e3 * (found.center() - truth.center()).norm()),
        ("radii off", 1e3 * (found.radii() - truth.radii()).amax()),
        ("unfit", 1.0 - steps[0].fitness),
    ]
}

/// Three ellipsoids, modelled by one, by four and by six.
fn with_a_count(seed: u64) -> Figures {
    let third = solid([-0.07, 0.05, -0.03], [0.02, 0.06, 0.03]);
    let scene = Seen::new(&[pair(), vec![third]].concat());
    let (mut falls, mut missed) = (0.0, 0.0_f64);
    for count in [1, 4, 6] {
        let steps = scene.model(settings(seed, count));
        assert_eq!(steps.len(), count);
        let (mut overlap, mut fitness) = (0.0, 0.0);
        for (index, step) in steps.iter().enumerate() {
            assert_eq!(step.body.ellipsoids().len(), index + 1);
            assert!(step.fitness >= fitness);
            let ious = silhouette_ious(&step.body, &scene.views());
            let now = ious.iter().sum::<f64>() / ious.len() as f64;
            falls += f64::from(u8::from(now < overlap));
            (overlap, fitness) = (now, step.fitness);
        }
        missed = if count < 4 { 0.0 } else { missed.max(1.0 - overlap) };
    }
    vec![("falls", falls), ("missed", missed)]
}

fn that_stops(seed: u64) -> Figures {
    let steps = Seen::new(&pair()).model(settings(seed, 6).with(|it| it.delta = 0.05));
    vec![("miscounted", f64::from(u8::from(steps.len() != 2)))]
}

fn held_out(seed: u64) -> Figures {
    let settings = Settings::default().with(|it| {
        it.seed = seed;
        it.held_out = true;
        it.max_ellipsoids = 6;
    });
    let count = Seen::new(&pair()).model(settings).len();
    vec![("miscounted", f64::from(u8::from(!(2..=3).contains(&count))))]
}

/// Two balls of different sizes.
fn a_mesh(seed: u64) -> Figures {
    let steps = model_mesh(&dumbbell(), &settings(seed, 3));
    let mut radii: Vec<f64> =
        steps[1].body.ellipsoids().iter().map(|e| e.volume().cbrt()).collect();
    radii.sort_by(f64::total_cmp);
    let ball = |radius: f64| (4.0 / 3.0 * std::f64::consts::PI).cbrt() * radius;
    let off = |(found, truth): (&f64, f64)| (found / ball(truth) - 1.0).abs();
    let sizes = radii.iter().zip([0.03, 0.05]).map(off).fold(0.0, f64::max);
    vec![("unfit", 1.0 - steps[1].fitness), ("sizes off", sizes)]
}

fn unmarked(seed: u64) -> Figures {
    let ious = painted_initial(&Settings::default().with(|it| {
        it.seed = seed;
        it.max_ellipsoids = 2;
        it.delta = 0.0;
    }));
    vec![("missed", 1.0 - ious.into_iter().fold(1.0, f64::min))]
}
