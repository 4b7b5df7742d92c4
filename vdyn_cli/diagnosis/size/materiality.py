"""The limits below which a finding does not matter: those of the description, or shares of the uncertainty."""

from __future__ import annotations

from collections.abc import Mapping

from vdyn_cli.diagnosis.policy import POLICY
from vdyn_cli.diagnosis.size.finding_size import Limits
from vdyn_cli.quantities.errors import Finding, did_you_mean, raise_all
from vdyn_cli.quantities.quantity import UnitError, parse
from vdyn_cli.quantities.result import Result

PERCENT = "%"
REMEDY = "write a quantity with its unit, such as 'speed: 0.05 m/s', or for a parameter a share, 'drag_area: 1 %'"


def limits_of(result: Result, unit: str, stated: Mapping[str, str | float]) -> Limits:
    """The limits below which a finding does not matter.

    Parameters
    ----------
    result : of the baseline. unit : of the main channel in which gains are measured.
    stated : ``diagnose.matters`` of the description: a limit by output or parameter, in its unit or, for a parameter,
        in percent of its value. Default of the others: ``matters_share`` of the half interval or noise floor.

    Raises
    ------
    InputError : a name that is neither the main output nor a parameter of the result, or a quantity of another unit.
    """
    fit, share = result.fit, POLICY.matters_share
    same = fit.unit == unit and fit.noise_floor > 0
    output, noise = (share * fit.noise_floor, fit.noise_floor) if same else (float("nan"), float("nan"))
    limits = {n: share * e.half_width for n, e in result.parameters.items() if e.half_width > 0}
    findings = []
    main = main_output(result)
    for name, text in stated.items():
        try:
            if name == main:
                output = abs(parse(text, fit.unit).value)
                noise = fit.noise_floor
            elif name in result.parameters:
                limits[name] = _parameter_limit(result, name, text)
            else:
                known = [*([main] if main else []), *result.parameters]
                findings.append(
                    Finding("diagnose.matters", f"unknown key '{name}'", remedy=did_you_mean(name, known, REMEDY))
                )
        except UnitError as error:
            findings.append(Finding("diagnose.matters", f"'{name}': {error}", str(text), REMEDY))
    raise_all(findings)
    return Limits(output, noise, limits, bool(stated))


def main_output(result: Result) -> str:
    """Name of the channel in whose unit the fit is summarized; empty where nothing is compared."""
    return next((c.channel.replace(" ", "_") for c in result.comparisons if c.unit == result.fit.unit), "")


def _parameter_limit(result: Result, name: str, text: str | float) -> float:
    one = result.parameters[name]
    if isinstance(text, str) and text.strip().endswith(PERCENT):
        return abs(0.01 * parse(text.strip()[: -len(PERCENT)], "").value * one.value)
    return abs(parse(text, one.unit).value)
