"""Pages written from the package whenever the site is built, so that they cannot go stale.

`reference/commands.md` from the commands, `reference/gait.md` from the definitions of gait parameters.
"""

from __future__ import annotations

import inspect
import re
from pathlib import Path
from typing import Any

import typer
from memo.cli import _app
from memo.gait import DEFINITIONS

HEAD = """# Commands

`memo COMMAND --help` prints the same. This page is written from the commands whenever it is built.
"""


def setup(app: Any) -> dict[str, bool]:
    app.connect("builder-inited", write)
    return {"parallel_read_safe": True, "parallel_write_safe": True}


GAIT = """# Gait parameters

What `gait_parameters.csv` has. Intervals are of 95 %, for the height that was given: lengths scale with it.

"""


def write(app: Any) -> None:
    for name, text in (("commands", reference()), ("gait", definitions())):
        page = Path(app.srcdir) / "reference" / f"{name}.md"
        if not page.is_file() or page.read_text(encoding="utf-8") != text:  # else Sphinx would read it anew
            page.write_text(text, encoding="utf-8")


def definitions() -> str:
    return GAIT + "\n".join(f"`{name}`\n: {_plain(text)}\n" for name, text in DEFINITIONS.items())


def reference() -> str:
    program = typer.main.get_command(_app())
    context = program.make_context("memo", [], resilient_parsing=True)
    return "\n".join([HEAD, *_sections(program, context)])


def _sections(group: Any, context: Any) -> list[str]:
    lines: list[str] = []
    for name in sorted(group.list_commands(context)):
        command = group.get_command(context, name)
        inner = type(context)(command, info_name=name, parent=context)
        lines += [f"({context.command_path}-{name})=".replace(" ", "-"), f"## {inner.command_path}", ""]
        lines += _command(command, inner)
        if hasattr(command, "list_commands"):
            lines += _sections(command, inner)
    return lines


def _command(command: Any, context: Any) -> list[str]:
    given = [parameter for parameter in command.params if parameter.param_type_name == "argument"]
    usage = " ".join([context.command_path, "[OPTIONS]", *map(_placeholder, given)])
    lines = ["```text", usage, "```", "", _plain(command.help), ""]
    rows = [row for parameter in command.params if (row := _row(parameter, context))]
    if rows:
        lines += [*rows, ""]
    if command.epilog:
        *examples, codes = command.epilog.split("\n\n")
        lines += [
            "```text",
            *inspect.cleandoc("\n".join(examples)).splitlines()[1:],
            "```",
            "",
            _plain(codes),
            "",
        ]
    return lines


def _row(parameter: Any, context: Any) -> str | None:
    if parameter.param_type_name == "argument":
        return f"`{_placeholder(parameter)}`\n: {_plain(parameter.help)}\n"
    record = parameter.get_help_record(context)
    if record is None or "--help" in parameter.opts:
        return None
    return f"`{record[0]}`\n: {_plain(record[1])}\n"


def _placeholder(argument: Any) -> str:
    """How an argument is written in the usage, such as `VIDEO`, or `[MOTION]` where it may be left out."""
    name = (argument.metavar or argument.name).upper().strip("[]")
    return name if argument.required else f"[{name}]"


def _plain(text: str | None) -> str:
    """Text of the command line as Markdown: brackets, stars and angles mean themselves."""
    joined = " ".join((text or "").split())
    for mark in "\\[]*<>_":
        joined = joined.replace(mark, f"\\{mark}")
    return re.sub(r"--[a-z][a-z-]*", r"`\g<0>`", joined)  # typography would make a dash of the hyphens
