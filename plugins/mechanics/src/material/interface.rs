//! Where two bodies touch: joints between segments, cushions, the ground.
//!
//! An opening has three components, [across, along, along], positive across = apart; a traction likewise, negative across = pressure.

/// A dry joint: pressure by a normal stiffness, no tension, Coulomb friction on the pressure.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Joint {
    /// Pressure per closing k_n, Pa/m; E/t for a cushion of thickness t.
    pub normal: f64,
    /// Shear per slip while it sticks k_s, Pa/m; G/t for a cushion.
    pub shear: f64,
    /// Coefficient of friction.
    pub friction: f64,
    /// Share of both stiffnesses that an open joint keeps, so that a solver can always turn the system round; 1e-6, say.
    pub rest: f64,
}

/// What a joint remembers: the slip that would be left without shear, m.
pub type Slip = [f64; 2];

/// Traction (Pa), its derivative by the opening (row = component of traction, Pa/m) and the slip at the end.
pub type Contact = ([f64; 3], [[f64; 3]; 3], Slip);

impl Joint {
    /// Answer to an opening (m). The tangent of a slipping joint is not symmetric: friction depends on pressure, pressure not on slip.
    #[must_use]
    pub fn respond(&self, opening: [f64; 3], slip: &Slip) -> Contact {
        let [across, u, v] = opening;
        if across >= 0.0 {
            let (kn, ks) = (self.rest * self.normal, self.rest * self.shear);
            // An open joint forgets: it will stick where it closes.
            return ([kn * across, 0.0, 0.0], [[kn, 0.0, 0.0], [0.0, ks, 0.0], [0.0, 0.0, ks]], [u, v]);
        }
        let pressure = -self.normal * across;
        let trial = [self.shear * (u - slip[0]), self.shear * (v - slip[1])];
        let size = trial[0].hypot(trial[1]);
        let limit = self.friction * pressure;
        if size <= limit {
            let tangent = [[self.normal, 0.0, 0.0], [0.0, self.shear, 0.0], [0.0, 0.0, self.shear]];
            return ([-pressure, trial[0], trial[1]], tangent, *slip);
        }
        let way = trial.map(|t| t / size);
        let shear = way.map(|w| w * limit);
        let mut tangent = [[self.normal, 0.0, 0.0], [0.0; 3], [0.0; 3]];
        for i in 0..2 {
            tangent[i + 1][0] = -self.friction * self.normal * way[i];
            for j in 0..2 {
                // The direction of sliding turns, its size does not change; `rest` keeps the tangent regular.
                let turn = f64::from(u8::from(i == j)) - way[i] * way[j];
                tangent[i + 1][j + 1] = self.shear * (limit / size * turn + self.rest * way[i] * way[j]);
            }
        }
        let next = [u - shear[0] / self.shear, v - shear[1] / self.shear];
        ([-pressure, shear[0], shear[1]], tangent, next)
    }
}

/// The ground around a lining as springs per area: it pushes back where the lining moves outward and lets go where it moves inward.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Ground {
    /// Radial stiffness k_r, Pa/m.
    pub radial: f64,
    /// Tangential stiffness where it presses, Pa/m.
    pub tangential: f64,
    /// Pressure that is there before anything moves, Pa.
    pub initial: f64,
    /// Share of the stiffness that is left where the ground has let go.
    pub rest: f64,
}

impl Ground {
    /// k_r = E/((1 + ν)R) of an infinite elastic medium around a hole of radius R under uniform pressure, a third of it tangentially.
    #[must_use]
    pub fn around(modulus: f64, poisson: f64, radius: f64) -> Self {
        let radial = modulus / ((1.0 + poisson) * radius);
        Self { radial, tangential: radial / 3.0, initial: 0.0, rest: 1e-6 }
    }

    /// Traction (Pa) on the lining in [outward, tangential, axial] directions and its derivative (diagonal, Pa/m), for a displacement (m) of it.
    #[must_use]
    pub fn respond(&self, displacement: [f64; 3]) -> ([f64; 3], [f64; 3]) {
        let pressure = self.initial + self.radial * displacement[0];
        let share = if pressure > 0.0 { 1.0 } else { self.rest };
        let tangential = share * self.tangential;
        let traction = [-share * pressure, -tangential * displacement[1], -tangential * displacement[2]];
        (traction, [-share * self.radial, -tangential, -tangential])
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::tensor::tests::random;

    const JOINT: Joint = Joint { normal: 1e11, shear: 4e10, friction: 0.6, rest: 1e-6 };

    #[test]
    fn open_stick_and_slip() {
        let (t, _, _) = JOINT.respond([1e-3, 1e-3, 0.0], &[0.0; 2]);
        assert!(t[0] < 1e3 && t[1] == 0.0);
        let (t, _, slip) = JOINT.respond([-1e-5, 1e-6, 0.0], &[0.0; 2]);
        assert!((t[0] + 1e6).abs() < 1e-6 && (t[1] - 4e4).abs() < 1e-6 && slip == [0.0; 2]);
        let (t, _, slip) = JOINT.respond([-1e-5, 3e-3, 4e-3], &[0.0; 2]);
        assert!((t[1].hypot(t[2]) - 0.6e6).abs() < 1e-6 && (t[2] / t[1] - 4.0 / 3.0).abs() < 1e-12);
        // Going back a little sticks again.
        let (back, _, _) = JOINT.respond([-1e-5, 3e-3 - 1e-6, 4e-3], &slip);
        assert!((t[1] - back[1] - 4e4).abs() < 1e-3);
    }

    #[test]
    fn tangent_is_that_of_finite_differences() {
        for walk in 0..200 {
            let r = random(walk, 1.0);
            let (opening, slip) = ([-1e-5 * r[0].abs() - 1e-7, 1e-4 * r[1], 1e-4 * r[2]], [1e-4 * r[3], 1e-4 * r[4]]);
            let (_, tangent, _) = JOINT.respond(opening, &slip);
            for j in 0..3 {
                let (mut up, mut down) = (opening, opening);
                up[j] += 1e-11;
                down[j] -= 1e-11;
                let (up, down) = (JOINT.respond(up, &slip).0, JOINT.respond(down, &slip).0);
                for i in 0..3 {
                    let numeric = (up[i] - down[i]) / 2e-11;
                    assert!((numeric - tangent[i][j]).abs() < 1e-4 * JOINT.normal, "{walk} {i} {j} {numeric:e} {:e}", tangent[i][j]);
                }
            }
        }
    }

    /// E 30 MPa, ν .3, R 3 m: 7.692 MPa/m; a ring of E 34.5 GPa, t .3 m in it under .3 MPa from inside moves by .25914 mm.
    #[test]
    fn ring_in_the_ground() {
        let ground = Ground::around(30e6, 0.3, 3.0);
        assert!((ground.radial / 1e6 - 7.692).abs() < 5e-4);
        let u = 0.3e6 / (34.5e9 * 0.3 / 9.0 + ground.radial);
        assert!((u * 1e3 - 0.25914).abs() < 1e-5);
        let (t, slope) = ground.respond([u, 0.0, 0.0]);
        assert!((t[0] + ground.radial * u).abs() < 1e-9 && slope[0] == -ground.radial);
        assert!((0.3e6 + t[0] - 34.5e9 * 0.3 / 9.0 * u).abs() < 1e-6);
        // Inward, it lets go.
        assert!(ground.respond([-u, 1e-3, 0.0]).0.iter().all(|t| t.abs() < 1.0));
    }
}
