"""Figure 13: procedural growth over helix radius p_h and step length p_tau."""
from .growth import table

RADII = (0, 10, 20, 30)


def make(figures):
    figures.record({"cells": table(figures, "helix_radius", "p_h", RADII)})
