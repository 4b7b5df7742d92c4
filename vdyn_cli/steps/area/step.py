"""The step ``area``."""

from __future__ import annotations

from vdyn_cli.steps.area.pictures import load_pictures
from vdyn_cli.steps.area.problem import prepare
from vdyn_cli.steps.area.spec import AreaSpec
from vdyn_cli.steps.step_definition import Step

STEP = Step(
    name="area",
    spec=AreaSpec,
    required=(),
    optional=(),
    needs=(),
    gives=("frontal_area",),
    reads=(),
    run_keys=(),
    prepare=prepare,
    load=load_pictures,
)
