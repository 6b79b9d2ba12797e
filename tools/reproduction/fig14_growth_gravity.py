"""Figure 14: procedural growth over gravity influence p_gamma and step length p_tau."""
from .growth import table

INFLUENCES = (0, 0.01, 0.04, 0.16)


def make(figures):
    figures.record({"cells": table(figures, "gravity_influence", "p_gamma", INFLUENCES)})
