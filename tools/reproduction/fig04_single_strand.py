"""Figure 4: a curled strand let go, AMS beside mass springs of rising stiffness, both schemes."""
import numpy as np

from . import pictures

STIFFNESS = [1e4, 1e5, 1e6, 1e7, 1e8, 1e9, 1e10, 1e11]
SHOWN = STIFFNESS[:6]
STIFFEST_IN_FLOAT = 1e9
SCHEMES = ["paper", "projected"]
# Steps a second and precisions that each model and scheme is run at.
WAYS = {
    ("mass_spring", "paper"): [(24, "float"), (60, "float"), (60, "double"), (480, "float")],
    ("mass_spring", "projected"): [(24, "float"), (60, "float"), (480, "float")],
    ("ams", "paper"): [(60, "float"), (60, "double")],
    ("ams", "projected"): [(60, "float")],
}
FPS = 12  # written; steps a second are a multiple
SECONDS = 20  # long enough for a strand that is damped at all to hang still
GAIN = 2  # of energy, beyond which a run has made it up: companions can hand the hair as much again as it released
SHAKE = [
    {"frame": 7},
    {"frame": 10, "translate": [0, 0.05, 0]},
    {"frame": 13, "translate": [0, -0.05, 0]},
    {"frame": 16},
]


def run(figures, model, scheme, stiffness, steps=60, precision="float", label="", **more):
    """`more`: further overrides, with `label`."""
    overrides = {f"/model/stiffness/{coupling}": stiffness for coupling in ("edge", "bend", "twist")}
    overrides |= {"/model/type": model, "/model/scheme": scheme, "/model/substeps": steps // FPS}
    overrides |= {"/frames/fps": FPS, "/frames/last": 1 + SECONDS * FPS, "/limits/edge_strain": 10}
    name = f"{label}{model}_{scheme}_{stiffness:.0e}_{steps}_{precision}"
    return figures.run("single_strand", name, overrides | more, options=["--precision", precision])


def history(run):
    """Of each frame: largest distance from the rest shape over the strand's length; root mean square speed [m/s]; and
    per unit mass the energy that the hair moves with and its segments hold, and what gravity has given [J/kg]."""
    stiffness = run.scene["model"]["stiffness"]["edge"]
    rest, length = run.cache.rest_position.astype(float), run.rest_lengths
    names, rows = ("deviation", "speed", "held", "released"), []
    for frame in run.frames:
        position, speed = run.position(frame), run.speeds(frame)
        stretch = np.linalg.norm(np.diff(position, axis=0), axis=1) - length[1:]
        held = 0.5 * (speed**2).sum() + 0.5 * stiffness * (stretch**2).sum()
        released = 9.81 * (rest[:, 1] - position[:, 1]).sum()
        away = np.linalg.norm(position - rest, axis=1).max() / run.lengths[0]
        rows.append((away, np.sqrt((speed**2).mean()), held, released))
    return dict(zip(names, np.array(rows).T))


def row(run, model, scheme, stiffness, steps, precision):
    """One line of the table."""
    past = history(run)
    released = past["released"].max()
    gain = past["held"].max() / released if released > 1e-3 else 0
    ended = run.code == 0
    return {
        "model": model, "scheme": scheme, "kappa_L": stiffness, "steps_per_second": steps, "precision": precision,
        "diverged_frame": run.diverged_frame,
        "deviation_max": past["deviation"].max(),
        "deviation_end": past["deviation"][-1] if ended else None,
        "speed_rms_last_second": np.sqrt((past["speed"][-FPS:] ** 2).mean()) if ended else None,
        "energy_over_released": gain,
        "edge_strain_max": run.worst("edge_strain_free"),
        "unstable": not ended or gain > GAIN,
    }


def table(figures):
    """In float as far as the program runs it."""
    return [
        row(run(figures, model, scheme, stiffness, *way), model, scheme, stiffness, *way)
        for (model, scheme), ways in WAYS.items()
        for way in ways
        for stiffness in STIFFNESS
        if stiffness <= STIFFEST_IN_FLOAT or way[1] == "double"
    ]


def variants(figures):
    """Largest deviation while it runs and at the end: after a shake of 5 cm, with projected lengths, and with the first
    segment clamped instead of hinged."""
    cases = {
        "shaken": (["ams", "mass_spring"], [1e7], {"/groom/animation": {"keys": SHAKE}}),
        "inextensible": (["mass_spring"], SHOWN, {"/effects/inextensible": {}}),
        "clamped": (["mass_spring"], SHOWN, {"/model/clamped_particles": 2}),
    }
    rows = []
    for case, (models, stiffnesses, more) in cases.items():
        for model in models:
            for scheme in SCHEMES:
                for stiffness in stiffnesses:
                    past = history(run(figures, model, scheme, stiffness, 480, label=f"{case}_", **more))
                    ends = {"deviation_max": past["deviation"].max(), "deviation_end": past["deviation"][-1]}
                    rows.append({"case": case, "model": model, "scheme": scheme, "kappa_L": stiffness} | ends)
    return rows


def strands(figures):
    """The strands after 4 s, drawn three times as wide: AMS, then mass springs by their stiffness."""
    frame = 1 + 4 * FPS
    shown = {"AMS 1e7": ("ams", 1e7)} | {f"MS 1e{np.log10(each):.0f}": ("mass_spring", each) for each in SHOWN}
    rows = [
        [(label, run(figures, model, scheme, stiffness)) for label, (model, stiffness) in shown.items()]
        for scheme in SCHEMES
    ]
    for _, one in sum(rows, []):
        one.cache.width = 3 * one.cache.width
    every = [(one, frame) for _, one in sum(rows, [])]
    camera = pictures.shared_camera(every, (20, 5), figures.size(190, 300))
    drawn = [
        [
            pictures.titled(pictures.render(one, frame, camera, **figures.look), f"{scheme}\n{label}")
            for label, one in row
        ]
        for row, scheme in zip(rows, SCHEMES)
    ]
    pictures.save(pictures.sheet(drawn), figures.path(".png"))


def plots(figures):
    """Largest deviation, speed and energy against time."""

    def draw(axes):
        for model, scheme, stiffness, style in (
            ("ams", "paper", 1e7, "k-"), ("mass_spring", "paper", 1e6, "C1-"), ("mass_spring", "paper", 1e9, "C3-"),
            ("mass_spring", "projected", 1e6, "C0-"), ("mass_spring", "projected", 1e9, "C2-"),
        ):
            one = run(figures, model, scheme, stiffness)
            past, name = history(one), {"ams": "AMS", "mass_spring": "MS"}[model]
            for ax, value in zip(axes, (past["deviation"], past["speed"], past["held"])):
                ax.plot(one.times, np.maximum(value, 1e-7), style, lw=0.9, label=f"{name} {scheme} {stiffness:.0e}")
        for ax, label in zip(axes, ("largest deviation / length", "RMS speed [m/s]", "kinetic + edges [J/kg]")):
            ax.set_yscale("log")
            ax.set_xlabel("time [s]")
            ax.set_ylabel(label)
        axes[0].legend(fontsize=7)

    pictures.plot(figures.path("_plot.png"), draw, columns=3, width=10.5, height=3.4)


def make(figures):
    strands(figures)
    plots(figures)
    figures.record({"table": table(figures), "variants": variants(figures)})
