//! Parts and creases -> bodies and joints of the model, in metres.

use std::collections::{HashMap, HashSet};

use lamc_drawings::{Edge, FacetId, Role, VertexId};

use super::creases::{Line, is_crease};
use super::outlines::{self, Rings};
use super::sheet::{Part, Sheet};
use super::{Crease, CreaseSpring, Drawn, Settings, bending, gaps};
use crate::source::codes;
use crate::source::diagnostic::{Diagnostic, Diagnostics, Severity, Span, Spanned};
use crate::source::expression::{Expression, Operator};
use crate::source::ids::{BodyId, JointId};
use crate::source::model::{Body, Joint, MAX_VERTICES, Material, Plate, Shape, Spring};

/// Sizes of a sheet between which lamc compiles it, m. Others are mistakes, and lose digits.
const SMALLEST: f64 = 1e-9;
const LARGEST: f64 = 1e9;

/// The materials of the model, and the layers of the sheet.
pub(in crate::source) struct Stack<'m> {
    pub materials: &'m [Material],
    /// Indices into the materials, bottom to top.
    pub layup: &'m [usize],
}

/// What a pattern adds to a model.
pub(in crate::source) struct Built {
    pub bodies: Vec<Body>,
    pub joints: Vec<Joint>,
    /// Angles of the folded state in the drawing, rad.
    pub initial_q: Vec<(JointId, f64)>,
}

/// Makes bodies and joints, whose numbers follow those of the model.
struct Builder<'a> {
    sheet: &'a Sheet,
    settings: &'a Settings,
    stack: &'a Stack<'a>,
    /// The position of the pattern in the model.
    span: Span,
    /// The number of bodies before those of the pattern.
    first: usize,
    /// The pairs of vertices between which there is a crease with a gap.
    gaps: HashSet<[VertexId; 2]>,
}

impl Sheet {
    /// Makes the bodies and joints. `before` are the numbers of bodies and joints that the model has already.
    pub fn build(
        &self,
        drawn: &Drawn,
        settings: &Settings,
        stack: &Stack,
        span: Span,
        before: [usize; 2],
        found: &mut Diagnostics,
    ) -> Option<Built> {
        let across = drawn.across() * settings.scale;
        if !(SMALLEST..LARGEST).contains(&across) {
            let message = format!("the sheet would be {across:e} m across");
            let error = drawn.finding(Severity::Error, codes::OUT_OF_SCALE, None, message);
            found.push(error.hint("is the scale right?"));
            return None;
        }
        let gaps = match settings.crease.flexible.filter(|_| settings.crease.width > 0.0) {
            Some(_) => self.gaps(),
            None => HashSet::new(),
        };
        let builder = Builder { sheet: self, settings, stack, span, first: before[0], gaps };
        let joints = builder.joints(found)?;
        let bodies = builder.bodies(drawn, found)?;
        let angles = self
            .lines
            .iter()
            .enumerate()
            .filter_map(|(index, line)| Some((JointId(before[1] + index), line.angle?)));
        Some(Built { bodies, joints, initial_q: angles.collect() })
    }

    /// The pairs of vertices, the smaller first, between which a crease folds.
    fn gaps(&self) -> HashSet<[VertexId; 2]> {
        let folds = |edge: &&Edge| is_crease(edge) && edge.role != Role::Flat;
        self.pattern.edges.iter().filter(folds).map(|edge| sorted(edge.vertices)).collect()
    }
}

fn sorted(mut pair: [VertexId; 2]) -> [VertexId; 2] {
    pair.sort_unstable();
    pair
}

impl Builder<'_> {
    fn spanned<T>(&self, value: T) -> Spanned<T> {
        Spanned { value, span: self.span }
    }

    fn bodies(&self, drawn: &Drawn, found: &mut Diagnostics) -> Option<Vec<Body>> {
        let mut bodies = Vec::with_capacity(self.sheet.parts.len());
        let mut vanished = Vec::new();
        let slits = self.slits();
        for (index, part) in self.sheet.parts.iter().enumerate() {
            let whole = outlines::whole(&self.sheet.pattern, part.facet);
            self.refuse_long_outline(drawn, part, &whole, found)?;
            let rigid = self.cut_back(part.facet, &whole);
            if rigid.as_ref().is_some_and(Vec::is_empty) {
                vanished.push(part.centre);
            }
            bodies.push(Body {
                name: self.spanned(part.name.clone()),
                fixed: self.sheet.ground == Some(index) && !self.settings.free,
                free: self.sheet.ground == Some(index) && self.settings.free,
                shape: Shape::Plates(self.layers(&whole, rigid.as_ref())),
                slits: slits.get(&part.facet).cloned().unwrap_or_default(),
                point_masses: Vec::new(),
                span: self.span,
            });
        }
        if !vanished.is_empty() {
            let what = match vanished.len() {
                1 => "nothing is left of a facet between its creases".to_owned(),
                count => format!("nothing is left of {count} facets between their creases"),
            };
            let warning = drawn.finding(Severity::Warning, codes::WIDE_CREASE, None, what);
            found.push(
                warning
                    .at(vanished)
                    .hint("they have the flexible layer only: give a smaller `width`"),
            );
        }
        Some(bodies)
    }

    /// The cuts that end within a facet, by facet, m: on both of their sides is the same one.
    fn slits(&self) -> HashMap<FacetId, Vec<[[f64; 2]; 2]>> {
        let pattern = &self.sheet.pattern;
        let mut slits: HashMap<FacetId, Vec<[[f64; 2]; 2]>> = HashMap::new();
        for edge in pattern.edges.iter().filter(|it| matches!(it.role, Role::Cut | Role::Border)) {
            if let [Some(left), Some(right)] = edge.facets
                && left == right
            {
                let ends = edge.vertices.map(|end| self.metres(pattern.vertices[end.index()]));
                slits.entry(left).or_default().push(ends);
            }
        }
        slits
    }

    /// Refuses an outline with so many vertices that no model may have it.
    fn refuse_long_outline(
        &self,
        drawn: &Drawn,
        part: &Part,
        whole: &[Rings],
        found: &mut Diagnostics,
    ) -> Option<()> {
        let rings = whole.iter().flat_map(|(outline, holes)| std::iter::once(outline).chain(holes));
        let longest = rings.map(Vec::len).max().unwrap_or(0);
        if longest <= MAX_VERTICES {
            return Some(());
        }
        let message =
            format!("a facet has {longest} vertices, but lamc reads at most {MAX_VERTICES}");
        let error = drawn.finding(Severity::Error, codes::TOO_MANY_VERTICES, None, message);
        found.push(error.at(vec![part.centre]).hint("draw curves with fewer points"));
        None
    }

    /// The plates of the layers that are not flexible, if they differ from the whole facet.
    fn cut_back(&self, facet: FacetId, whole: &[Rings]) -> Option<Vec<Rings>> {
        let is_crease = |side| self.gaps.contains(&sorted(side));
        let half = self.settings.crease.width / self.settings.scale / 2.0;
        gaps::cut_back(&self.sheet.pattern, facet, whole, is_crease, half)
    }

    /// One list of plates for each layer of the layup.
    fn layers(&self, whole: &[Rings], rigid: Option<&Vec<Rings>>) -> Vec<Vec<Plate>> {
        let metres = |ring: &Vec<[f64; 2]>| {
            self.spanned(ring.iter().map(|point| self.metres(*point)).collect::<Vec<_>>()).into()
        };
        let plates = |rings: &[Rings]| -> Vec<Plate> {
            let plate = |(outline, holes): &Rings| Plate {
                outline: metres(outline),
                holes: holes.iter().map(metres).collect(),
            };
            rings.iter().map(plate).collect()
        };
        let layer = |material: &usize| match rigid {
            Some(rigid) if self.settings.crease.flexible != Some(*material) => plates(rigid),
            _ => plates(whole),
        };
        self.stack.layup.iter().map(layer).collect()
    }

    fn metres(&self, point: [f64; 2]) -> [f64; 2] {
        point.map(|value| value * self.settings.scale)
    }

    /// The middle of the flexible layers, or of the sheet, m.
    fn height(&self) -> f64 {
        let (mut bottom, mut middles) = (0.0, Vec::new());
        for &material in self.stack.layup {
            let thickness = self.stack.materials[material].thickness.value;
            if self.settings.crease.flexible == Some(material) {
                middles.push(bottom + thickness / 2.0);
            }
            bottom += thickness;
        }
        match middles.is_empty() {
            true => bottom / 2.0,
            false => middles.iter().sum::<f64>() / middles.len() as f64,
        }
    }

    fn joints(&self, found: &mut Diagnostics) -> Option<Vec<Joint>> {
        let mut flat = vec![0; self.sheet.parts.len()];
        let flat_lines = self.sheet.lines.iter().filter(|line| line.role == Role::Flat);
        flat_lines.for_each(|line| line.parts.iter().for_each(|part| flat[*part] += 1));
        let rigidity = match flat.iter().any(|count| *count > 0) {
            true => self.rigidity(found)?,
            false => 0.0,
        };
        let height = self.height();
        let joint = |line: &Line| Joint {
            name: self.spanned(line.name.clone()),
            bodies: line.parts.map(|part| self.spanned(BodyId(self.first + part))),
            axis: self.spanned(line.ends.map(|end| self.metres(end))).into(),
            z: self.spanned(height).into(),
            spring: match line.role {
                Role::Flat => {
                    let stiffness = Expression::Number(self.bending(line, rigidity, &flat));
                    Spring::Stiffness(self.spanned(stiffness))
                }
                _ => self.spring(line),
            },
            damping: self.damping(line),
            rest: self.spanned(Expression::ZERO),
            cubic_stiffness: self.spanned(Expression::ZERO),
            friction: None,
            limits: None,
            torque: self.spanned(Expression::ZERO),
            drive: None,
            fold: self.fold(line).map(|angle| self.spanned(angle)),
            span: self.span,
        };
        Some(self.sheet.lines.iter().map(joint).collect())
    }

    /// The bending stiffness of the sheet per length, N m.
    fn rigidity(&self, found: &mut Diagnostics) -> Option<f64> {
        match bending::plate(self.stack) {
            Ok(rigidity) => Some(rigidity),
            Err(bending::NoModulus(material)) => {
                let name = &self.stack.materials[material].name;
                let message = format!("`{}` has no `youngs_modulus`", name.value);
                found.push(
                    Diagnostic::error(codes::NO_MODULUS, name.span, message)
                        .label("the stiffness of flat creases needs it")
                        .hint("add it to the material, as in `youngs_modulus: 4.4 GPa`"),
                );
                None
            }
        }
    }

    fn bending(&self, line: &Line, rigidity: f64, flat: &[usize]) -> f64 {
        let scale = self.settings.scale;
        let facets =
            line.parts.map(|part| (self.sheet.parts[part].area * scale * scale, flat[part]));
        bending::stiffness(rigidity, line.length * scale, facets)
    }

    fn spring(&self, line: &Line) -> Spring {
        let Crease { width, spring, .. } = &self.settings.crease;
        let across = self.spanned(line.length * self.settings.scale);
        let length = self.spanned(*width);
        match spring {
            CreaseSpring::Stiffness(stiffness) => Spring::Stiffness(times(stiffness, across.value)),
            CreaseSpring::Beam(material) => {
                let material = material.clone();
                Spring::Beam { material, length: length.into(), width: across.into(), gaps: None }
            }
            CreaseSpring::Sharifzadeh2018 => Spring::Sharifzadeh2018 {
                length,
                width: across,
                area: None,
                printed: false,
                span: self.span,
            },
            CreaseSpring::Family(model) => {
                let (model, span) = (*model, self.span);
                Spring::Family { model, length, width: across, area: None, span }
            }
        }
    }

    fn damping(&self, line: &Line) -> Spanned<Expression> {
        times(&self.settings.crease.damping, line.length * self.settings.scale)
    }

    /// The angle of the finished fold, rad.
    fn fold(&self, line: &Line) -> Option<f64> {
        let [mountain, valley] = self.settings.fold;
        match line.role {
            Role::Mountain => Some(line.fold.unwrap_or(mountain)),
            Role::Valley => Some(line.fold.unwrap_or(valley)),
            // The sheet bends there while it folds, and nothing holds it flat but its stiffness.
            Role::Flat => None,
            Role::Hinge | Role::Border | Role::Cut => line.fold,
        }
    }
}

/// A law per length, times a length.
fn times(law: &Spanned<Expression>, length: f64) -> Spanned<Expression> {
    let value = match &law.value {
        Expression::Number(number) => Expression::Number(number * length),
        Expression::Chain(first, rest)
            if rest.iter().all(|(it, _)| matches!(it, Operator::Mul | Operator::Div)) =>
        {
            let mut rest = rest.clone();
            rest.push((Operator::Mul, Expression::Number(length)));
            Expression::Chain(first.clone(), rest)
        }
        other => Expression::Chain(
            Box::new(other.clone()),
            vec![(Operator::Mul, Expression::Number(length))],
        ),
    };
    Spanned { value, span: law.span }
}
