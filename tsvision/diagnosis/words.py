"""A diagnosis in plain words, for a lab book."""

from __future__ import annotations

from tsvision.diagnosis.verdict import Cause, Estimate
from tsvision.mechanisms import MECHANISMS

ALIKE = 3.0  # log evidence
LIKELY = 0.8  # chance of one cause below which a proposal says that it may not be enough


def paragraph(
    status: str,
    causes: tuple[Cause, ...],
    equivalent: tuple[tuple[str, ...], ...],
    base: dict,
    extended: dict,
    gain: dict | None,
    next_experiment: dict | None,
    residual: dict,
    unit: str,
    rivals: list[dict],
) -> str:
    """A few sentences: how wrong the model is, why, what mending it gains, what to do next."""
    key = "rmse_mm" if "rmse_mm" in base else "rmse"
    said = [f"The {base['model'].replace('_', '-')} model is {base[key]:.3g} {unit} off (RMSE)."]
    if status == "no_discrepancy":
        said.append(
            "That is within the noise and the tolerances of its inputs: nothing is shown to be "
            "wrong with it."
        )
        return " ".join(said)
    if status == "unexplained":
        said.append(f"Something is wrong that no known cause explains: {residual['hint']}.")
        if residual.get("partly"):
            names = " with ".join(residual["partly"])
            said.append(f"Part of it resembles {names}, which is not enough to name it.")
        return " ".join(said)
    said.append(_causes(causes))
    if len(equivalent) > 1:
        others = "; ".join(_joined(names) for names in equivalent[1:])
        said.append(f"These data cannot tell that from: {others}.")
    if gain:
        said.append(
            f"Extended by it, the model is {extended[key]:.3g} {unit} off, and "
            f"{gain['extended']:.3g} {unit} on data that it had not seen ({gain['scheme']}; the "
            f"base: {gain['base']:.3g} {unit}; {gain['ratio']:.2g} times better, 95 % interval "
            f"{gain['low']:.2g} to {gain['high']:.2g})."
        )
    if residual["lack_of_fit_p"] is None:
        said.append("There are too few readings to test whether anything is left over.")
    elif residual["lack_of_fit_p"] < 0.01:
        said.append(f"A small part is left over: {residual['hint']}.")
    said += _next_best(rivals, len(equivalent) > 1)
    if next_experiment:
        said.append(_next(next_experiment))
    return " ".join(said)


def _next_best(rivals: list[dict], ambiguous: bool) -> list[str]:
    """Forms of the same causes that fit alike, and the nearest other causes."""
    own = rivals[0]["causes"] if rivals else []
    same = [r for r in rivals if r["causes"] == own and r["behind"] < ALIKE]
    said = []
    if same:
        forms = ", ".join("/".join(r["shapes"]).replace("_", " ") for r in same)
        said.append(f"Other forms of it fit nearly as well ({forms}).")
    others = [r for r in rivals if r["behind"] >= ALIKE]
    if others and not ambiguous:
        nearest = min(others, key=lambda r: r["behind"])
        said.append(
            f"The nearest rival, {_joined(tuple(nearest['causes']))}, is {nearest['behind']:.1f} "
            "behind in log evidence."
        )
    return said


def _causes(causes: tuple[Cause, ...]) -> str:
    told = []
    for cause in causes:
        numbers = ", ".join(f"{key} {_number(e)}" for key, e in cause.parameters.items())
        told.append(f"{cause.title.lower()} ({cause.claim}; {numbers})")
    return "The data point to " + "; and to ".join(told) + "."


def _number(e: Estimate) -> str:
    unit = "" if e.unit == "1" else f" {e.unit}"
    return f"{e.value:.3g}{unit} [{e.low:.3g}, {e.high:.3g}]"


def _joined(names: tuple[str, ...]) -> str:
    return " with ".join(MECHANISMS[name].title.lower() for name in names)


def _next(proposal: dict) -> str:
    where = f"at {proposal['turns']:.3g} turns"
    if proposal["load_N"] is not None and proposal["load_N"] == proposal["load_N"]:
        where += f" under {proposal['load_N']:.3g} N"
    what = proposal["observable"].rsplit("_", 1)[0].replace("_", " ")
    said = (
        f"To decide, measure the {what} {where}: the candidates differ there by "
        f"{proposal['expected_difference']:.2g} {proposal['unit']}."
    )
    if proposal["chance_to_resolve"] < LIKELY:
        said += (
            " Even read all along the runs it leaves one cause with a probability of "
            f"{proposal['chance_to_resolve']:.1g} only."
        )
    return said


def bundle_paragraph(
    status: str,
    causes: tuple[Cause, ...],
    sets: list[tuple[str, ...]],
    base: dict,
    extended_rmse_mm: float,
    gain: dict,
    looks: dict[str, str],
    next_experiment: dict | None,
    rivals: list[tuple[str, float]],
) -> str:
    """The same for a bundle model: how far off, why, the gain, what a picture would show."""
    name = base["model"].replace("_", "-")
    said = [f"The {name} section is {base['rmse_mm']:.3f} mm off (RMSE over N > 1)."]
    if status == "no_discrepancy":
        said.append("That is within the scatter of the measurements.")
        return " ".join(said)
    said.append(_causes(causes))
    if len(sets) > 1:
        others = "; ".join(" with ".join(names).replace("_", " ") for names in sets[1:])
        said.append(f"These data cannot tell that from: {others}.")
    said.append(
        f"Extended by it, the model is {extended_rmse_mm:.3f} mm off, and "
        f"{gain['held_out_rmse_extended_mm']:.3f} mm on the N left out "
        f"(the base: {gain['held_out_rmse_base_mm']:.3f} mm)."
    )
    if rivals:
        behind = ", ".join(f"{title} ({gap:.1f})" for title, gap in rivals)
        said.append(f"Rivals, and how far they fall behind in log evidence: {behind}.")
    told = "; ".join(f"{key.replace('_', ' ')}: {look}" for key, look in looks.items())
    said.append(f"What a picture would show: {told}.")
    if next_experiment:
        said.append(
            f"The two likeliest differ most at N = {next_experiment['strings']}, by "
            f"{next_experiment['expected_difference']:.2g} mm."
        )
    return " ".join(said)
