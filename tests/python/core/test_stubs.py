# SPDX-License-Identifier: MIT
"""Does _core.pyi say what the module is?

stubtest finds members that are missing or too many. It reads no signature of pybind11's functions,
so arguments, defaults and types are compared here with those that pybind11 writes into docstrings.
"""

import ast
import inspect
import re
import subprocess
import sys
from collections import defaultdict
from pathlib import Path

import numpy as np
import pytest

import ehsid
from ehsid import _core

# Where pybind11 and the stub must differ:
ALLOWED = r"""
# classes: their metaclass is pybind11's
ehsid\._core\.[A-Z]\w*
# enums: a member of pybind11's own
ehsid\._core\.\w+\.__pybind11_native_enum__
# results, which only the module makes: their __init__ takes anything, and raises
ehsid\._core\.(EffectInfo|Growth|GrowthRun|PlantParameter|PolicyInfo|PolicySetting|ServoReading)\.__init__
ehsid\._core\.(TrackedRun|TrackedSeries|TrackedServo|TrackedServos|TrackedValue|Trajectory)\.__init__
"""

# What the stub says more exactly than pybind11 can, as pybind11 says it.
STUB_TO_MODULE = {
    "npt.ArrayLike | None": "object",
    "npt.ArrayLike": "object",
    "npt.DTypeLike": "object",
    "npt.NDArray[np.bool_] | None": "object",
    "npt.NDArray[np.bool_]": "ndarray",
    "npt.NDArray[np.uint8]": "ndarray",
    "_Samples": "ndarray",
    "np.dtype[Any]": "dtype",
    "tuple[_Array, _Array]": "tuple",
    "tuple[_Array, bool]": "tuple",
    "Callable[[], Sequence[float]]": "Callable",
    "Callable[[float, Sequence[float]], Sequence[float]]": "Callable",
    "tuple[EffectInfo, ...]": "tuple",
    "tuple[PlantParameter, ...]": "tuple",
    "tuple[PolicyInfo, ...]": "tuple",
    "tuple[PolicySetting, ...]": "tuple",
    "type[Forgetting]": "object",
    "Sequence[float] | _Array": "Sequence[float]",
}
MODULE_TO_STUB = {
    "typing.SupportsFloat | typing.SupportsIndex": "float",
    "typing.SupportsInt | typing.SupportsIndex": "int",
    "typing.Annotated[numpy.typing.ArrayLike, numpy.float64]": "object",
    "numpy.typing.NDArray[numpy.float64]": "_Array",
    "numpy.ndarray": "ndarray",
    "numpy.dtype": "dtype",
    "collections.abc.": "",
    "ehsid._core.": "",
    " | ".join(info.policy.__name__ for info in ehsid.policies()): "Forgetting",
}

# Methods that a stub lists like any other.
SPECIAL = {"__init__", "__len__", "__getitem__"}

Signatures = dict[str, list[str]]


def replaced(text: str, table: dict[str, str]) -> str:
    for old, new in table.items():
        text = text.replace(old, new)
    return text


def signature(function: ast.FunctionDef, *, method: bool) -> str:
    """Names, kinds, types and defaults, without self; an object as a default shows as `...`."""
    arguments = function.args
    arguments.args = arguments.args[1:] if method else arguments.args
    for defaults in (arguments.defaults, arguments.kw_defaults):
        for i, default in enumerate(defaults):
            if isinstance(default, ast.Call):
                defaults[i] = ast.Constant(...)
    returns = ast.unparse(function.returns) if function.returns else "nothing"
    return f"({ast.unparse(arguments)}) -> {returns}"


def stub_signatures() -> Signatures:
    found: Signatures = defaultdict(list)
    for node in ast.parse(Path(_core.__file__).with_name("_core.pyi").read_text()).body:
        if isinstance(node, ast.FunctionDef):
            text = signature(node, method=False)
            found[node.name].append(replaced(text, STUB_TO_MODULE))
        elif isinstance(node, ast.ClassDef):
            for member in node.body:
                if isinstance(member, ast.FunctionDef):
                    static = any(ast.unparse(d) == "staticmethod" for d in member.decorator_list)
                    text = signature(member, method=not static)
                    found[f"{node.name}.{member.name}"].append(replaced(text, STUB_TO_MODULE))
    return dict(found)


def documented(function: object, *, method: bool) -> list[str]:
    """The signatures pybind11 wrote into a docstring: one, or one an overload."""
    lines = (function.__doc__ or "").splitlines()
    lines = [line for line in lines if re.match(r"(\d+\. )?\w*\(.*\) -> ", line)]
    signatures = []
    for line in lines:
        text = re.sub(r"^[^(]*", "def f", replaced(line, MODULE_TO_STUB)) + ": ..."
        (parsed,) = ast.parse(text).body
        assert isinstance(parsed, ast.FunctionDef)
        signatures.append(signature(parsed, method=method))
    return signatures


def module_signatures() -> Signatures:
    found = {}
    for name, value in vars(_core).items():
        if inspect.isbuiltin(value):
            found[name] = documented(value, method=False)
        elif inspect.isclass(value) and not issubclass(value, int):
            for member, inner in vars(value).items():
                where = f"{name}.{member}"
                if isinstance(inner, staticmethod):
                    found[where] = documented(inner.__func__, method=False)
                elif isinstance(inner, property):
                    accessors = [a for a in (inner.fget, inner.fset) if a is not None]
                    found[where] = [s for a in accessors for s in documented(a, method=True)]
                elif callable(inner) and (member in SPECIAL or not member.startswith("_")):
                    found[where] = documented(inner, method=True)
    # A class that Python cannot make has object's __init__, whose docstring is no signature.
    return {where: signatures for where, signatures in found.items() if signatures}


@pytest.mark.thorough
def test_stub_and_module_have_the_same_members(tmp_path: Path) -> None:
    allowed, settings = tmp_path / "allowed", tmp_path / "mypy.ini"
    allowed.write_text(ALLOWED)
    # The package names the types of the harness, all of whose modules would be read otherwise.
    settings.write_text("[mypy]\n[mypy-ehsid.harness.*]\nfollow_imports = skip\n")
    command = [sys.executable, "-m", "mypy.stubtest", "ehsid._core", "--allowlist", str(allowed)]
    command += ["--mypy-config-file", str(settings)]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stdout


def test_stub_and_module_have_the_same_classes() -> None:
    # The list of what stubtest may find says any class, so a missing one must be found here.
    body = ast.parse(Path(_core.__file__).with_name("_core.pyi").read_text()).body
    in_stub = {node.name for node in body if isinstance(node, ast.ClassDef)}
    assert in_stub == {name for name, value in vars(_core).items() if inspect.isclass(value)}


def test_stub_and_module_have_the_same_signatures() -> None:
    assert stub_signatures() == module_signatures()


@pytest.mark.parametrize("dtype", [np.float32, np.float64])
def test_types_that_pybind11_does_not_tell(dtype: type) -> None:
    y = np.linspace(0.0, 1.0, 30)
    servo = ehsid.ArxEstimator(1, 1, 1, dtype=dtype).run(y, y)
    rls = ehsid.Rls(1, dtype=dtype).run(y[:, None], y)
    for run in (servo, rls):
        for name in (
            "theta",
            "standard_deviation",
            "innovation",
            "forgetting_factor",
            "residual_variance",
        ):
            assert getattr(run, name).dtype == dtype, name
        assert run.status.dtype == np.uint8
    assert servo.converged is not None
    assert servo.converged.dtype == np.bool_
    assert rls.converged is None
    assert {type(effect) for effect in ehsid.effects()} == {ehsid.EffectInfo}
    assert {type(parameter) for parameter in ehsid.plant_parameters()} == {ehsid.PlantParameter}
    listed = [effect.parameters for effect in ehsid.effects()]
    assert {type(parameter) for of in listed for parameter in of} == {ehsid.PlantParameter}


SERVO = ehsid.ServoParameters(
    k_v=1e-4, k_q=1.0, k_c=1e-12, c_p=0.0, a_p=1e-3, v_t=1e-4, beta_e=1e9, m_t=100.0
)


@pytest.mark.parametrize(
    "options",
    [
        *(info.policy() for info in ehsid.policies()),
        ehsid.Scaling(),
        ehsid.RlsOptions(),
        ehsid.RmseResetOptions(),
        ehsid.ConvergenceOptions(),
        SERVO,
        ehsid.ContinuousServo(gain=0.1, omega_n=100.0, xi=0.2),
    ],
)
def test_settings_are_shown_as_they_are_made(options: object) -> None:
    shown = repr(options)
    again = eval(shown, vars(ehsid))  # the text is the call that makes an equal object
    assert repr(again) == shown
    assert shown.startswith(type(options).__name__ + "(")
    assert "=" in shown


def test_signatures_name_no_address_and_no_cpp_type() -> None:
    for where, signatures in module_signatures().items():
        for text in signatures:
            assert " at 0x" not in text, where
            assert "::" not in text, where
