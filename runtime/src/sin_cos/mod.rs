//! Sine and cosine of many angles at once, without branches, so that compilers vectorise them.
//!
//! Angles are taken in blocks of eight, four, two and one, each a function of its own: inlined among
//! other code, blocks lose their vectors. Only where an angle of a block is beyond [`Angle::NEAR`],
//! or not finite, are such angles done once more, one by one.
//!
//! Errors in units of the last place, the largest that the tests find:
//!
//! | | near | beyond |
//! |---|---|---|
//! | `f64` | 0.8 up to 2^20 rad | libm's |
//! | `f32` | 1.7 up to 128 rad | 2.5 |
//!
//! The sine of an angle does not depend on the other lanes or on the feature `std`.

mod double;
mod single;

pub use double::sin_cos_unfused;
#[cfg(not(feature = "std"))]
pub(crate) use single::tan;

use crate::Arithmetic;

/// A number that has a sine without branches.
pub(crate) trait Angle: Arithmetic + PartialOrd {
    /// Below this magnitude (rad) [`near`](Self::near) is right.
    const NEAR: Self;
    /// Sine and cosine, without branches.
    fn near(self) -> (Self, Self);
    /// Sine and cosine beyond; NaN of what is not finite.
    fn far(self) -> (Self, Self);
}

/// Sine and cosine of each angle (rad).
#[inline]
pub(crate) fn sin_cos_all<S: Angle, const K: usize>(angles: [S; K]) -> [(S, S); K] {
    let [mut sines, mut cosines] = [[S::ZERO; K]; 2];
    write_sin_cos(&angles, &mut sines, &mut cosines);
    core::array::from_fn(|k| (sines[k], cosines[k]))
}

/// As [`sin_cos_all`], into slices of one length.
#[inline]
pub(crate) fn write_sin_cos<S: Angle>(angles: &[S], sines: &mut [S], cosines: &mut [S]) {
    let task = (angles, sines, cosines);
    blocks::<S, 1>(blocks::<S, 2>(blocks::<S, 4>(blocks::<S, 8>(task))));
}

/// Angles, where their sines go, and where their cosines go.
type Task<'a, S> = (&'a [S], &'a mut [S], &'a mut [S]);

/// Does as many whole blocks as there are, and leaves the rest.
#[inline(always)]
fn blocks<'a, S: Angle, const W: usize>((x, sines, cosines): Task<'a, S>) -> Task<'a, S> {
    let (x, x_rest) = x.as_chunks::<W>();
    let (sines, sines_rest) = sines.as_chunks_mut::<W>();
    let (cosines, cosines_rest) = cosines.as_chunks_mut::<W>();
    for ((x, sines), cosines) in x.iter().zip(sines).zip(cosines) {
        block(x, sines, cosines);
    }
    (x_rest, sines_rest, cosines_rest)
}

#[inline(never)]
fn block<S: Angle, const W: usize>(x: &[S; W], sines: &mut [S; W], cosines: &mut [S; W]) {
    let mut all_near = true;
    for k in 0..W {
        all_near &= x[k].abs() < S::NEAR;
        (sines[k], cosines[k]) = x[k].near();
    }
    if !all_near {
        redo_far(x, sines, cosines);
    }
}

#[cold]
#[inline(never)]
fn redo_far<S: Angle>(x: &[S], sines: &mut [S], cosines: &mut [S]) {
    for ((x, sine), cosine) in x.iter().zip(sines).zip(cosines) {
        if !(x.abs() < S::NEAR) {
            (*sine, *cosine) = x.far();
        }
    }
}
