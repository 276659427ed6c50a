"""Types for compiled functions: a compiled module knows names of arguments, its stub knows their types."""

from __future__ import annotations

import ast
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


def setup(app: Any) -> dict[str, bool]:
    known = signatures()

    def with_types(app, what, name, obj, options, arguments, result):  # type: ignore[no-untyped-def]
        below = name.removeprefix("memo.").removeprefix("_memo.")
        if what == "class" and getattr(obj, "__module__", "") == "memo._memo":
            return known.get(f"{below}.__new__", ("", ""))[0], ""
        compiled = type(obj).__name__ in ("builtin_function_or_method", "method_descriptor")
        return known[below] if compiled and below in known else None

    app.connect("autodoc-process-signature", with_types)
    return {"parallel_read_safe": True, "parallel_write_safe": True}
