# SPDX-License-Identifier: MIT
"""The interface in Python: the names of `import ehsid`, as sources without bodies.

griffe compares two such folders and finds the changes that break the code of a user.
"""

import ast
import logging
import re
from contextlib import suppress
from pathlib import Path

import griffe
from changes import Change, table_changes

# Where the names of `import ehsid` come from. Other rooms of the harness are no public interface.
PUBLIC = ("ehsid/__init__.py", "ehsid/_core.pyi", "harness/api/*.py")


def write_skeletons(sources: Path, to: Path) -> None:
    """Writes the public modules below the folder `python`, without bodies and private names."""
    for pattern in PUBLIC:
        for path in sorted(sources.glob(pattern)):
            inside = path.relative_to(sources).as_posix()
            inside = inside if inside.startswith("ehsid/") else f"ehsid/{inside}"
            written = to / inside
            written.parent.mkdir(parents=True, exist_ok=True)
            written.write_text(_skeleton(path.read_text(encoding="utf-8")), encoding="utf-8")
            if "harness" in inside:
                (to / "ehsid" / "harness" / "__init__.py").touch()


def python_changes(before: Path, now: Path) -> list[Change]:
    """Compares two folders that `write_skeletons` has written."""
    old, new = _public(before), _public(now)
    calls = [
        Change(
            "Python",
            "changed",
            _public_path(breakage.obj.path, new),
            _text(breakage.old_value),
            _text(breakage.new_value),
            breakage.kind.value,
        )
        for breakage in griffe.find_breaking_changes(old, new)
        if breakage.kind is not griffe.BreakageKind.OBJECT_REMOVED
    ]
    # griffe does not compare values and types. What is inherited it names by the class above.
    return calls + table_changes("Python", _types(old), _types(new))


def _text(value: object) -> str:
    return "nothing" if value is None else str(value)


def _public_path(path: str, package: griffe.Module) -> str:
    """The name as a user writes it, or the full one of a class that others inherit from."""
    name = re.sub(r"^ehsid\.(_core|harness\.api\.\w+)\.", "", path)
    return f"ehsid.{name}" if name.split(".")[0] in package.members else path


def _types(package: griffe.Module) -> dict[str, str]:
    """Every public name: the type and value of an attribute, and what a function returns."""
    table = {}
    for name, member in package.members.items():
        table[f"ehsid.{name}"] = _type(member)
        if member.is_class:
            inside = {key: value for key, value in member.all_members.items() if key[0] != "_"}
            table |= {f"ehsid.{name}.{key}": _type(value) for key, value in inside.items()}
    return table


def _type(member: griffe.Object | griffe.Alias) -> str:
    target = member.final_target if isinstance(member, griffe.Alias) else member
    if isinstance(target, griffe.Function):
        return f"returns {target.returns}"
    if isinstance(target, griffe.Attribute):
        return " ".join(str(part) for part in (target.annotation, target.value) if part is not None)
    return target.kind.value


def _public(folder: Path) -> griffe.Module:
    """What a user gets from `import ehsid`: names for people, and those of the compiled module."""
    logging.getLogger("griffe").setLevel(logging.CRITICAL)  # other rooms and packages are not there
    package = griffe.load("ehsid", search_paths=[folder], allow_inspection=False)
    public = griffe.Module("ehsid", modules_collection=package.modules_collection)
    for source in (package.members["_core"], package):
        for name, member in source.members.items():
            if name.startswith("_") or name == "harness":
                continue
            if not isinstance(member, griffe.Alias):
                public.set_member(name, griffe.Alias(name, member, parent=public))
            elif member.target_path.startswith("ehsid.harness.api."):
                with suppress(griffe.AliasResolutionError):  # what it names is not there any more
                    target = member.final_target
                    public.set_member(name, griffe.Alias(name, target, parent=public))
    public.exports = list(public.members)
    return public


def _skeleton(source: str) -> str:
    """A module without docstrings, bodies of functions and private functions."""
    module = ast.parse(source)
    module.body = _kept(module.body)
    code = ast.unparse(ast.fix_missing_locations(module))
    return f"# SPDX-License-Identifier: MIT\n{code}\n"


def _kept(body: list[ast.stmt]) -> list[ast.stmt]:
    kept: list[ast.stmt] = []
    for statement in body:
        if isinstance(statement, ast.Expr) and isinstance(statement.value, ast.Constant):
            continue
        if isinstance(statement, ast.FunctionDef):
            if statement.name.startswith("_") and statement.name != "__init__":
                continue
            statement.body = [ast.Expr(ast.Constant(...))]
        elif isinstance(statement, ast.ClassDef | ast.If):
            statement.body = _kept(statement.body) or [ast.Pass()]
        kept.append(statement)
    return kept
