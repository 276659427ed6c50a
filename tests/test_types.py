"""The annotations as a user's type checker sees them, in pyright's strict mode."""

import json
import os
import subprocess
import sys
from pathlib import Path

TYPED = Path(__file__).parent / "typed"


def pyright(*arguments):
    command = [
        sys.executable,
        "-m",
        "basedpyright",
        "--pythonpath",
        sys.executable,
        "--outputjson",
        *arguments,
    ]
    own_first = os.pathsep.join([str(Path(sys.executable).parent), os.environ.get("PATH", "")])
    # --verifytypes looks for the package where the first `python` of the path is, whatever --pythonpath says.
    done = subprocess.run(command, capture_output=True, text=True, env=os.environ | {"PATH": own_first})
    return json.loads(done.stdout)


def test_a_users_program_passes_the_strict_mode():
    report = pyright("--project", str(TYPED / "pyrightconfig.json"))
    assert report["summary"]["filesAnalyzed"] >= 1
    assert [problem["message"] for problem in report["generalDiagnostics"]] == []


def test_every_public_name_has_a_type():
    found = pyright("--verifytypes", "memo", "--ignoreexternal")["typeCompleteness"]
    unknown = [symbol["name"] for symbol in found["symbols"] if not symbol["isTypeKnown"]]
    assert unknown == []
    assert found["exportedSymbolCounts"]["withKnownType"] > 300
