//! A recorded motion.

use std::num::NonZeroU32;
use std::sync::Arc;

use lamc::pipeline::Compiled;
use lamc_workbench::motion::{Motion as Recorded, Sample};
use lamc_workbench::page;
use lamc_workbench::picture::{Encoder, Renderer, View};
use lamc_workbench::scene::{Scene, poses_at};
use numpy::PyArray1;
use pyo3::prelude::*;
use pyo3::types::PyBytes;

use crate::error;
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
            renderer.draw(&poses_at(&self.recorded, t)).png()
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
            let mut encoder = Encoder::new(size, RATE)?;
            for picture in 0..=count {
                let t = first.t + picture as f64 * speed / f64::from(RATE.get());
                encoder.push(&renderer.draw(&poses_at(&self.recorded, t)))?;
            }
            encoder.finish()
        });
        Ok(PyBytes::new(py, &bytes.map_err(error)?))
    }
}
