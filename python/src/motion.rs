//! A recorded motion.

use std::num::NonZeroU32;
use std::sync::Arc;

use lamc::pipeline::Compiled;
use lamc::source::free::{COORDINATES, SPEEDS};
use lamc_runtime::{Energy, State};
use lamc_workbench::motion::{Course, Motion as Recorded, Pose, Sample, Tensions};
use lamc_workbench::page;
use lamc_workbench::picture::{Encoder, Renderer, View};
use lamc_workbench::scene::{Scene, moment_at};
use numpy::{PyArray1, PyReadonlyArray1};
use pyo3::prelude::*;
use pyo3::types::PyBytes;

use crate::error;
use crate::program::Program;
use crate::states::array;

/// Pictures per second of a video.
const RATE: NonZeroU32 = NonZeroU32::new(30).unwrap();

/// Most pictures of a video: an hour.
const MOST_PICTURES: f64 = 1e5;

/// A recorded motion.
#[pyclass(frozen, module = "lamc._lamc")]
pub struct Motion {
    pub compiled: Arc<Compiled>,
    pub recorded: Recorded,
    /// The inputs that were held from each sample on.
    pub inputs: Vec<f64>,
    /// Steps of the explicit and of the implicit method.
    pub steps: [usize; 2],
    /// The states at the changes of each event.
    pub events: Vec<Vec<State<Vec<f64>, f64>>>,
}

/// Times, q and u of states: flat arrays.
type States<'py> =
    (Bound<'py, PyArray1<f64>>, Bound<'py, PyArray1<f64>>, Bound<'py, PyArray1<f64>>);

/// A time, q and u.
type Found = (f64, Vec<f64>, Vec<f64>);

/// The arrays of a motion that was recorded elsewhere, by the names of [`Motion::arrays`].
#[derive(FromPyObject)]
#[pyo3(from_item_all)]
struct Arrays<'py> {
    t: PyReadonlyArray1<'py, f64>,
    q: PyReadonlyArray1<'py, f64>,
    u: PyReadonlyArray1<'py, f64>,
    acceleration: PyReadonlyArray1<'py, f64>,
    kinetic: PyReadonlyArray1<'py, f64>,
    potential: PyReadonlyArray1<'py, f64>,
    closure: PyReadonlyArray1<'py, f64>,
    points: PyReadonlyArray1<'py, f64>,
    poses: PyReadonlyArray1<'py, f64>,
    contacts: PyReadonlyArray1<'py, f64>,
    tensions: PyReadonlyArray1<'py, f64>,
    inputs: PyReadonlyArray1<'py, f64>,
}

impl Arrays<'_> {
    /// The samples, each with as many joints, free bodies, points, bodies and contact points as a motion.
    fn samples(&self, motion: &Recorded) -> PyResult<Vec<Sample>> {
        let Recorded { joints, free, points, bodies, contacts, .. } = motion;
        let [joints, free, points, bodies, contacts] =
            [joints, free, points, bodies, contacts].map(Vec::len);
        let [coordinates, speeds] = [COORDINATES, SPEEDS].map(|width| joints + width * free);
        let t = self.t.as_slice()?;
        let rows = |array: &PyReadonlyArray1<'_, f64>, width: usize| {
            let numbers = array.as_slice()?;
            match numbers.len() == t.len() * width {
                true => Ok(numbers.to_vec()),
                false => Err(error("the arrays of the motion do not fit its model")),
            }
        };
        let (q, u, acceleration) = (
            rows(&self.q, coordinates)?,
            rows(&self.u, speeds)?,
            rows(&self.acceleration, speeds)?,
        );
        let [kinetic, potential, closure] =
            [rows(&self.kinetic, 1)?, rows(&self.potential, 1)?, rows(&self.closure, 1)?];
        let (places, poses) = (rows(&self.points, 3 * points)?, rows(&self.poses, 12 * bodies)?);
        let touched = rows(&self.contacts, 6 * contacts)?;
        let tensions = motion.tensions.len();
        let pulls = rows(&self.tensions, tensions)?;
        let of =
            |numbers: &[f64], row: usize, width: usize| numbers[row * width..][..width].to_vec();
        let sample = |(row, &t): (usize, &f64)| Sample {
            t,
            q: of(&q, row, coordinates),
            u: of(&u, row, speeds),
            acceleration: of(&acceleration, row, speeds),
            energy: Energy { kinetic: kinetic[row], potential: potential[row] },
            closure: closure[row],
            points: of(&places, row, 3 * points).as_chunks().0.to_vec(),
            poses: of(&poses, row, 12 * bodies).as_chunks().0.iter().map(pose).collect(),
            contacts: of(&touched, row, 6 * contacts).as_chunks().0.to_vec(),
            tensions: of(&pulls, row, tensions),
            // The inputs of the motion stand beside its samples.
            inputs: Vec::new(),
        };
        Ok(t.iter().enumerate().map(sample).collect())
    }
}

/// R by row, then p.
fn pose(numbers: &[f64; 12]) -> Pose {
    let (rotation, translation) = numbers.split_at(9);
    Pose {
        rotation: std::array::from_fn(|i| std::array::from_fn(|k| rotation[3 * i + k])),
        translation: std::array::from_fn(|k| translation[k]),
    }
}

/// Refuses pictures that cannot be drawn.
fn check(size: [usize; 2], speed: f64) -> PyResult<()> {
    if !size.iter().all(|pixels| (16..=4096).contains(pixels)) {
        return Err(error("`size` must be two numbers of pixels, each 16 to 4096"));
    }
    if !(speed.is_finite() && speed > 0.0) {
        return Err(error("`speed` must be a positive number"));
    }
    Ok(())
}

impl Motion {
    /// One list of numbers of each sample after the other.
    fn gathered<'py, N: AsRef<[f64]>>(
        &self,
        py: Python<'py>,
        numbers: impl Fn(&Sample) -> N,
    ) -> Bound<'py, PyArray1<f64>> {
        let gathered: Vec<f64> = self
            .recorded
            .samples
            .iter()
            .flat_map(|sample| numbers(sample).as_ref().to_vec())
            .collect();
        array(py, &gathered)
    }
}

#[pymethods]
impl Motion {
    /// A motion of a model that was recorded elsewhere. `events` has the changes of each event.
    #[new]
    fn new(
        program: &Program,
        arrays: Arrays<'_>,
        complete: bool,
        steps: [usize; 2],
        events: Vec<Vec<Found>>,
    ) -> PyResult<Self> {
        let mut recorded = Recorded::new(program.interface());
        let mechanism = &program.compiled.topology.mechanism;
        recorded.tensions = Tensions::new(mechanism).names().collect();
        recorded.samples = arrays.samples(&recorded)?;
        (recorded.complete, recorded.course) = (complete, Course::Time);
        let state = |(t, q, u)| State { t, q, u };
        let events = events.into_iter().map(|found| found.into_iter().map(state).collect());
        Ok(Self {
            compiled: program.compiled.clone(),
            recorded,
            inputs: arrays.inputs.as_slice()?.to_vec(),
            steps,
            events: events.collect(),
        })
    }

    /// Flat arrays by name.
    fn arrays<'py>(&self, py: Python<'py>) -> Vec<(&'static str, Bound<'py, PyArray1<f64>>)> {
        let poses = |sample: &Sample| -> Vec<f64> {
            let numbers = |pose: &lamc_workbench::motion::Pose| {
                [pose.rotation.as_flattened(), &pose.translation].concat()
            };
            sample.poses.iter().flat_map(numbers).collect()
        };
        vec![
            ("t", self.gathered(py, |sample| [sample.t])),
            ("q", self.gathered(py, |sample| sample.q.clone())),
            ("u", self.gathered(py, |sample| sample.u.clone())),
            ("acceleration", self.gathered(py, |sample| sample.acceleration.clone())),
            ("kinetic", self.gathered(py, |sample| [sample.energy.kinetic])),
            ("potential", self.gathered(py, |sample| [sample.energy.potential])),
            ("closure", self.gathered(py, |sample| [sample.closure])),
            ("points", self.gathered(py, |sample| sample.points.as_flattened().to_vec())),
            ("poses", self.gathered(py, poses)),
            ("contacts", self.gathered(py, |sample| sample.contacts.as_flattened().to_vec())),
            ("tensions", self.gathered(py, |sample| sample.tensions.clone())),
            ("inputs", array(py, &self.inputs)),
        ]
    }

    #[getter]
    fn complete(&self) -> bool {
        self.recorded.complete
    }

    #[getter]
    fn steps(&self) -> [usize; 2] {
        self.steps
    }

    /// The times, q and u of the changes of each event.
    fn events<'py>(&self, py: Python<'py>) -> Vec<States<'py>> {
        let flat = |found: &[State<Vec<f64>, f64>]| {
            let all = |of: fn(&State<Vec<f64>, f64>) -> &[f64]| {
                array(py, &found.iter().flat_map(of).copied().collect::<Vec<_>>())
            };
            let t: Vec<f64> = found.iter().map(|state| state.t).collect();
            (array(py, &t), all(|state| &state.q), all(|state| &state.u))
        };
        self.events.iter().map(|found| flat(found)).collect()
    }

    /// The table that `lamc simulate --csv` writes.
    fn csv(&self) -> String {
        self.recorded.to_csv()
    }

    /// The archive that `lamc simulate --npz` writes.
    fn npz<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyBytes>> {
        Ok(PyBytes::new(py, &self.recorded.to_npz().map_err(error)?))
    }

    /// The viewer, as one HTML file that needs nothing else.
    fn html(&self) -> String {
        let mechanism = &self.compiled.topology.mechanism;
        let data = page::data(&Scene::new(mechanism), &self.recorded, mechanism, View::default());
        page::write(&self.recorded.name, &data)
    }

    /// A picture at a time, s, as PNG.
    fn png<'py>(&self, py: Python<'py>, t: f64, size: [usize; 2]) -> PyResult<Bound<'py, PyBytes>> {
        check(size, 1.0)?;
        if self.recorded.samples.is_empty() {
            return Err(error("there is no motion"));
        }
        let bytes = py.detach(|| {
            let scene = Scene::new(&self.compiled.topology.mechanism);
            let mut renderer = Renderer::new(&scene, &self.recorded, View::default(), size);
            renderer.draw(&moment_at(&self.recorded, t)).png()
        });
        Ok(PyBytes::new(py, &bytes.map_err(error)?))
    }

    /// A video, as MP4.
    fn mp4<'py>(
        &self,
        py: Python<'py>,
        speed: f64,
        size: [usize; 2],
    ) -> PyResult<Bound<'py, PyBytes>> {
        let [Some(first), Some(last)] =
            [self.recorded.samples.first(), self.recorded.samples.last()]
        else {
            return Err(error("there is no motion"));
        };
        check(size, speed)?;
        let count = ((last.t - first.t) / speed * f64::from(RATE.get())).floor();
        if count > MOST_PICTURES {
            return Err(error(format_args!("{count} pictures are too many: raise `speed`")));
        }
        let count = count as usize;
        let bytes = py.detach(|| {
            let scene = Scene::new(&self.compiled.topology.mechanism);
            let mut renderer = Renderer::new(&scene, &self.recorded, View::default(), size);
            let mut encoder = Encoder::new(size, RATE).map_err(error)?;
            for picture in 0..=count {
                Python::attach(|py| py.check_signals())?;
                let t = first.t + picture as f64 * speed / f64::from(RATE.get());
                encoder.push(&renderer.draw(&moment_at(&self.recorded, t))).map_err(error)?;
            }
            encoder.finish().map_err(error)
        });
        Ok(PyBytes::new(py, &bytes?))
    }
}
