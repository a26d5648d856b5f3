//! A motion as a NumPy archive: a zip of arrays, by name.

use lamc::source::free::{COORDINATES, SPEEDS};
use std::io::{self, Cursor, Write};

use npyz::{AutoSerialize, DType, WriterBuilder};
use zip::write::SimpleFileOptions;
use zip::{CompressionMethod, ZipWriter};

use super::{Motion, Sample};

impl Motion {
    /// Writes everything that was recorded, for T samples of N joints, P points and B bodies:
    ///
    /// ```text
    /// joints N, points P, bodies B        names
    /// t T                                 s
    /// q, u, a T x N                       rad, rad/s, rad/s^2
    /// kinetic, potential T                J
    /// closure T                           m
    /// positions T x P x 3                 of the points, m
    /// rotations T x B x 3 x 3             R of the bodies: x drawn lies at R x + p
    /// translations T x B x 3              p, m
    /// contacts K, forces T x K x 6        position, m, and force, N, of contact points, if there are any
    /// tension_names L, tensions T x L     N, of springs between points and tendons, if there are any
    /// input_names I, inputs T x I         SI, of inputs that controllers drive, if there are any
    /// complete                            whether the motion was simulated to its end
    /// ```
    ///
    /// # Errors
    /// Those of the archive, for example if it is too large.
    pub fn to_npz(&self) -> io::Result<Vec<u8>> {
        let mut archive = Archive(ZipWriter::new(Cursor::new(Vec::new())));
        let (samples, points, bodies) = (self.samples.len(), self.points.len(), self.bodies.len());
        let joints = self.joints.len();
        let coordinates = joints + COORDINATES * self.free.len();
        let speeds = joints + SPEEDS * self.free.len();
        archive.names("joints", &self.joints)?;
        archive.names("free_bodies", &self.free)?;
        archive.names("points", &self.points)?;
        archive.names("bodies", &self.bodies)?;
        let each = |of: fn(&Sample) -> f64| self.samples.iter().map(of);
        archive.numbers("t", &[samples], each(|sample| sample.t))?;
        let each_of = |of: fn(&Sample) -> &Vec<f64>| self.samples.iter().flat_map(of).copied();
        archive.numbers("q", &[samples, coordinates], each_of(|sample| &sample.q))?;
        archive.numbers("u", &[samples, speeds], each_of(|sample| &sample.u))?;
        archive.numbers("a", &[samples, speeds], each_of(|sample| &sample.acceleration))?;
        archive.numbers("kinetic", &[samples], each(|sample| sample.energy.kinetic))?;
        archive.numbers("potential", &[samples], each(|sample| sample.energy.potential))?;
        archive.numbers("closure", &[samples], each(|sample| sample.closure))?;
        let positions = self.samples.iter().flat_map(|sample| sample.points.as_flattened());
        archive.numbers("positions", &[samples, points, 3], positions.copied())?;
        let poses = || self.samples.iter().flat_map(|sample| &sample.poses);
        let rotations = poses().flat_map(|pose| pose.rotation.as_flattened());
        archive.numbers("rotations", &[samples, bodies, 3, 3], rotations.copied())?;
        let translations = poses().flat_map(|pose| pose.translation);
        archive.numbers("translations", &[samples, bodies, 3], translations)?;
        if !self.contacts.is_empty() {
            archive.names("contacts", &self.contacts)?;
            let forces = self.samples.iter().flat_map(|sample| sample.contacts.as_flattened());
            archive.numbers("forces", &[samples, self.contacts.len(), 6], forces.copied())?;
        }
        if !self.tensions.is_empty() {
            archive.names("tension_names", &self.tensions)?;
            let tensions = self.samples.iter().flat_map(|sample| &sample.tensions);
            archive.numbers("tensions", &[samples, self.tensions.len()], tensions.copied())?;
        }
        if !self.inputs.is_empty() {
            archive.names("input_names", &self.inputs)?;
            let inputs = self.samples.iter().flat_map(|sample| &sample.inputs);
            archive.numbers("inputs", &[samples, self.inputs.len()], inputs.copied())?;
        }
        archive.array("complete", &[], bool::default_dtype(), std::iter::once(self.complete))?;
        Ok(archive.0.finish()?.into_inner())
    }
}

/// The arrays of an archive. They are stored uncompressed, because floating-point numbers hardly shrink.
struct Archive(ZipWriter<Cursor<Vec<u8>>>);

impl Archive {
    fn numbers(
        &mut self,
        name: &str,
        shape: &[usize],
        numbers: impl Iterator<Item = f64>,
    ) -> io::Result<()> {
        self.array(name, shape, f64::default_dtype(), numbers)
    }

    fn names(&mut self, name: &str, names: &[String]) -> io::Result<()> {
        let longest = names.iter().map(|name| name.chars().count()).max().unwrap_or(0).max(1);
        let kind = format!("<U{longest}").parse().map_err(io::Error::other)?;
        self.array(name, &[names.len()], DType::new_scalar(kind), names.iter().map(String::as_str))
    }

    fn array<T: npyz::Serialize>(
        &mut self,
        name: &str,
        shape: &[usize],
        kind: DType,
        entries: impl Iterator<Item = T>,
    ) -> io::Result<()> {
        let shape: Vec<u64> = shape.iter().map(|&length| length as u64).collect();
        let mut bytes = Vec::new();
        let options = npyz::WriteOptions::new().dtype(kind).shape(&shape);
        let mut writer = options.writer(&mut bytes).begin_nd()?;
        for entry in entries {
            writer.push(&entry)?;
        }
        writer.finish()?;
        let stored = SimpleFileOptions::default().compression_method(CompressionMethod::Stored);
        self.0.start_file(format!("{name}.npy"), stored.large_file(bytes.len() > 1 << 31))?;
        self.0.write_all(&bytes)
    }
}
