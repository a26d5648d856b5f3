//! Perforation: cuts along hinge lines with bridges between them.

use super::Line;
use super::edges::{Hinge, Joint, Track};

/// A pattern of cuts and bridges.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Perforation {
    /// The length of each cut, mm.
    pub cut: f64,
    /// The least length of material between two cuts, and at both ends of a hinge, mm.
    pub bridge: f64,
}

impl Perforation {
    /// The number of cuts that fit a length: n cuts need n + 1 bridges.
    pub fn count(&self, length: f64) -> usize {
        // The tolerance is for lengths that fit exactly.
        let count = ((length - self.bridge) / (self.cut + self.bridge) + 1e-9).floor();
        if count > 0.0 { count as usize } else { 0 }
    }

    /// The cuts along all hinge lines, where plates of both bodies touch. The laser makes each line
    /// longer by the kerf, so the lines are shorter by it.
    pub fn lines(&self, bridged: &[(&Joint, &Hinge)], kerf: f64) -> Vec<Line> {
        let mut lines = Vec::new();
        for (joint, hinge) in bridged {
            let Some(track) = Track::new(joint.line) else { continue };
            for [from, to] in &hinge.shared {
                lines.extend(self.along(&track, *from, to - from, kerf));
            }
        }
        lines
    }

    /// The cuts of one part of a hinge line, in its middle.
    fn along(
        &self,
        track: &Track,
        from: f64,
        length: f64,
        kerf: f64,
    ) -> impl Iterator<Item = Line> {
        let count = self.count(length);
        let step = self.cut + self.bridge;
        let begin = from + (length - (count as f64 * step - self.bridge)) / 2.0;
        let (cut, track) = (self.cut, *track);
        (0..count).map(move |number| {
            let start = begin + number as f64 * step;
            [track.at(start + kerf / 2.0, 0.0), track.at(start + cut - kerf / 2.0, 0.0)]
        })
    }
}
