//! Pictures, a video and a viewer page of a motion.

use std::num::NonZeroU32;
use std::path::Path;
use std::thread;

use clap::Args;
use lamc::laminate::Mechanism;
use lamc_workbench::motion::Motion;
use lamc_workbench::page;
use lamc_workbench::picture::{Encoder, Picture, Renderer, View};
use lamc_workbench::scene::{Moment, Scene, moment_at};

use super::interrupt::{self, EXIT_INTERRUPTED};
use super::{Failed, Outcome, fail, misused, output};
use super::{paths::Paths, progress};

/// Pictures per second of a video.
const RATE: NonZeroU32 = NonZeroU32::new(30).unwrap();

/// Most pictures of a video or a series: an hour and some.
const MOST: f64 = 1e5;

/// What to make of a motion.
#[derive(Args)]
pub struct Pictures {
    /// Draw a video of the motion, 30 pictures per second, as MP4
    #[arg(long, value_name = "FILE")]
    video: Option<String>,
    /// Draw the end of the motion as PNG; with `#` in the name, all frames of the video:
    /// frames/####.png
    #[arg(long, value_name = "FILE")]
    png: Option<String>,
    /// Write an interactive viewer of the motion as one HTML file; `-` writes only its data as JSON
    /// to standard output
    #[arg(long, value_name = "FILE")]
    view: Option<String>,
    /// Direction of the camera, degrees: azimuth from x towards y, elevation; zoom 1 shows
    /// everything
    #[arg(long, value_name = "AZIMUTH,ELEVATION[,ZOOM]", allow_hyphen_values = true)]
    camera: Option<View>,
    /// Width and height of pictures, pixels
    #[arg(long, value_name = "WIDTHxHEIGHT", default_value = "800x600", value_parser = size)]
    size: [usize; 2],
    /// Speed of the video: 1 is real time, 0.1 is ten times slower
    #[arg(long, value_name = "TIMES", default_value_t = 1.0)]
    speed: f64,
}

/// Reads `WIDTHxHEIGHT`.
fn size(text: &str) -> Result<[usize; 2], String> {
    let pixels = |text: &str| text.parse().ok().filter(|pixels| (16..=4096).contains(pixels));
    let sides = text.split_once('x').and_then(|(w, h)| Some([pixels(w)?, pixels(h)?]));
    sides.ok_or_else(|| "not of the form `800x600`, each 16 to 4096".to_owned())
}

impl Pictures {
    /// Refuses what cannot be made.
    pub fn check(&self) -> Outcome {
        if !(self.speed.is_finite() && self.speed > 0.0) {
            return Err(misused("--speed must be a positive number"));
        }
        output::has_extension(self.video.as_ref(), "mp4")?;
        output::has_extension(self.png.as_ref(), "png")?;
        match self.video {
            Some(_) => Encoder::new(self.size, RATE).map(drop).map_err(misused),
            None => Ok(()),
        }
    }

    /// Adds what is to be written.
    pub fn paths<'a>(&'a self, paths: Paths<'a>) -> Paths<'a> {
        paths.output("--video", &self.video).output("--png", &self.png).output("--view", &self.view)
    }

    /// Writes what was asked for.
    pub fn write(&self, mechanism: &Mechanism, motion: &Motion) -> Outcome {
        if self.video.is_none() && self.png.is_none() && self.view.is_none() {
            return Ok(());
        }
        let scene = Scene::new(mechanism);
        let view = self.camera.unwrap_or_default();
        if let Some(path) = &self.view {
            let data = page::data(&scene, motion, mechanism, view);
            let page = if path == "-" { data } else { page::write(&scene.name, &data) };
            output::write(path, &page)?;
        }
        if self.video.is_none() && self.png.is_none() {
            return Ok(());
        }
        let mut renderer = Renderer::new(&scene, motion, view, self.size);
        let series = self.png.as_deref().filter(|path| name_of(path).contains('#'));
        if let (Some(path), None) = (&self.png, series) {
            let end = motion.samples.last().map_or_else(Moment::default, Moment::from);
            output::write(path, &png(&renderer.draw(&end))?)?;
        }
        match (&self.video, series) {
            (None, None) => Ok(()),
            (video, series) => self.draw(&renderer, motion, video.as_deref(), series),
        }
    }

    /// Draws the pictures of a video, one after the other.
    fn draw(
        &self,
        renderer: &Renderer<'_>,
        motion: &Motion,
        video: Option<&str>,
        series: Option<&str>,
    ) -> Outcome {
        let times = self.times(motion)?;
        let encoder = video.map(|_| Encoder::new(self.size, RATE)).transpose();
        let mut encoder = encoder.map_err(misused)?;
        let progress = progress::bar(times.len());
        each_picture(renderer, motion, &times, |number, picture| {
            if let Some(name) = series {
                output::write(&numbered(name, number), &png(picture)?)?;
            }
            if let Some(encoder) = &mut encoder {
                encoder.push(picture).map_err(fail)?;
            }
            progress.inc(1);
            Ok(())
        })?;
        progress.finish_and_clear();
        match (video, encoder) {
            (Some(path), Some(encoder)) => output::write(path, &encoder.finish().map_err(fail)?),
            _ => Ok(()),
        }
    }

    /// The times a video shows, s, or percents of a fold.
    fn times(&self, motion: &Motion) -> Result<Vec<f64>, Failed> {
        let [Some(start), Some(end)] =
            [motion.samples.first(), motion.samples.last()].map(|sample| sample.map(|s| s.t))
        else {
            return Ok(Vec::new());
        };
        let step = self.speed * motion.course.per_second() / f64::from(RATE.get());
        let pictures = ((end - start) / step + 1e-9).floor() + 1.0;
        if pictures > MOST {
            return Err(misused(format_args!(
                "{pictures:.0} frames are too many: raise --speed, or shorten the motion"
            )));
        }
        Ok((0..pictures as usize).map(|picture| start + step * picture as f64).collect())
    }
}

/// Draws the motion at each of `times`, on all processors, and hands on the pictures in order,
/// while the next ones are drawn. An interrupt ends it.
fn each_picture(
    renderer: &Renderer<'_>,
    motion: &Motion,
    times: &[f64],
    mut each: impl FnMut(usize, &Picture) -> Outcome,
) -> Outcome {
    let workers = thread::available_parallelism().map_or(1, usize::from);
    let mut renderers = vec![renderer.clone(); workers];
    let mut drawn: Vec<Picture> = Vec::new();
    let mut numbers = 0..;
    let mut hand_on = |drawn: &[Picture]| {
        if interrupt::is_asked_for() {
            return Err(Failed(EXIT_INTERRUPTED));
        }
        drawn.iter().zip(&mut numbers).try_for_each(|(picture, number)| each(number, picture))
    };
    for times in times.chunks(2 * workers) {
        let shares = times.chunks(times.len().div_ceil(workers));
        drawn = thread::scope(|scope| {
            let at_work: Vec<_> = renderers
                .iter_mut()
                .zip(shares)
                .map(|(renderer, times)| {
                    let draw = |t: &f64| renderer.draw(&moment_at(motion, *t));
                    scope.spawn(move || times.iter().map(draw).collect::<Vec<_>>())
                })
                .collect();
            hand_on(&drawn)?;
            let pictures = at_work.into_iter().map(|worker| {
                worker.join().unwrap_or_else(|panic| std::panic::resume_unwind(panic))
            });
            Ok(pictures.flatten().collect())
        })?;
    }
    hand_on(&drawn)
}

fn png(picture: &Picture) -> Result<Vec<u8>, Failed> {
    picture.png().map_err(|error| fail(format_args!("cannot write PNG: {error}")))
}

/// The name of a file without its folder.
fn name_of(path: &str) -> &str {
    Path::new(path).file_name().and_then(|name| name.to_str()).unwrap_or_default()
}

/// What stands before and after the first `#`s of a name, and how many these are.
fn parts(name: &str) -> (&str, usize, &str) {
    let start = name.find('#').unwrap_or(name.len());
    let digits = name[start..].bytes().take_while(|byte| *byte == b'#').count();
    (&name[..start], digits, &name[start + digits..])
}

/// `####` in the file's name replaced by a number with as many digits.
fn numbered(path: &str, number: usize) -> String {
    let (folder, name) = path.split_at(path.len() - name_of(path).len());
    let (before, digits, after) = parts(name);
    format!("{folder}{before}{number:0digits$}{after}")
}

/// Whether [`numbered`] makes this name of a series for some number.
pub fn is_numbered(series: &str, name: &str) -> bool {
    let (before, digits, after) = parts(series);
    let number = name.strip_prefix(before).and_then(|rest| rest.strip_suffix(after));
    let number = number.filter(|number| number.bytes().all(|byte| byte.is_ascii_digit()));
    number
        .and_then(|number| number.parse().ok())
        .is_some_and(|number: usize| name == format!("{before}{number:0digits$}{after}"))
}
