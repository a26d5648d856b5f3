//! Exact area moments of polygons and the mass properties that follow.
//!
//! Green's theorem turns the area integrals of 1, x, y, x^2, x y, y^2 into sums over edges (Steger,
//! On the calculation of arbitrary moments of polygons, 1996).

use nalgebra::{Matrix3, Vector3};

use super::mechanism::MassProperties;

/// Integrals over an area about some origin.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct AreaMoments {
    /// m^2, positive whatever the orientation.
    pub area: f64,
    /// Of x and y, m^3.
    pub first: [f64; 2],
    /// Of x^2, x y, y^2, m^4.
    pub second: [f64; 3],
}

impl AreaMoments {
    /// Of a simple polygon about `origin`; closed by itself.
    pub fn of(polygon: &[[f64; 2]], origin: [f64; 2]) -> Self {
        let mut sum = Self::default();
        let relative = |p: [f64; 2]| [p[0] - origin[0], p[1] - origin[1]];
        for (index, &point) in polygon.iter().enumerate() {
            let [x0, y0] = relative(point);
            let [x1, y1] = relative(polygon[(index + 1) % polygon.len()]);
            let cross = x0 * y1 - x1 * y0;
            sum.area += cross / 2.0;
            sum.first[0] += cross * (x0 + x1) / 6.0;
            sum.first[1] += cross * (y0 + y1) / 6.0;
            sum.second[0] += cross * (x0 * x0 + x0 * x1 + x1 * x1) / 12.0;
            sum.second[1] += cross * (2.0 * (x0 * y0 + x1 * y1) + x0 * y1 + x1 * y0) / 24.0;
            sum.second[2] += cross * (y0 * y0 + y0 * y1 + y1 * y1) / 12.0;
        }
        let sign = sum.area.signum();
        sum.scaled(sign)
    }

    /// Times a number.
    pub fn scaled(self, k: f64) -> Self {
        Self {
            area: self.area * k,
            first: self.first.map(|x| x * k),
            second: self.second.map(|x| x * k),
        }
    }

    /// The sum of two areas.
    pub fn plus(self, other: Self) -> Self {
        Self {
            area: self.area + other.area,
            first: std::array::from_fn(|i| self.first[i] + other.first[i]),
            second: std::array::from_fn(|i| self.second[i] + other.second[i]),
        }
    }
}

/// Mass, first moment and second moments (integral of x x^T dm) about an origin: these add up.
#[derive(Clone, Copy, Debug, Default)]
pub struct MassMoments {
    mass: f64,
    first: Vector3<f64>,
    second: Matrix3<f64>,
}

impl MassMoments {
    /// A slab of an area between two heights, kg, about the area's origin.
    pub fn slab(area: AreaMoments, density: f64, bottom: f64, top: f64) -> Self {
        let thickness = top - bottom;
        let middle = (top + bottom) / 2.0;
        let height_squared = (top * top + top * bottom + bottom * bottom) / 3.0;
        let [x, y] = area.first;
        let [xx, xy, yy] = area.second;
        let zz = area.area * height_squared;
        Self {
            mass: area.area,
            first: Vector3::new(x, y, area.area * middle),
            second: Matrix3::new(
                xx,
                xy,
                x * middle,
                xy,
                yy,
                y * middle,
                x * middle,
                y * middle,
                zz,
            ),
        }
        .scaled(density * thickness)
    }

    /// A mass without extent.
    pub fn point(mass: f64, at: Vector3<f64>) -> Self {
        Self { mass, first: at * mass, second: at * at.transpose() * mass }
    }

    fn scaled(self, k: f64) -> Self {
        Self { mass: self.mass * k, first: self.first * k, second: self.second * k }
    }

    /// Both together.
    pub fn plus(self, other: Self) -> Self {
        Self {
            mass: self.mass + other.mass,
            first: self.first + other.first,
            second: self.second + other.second,
        }
    }

    /// Mass properties, given where the origin of the moments lies; zero mass stays at the origin.
    pub fn properties(self, origin: Vector3<f64>) -> MassProperties {
        if self.mass == 0.0 {
            return MassProperties { mass: 0.0, com: origin, inertia: Matrix3::zeros() };
        }
        let offset = self.first / self.mass;
        let central = self.second - offset * offset.transpose() * self.mass;
        MassProperties {
            mass: self.mass,
            com: origin + offset,
            inertia: Matrix3::identity() * central.trace() - central,
        }
    }
}

impl MassProperties {
    /// These properties as moments about `origin`.
    pub fn moments(&self, origin: Vector3<f64>) -> MassMoments {
        let offset = self.com - origin;
        let central = Matrix3::identity() * (self.inertia.trace() / 2.0) - self.inertia;
        MassMoments {
            mass: self.mass,
            first: offset * self.mass,
            second: central + offset * offset.transpose() * self.mass,
        }
    }
}
