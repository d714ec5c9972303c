"""Shear strength by hand of the beams with stirrups of plugins/mechanics/tests/experiments/series.rs.

    python3 plugins/experiments/peers/shear.py

The general procedure of AASHTO LRFD 5.7.3.4.2 and of CSA A23.3, 11.3.6.4: modified compression field theory, simplified (Bentz, Vecchio and Collins 2006), all
partial factors one. It looks at the section d_v beside the load's plate, where moment and shear are largest together, and knows no bending: what a beam bears
there, `opensees.py --only series` says.
"""

import math

YOUNG = 200e3
PLATE = 75.0  # from the middle of the beam to the plate's edge, mm

# Width, depth, span (mm), f_c (MPa), bars in the lower and the upper row, diameters of bars and stirrups, from the lower row to the bottom and to the upper row (mm),
# spacing of the stirrups (mm), their yield stress (MPa), measured (kN).
BEAMS = {
    "A1": (307, 561, 3660, 24.1, (2, 2), (28.7, 6.4), (64, 63), 210, 325, 467),
    "A3": (307, 561, 6400, 35.1, (3, 3), (28.7, 6.4), (64, 63), 210, 325, 467),
    "B1": (231, 556, 3660, 24.8, (2, 2), (28.7, 6.4), (64, 63), 190, 325, 445),
    "B3": (229, 556, 6400, 38.8, (3, 2), (28.7, 6.4), (64, 63), 190, 325, 356),
    "A2": (305, 559, 4570, 24.3, (3, 2), (28.7, 6.4), (64, 63), 210, 325, 489),
    "B2": (229, 561, 4570, 23.2, (2, 2), (28.7, 6.4), (64, 63), 190, 325, 400),
    "C1": (155, 559, 3660, 29.6, (1, 1), (28.7, 6.4), (64, 63), 210, 325, 311),
    "C2": (152, 559, 4570, 23.8, (2, 2), (28.7, 6.4), (64, 63), 210, 325, 325),
    "C3": (155, 554, 6400, 35.1, (2, 2), (28.7, 6.4), (64, 63), 210, 325, 269),
    "N1-N": (375, 750, 4300, 36.0, (5, 5), (29.9, 8.0), (65, 60), 325, 430, 914),
}


def shear(beam):
    """Load in the middle (kN) at which the section fails in shear, and θ there (degrees)."""
    width, depth, span, fc, bars, (bar, stirrup), (low, inset), spacing, yielding, _ = beam
    steel = sum(bars) * 0.25 * math.pi * bar**2
    d = depth - low - inset * bars[1] / sum(bars)
    lever = max(0.9 * d, 0.72 * depth)
    arm = 0.5 * span - PLATE - lever
    ties = 2 * 0.25 * math.pi * stirrup**2 * yielding / (width * spacing)

    def bears(force):
        strain = min((force * arm / lever + force) / (2 * YOUNG * steel), 3e-3)
        angle = math.radians(29 + 7000 * strain)
        stress = 0.4 / (1 + 1500 * strain) * math.sqrt(fc) + ties / math.tan(angle)
        return min(stress, 0.25 * fc) * width * lever, angle

    # What it bears falls as the force grows.
    least, most = 0.0, 1e7
    for _ in range(60):
        force = 0.5 * (least + most)
        least, most = (force, most) if bears(force)[0] > force else (least, force)
    return 2e-3 * least, math.degrees(bears(least)[1])


if __name__ == "__main__":
    for name, beam in BEAMS.items():
        load, angle = shear(beam)
        print(f"{name:5} {load:6.0f} kN, measured {beam[-1]}: {load / beam[-1]:.2f}, cracks at {angle:.0f} degrees")
