"""Defaults are those of the core, in calls, in docstrings and in the help of commands."""

import ast
import inspect
import re

import memo
import pytest
from memo import _memo

PICTURE = {"dot_px": "dot_px", "shape": "shape"}
"""Options of `memo pointlight` that have the default of `PointLightDisplay.frames`."""

FUNCTIONS = {
    name: getattr(memo, name)
    for name in (
        "edge_segments",
        "fit_walk",
        "planar",
        "pointlight",
        "posture",
        "silhouettes",
        "track",
        "walker_motion",
    )
}
OPTIONS = {
    ("planar", "noise_px"): "noise_px",
    ("planar", "window"): "window_s",
    ("pointlight", "azimuth_deg"): "azimuth_deg",
    ("pointlight", "elevation_deg"): "elevation_deg",
    ("pointlight", "px_per_m"): "px_per_m",
    ("pointlight", "locomotion"): "locomotion",
    ("pointlight", "scramble_axes"): "scramble_axes",
    ("pointlight", "dots"): "life_dots",
    ("pointlight", "on"): "life_sites",
    ("pointlight", "noise_dots"): "noise_dots",
    ("pointlight", "noise_kind"): "noise_kind",
    ("pointlight", "noise_area"): "noise_area",
    ("pointlight", "noise_px"): "noise_sd_px",
    ("pointlight", "seed"): "seed",
    ("posture", "rules"): "rules",
    ("posture", "strength"): "strength",
    ("posture", "anchor"): "anchor",
    ("posture", "noise_px"): "noise_px",
}
"""Options of commands that have the default of the core."""


@pytest.mark.parametrize("name", FUNCTIONS)
def test_a_call_leaves_defaults_to_the_core(name):
    calls = [FUNCTIONS[name], getattr(_memo, name, _memo.Tracker)]
    signatures = [inspect.signature(call) for call in calls]
    for option, value in _memo.defaults(name).items():
        for parameters in (signature.parameters for signature in signatures):
            if option in parameters:
                given = parameters[option].default
                assert given is (value if isinstance(value, bool) else None), option
        assert any(option in signature.parameters for signature in signatures), option


@pytest.mark.parametrize("name", FUNCTIONS)
def test_a_docstring_states_the_defaults(name):
    documented = memo.Tracker if name == "track" else FUNCTIONS[name]
    (stated,) = re.findall(r"Defaults: (.*?)\.(?:\s|$)", documented.__doc__, re.DOTALL)
    found = dict(re.findall(r"`(\w+)` ([^,\s]+)", stated))
    expected = {key: value for key, value in _memo.defaults(name).items() if not isinstance(value, bool)}
    assert {key: ast.literal_eval(value) for key, value in found.items()} == expected


@pytest.mark.parametrize(("command", "option"), OPTIONS)
def test_the_help_of_a_command_states_the_defaults(command, option):
    typer = pytest.importorskip("typer")
    from memo.cli import _app

    (found,) = (
        parameter
        for parameter in typer.main.get_command(_app()).commands[command].params
        if parameter.name == option
    )
    value = _memo.defaults(command)[OPTIONS[command, option]]
    assert found.default == value if found.default is not None else f"default: {value}." in found.help


@pytest.mark.parametrize("option", PICTURE)
def test_pictures_of_displays_have_the_defaults_of_the_core(option):
    typer = pytest.importorskip("typer")
    from memo.cli import _app

    usual = _memo.defaults("pointlight_frames")
    parameters = typer.main.get_command(_app()).commands["pointlight"].params
    (found,) = (parameter for parameter in parameters if parameter.name == option)
    assert found.default == usual[PICTURE[option]]
    stated = " ".join(memo._memo.PointLightDisplay.frames.__doc__.split())
    shown = {"shape": '"disc"', "dot_px": "10"}
    assert f"`{option}` {shown[option]}" in stated


def test_a_function_without_options_of_the_core_has_no_defaults():
    with pytest.raises(ValueError, match="no_function"):
        _memo.defaults("no_function")


def test_a_tracker_keeps_the_values_of_the_defaults():
    options, usual = memo.Tracker().options, _memo.defaults("track")
    assert {name: options[name] for name in ("gait", "start_frames", "measure")} == {
        name: usual[name] for name in ("gait", "start_frames", "measure")
    }
    assert memo.Tracker(gait="sampled_10", start_frames=9).options["start_frames"] == 9
