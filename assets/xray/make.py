#!/usr/bin/env python3
"""Makes attenuation.csv, form.csv and tube.csv of this folder. README.md says from what, and under which licences.

    pip install numpy xraylib==4.3.0 spekpy==2.5.4 && python make.py
"""

import numpy as np
import spekpy
import xraylib as xl

# Mass fractions by atomic number, density in kg/m3. What each is, is said in README.md.
MATERIALS = {
    "concrete": (2300, {1: .0221, 6: .002484, 8: .57493, 11: .015208, 12: .001266, 13: .019953, 14: .304627, 19: .010045, 20: .042951, 26: .006435}),
    "mortar": (2150, {1: .0180, 6: .0010, 8: .5310, 11: .0030, 12: .0080, 13: .0190, 14: .2710, 16: .0060, 19: .0050, 20: .1280, 26: .0100}),
    "cement paste": (1950, {1: .0290, 8: .4660, 11: .0020, 12: .0110, 13: .0220, 14: .0830, 16: .0110, 19: .0050, 20: .3510, 26: .0200}),
    "quartz": (2650, {8: .532565, 14: .467435}),
    "limestone": (2710, {6: .120003, 8: .479566, 20: .400431}),
    "granite": (2650, {8: .4890, 11: .0270, 12: .0040, 13: .0760, 14: .3370, 19: .0340, 20: .0130, 26: .0200}),
    "steel": (7874, {26: 1.0}),
    "water": (1000, {1: .111898, 8: .888102}),
    "air": (1.205, {6: .000124, 7: .755268, 8: .231781, 18: .012827}),
    "aluminium": (2699, {13: 1.0}),
    "copper": (8960, {29: 1.0}),
    "tin": (7310, {50: 1.0}),
    "caesium iodide": (4510, {53: .488451, 55: .511549}),
}
# keV. 75 steps, so that no round energy is a grid point.
ENERGIES = 5.0 * 100.0 ** (np.arange(76) / 75)
# sin(theta/2)/wavelength in 1/angstrom; 500 keV straight back is 40.33.
TRANSFERS = np.concatenate([[0.0], np.geomspace(0.004, 41.0, 96)])
KV = [60, 80, 100, 120, 140, 160, 180, 200, 225, 250, 275, 300, 350, 400, 450]
ANODE_DEGREES = 20


def edges(fractions):
    """K and L edges within the grid."""
    found = {edge(z, shell) for z in fractions for shell in range(xl.K_SHELL, xl.M1_SHELL)}
    return sorted(e for e in found if ENERGIES[0] < e < ENERGIES[-1])


def edge(z, shell):
    try:
        return xl.EdgeEnergy(z, shell)
    except ValueError:
        return 0.0


def mix(fractions, cross_section, energy):
    total = sum(fractions.values())
    return sum(w / total * cross_section(z, float(energy)) for z, w in fractions.items())


def attenuation():
    """m2/kg. An edge has two rows of the same energy, below and above it."""
    yield "material,density_kg_m3,energy_keV,photo_m2_kg,compton_m2_kg,rayleigh_m2_kg"
    for name, (density, fractions) in MATERIALS.items():
        points = [(e, e) for e in ENERGIES]
        for e in edges(fractions):
            points = [p for p in points if abs(p[0] / e - 1) > 2e-3] + [(e, e * (1 - 1e-4)), (e, e * (1 + 1e-4))]
        for shown, energy in sorted(points, key=lambda p: (p[0], p[1])):
            values = [0.1 * mix(fractions, f, energy) for f in (xl.CS_Photo, xl.CS_Compt, xl.CS_Rayl)]
            yield f"{name},{density:g},{shown:.7g}," + ",".join(f"{v:.6e}" for v in values)


def form():
    """Incoherent scattering function over the number of electrons, and the square of the form factor over that of x = 0."""
    yield "material,x_per_angstrom,incoherent,coherent_squared"
    for name, (_, fractions) in MATERIALS.items():
        atoms = {z: w / xl.AtomicWeight(z) for z, w in fractions.items()}
        electrons = sum(n * z for z, n in atoms.items())
        squares = sum(n * z * z for z, n in atoms.items())
        for x in TRANSFERS:
            s = sum(n * xl.SF_Compt(z, float(x)) for z, n in atoms.items() if x > 0) / electrons
            f = sum(n * xl.FF_Rayl(z, float(x)) ** 2 for z, n in atoms.items()) / squares
            yield f"{name},{x:.6g},{min(s, 1.0):.6e},{f:.6e}"


def tube():
    """Photons per keV, cm2 and mAs at 1 m from a bare tungsten anode, in bins of 1 keV (the energy is the middle)."""
    columns = []
    for kv in KV:
        energy, fluence = spekpy.Spek(kvp=kv, th=ANODE_DEGREES, physics="kqp", dk=1.0).get_spectrum()
        columns.append(dict(zip(energy, fluence)))
    yield "energy_keV," + ",".join(str(kv) for kv in KV)
    for energy in sorted(columns[-1]):
        if energy > ENERGIES[0]:
            yield f"{energy:g}," + ",".join(f"{c[energy]:.4e}" if c.get(energy, 0) > 0 else "0" for c in columns)


for file, rows in (("attenuation.csv", attenuation()), ("form.csv", form()), ("tube.csv", tube())):
    with open(file, "w") as out:
        out.writelines(row + "\n" for row in rows)
