"""Linearized fits of play converge to the amplitude at which all impacts fit, not to the first result."""

from __future__ import annotations

from dataclasses import replace

import pytest

from tests.steps.validate.test_nondifferentiable import PLAY, one_drive, simulated
from vdyn_cli.steps.validate.fit import effect_fit, nondifferentiable
from vdyn_cli.steps.validate.fit.effect_fit import fit_effects
from vdyn_cli.steps.validate.fit.nondifferentiable import with_best_zeros
from vdyn_cli.steps.validate.fit.whitening import whiten_drives

pytestmark = pytest.mark.slow  # whole diagnoses or recoveries


def test_a_size_that_is_begun_too_small_begins_again_where_all_impacts_fit(
    tmp_path_factory: pytest.TempPathFactory, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Linearizations about two thirds of the amplitude converge to a local maximum near it."""
    monkeypatch.setattr(effect_fit, "PASSES", 2)  # fewer passes and sizes than in earnest: they take time
    monkeypatch.setattr(nondifferentiable, "AROUND", (0.8, 0.9, 1.0, 1.1, 1.2))
    drive = one_drive(tmp_path_factory.mktemp("play"))
    reference = drive.reference
    found = fit_effects(
        simulated(drive, PLAY / 1.5),
        lambda begun, values: whiten_drives(with_best_zeros(begun, reference), averaged=True).regression,
        reference,
    )
    size, spread = found.solution.values["backlash"], found.spreads["backlash"]
    assert size == pytest.approx(PLAY, rel=0.1)
    assert size == pytest.approx(PLAY, abs=2 * spread)
    assert found.solution.std["backlash"] < spread < 0.1 * PLAY
    assert found.setup.added.unknowns[0].start == size
    assert not found.setup.at
    assert not found.doubts
    (doubt,) = replace(found, moved=2.0).doubts
    assert "have not converged: the last pass moved them by 2.0 standard errors" in doubt.what
    assert doubt.doubt
