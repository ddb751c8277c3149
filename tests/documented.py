"""The blocks of code in the pages of the documentation, and a reader who tries them."""

import os
import re
import subprocess
import sys
from contextlib import chdir
from dataclasses import dataclass
from pathlib import Path
from textwrap import dedent

import yaml
from typer.testing import CliRunner

from chipglow.cli import app
from chipglow.cutting import workpiece
from chipglow.study import load_study

ROOT = Path(__file__).parents[1]
PARTS = ("learn", "do", "understand", "look-up")
PAGES = [
    ROOT / "README.md",
    ROOT / "docs" / "index.md",
    *(page for part in PARTS for page in sorted((ROOT / "docs" / part).glob("*.md"))),
]
NOTE = re.compile(r" *<!-- (file|kind|not run): (.+) -->")
FENCE = re.compile(r"( *)(```+)(.*)")


@dataclass(frozen=True)
class Block:
    """What stands between fences, the comment on the line before, and the words before that."""

    page: Path
    line: int
    language: str
    text: str
    words: str
    note: str | None
    about: str

    def __str__(self):
        return f"{self.page.name}, line {self.line}"


def blocks(page):
    """The blocks of a page in their order."""
    lines, found = page.read_text(encoding="utf-8").splitlines(), []
    start = after = 0
    while start < len(lines):
        if not (fence := FENCE.fullmatch(lines[start])):
            start += 1
            continue
        end = lines.index(fence[1] + fence[2], start + 1)
        note = NOTE.fullmatch(lines[start - 1])
        text = dedent("\n".join(lines[start + 1 : end])) + "\n"
        words = "\n".join(lines[after : start - bool(note)])
        said = note.groups() if note else (None, "")
        found.append(Block(page, start + 1, fence[3], text, words, *said))
        start = after = end + 1
    return found


class Reader:
    """Someone who types what a page shows, in a folder with its sample files.

    Commands whose results the folder already holds, ``done``, are not run again.
    """

    def __init__(self, folder, done=()):
        self.folder, self.done = folder, done
        self.names, self.variables, self.material = {"__name__": "__main__"}, "", None
        for name in ("benchmarks", "docs"):
            (folder / name).symlink_to(ROOT / name)

    def follow(self, block):
        """Do what a block asks for; text without a name is what a program prints."""
        if block.note == "not run":
            return
        if block.note == "file":
            (self.folder / block.about).write_text(block.text, encoding="utf-8")
        elif block.language == "python":
            self.execute(block)
        elif block.language == "console":
            for line in re.sub(r" *\\\n *", " ", block.text).splitlines():
                self.type(line)
        elif block.language == "yaml":
            self.check(block)

    def execute(self, block):
        """Run Python, with the names that earlier blocks of the page left."""
        code = compile("\n" * block.line + block.text, str(block.page), "exec")
        with chdir(self.folder):
            exec(code, self.names)

    def type(self, line):
        """Run one line of a shell; chipglow in this process, which has it loaded."""
        if line in self.done:
            return
        if re.match(r"[A-Z]+=", line):
            self.variables += line + "\n"
            return
        if not line.startswith("chipglow "):
            self.folder = Path(self.shell(f"{line}\npwd >&2", "stderr").splitlines()[-1])
            return
        words = self.shell(f"printf '%s\\0' {line}", "stdout").split("\0")[1:-1]
        with chdir(self.folder):
            result = CliRunner().invoke(app, words)
        assert result.exit_code == 0, f"{line}\n{result.output}\n{result.exception!r}"

    def shell(self, script, stream):
        """What a script prints."""
        environment = {**os.environ, "PATH": f"{Path(sys.executable).parent}:{os.environ['PATH']}"}
        done = subprocess.run(
            ["bash", "-euc", self.variables + script],
            cwd=self.folder,
            env=environment,
            capture_output=True,
            encoding="utf-8",
        )
        assert done.returncode == 0, f"{script}\n{done.stderr}"
        return getattr(done, stream)

    def check(self, block):
        """Check a piece of YAML as what it is said to be."""
        path = self.folder / "block.yaml"
        if block.about == "study":
            path.write_text(block.text, encoding="utf-8")
            load_study(path)
            return
        content = yaml.safe_load(block.text)
        if block.about == "part of the material":
            content = joined(self.material, content)
        else:
            assert block.about == "material", f"{block}: what is it?"
        self.material = content
        path.write_text(yaml.safe_dump(content), encoding="utf-8")
        for name in content["flow_stress"]:
            workpiece(f"{path}/{name}")


def joined(whole, part):
    """A mapping with values replaced, or joined where both are mappings; None is as it was."""
    said = {key: value for key, value in part.items() if value is not None}
    inner = [key for key, value in said.items() if isinstance(value, dict) and key in whole]
    return {**whole, **said, **{key: joined(whole[key], said[key]) for key in inner}}
