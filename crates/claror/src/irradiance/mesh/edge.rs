//! Derivatives of an edge's part of a polygon's form factor by the receiver's position.

use crate::math::DVec3;

/// Four-point Gauss-Legendre rule on [0, 1]: abscissae and weights.
const GAUSS: [(f64, f64); 4] = [
    (0.069_431_844_202_973_71, 0.173_927_422_568_726_93),
    (0.330_009_478_207_571_87, 0.326_072_577_431_273_07),
    (0.669_990_521_792_428_1, 0.326_072_577_431_273_07),
    (0.930_568_155_797_026_3, 0.173_927_422_568_726_93),
];
/// Three points, for edges no longer than `SHORT` times their distance: 10⁻⁷.
const GAUSS_SHORT: [(f64, f64); 3] = [
    (0.112_701_665_379_258_31, 0.277_777_777_777_777_8),
    (0.5, 0.444_444_444_444_444_4),
    (0.887_298_334_620_741_7, 0.277_777_777_777_777_8),
];
const SHORT: f64 = 0.25;
/// A panel of the quadrature is at most this much longer than its distance from the receiver:
/// the integrands' poles stay so far away that the rule errs by less than 10⁻⁶, relatively.
const PANEL: f64 = 0.45;
/// Of an edge; more are needed only where it is 10¹⁰ times as long as it is far.
const MAX_PANELS: u32 = 64;

/// π times the derivatives of an edge's part of Lambert's form factor, tangential: weights of the
/// radiance on the edge's left side in those of the irradiance.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(super) struct EdgeDerivatives {
    /// By x and y.
    pub(super) gradient: [f64; 2],
    /// By xx, xy and yy.
    pub(super) hessian: [f64; 3],
}

/// For the edge from `a` to `b`, both relative to the receiver, in whose frame z is the normal.
///
/// The gradient is `½ (p ∫1/r² + 2 c_z ∫r/r⁴)` and the Hessian
/// `p vᵀ + v pᵀ − c_z I ∫1/r⁴ + 4 c_z ∫r rᵀ/r⁶` along the edge, with `v = ∫r/r⁴`, `p = n × e`,
/// `c = a × b`: the derivatives of Arvo (1994) and Holzschuch and Sillion (1998). The integrals
/// have closed forms, whose differences lose all digits where an edge points at the receiver;
/// quadrature does not, and is faster for the short edges that nearly all of them are.
pub(super) fn derivatives(a: DVec3, b: DVec3) -> EdgeDerivatives {
    let e = b - a;
    let (length2, a2, b2) = (e.length_squared(), a.length_squared(), b.length_squared());
    if length2 == 0.0 {
        return EdgeDerivatives::default();
    }
    let mut integrals = Integrals::default();
    let nearest2 = a2.min(b2);
    if length2 <= SHORT * SHORT * nearest2 {
        integrals.add_panel(a, e, 0.0, 1.0, GAUSS_SHORT);
    } else if length2 <= PANEL * PANEL * nearest2 {
        integrals.add_panel(a, e, 0.0, 1.0, GAUSS);
    } else {
        integrals.add_long(a, e, length2);
    }
    integrals.derivatives(e, a.x * b.y - a.y * b.x)
}

/// Along the edge r(t), t from 0 to 1.
#[derive(Default)]
struct Integrals {
    inverse2: f64,
    inverse4: f64,
    first: [f64; 2],
    second: [f64; 3],
}

impl Integrals {
    #[inline(always)]
    fn add_panel<const N: usize>(
        &mut self,
        a: DVec3,
        e: DVec3,
        from: f64,
        to: f64,
        rule: [(f64, f64); N],
    ) {
        let width = to - from;
        for (x, weight) in rule {
            let r = a + (from + width * x) * e;
            let q = 1.0 / r.length_squared();
            let w = width * weight * q;
            let w2 = w * q;
            let w3 = w2 * q;
            self.inverse2 += w;
            self.inverse4 += w2;
            self.first[0] += w2 * r.x;
            self.first[1] += w2 * r.y;
            self.second[0] += w3 * r.x * r.x;
            self.second[1] += w3 * r.x * r.y;
            self.second[2] += w3 * r.y * r.y;
        }
    }

    /// In panels as long as their distance allows, from the point nearest to the receiver to both
    /// ends.
    #[cold]
    fn add_long(&mut self, a: DVec3, e: DVec3, length2: f64) {
        let nearest = (-a.dot(e) / length2).clamp(0.0, 1.0);
        let step = PANEL / length2.sqrt();
        for end in [0.0, 1.0] {
            let mut t = nearest;
            for panel in 0..MAX_PANELS {
                if t == end {
                    break;
                }
                let reach = step * (a + t * e).length();
                let last = panel + 1 == MAX_PANELS || (end - t).abs() <= reach;
                let next = if last { end } else { t + reach.copysign(end - t) };
                self.add_panel(a, e, t.min(next), t.max(next), GAUSS);
                t = next;
            }
        }
    }

    fn derivatives(&self, e: DVec3, cz: f64) -> EdgeDerivatives {
        let p = [-e.y, e.x];
        let [vx, vy] = self.first;
        EdgeDerivatives {
            gradient: [0.5 * self.inverse2 * p[0] + cz * vx, 0.5 * self.inverse2 * p[1] + cz * vy],
            hessian: [
                2.0 * p[0] * vx - cz * self.inverse4 + 4.0 * cz * self.second[0],
                p[0] * vy + p[1] * vx + 4.0 * cz * self.second[1],
                2.0 * p[1] * vy - cz * self.inverse4 + 4.0 * cz * self.second[2],
            ],
        }
    }
}
