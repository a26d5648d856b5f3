//! From entities to strokes: blocks, layers, colours.

use super::entity::{Chain, Colour, Entity, Insert, Kind};
use super::file::File;
use super::pairs::fault;
use super::roles::Roles;
use crate::affine::{Affine, sine_cosine};
use crate::curve::{Arc, Curve, Point};
use crate::drawing::Place;
use crate::fault::Cause;
use crate::limits;
use crate::sketch::{Pen, Sketch, Step};

/// A bulge below this is straight: the arc is within half a millionth of its chord, and its centre far away.
const STRAIGHT: f64 = 1e-6;

/// Draws the entities of a file.
pub(super) struct Draw<'a> {
    pub file: &'a File,
    pub roles: &'a Roles,
    pub sketch: &'a mut Sketch,
    /// The number of the name of layer `0`, on which entities of a block take the layer of the INSERT.
    pub zero: Option<usize>,
    /// Blocks that are drawn at the moment.
    pub open: Vec<usize>,
    pub work: usize,
}

/// What an entity gets from the INSERT around it.
#[derive(Clone, Copy)]
pub(super) struct Context {
    pub transform: Affine,
    pub layer: Option<usize>,
    pub colour: Colour,
}

impl<'a> Draw<'a> {
    /// Draws entities, those of the drawing or of a block.
    pub(super) fn entities(&mut self, entities: &'a [Entity], context: &Context) -> Step {
        entities.iter().try_for_each(|entity| self.entity(entity, context))
    }

    fn entity(&mut self, entity: &'a Entity, context: &Context) -> Step {
        self.spend(entity.size(), entity.place)?;
        let file = self.file;
        let layer = if Some(entity.layer) == self.zero {
            context.layer.unwrap_or(entity.layer)
        } else {
            entity.layer
        };
        let name = file.names.name(layer);
        let known = file.layers.get(&layer);
        if let Kind::Other(what) = entity.kind {
            self.sketch.ignore(file.names.name(what), entity.place);
            return Ok(());
        }
        if known.is_some_and(|l| l.hidden) {
            self.sketch
                .ignore(&format!("{} on hidden layer {name}", entity.kind.name()), entity.place);
            return Ok(());
        }
        let colour = match entity.colour {
            Colour::ByBlock => context.colour,
            // Layers that the table does not know are white.
            Colour::ByLayer => known.map_or(Colour::Index(7), |l| l.colour),
            own => own,
        };
        let transform = match entity.mirrored {
            true => context.transform.after(&Affine::scaling(-1.0, 1.0)),
            false => context.transform,
        };
        if let Kind::Insert(insert) = &entity.kind {
            return self.insert(
                insert,
                &Context { transform, layer: Some(layer), colour },
                entity.place,
            );
        }
        let Some(role) = self.roles.role(layer, colour) else {
            let what = format!("{} on layer {name} in {}", entity.kind.name(), described(colour));
            self.sketch.ignore(&what, entity.place);
            return Ok(());
        };
        self.geometry(&entity.kind, &transform, Pen { role, fold: None, place: entity.place })
    }

    fn geometry(&mut self, kind: &Kind, map: &Affine, pen: Pen) -> Step {
        match kind {
            Kind::Line(ends) => self.sketch.line(ends.map(|p| map.point(p)), pen),
            Kind::Chain(chain) if !chain.is_flat() => {
                self.sketch.ignore("POLYLINE with vertices at different heights", pen.place);
                Ok(())
            }
            Kind::Chain(chain) => self.chain(chain, map, pen),
            Kind::Arc(centre, radius, ends) => self.circular_arc(*centre, *radius, *ends, map, pen),
            Kind::Circle(centre, radius) => {
                self.turn(*centre, [[*radius, 0.0], [0.0, *radius]], map, pen)
            }
            Kind::Ellipse(centre, axes, ends) => self.elliptic_arc(*centre, *axes, *ends, map, pen),
            Kind::Spline(spline) => {
                self.spend(spline.work(), pen.place)?;
                for piece in spline.pieces() {
                    let map_weighted = |p: &[f64; 3]| {
                        let v = map.vector([p[0], p[1]]);
                        [v[0] + map.o[0] * p[2], v[1] + map.o[1] * p[2], p[2]]
                    };
                    self.sketch
                        .curve(Curve::Rational(piece.iter().map(map_weighted).collect()), pen)?;
                }
                Ok(())
            }
            Kind::Insert(_) | Kind::Other(_) => Ok(()),
        }
    }

    fn chain(&mut self, chain: &Chain, map: &Affine, pen: Pen) -> Step {
        let next =
            chain.vertices.iter().skip(1).chain(chain.vertices.first().filter(|_| chain.closed));
        for ((start, bulge), (end, _)) in chain.vertices.iter().zip(next) {
            let chord = [end[0] - start[0], end[1] - start[1]];
            if bulge.abs() < STRAIGHT {
                self.sketch.line([map.point(*start), map.point(*end)], pen)?;
                continue;
            }
            // The centre is on the left of the chord if the arc goes counterclockwise by less than half a turn.
            let height = (1.0 - bulge * bulge) / (4.0 * bulge);
            let centre = [
                0.5 * (start[0] + end[0]) - height * chord[1],
                0.5 * (start[1] + end[1]) + height * chord[0],
            ];
            let arm = [start[0] - centre[0], start[1] - centre[1]];
            let axes = [arm, [-arm[1], arm[0]]];
            self.arc(
                Arc {
                    centre,
                    axes,
                    from: 0.0,
                    sweep: 4.0 * libm::atan(*bulge),
                    ends: [*start, *end],
                },
                map,
                pen,
            )?;
        }
        Ok(())
    }

    /// An arc between two angles in degrees, counterclockwise.
    fn circular_arc(
        &mut self,
        centre: Point,
        radius: f64,
        [from, to]: [f64; 2],
        map: &Affine,
        pen: Pen,
    ) -> Step {
        let turn = (to - from).rem_euclid(360.0);
        let sweep = if turn == 0.0 { 360.0 } else { turn };
        let at = |degrees| {
            let (sine, cosine) = sine_cosine(degrees);
            [centre[0] + radius * cosine, centre[1] + radius * sine]
        };
        let axes = [[radius, 0.0], [0.0, radius]];
        let ends = [at(from), at(to)];
        self.arc(
            Arc { centre, axes, from: from.to_radians(), sweep: sweep.to_radians(), ends },
            map,
            pen,
        )
    }

    /// An arc between two parameters, rad, from the first axis to the second.
    fn elliptic_arc(
        &mut self,
        centre: Point,
        axes: [Point; 2],
        [from, to]: [f64; 2],
        map: &Affine,
        pen: Pen,
    ) -> Step {
        const TURN: f64 = std::f64::consts::TAU;
        let sweep = (to - from).rem_euclid(TURN);
        // Programs write a full turn with six digits.
        if !(1e-5..=TURN - 1e-5).contains(&sweep) {
            return self.turn(centre, axes, map, pen);
        }
        let at = |angle| {
            let (sine, cosine) = libm::sincos(angle);
            std::array::from_fn(|i| centre[i] + axes[0][i] * cosine + axes[1][i] * sine)
        };
        self.arc(Arc { centre, axes, from, sweep, ends: [at(from), at(to)] }, map, pen)
    }

    /// A full ellipse: four quarters, so that its extreme points are exact.
    fn turn(&mut self, centre: Point, [a, b]: [Point; 2], map: &Affine, pen: Pen) -> Step {
        let (minus_a, minus_b) = (a.map(|x| -x), b.map(|x| -x));
        let at = |axis: Point| [centre[0] + axis[0], centre[1] + axis[1]];
        for axes in [[a, b], [b, minus_a], [minus_a, minus_b], [minus_b, a]] {
            let arc = Arc {
                centre,
                axes,
                from: 0.0,
                sweep: std::f64::consts::FRAC_PI_2,
                ends: axes.map(at),
            };
            self.arc(arc, map, pen)?;
        }
        Ok(())
    }

    fn arc(&mut self, arc: Arc, map: &Affine, pen: Pen) -> Step {
        let arc = Arc {
            centre: map.point(arc.centre),
            axes: arc.axes.map(|axis| map.vector(axis)),
            ends: arc.ends.map(|p| map.point(p)),
            ..arc
        };
        self.sketch.curve(Curve::Arc(Box::new(arc)), pen)
    }

    fn insert(&mut self, insert: &Insert, context: &Context, place: Place) -> Step {
        let file = self.file;
        let name = file.names.name(insert.block);
        let Some(block) = file.blocks.get(&insert.block) else {
            self.sketch.ignore("INSERT of a block that is not in the file", place);
            return Ok(());
        };
        if self.open.contains(&insert.block) {
            return self.sketch.stop(fault(
                Cause::Syntax,
                format!("the block `{name}` contains itself"),
                place,
            ));
        }
        if self.open.len() >= limits::DEPTH {
            let message = format!("blocks are nested deeper than {}", limits::DEPTH);
            return self.sketch.stop(fault(Cause::Limit, message, place));
        }
        self.open.push(insert.block);
        let turned = Affine::translation(insert.at).after(&Affine::rotation(insert.rotation));
        let scaled = Affine::scaling(insert.scale[0], insert.scale[1]);
        let inside = scaled.after(&Affine::translation(block.base.map(|x| -x)));
        for row in 0..insert.counts[1] {
            for column in 0..insert.counts[0] {
                self.spend(1, place)?;
                let cell =
                    [f64::from(column) * insert.spacing[0], f64::from(row) * insert.spacing[1]];
                let own = turned.after(&Affine::translation(cell)).after(&inside);
                let transform = context.transform.after(&own);
                self.entities(&block.entities, &Context { transform, ..*context })?;
            }
        }
        self.open.pop();
        Ok(())
    }

    fn spend(&mut self, work: usize, place: Place) -> Step {
        self.work = self.work.saturating_add(work);
        if self.work <= limits::WORK_OF_BLOCKS {
            return Ok(());
        }
        let message = "the blocks and splines of this file are too much work".to_string();
        self.sketch.stop(fault(Cause::Limit, message, place))
    }
}

impl Kind {
    /// Its name in the format.
    fn name(&self) -> &'static str {
        match self {
            Kind::Line(_) => "LINE",
            Kind::Chain(_) => "POLYLINE",
            Kind::Arc(..) => "ARC",
            Kind::Circle(..) => "CIRCLE",
            Kind::Ellipse(..) => "ELLIPSE",
            Kind::Spline(_) => "SPLINE",
            Kind::Insert(_) => "INSERT",
            Kind::Other(_) => "entity",
        }
    }
}

fn described(colour: Colour) -> String {
    match colour {
        Colour::Index(index) => format!("colour {index}"),
        Colour::True([red, green, blue]) => format!("colour #{red:02x}{green:02x}{blue:02x}"),
        Colour::ByLayer | Colour::ByBlock => "the colour of a layer".into(),
    }
}
