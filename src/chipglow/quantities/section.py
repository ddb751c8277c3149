"""Sections of YAML files that are written by hand: known keys only, each declared once."""

import reprlib
from collections.abc import Iterable, Iterator, Mapping
from contextlib import contextmanager
from difflib import get_close_matches
from inspect import Parameter as Argument, Signature
from pathlib import Path
from typing import Annotated, Any, Final, Generic, Self, TypeVar

from pydantic import AfterValidator, BaseModel, ConfigDict, ValidationInfo, model_validator
from pydantic_core import CoreConfig

Built = TypeVar("Built")

STRICT: Final = CoreConfig(strict=True, allow_inf_nan=False)


def beside_the_study(file: str, info: ValidationInfo) -> str:
    """Path of a file that a study names: relative to the study's folder.

    A link keeps its own name, which says what kind of file it is.
    """
    path = Path((info.context or {}).get("folder") or ".", file)
    try:
        return str(path.parent.resolve() / path.name)
    except (OSError, RuntimeError):  # Python 3.13 and later let a link to itself be
        raise ValueError(f"{file!r}: its folder is a link to itself") from None


FileBeside = Annotated[str, AfterValidator(beside_the_study)]
"""A file that a study names."""


def known_keys(data: object, keys: Iterable[str]) -> Mapping[str, Any]:
    """Data of a section; None is the section with its defaults."""
    if data is None:
        return {}
    names = list(keys)
    known = ", ".join(names)
    if not isinstance(data, Mapping):
        raise ValueError(f"{reprlib.repr(data)} is no section, expected keys of {known}")
    for key in data:
        if key not in names:
            close = get_close_matches(str(key), names, n=1)
            hint = f"did you mean {close[0]!r}?" if close else f"expected one of {known}"
            raise ValueError(f"unknown key {key!r}, {hint}")
    return data


@contextmanager
def naming_file(values: Mapping[str, Any]) -> Iterator[None]:
    """Name the field of a file that cannot be read, in a ValueError."""
    try:
        yield
    except OSError as error:
        named = [name for name, value in values.items() if str(value) == str(error.filename)]
        place = ": ".join([*named, str(error.filename)])
        raise ValueError(f"{place}: {error.strerror}, expected a file") from None


class Section(BaseModel):
    """A section of a description, whose fields declare their `Parameter` as those of a `Part` do.

    Unknown keys are refused; an empty section means the defaults.
    """

    model_config = ConfigDict(
        extra="forbid", frozen=True, strict=True, allow_inf_nan=False, arbitrary_types_allowed=True
    )

    @classmethod
    def __pydantic_init_subclass__(cls, **arguments: Any) -> None:
        """Let `help` show the plain types."""
        super().__pydantic_init_subclass__(**arguments)
        cls.__signature__ = Signature(
            [
                Argument(
                    name,
                    Argument.KEYWORD_ONLY,
                    default=Argument.empty if one.is_required() else one.default,
                    annotation=one.annotation,
                )
                for name, one in cls.model_fields.items()
                if name.isidentifier()
            ]
        )

    @model_validator(mode="before")
    @classmethod
    def _known_keys(cls, data: object) -> object:
        return known_keys(data, cls.model_fields)


class Settings(Section, Generic[Built]):
    """A section from which an object of the library is built, whose checks hold for the section."""

    def build(self) -> Built:
        """The object that this section describes."""
        raise NotImplementedError

    @model_validator(mode="after")
    def _possible(self) -> Self:
        with naming_file(dict(self)):
            self.build()
        return self
