//! Size and division of the workspace of the algorithms.

use crate::plumbing::Dimensions;
use crate::reduction::reduction_len;
use crate::unilateral::unilateral_len;
use crate::{Error, Mechanism};

/// Length of a workspace that is sufficient for every algorithm of this crate, with any number of
/// joints at stops.
///
/// With NQ coordinates, N = NU speeds, C closure rows, L loops and D driven joints, to which each joint at
/// a stop adds one, there are c = C + D + N rows and r = 9 L + D + N residuals at most; P parameters and
/// I inputs. It is the largest of
///
/// * acceleration: residuals and their Jacobian r + r N; then, in the same place, M or its factor N N;
///   J and two copies, one weighted and one orthogonalised, 3 c N; gamma and another right-hand side
///   2 c; a vector N; or, where a motion passes through a singular state, M or its factor N N, J and its
///   change 2 c N, and 3 c + N;
/// * projection: M or its factor N N; then, one after the other in the same place, f, J, gamma
///   N + C N + C, or residuals, their Jacobian, a step and coordinates r + r N + N + NQ; or residuals,
///   two vectors and coordinates r + 2 N + NQ, which is never more;
/// * assembly: residuals and their Jacobian r + r N; the normal equations and their factor 2 N N;
///   seven vectors 7 N and five of coordinates 5 NQ;
/// * jacobian: M or its factor N N; J c N and what orthogonalised it c c; four vectors of rows
///   4 c and two of coordinates 2 N; directions P + I;
/// * a reduction to d independent speeds, of B joints, with K entries of the rows of J and F of their L and U, where the
///   module has one: 22 B + K + F; with w = 8 for d <= 8, else 16, and b for d / w rounded up, (b + 1) w for each joint,
///   6 w + 12 for each on the longest way from the ground; d d + b w + 21; (D + N + 1) d + (D + N) (D + N + 4);
///   residuals, two vectors and coordinates r + 2 N + NQ; with more than 24 speeds, d and D are larger by L, and K counts twice;
/// * rigid contacts: 3 N and some 20 numbers for each contact point; for mechanisms without, never the largest.
pub const fn workspace_len(dimensions: Dimensions) -> usize {
    let with_stops =
        needed(Dimensions { drives: dimensions.drives + dimensions.joints, ..dimensions });
    greater(with_stops, rigid_len(dimensions))
}

/// Length of the storage of [`Rigid`](crate::Rigid) beside a workspace.
pub(crate) const fn rigid_len(dimensions: Dimensions) -> usize {
    unilateral_len(dimensions) + 2 * dimensions.speeds
}

/// Length that is needed without further joints at a stop.
#[inline]
const fn needed(dimensions: Dimensions) -> usize {
    let Dimensions { coordinates, speeds: n, rows, loops, drives, parameters, inputs, .. } =
        dimensions;
    let c = rows + drives;
    let r = 9 * loops + drives;
    let acceleration =
        greater(r + r * n, n * n + greater(3 * c * n + 2 * c, 2 * c * n + 3 * c) + n);
    let projection = n * n + greater(n + rows * n + rows, r + r * n + n + coordinates);
    let assembly = r + r * n + 2 * n * n + 7 * n + 5 * coordinates;
    let jacobian = n * n + c * n + c * c + 4 * c + 2 * n + parameters + inputs;
    let most = greater(greater(acceleration, jacobian), greater(projection, assembly));
    greater(most, reduction_len(dimensions))
}

const fn greater(a: usize, b: usize) -> usize {
    if a > b { a } else { b }
}

/// Cuts the first `len` numbers off a workspace.
#[inline]
pub(crate) fn split<'a, S>(workspace: &mut &'a mut [S], len: usize) -> Result<&'a mut [S], Error> {
    let given = workspace.len();
    match core::mem::take(workspace).split_at_mut_checked(len) {
        Some((part, rest)) => {
            *workspace = rest;
            Ok(part)
        }
        None => Err(Error::Workspace { needed: len, given }),
    }
}

/// Checks that a workspace suffices and that vectors of coordinates and of speeds have their lengths.
#[inline]
pub(crate) fn check<Y: Mechanism>(
    system: &Y,
    workspace: &[Y::Scalar],
    coordinates: &[usize],
    speeds: &[usize],
) -> Result<Dimensions, Error> {
    let dimensions = system.dimensions();
    let needed = needed(dimensions);
    if workspace.len() < needed {
        return Err(Error::Workspace { needed, given: workspace.len() });
    }
    let places = [(dimensions.coordinates, coordinates), (dimensions.speeds, speeds)];
    for (expected, lengths) in places {
        if let Some(&given) = lengths.iter().find(|&&given| given != expected) {
            return Err(Error::Length { expected, given });
        }
    }
    Ok(dimensions)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Firmware without contacts has no room for them.
    #[test]
    fn contacts_cost_room_only_where_there_are_some() {
        for joints in 1..40 {
            for (loops, rows) in [(0, 0), (1, 3), (1, 6), (3, 18)] {
                let d = Dimensions { loops, rows, ..Dimensions::of_joints(joints) };
                let stops = Dimensions { drives: joints, ..d };
                assert_eq!(workspace_len(d), needed(stops));
                let free =
                    Dimensions { coordinates: joints + 7, speeds: joints + 6, contacts: 8, ..d };
                assert!(workspace_len(free) >= rigid_len(free));
            }
        }
    }
}
