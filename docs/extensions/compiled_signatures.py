"""Signatures as one would write them: types of compiled functions from their stub, arrays as `NDArray`."""

from __future__ import annotations

import ast
import re
from pathlib import Path
from typing import Any

import memo


def signatures() -> dict[str, tuple[str, str]]:
    """Arguments and result of every function of the stub, by its dotted name below the module."""
    stub = Path(memo.__file__).with_name("_memo.pyi").read_text(encoding="utf-8")
    found: dict[str, tuple[str, str]] = {}

    def collect(body: list[ast.stmt], prefix: str) -> None:
        for node in body:
            if isinstance(node, ast.ClassDef):
                collect(node.body, f"{prefix}{node.name}.")
            elif isinstance(node, ast.FunctionDef):
                arguments = node.args
                if prefix and not any("staticmethod" in ast.unparse(d) for d in node.decorator_list):
                    arguments.args = arguments.args[1:]
                found[prefix + node.name] = (f"({ast.unparse(arguments)})", ast.unparse(node.returns))

    collect(ast.parse(stub).body, "")
    return found


_ARRAY = re.compile(r"(?:np\.|numpy\.)?ndarray\[tuple\[Any, \.\.\.\], (?:np\.|numpy\.)?dtype\[(\w+)\]\]")


def short(text: str | None) -> str | None:
    """The text with numpy's long name for an array of any shape replaced by the short one."""
    return text and _ARRAY.sub(r"NDArray[\1]", text)


def setup(app: Any) -> dict[str, bool]:
    known = signatures()

    def with_types(app, what, name, obj, options, arguments, result):  # type: ignore[no-untyped-def]
        below = name.removeprefix("memo.").removeprefix("_memo.")
        if what == "class" and getattr(obj, "__module__", "") == "memo._memo":
            return known.get(f"{below}.__new__", ("", ""))[0], ""
        compiled = type(obj).__name__ in ("builtin_function_or_method", "method_descriptor")
        if compiled and below in known:
            return known[below]
        return short(arguments), short(result)

    app.connect("autodoc-process-signature", with_types)
    return {"parallel_read_safe": True, "parallel_write_safe": True}
